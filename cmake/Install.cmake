# What `cmake --install` and CPack take, in two components: `program` (programs, the libraries that they
# load late, man page, completion) and `development` (static libraries, headers, the package that
# find_package(Atelier) finds). Nothing in it names where it lies, so that a prefix can be moved.

set(programs "")
foreach(program atelier atelier-appearance)
  if(TARGET ${program})
    list(APPEND programs ${program})
  endif()
endforeach()
if(programs)
  # A libtorch that no package installed (TORCH_ROOT) is found where it was linked.
  set_target_properties(${programs} PROPERTIES INSTALL_RPATH_USE_LINK_PATH ON)
  install(TARGETS ${programs} RUNTIME DESTINATION bin COMPONENT program)
endif()
foreach(late pictures film videos point_clouds)
  if(TARGET atelier_${late})
    install(TARGETS atelier_${late} LIBRARY DESTINATION lib/atelier COMPONENT program)
  endif()
endforeach()
if(TARGET atelier)
  # The program itself says which commands this build has.
  install(CODE "
    execute_process(COMMAND \"${CMAKE_COMMAND}\" \"-DPROGRAM=$<TARGET_FILE:atelier>\"
      \"-DSOURCE=${CMAKE_SOURCE_DIR}\" \"-DVERSION=${PROJECT_VERSION}\"
      \"-DPREFIX=\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}\" -P \"${CMAKE_SOURCE_DIR}/cmake/install_pages.cmake\"
      COMMAND_ERROR_IS_FATAL ANY)" COMPONENT program)
endif()
# `atelier run --workflow` finds it in the same place of the build folder.
configure_file(workflow/Snakefile "${CMAKE_BINARY_DIR}/share/atelier/workflow/Snakefile" COPYONLY)
install(FILES workflow/Snakefile DESTINATION share/atelier/workflow COMPONENT program)
install(FILES LICENSE CHANGELOG.md docs/reference/dependencies.md DESTINATION share/doc/atelier COMPONENT program)

# The libraries of core and the domains; those of the pipeline are the program's own.
get_property(libraries GLOBAL PROPERTY ATELIER_LIBRARIES)
list(FILTER libraries EXCLUDE REGEX "^pipeline_")
if(NOT libraries)
  return()
endif()
install(TARGETS ${libraries} EXPORT AtelierTargets ARCHIVE DESTINATION lib/atelier COMPONENT development)
install(EXPORT AtelierTargets NAMESPACE Atelier:: DESTINATION lib/cmake/Atelier COMPONENT development)
install(DIRECTORY core capture bodymodel registration simulation appearance DESTINATION include/atelier
  COMPONENT development FILES_MATCHING PATTERN "*.h"
  PATTERN late EXCLUDE PATTERN generate EXCLUDE)

# What each library needs: libraries of ours by their names, packages by the words of Dependencies.cmake.
set(needs "")
foreach(library IN LISTS libraries)
  get_target_property(dependencies ${library} ATELIER_NEEDS)
  if(ATELIER_HAS_CUDA)
    list(APPEND dependencies cuda)
  endif()
  list(TRANSFORM dependencies REPLACE "^TBB::tbb$" tbb)
  list(TRANSFORM dependencies REPLACE "^opencv_.*$" opencv)
  list(REMOVE_ITEM dependencies Eigen3::Eigen)  # always looked for
  list(JOIN dependencies " " dependencies)
  string(APPEND needs "set(atelier_needs_${library} ${dependencies})\n")
endforeach()
list(JOIN libraries " " library_names)
include(CMakePackageConfigHelpers)
configure_package_config_file(cmake/AtelierConfig.cmake.in "${CMAKE_BINARY_DIR}/generated/AtelierConfig.cmake"
  INSTALL_DESTINATION lib/cmake/Atelier NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file("${CMAKE_BINARY_DIR}/generated/AtelierConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_BINARY_DIR}/generated/AtelierConfig.cmake"
  "${CMAKE_BINARY_DIR}/generated/AtelierConfigVersion.cmake" DESTINATION lib/cmake/Atelier COMPONENT development)
install(FILES cmake/Dependencies.cmake RENAME AtelierDependencies.cmake DESTINATION lib/cmake/Atelier
  COMPONENT development)

# Packages of Debian: cpack -G DEB, in the build folder.
set(CPACK_PACKAGE_NAME atelier)
set(CPACK_PACKAGE_VENDOR Atelier)
set(CPACK_PACKAGE_CONTACT "The authors of Atelier <atelier@example.org>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Multi-view capture of a clothed person to an avatar with simulated clothing")
set(CPACK_RESOURCE_FILE_LICENSE "${CMAKE_SOURCE_DIR}/LICENSE")
set(CPACK_GENERATOR DEB)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "Programs atelier and atelier-appearance")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Static libraries, headers and CMake package of Atelier")
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME atelier)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME atelier-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
find_program(DPKG_SHLIBDEPS dpkg-shlibdeps)
if(DPKG_SHLIBDEPS)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
endif()
set(debian_tbb libtbb-dev)
set(debian_hdf5 libhdf5-dev)
set(debian_opencv libopencv-dev)
set(debian_ceres libceres-dev)
set(debian_jpeg libjpeg62-turbo-dev)
set(debian_png libpng-dev)
set(debian_avif "pkg-config, libavif-dev")
set(debian_zip "pkg-config, libzip-dev")
set(debian_sodium "pkg-config, libsodium-dev")
set(debian_libav "pkg-config, libavformat-dev, libavcodec-dev, libavutil-dev")
set(debian_tomlplusplus "pkg-config, libtomlplusplus-dev")
set(debian_tinygltf libtinygltf-dev)
set(debian_assimp libassimp-dev)
set(debian_nlohmann_json nlohmann-json3-dev)
set(debian_embree libembree-dev)
set(debian_cgal libcgal-dev)
set(debian_torch libtorch-dev)
set(depends "atelier (= ${PROJECT_VERSION})" libeigen3-dev)
string(REGEX MATCHALL "[a-z0-9_]+" words "${needs}")
list(REMOVE_DUPLICATES words)
foreach(word IN LISTS words)
  if(DEFINED debian_${word})
    string(REPLACE ", " ";" packages "${debian_${word}}")
    list(APPEND depends ${packages})
  endif()
endforeach()
list(REMOVE_DUPLICATES depends)
list(JOIN depends ", " CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS)
include(CPack)
