# atelier_library(name DIRECTORY dir [ONLY ...] [EXCEPT ...] PUBLIC ... PRIVATE ... [OPTIONAL ...]
#                 [LATE ...])
#   The library of a folder, or of several: every *.cpp in it, and every *.cu where there is CUDA (ONLY and EXCEPT
#   name files, without extension, where a part of a folder needs less than the rest). Each
#   dependency is said to be PUBLIC (appears in a header) or PRIVATE; OPTIONAL ones are private
#   and used where present (ATELIER_HAS_<NAME>=1). If a needed package is missing, the library is
#   left out with one line, and so is everything that needs it. LATE: late libraries that it
#   loads, needed too.
# atelier_late_library(name folder PRIVATE ...)   <folder>/<name>.cpp as the shared object
#   lib/libatelier_<name>.so, which programs load when they first need it (core/late_library.h)
# atelier_room(name [STAGES ... [BEFORE room]] [DIRECTORY dir] NEEDS ...)   the library pipeline_<name> of the
#   folder pipeline/<name>; it is left out where one that it needs is missing. STAGES: those whose rows it
#   has, each a function `const StageRow& <stage>_row()`; they are listed behind those of the rooms before,
#   or before those of a room that it needs
# atelier_viewer_page(target)   compiles the viewer's page, from the folder viewer, into a library
# atelier_stage_table(name [ROOMS ...])   the object that lists the stages of rooms (pipeline/row/stage_row.h), of
#   those that are there, in this order; without ROOMS of every room so far
# atelier_executable(name DIRECTORY dir [EXCEPT ...] PRIVATE ... [OPTIONAL ...])
# atelier_program(name DIRECTORY dir [EXCEPT ...] PRIVATE ... COMMANDS "file: target ..." ...)   an executable
#   whose files of commands, of these names, are left out where a target that they need is missing or
#   ATELIER_LEAVE_OUT names them; ATELIER_COMMAND_<FILE>=1 tells its other files of each that is there,
#   ATELIER_COMMANDS_LEFT_OUT of the others
# atelier_objects(name DIRECTORY dir ONLY ... PRIVATE ... [OPTIONAL ...])   files of a program's
#   folder as objects, for the program and for whoever else links them; where a package is missing
#   there are none, and the program says so
# atelier_tests(name DIRECTORY dirs... PRIVATE ... [APART filter])   a GoogleTest program of a folder
#   of tests, or of several; those that match the filter run as a second process, so that the longest
#   program does not leave a core idle.

set(ATELIER_WARNINGS -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wconversion
    -Wno-sign-conversion -Wno-float-conversion -Werror)
if(NOT ATELIER_CHECKS)
  set(ATELIER_WARNINGS -w)
elseif(CMAKE_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # A local thing may have the name of a file-local one of another source of its batch.
  list(TRANSFORM ATELIER_WARNINGS REPLACE "^-Wshadow$" "-Wshadow=local")
endif()

function(atelier_missing result)
  set(missing "")
  foreach(dependency IN LISTS ARGN)
    if(NOT TARGET ${dependency})
      list(APPEND missing ${dependency})
    endif()
  endforeach()
  set(${result} "${missing}" PARENT_SCOPE)
endfunction()

function(atelier_sanitized target sanitizers)
  # Not vptr: UBSan looks into memory with calls that workers (core/io/worker.h) may not make, and
  # takes the refusal for a broken object. Not null and object-size either: AddressSanitizer stops at
  # both, and without them a third of the compile time goes.
  target_compile_options(${target} PRIVATE -fsanitize=${sanitizers} -fno-omit-frame-pointer
    -fno-sanitize-recover=all -fno-sanitize=vptr,null,object-size)
  target_link_options(${target} PRIVATE -fsanitize=${sanitizers})
  # No part of "undefined" in either compiler: numbers cast to integers that cannot hold them
  # (core/saturating_cast.h).
  if("${sanitizers}" MATCHES "undefined")
    target_compile_options(${target} PRIVATE
      "$<$<COMPILE_LANGUAGE:CXX>:-fsanitize=float-cast-overflow>")
  endif()
endfunction()

function(atelier_settings target)
  target_compile_options(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:${ATELIER_WARNINGS}>")
  # At -O3 GCC 12 sees overlaps in std::string's own concatenation where there are none (its bug 105651),
  # and in vectors that are copied the end of memory that is not on the heap.
  target_compile_options(${target} PRIVATE
    "$<$<AND:$<CONFIG:Release>,$<COMPILE_LANG_AND_ID:CXX,GNU>>:-Wno-restrict;-Wno-free-nonheap-object>")
  # GCC 13 takes every reference from a function that is also given a temporary for one to the
  # temporary, and at -O3 reads of Eigen's fixed vectors for reads beyond them, and empty optionals of
  # libtorch's for uninitialised ones.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 13)
    target_compile_options(${target} PRIVATE
      "$<$<COMPILE_LANGUAGE:CXX>:-Wno-dangling-reference;-Wno-array-bounds;-Wno-maybe-uninitialized>")
  endif()
  if(CMAKE_UNITY_BUILD)
    # A class of a source that another file includes would be defined twice; batches are included once.
    target_compile_options(${target} PRIVATE "$<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-subobject-linkage>")
  endif()
  target_include_directories(${target} PUBLIC "$<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}>"
    "$<INSTALL_INTERFACE:include/atelier>")
  if(ATELIER_HAS_CUDA)
    target_compile_definitions(${target} PUBLIC ATELIER_HAS_CUDA=1)
    target_link_libraries(${target} PRIVATE CUDA::cudart_static)
    target_compile_options(${target} PRIVATE
      "$<$<COMPILE_LANGUAGE:CUDA>:--expt-relaxed-constexpr;-Werror;all-warnings;-Xcompiler=-Wall,-Wextra>")
  endif()
  if(ATELIER_EXACT)
    target_compile_definitions(${target} PUBLIC ATELIER_EXACT=1)
    target_compile_options(${target} PRIVATE
      "$<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off>"
      "$<$<COMPILE_LANGUAGE:CUDA>:--fmad=false;-Xcompiler=-ffp-contract=off>")
  endif()
  if(ATELIER_SANITIZE)
    atelier_sanitized(${target} ${ATELIER_SANITIZE})
  endif()
  if(ATELIER_FUZZ)
    target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)
  endif()
  if(ATELIER_COVERAGE)
    target_compile_definitions(${target} PRIVATE ATELIER_COVERAGE=1)
    # Half-optimised code makes GCC see uninitialised values where there are none.
    target_compile_options(${target} PRIVATE --coverage -fprofile-update=atomic
      -Wno-maybe-uninitialized)
    target_link_options(${target} PRIVATE --coverage)
  endif()
endfunction()

# atelier_precompiled(target header|owner): what most of a target's sources include, parsed once, by
# this target or by another one with the same flags. Programs and tests only: a library's sources
# also prove that their own headers compile alone.
function(atelier_precompiled target from)
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    return()  # Clang wants the very same definitions in every target
  endif()
  if(TARGET ${from})
    target_precompile_headers(${target} REUSE_FROM ${from})
  else()
    target_precompile_headers(${target} PRIVATE
      "$<$<COMPILE_LANGUAGE:CXX>:${CMAKE_SOURCE_DIR}/${from}>")
  endif()
  target_compile_options(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:-fpch-preprocess>")  # ccache
endfunction()

# atelier_sources(result folders...)
function(atelier_sources result)
  list(TRANSFORM ARGN PREPEND "${CMAKE_SOURCE_DIR}/" OUTPUT_VARIABLE folders)
  list(TRANSFORM folders APPEND "/*.cpp" OUTPUT_VARIABLE patterns)
  file(GLOB sources CONFIGURE_DEPENDS ${patterns})
  if(ATELIER_HAS_CUDA)
    list(TRANSFORM folders APPEND "/*.cu" OUTPUT_VARIABLE patterns)
    file(GLOB cuda_sources CONFIGURE_DEPENDS ${patterns})
    # Each takes long alone; CMake from 3.31 on would batch these too.
    set_source_files_properties(${cuda_sources} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    list(APPEND sources ${cuda_sources})
  endif()
  set(${result} "${sources}" PARENT_SCOPE)
endfunction()

# Keeps of a list of files those of the names in `only`, or all but those in `except`.
function(atelier_only list_of_files only except)
  set(kept "${${list_of_files}}")
  if(only)
    list(JOIN only "|" names)
    list(FILTER kept INCLUDE REGEX "/(${names})[.]")
  elseif(except)
    list(JOIN except "|" names)
    list(FILTER kept EXCLUDE REGEX "/(${names})[.]")
  endif()
  set(${list_of_files} "${kept}" PARENT_SCOPE)
endfunction()

# The sources of some folders that a few files need: those whose own header (the first include) one of
# them includes, and so on. Read when configuring; a source that starts to include one more may need
# cmake to run again.
# atelier_included_sources(result folders... FROM files...)
function(atelier_included_sources result)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "FROM")
  foreach(folder IN LISTS arg_UNPARSED_ARGUMENTS)
    file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_SOURCE_DIR}/${folder}/*.cpp")
    foreach(source IN LISTS sources)
      file(STRINGS "${source}" first REGEX "^#include \"" LIMIT_COUNT 1)
      string(REGEX REPLACE "^#include \"([^\"]*)\".*" "\\1" header "${first}")
      string(MAKE_C_IDENTIFIER "${header}" key)
      list(APPEND sources_of_${key} "${source}")
    endforeach()
  endforeach()
  set(found "")
  set(seen "")
  set(files ${arg_FROM})
  while(files)
    list(POP_FRONT files file)
    file(STRINGS "${file}" includes REGEX "^#include \"")
    foreach(line IN LISTS includes)
      string(REGEX REPLACE "^#include \"([^\"]*)\".*" "\\1" header "${line}")
      if(NOT header IN_LIST seen AND EXISTS "${CMAKE_SOURCE_DIR}/${header}")
        list(APPEND seen "${header}")
        string(MAKE_C_IDENTIFIER "${header}" key)
        list(APPEND files "${CMAKE_SOURCE_DIR}/${header}" ${sources_of_${key}})
        list(APPEND found ${sources_of_${key}})
      endif()
    endforeach()
  endwhile()
  list(REMOVE_DUPLICATES found)
  list(SORT found)  # a batch is of one folder, where file-local names differ
  set(${result} "${found}" PARENT_SCOPE)
endfunction()

# Links what is there of the optional dependencies; each is seen as ATELIER_HAS_<NAME>=1.
function(atelier_optional target)
  foreach(dependency IN LISTS ARGN)
    if(TARGET ${dependency})
      target_link_libraries(${target} PRIVATE ${dependency})
      string(REGEX REPLACE ".*::" "" word "${dependency}")
      string(TOUPPER "${word}" word)
      target_compile_definitions(${target} PRIVATE ATELIER_HAS_${word}=1)
    endif()
  endforeach()
endfunction()

function(atelier_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "DIRECTORY;ONLY;EXCEPT;PUBLIC;PRIVATE;OPTIONAL;LATE")
  foreach(folder IN LISTS arg_DIRECTORY arg_UNPARSED_ARGUMENTS)
    if(TARGET ${folder} OR folder MATCHES "::" OR folder IN_LIST arg_UNPARSED_ARGUMENTS)
      message(FATAL_ERROR "${name}: say PUBLIC or PRIVATE before ${folder}")
    endif()
  endforeach()
  list(TRANSFORM arg_LATE PREPEND "atelier_")
  atelier_missing(missing ${arg_PUBLIC} ${arg_PRIVATE} ${arg_LATE})
  if(missing)
    message(STATUS "left out: ${name} (missing: ${missing})")
    return()
  endif()
  atelier_sources(sources ${arg_DIRECTORY})
  atelier_only(sources "${arg_ONLY}" "${arg_EXCEPT}")
  if(NOT sources)
    return()  # a folder whose first source is still to come
  endif()
  add_library(${name} STATIC ${sources})
  atelier_settings(${name})
  target_link_libraries(${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE} Threads::Threads)
  atelier_optional(${name} ${arg_OPTIONAL})
  if(arg_LATE)
    add_dependencies(${name} ${arg_LATE})
  endif()
  # For AtelierConfig.cmake: which packages to look for.
  set(needs ${arg_PUBLIC} ${arg_PRIVATE})
  foreach(dependency IN LISTS arg_OPTIONAL)
    if(TARGET ${dependency})
      list(APPEND needs ${dependency})
    endif()
  endforeach()
  set_target_properties(${name} PROPERTIES ATELIER_NEEDS "${needs}")
  set_property(GLOBAL APPEND PROPERTY ATELIER_LIBRARIES ${name})
endfunction()

function(atelier_late_library name folder)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "" "PRIVATE")
  atelier_missing(missing ${arg_PRIVATE})
  if(missing)
    message(STATUS "left out: atelier_${name} (missing: ${missing})")
    return()
  endif()
  add_library(atelier_${name} MODULE "${CMAKE_SOURCE_DIR}/${folder}/${name}.cpp")
  atelier_settings(atelier_${name})
  target_link_options(atelier_${name} PRIVATE -Wl,--as-needed)
  target_link_libraries(atelier_${name} PRIVATE ${arg_PRIVATE})
  set_target_properties(atelier_${name} PROPERTIES LIBRARY_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/lib")
endfunction()

function(atelier_executable name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "DIRECTORY;EXCEPT;PRIVATE;OPTIONAL")
  atelier_missing(missing ${arg_PRIVATE})
  if(missing)
    message(STATUS "left out: ${name} (missing: ${missing})")
    return()
  endif()
  atelier_sources(sources ${arg_DIRECTORY})
  atelier_only(sources "" "${arg_EXCEPT}")
  if(NOT sources)
    return()
  endif()
  add_executable(${name} ${sources})
  atelier_settings(${name})
  target_link_libraries(${name} PRIVATE ${arg_PRIVATE})
  atelier_optional(${name} ${arg_OPTIONAL})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")
endfunction()

function(atelier_program name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "DIRECTORY;EXCEPT;PRIVATE;COMMANDS")
  set(definitions "")
  set(libraries "")
  set(all_left_out "")
  foreach(row IN LISTS arg_COMMANDS)
    string(REGEX MATCH "^([a-z_]+): (.*)$" row "${row}")
    set(command ${CMAKE_MATCH_1})
    string(REPLACE " " ";" needs "${CMAKE_MATCH_2}")
    atelier_missing(missing ${needs})
    if(missing OR command IN_LIST ATELIER_LEAVE_OUT)
      if(missing)
        message(STATUS "left out: ${name} ${command} (missing: ${missing})")
      endif()
      list(APPEND arg_EXCEPT ${command})
      string(REPLACE "_" "-" left_out "${command}")
      list(APPEND all_left_out ${left_out})
    else()
      string(TOUPPER "ATELIER_COMMAND_${command}=1" definition)
      list(APPEND definitions ${definition})
      list(APPEND libraries ${needs})
    endif()
  endforeach()
  list(JOIN all_left_out " " all_left_out)
  list(APPEND definitions "ATELIER_COMMANDS_LEFT_OUT=\"${all_left_out}\"")
  list(REMOVE_DUPLICATES libraries)
  atelier_executable(${name} DIRECTORY ${arg_DIRECTORY} EXCEPT ${arg_EXCEPT} PRIVATE ${arg_PRIVATE} ${libraries})
  if(TARGET ${name})
    set_source_files_properties("${CMAKE_SOURCE_DIR}/apps/console/commands.cpp" PROPERTIES
      COMPILE_DEFINITIONS "${definitions}" SKIP_PRECOMPILE_HEADERS ON SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
endfunction()

function(atelier_room name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "DIRECTORY;BEFORE" "STAGES;NEEDS")
  if(NOT arg_DIRECTORY)
    set(arg_DIRECTORY pipeline/${name})
  endif()
  atelier_library(pipeline_${name} DIRECTORY ${arg_DIRECTORY} PUBLIC ${arg_NEEDS})
  if(NOT TARGET pipeline_${name})
    return()
  endif()
  set_target_properties(pipeline_${name} PROPERTIES ATELIER_STAGES "${arg_STAGES}")
  if(arg_STAGES)
    get_property(rooms GLOBAL PROPERTY ATELIER_STAGE_ROOMS)
    list(FIND rooms "${arg_BEFORE}" place)
    if(place EQUAL -1)
      list(APPEND rooms ${name})
    else()
      list(INSERT rooms ${place} ${name})
    endif()
    set_property(GLOBAL PROPERTY ATELIER_STAGE_ROOMS "${rooms}")
  endif()
  if(TARGET pipeline_statistics AND NOT name STREQUAL "statistics")
    atelier_precompiled(pipeline_${name} pipeline_statistics)
  elseif(name STREQUAL "statistics")
    atelier_precompiled(pipeline_${name} pipeline/precompiled.h)
  endif()
endfunction()

function(atelier_viewer_page target)
  if(NOT TARGET ${target})
    return()
  endif()
  set(out "${CMAKE_BINARY_DIR}/generated/view_assets.cpp")
  file(GLOB files CONFIGURE_DEPENDS "${CMAKE_SOURCE_DIR}/viewer/*.js" "${CMAKE_SOURCE_DIR}/viewer/*.html"
    "${CMAKE_SOURCE_DIR}/viewer/*.css" "${CMAKE_SOURCE_DIR}/viewer/*.txt")
  set(embed "${CMAKE_SOURCE_DIR}/cmake/embed_viewer.cmake")
  add_custom_command(OUTPUT "${out}" DEPENDS ${files} "${embed}"
    COMMAND "${CMAKE_COMMAND}" "-DVIEWER=${CMAKE_SOURCE_DIR}/viewer" "-DOUT=${out}" -P "${embed}" VERBATIM)
  target_sources(${target} PRIVATE "${out}")
  set_source_files_properties("${out}" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON SKIP_PRECOMPILE_HEADERS ON)
endfunction()

function(atelier_stage_table name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "ROOMS")
  if(NOT arg_ROOMS)
    get_property(arg_ROOMS GLOBAL PROPERTY ATELIER_STAGE_ROOMS)
  endif()
  set(declarations "")
  set(rows "")
  set(rooms "")
  foreach(room IN LISTS arg_ROOMS)
    if(TARGET pipeline_${room})
      list(APPEND rooms pipeline_${room})
      get_target_property(stages pipeline_${room} ATELIER_STAGES)
      foreach(stage IN LISTS stages)
        string(APPEND declarations "const StageRow& ${stage}_row();\n")
        string(APPEND rows "      &${stage}_row(),\n")
      endforeach()
    endif()
  endforeach()
  configure_file("${CMAKE_SOURCE_DIR}/cmake/stage_table.cpp.in" "${CMAKE_BINARY_DIR}/generated/${name}.cpp" @ONLY)
  # An object: the archive whose function it defines may stand behind it when a program is linked.
  add_library(${name} OBJECT "${CMAKE_BINARY_DIR}/generated/${name}.cpp")
  atelier_settings(${name})
  target_link_libraries(${name} PUBLIC core core_store ${rooms})
endfunction()

function(atelier_objects name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "DIRECTORY" "ONLY;PRIVATE;OPTIONAL")
  atelier_missing(missing ${arg_PRIVATE})
  if(missing)
    return()
  endif()
  atelier_sources(sources ${arg_DIRECTORY})
  atelier_only(sources "${arg_ONLY}" "")
  add_library(${name} OBJECT ${sources})
  atelier_settings(${name})
  target_link_libraries(${name} PRIVATE ${arg_PRIVATE})
  atelier_optional(${name} ${arg_OPTIONAL})
  # Compiled as the program is, whose precompiled headers they share.
  target_compile_options(${name} PRIVATE -fPIE)
  set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
endfunction()

# -O1: a test is compiled more often than its loops are run. -g0: GoogleTest names its lines itself.
function(atelier_test_flags target)
  target_compile_options(${target} PRIVATE
    "$<$<COMPILE_LANGUAGE:CXX>:-Wno-conversion>"
    "$<$<AND:$<CONFIG:RelWithDebInfo,Release>,$<COMPILE_LANGUAGE:CXX>>:-O1;-g0>")
endfunction()

function(atelier_tests name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "APART" "DIRECTORY;PRIVATE")
  atelier_missing(missing ${arg_PRIVATE} GTest::gtest GTest::gmock)
  if(missing)
    message(STATUS "left out: ${name} (missing: ${missing})")
    return()
  endif()
  atelier_sources(sources ${arg_DIRECTORY})
  if(NOT sources)
    return()
  endif()
  add_executable(${name} ${sources})
  atelier_settings(${name})
  atelier_test_flags(${name})
  atelier_precompiled(${name} test_precompiled)
  target_link_libraries(${name} PRIVATE ${arg_PRIVATE} test_main Threads::Threads)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/tests")
  set(results "${CMAKE_BINARY_DIR}/tests/results")
  if(arg_APART)
    add_test(NAME ${name}_apart COMMAND ${name} --gtest_filter=${arg_APART}
             --gtest_output=json:${results}/${name}_apart.json)
    set(filter --gtest_filter=-${arg_APART})
  endif()
  add_test(NAME ${name} COMMAND ${name} ${filter} --gtest_output=json:${results}/${name}.json)
  set_property(GLOBAL APPEND PROPERTY ATELIER_TEST_PROGRAMS ${name})
endfunction()
