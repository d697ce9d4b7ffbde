# One target per package, AtelierPackage::<word>; in this build it has the short word as a name, too. A
# package that is not there leaves it undefined; Targets.cmake then leaves out what needs it, in one
# line. The file is installed beside AtelierConfig.cmake, where ATELIER_PACKAGES names the packages that
# the libraries asked for link, and where nothing but AtelierPackage::<word> is defined.

macro(atelier_alias name)
  if(NOT TARGET AtelierPackage::${name})
    add_library(AtelierPackage::${name} INTERFACE IMPORTED)
    target_link_libraries(AtelierPackage::${name} INTERFACE ${ARGN})
    if(NOT DEFINED ATELIER_PACKAGES AND NOT TARGET ${name})
      add_library(${name} ALIAS AtelierPackage::${name})
    endif()
  endif()
endmacro()

# Third-party headers are SYSTEM: their warnings are not ours.
macro(atelier_system_alias name includes libraries)
  atelier_alias(${name} "${libraries}")
  target_include_directories(AtelierPackage::${name} SYSTEM INTERFACE ${includes})
endmacro()

find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)

function(atelier_find_tbb)
  find_package(TBB QUIET)
endfunction()

function(atelier_find_hdf5)
  if(CMAKE_C_COMPILER_LOADED)
    set(HDF5_PREFER_PARALLEL OFF)
    find_package(HDF5 1.10 QUIET COMPONENTS C)
    if(HDF5_FOUND)
      atelier_system_alias(hdf5 "${HDF5_C_INCLUDE_DIRS}" "${HDF5_C_LIBRARIES}")
    endif()
  else()  # CMake's own search asks the C compiler, which a project that links Atelier may not have enabled
    find_path(ATELIER_HDF5_INCLUDE hdf5.h PATH_SUFFIXES hdf5/serial)
    find_library(ATELIER_HDF5_LIBRARY NAMES hdf5 hdf5_serial PATH_SUFFIXES hdf5/serial)
    if(ATELIER_HDF5_INCLUDE AND ATELIER_HDF5_LIBRARY)
      atelier_system_alias(hdf5 "${ATELIER_HDF5_INCLUDE}" "${ATELIER_HDF5_LIBRARY}")
    endif()
  endif()
endfunction()

function(atelier_find_opencv)
  find_package(OpenCV 4.5 QUIET COMPONENTS core imgcodecs imgproc videoio calib3d aruco)
  if(OpenCV_FOUND)
    # Without the codecs of pictures and videos, which bring two hundred libraries: they are loaded late.
    set(opencv_libraries ${OpenCV_LIBS})
    list(REMOVE_ITEM opencv_libraries opencv_imgcodecs opencv_videoio)
    atelier_system_alias(opencv "${OpenCV_INCLUDE_DIRS}" "${opencv_libraries}")
  endif()
endfunction()

# Calibration's bundle adjustment.
function(atelier_find_ceres)
  find_package(Ceres 2.1 QUIET)
  if(Ceres_FOUND)
    atelier_alias(ceres Ceres::ceres)
  endif()
endfunction()

function(atelier_find_jpeg)
  find_package(JPEG QUIET)
  if(JPEG_FOUND)
    atelier_alias(jpeg JPEG::JPEG)
  endif()
endfunction()

function(atelier_find_png)
  find_package(PNG QUIET)
  if(PNG_FOUND)
    atelier_alias(png PNG::PNG)
  endif()
endfunction()

function(atelier_find_avif)
  find_package(PkgConfig QUIET)
  if(PkgConfig_FOUND)
    pkg_check_modules(AVIF QUIET IMPORTED_TARGET libavif)
    if(AVIF_FOUND)
      atelier_alias(avif PkgConfig::AVIF)
    endif()
  endif()
endfunction()

function(atelier_find_zip)
  find_package(PkgConfig QUIET)
  if(PkgConfig_FOUND)
    pkg_check_modules(ZIP QUIET IMPORTED_TARGET libzip)
    if(ZIP_FOUND)
      atelier_alias(zip PkgConfig::ZIP)
    endif()
  endif()
endfunction()

function(atelier_find_sodium)
  find_package(PkgConfig QUIET)
  if(PkgConfig_FOUND)
    pkg_check_modules(SODIUM QUIET IMPORTED_TARGET libsodium)
    if(SODIUM_FOUND)
      atelier_alias(sodium PkgConfig::SODIUM)
    endif()
  endif()
endfunction()

function(atelier_find_libav)
  find_package(PkgConfig QUIET)
  if(PkgConfig_FOUND)
    pkg_check_modules(LIBAV QUIET IMPORTED_TARGET libavformat libavcodec libavutil)
    if(LIBAV_FOUND)
      atelier_alias(libav PkgConfig::LIBAV)
    endif()
  endif()
endfunction()

function(atelier_find_tomlplusplus)
  find_package(PkgConfig QUIET)
  if(PkgConfig_FOUND)
    pkg_check_modules(TOMLPP QUIET IMPORTED_TARGET tomlplusplus)
    if(TOMLPP_FOUND)
      atelier_alias(tomlplusplus PkgConfig::TOMLPP)
    endif()
  endif()
endfunction()

function(atelier_find_tinygltf)
  find_path(TINYGLTF_INCLUDE tiny_gltf.h)
  find_library(TINYGLTF_LIBRARY tinygltf)
  if(TINYGLTF_INCLUDE AND TINYGLTF_LIBRARY)
    atelier_system_alias(tinygltf "${TINYGLTF_INCLUDE}" "${TINYGLTF_LIBRARY}")
  endif()
endfunction()

# FBX. Found by its header: its own package file names build folders in some versions.
function(atelier_find_assimp)
  find_path(ASSIMP_INCLUDE assimp/scene.h)
  find_library(ASSIMP_LIBRARY assimp)
  if(ASSIMP_INCLUDE AND ASSIMP_LIBRARY)
    atelier_system_alias(assimp "${ASSIMP_INCLUDE}" "${ASSIMP_LIBRARY}")
  elseif(NOT DEFINED ATELIER_PACKAGES)
    message(STATUS "left out: reading of FBX (missing: libassimp-dev)")
  endif()
endfunction()

function(atelier_find_nlohmann_json)
  find_package(nlohmann_json 3.10 QUIET)
  if(nlohmann_json_FOUND)
    atelier_alias(nlohmann_json nlohmann_json::nlohmann_json)
  endif()
endfunction()

function(atelier_find_cli11)
  find_package(CLI11 2.1 QUIET)
  if(CLI11_FOUND)
    atelier_alias(cli11 CLI11::CLI11)
  endif()
endfunction()

function(atelier_find_spdlog)
  find_package(spdlog 1.8 QUIET)
  if(spdlog_FOUND)
    atelier_alias(spdlog spdlog::spdlog)
  endif()
endfunction()

function(atelier_find_embree)
  find_package(embree 3 QUIET)
endfunction()

# Found by its header: CGAL's own package file changes compiler flags.
function(atelier_find_cgal)
  find_path(CGAL_INCLUDE CGAL/version.h)
  find_library(GMP_LIBRARY gmp)
  find_library(MPFR_LIBRARY mpfr)
  if(CGAL_INCLUDE AND GMP_LIBRARY AND MPFR_LIBRARY)
    atelier_system_alias(cgal "${CGAL_INCLUDE}" "${MPFR_LIBRARY};${GMP_LIBRARY}")
  endif()
endfunction()

# Found by its header too: PCL's own package file asks for VTK and every other thing that some part
# of it can use.
function(atelier_find_pcl)
  find_path(PCL_INCLUDE pcl/point_types.h PATH_SUFFIXES pcl-1.13 pcl-1.14 pcl-1.12)
  find_library(PCL_COMMON pcl_common)
  find_library(PCL_FILTERS pcl_filters)
  find_library(PCL_SURFACE pcl_surface)
  if(PCL_INCLUDE AND PCL_COMMON AND PCL_FILTERS AND PCL_SURFACE)
    atelier_system_alias(pcl "${PCL_INCLUDE};${EIGEN3_INCLUDE_DIR}"
      "${PCL_SURFACE};${PCL_FILTERS};${PCL_COMMON}")
  endif()
endfunction()

# libtorch (1.13 of Debian, or 2.x: -DTORCH_ROOT=<where it is unpacked>). Found by its header: its own
# package file sets flags and asks for CUDA's toolkit and Caffe2. Its CUDA half is loaded by nobody's
# symbols but its own, so that the linker has to be told to keep it; what that half needs (cuDNN, ...)
# lies beside it, where the linker does not look.
function(atelier_find_torch)
  find_path(TORCH_INCLUDE torch/torch.h HINTS "${TORCH_ROOT}"
    PATH_SUFFIXES include/torch/csrc/api/include torch/csrc/api/include)
  find_library(TORCH_LIBRARY torch HINTS "${TORCH_ROOT}" PATH_SUFFIXES lib)
  find_library(TORCH_CPU_LIBRARY torch_cpu HINTS "${TORCH_ROOT}" PATH_SUFFIXES lib)
  find_library(TORCH_CUDA_LIBRARY torch_cuda HINTS "${TORCH_ROOT}" PATH_SUFFIXES lib)
  find_library(C10_CUDA_LIBRARY c10_cuda HINTS "${TORCH_ROOT}" PATH_SUFFIXES lib)
  find_library(C10_LIBRARY c10 HINTS "${TORCH_ROOT}" PATH_SUFFIXES lib)
  if(TORCH_INCLUDE AND TORCH_LIBRARY AND TORCH_CPU_LIBRARY AND C10_LIBRARY)
    get_filename_component(torch_headers "${TORCH_INCLUDE}/../../../.." ABSOLUTE)
    atelier_system_alias(torch "${TORCH_INCLUDE};${torch_headers}"
      "${TORCH_LIBRARY};${TORCH_CPU_LIBRARY};${C10_LIBRARY}")
    if(TORCH_CUDA_LIBRARY)
      target_link_libraries(AtelierPackage::torch INTERFACE "-Wl,--no-as-needed,${TORCH_CUDA_LIBRARY},--as-needed"
        -Wl,--allow-shlib-undefined)
      if(C10_CUDA_LIBRARY AND CUDAToolkit_FOUND)
        target_link_libraries(AtelierPackage::torch INTERFACE "${C10_CUDA_LIBRARY}")
        target_include_directories(AtelierPackage::torch SYSTEM INTERFACE ${CUDAToolkit_INCLUDE_DIRS})
        target_compile_definitions(AtelierPackage::torch INTERFACE ATELIER_TORCH_CUDA=1)
      endif()
    endif()
  endif()
endfunction()

function(atelier_find_gtest)
  find_package(GTest 1.11 QUIET)
endfunction()

function(atelier_find_benchmark)
  find_package(benchmark 1.6 QUIET)
endfunction()

# What static libraries with kernels link; where this build has any, Options.cmake has found it.
function(atelier_find_cuda)
  find_package(CUDAToolkit QUIET)
endfunction()

if(DEFINED ATELIER_PACKAGES)
  set(atelier_packages ${ATELIER_PACKAGES})
else()
  set(atelier_packages tbb hdf5 opencv ceres jpeg png avif zip sodium libav tomlplusplus tinygltf assimp nlohmann_json
      cli11 spdlog embree cgal pcl torch gtest benchmark)
endif()
foreach(atelier_package IN LISTS atelier_packages)
  cmake_language(CALL atelier_find_${atelier_package})
endforeach()
