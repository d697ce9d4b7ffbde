# One alias per package, so that targets name packages by one short word. A package that is not
# there leaves its alias undefined; Targets.cmake then leaves out what needs it, in one line.

macro(atelier_alias name)
  if(NOT TARGET ${name})
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE ${ARGN})
  endif()
endmacro()

# Third-party headers are SYSTEM: their warnings are not ours.
macro(atelier_system_alias name includes libraries)
  if(NOT TARGET ${name})
    add_library(${name} INTERFACE)
    target_include_directories(${name} SYSTEM INTERFACE ${includes})
    target_link_libraries(${name} INTERFACE ${libraries})
  endif()
endmacro()

find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(TBB QUIET)

set(HDF5_PREFER_PARALLEL OFF)
find_package(HDF5 1.10 QUIET COMPONENTS C)
if(HDF5_FOUND)
  atelier_system_alias(hdf5 "${HDF5_C_INCLUDE_DIRS}" "${HDF5_C_LIBRARIES}")
endif()

find_package(OpenCV 4.5 QUIET COMPONENTS core imgcodecs imgproc videoio calib3d aruco)
if(OpenCV_FOUND)
  # Without the codecs of pictures and videos, which bring two hundred libraries: they are loaded late.
  set(opencv_libraries ${OpenCV_LIBS})
  list(REMOVE_ITEM opencv_libraries opencv_imgcodecs opencv_videoio)
  atelier_system_alias(opencv "${OpenCV_INCLUDE_DIRS}" "${opencv_libraries}")
endif()

# Calibration's bundle adjustment.
find_package(Ceres 2.1 QUIET)
if(Ceres_FOUND)
  atelier_alias(ceres Ceres::ceres)
endif()

find_package(JPEG QUIET)
if(JPEG_FOUND)
  atelier_alias(jpeg JPEG::JPEG)
endif()
find_package(PNG QUIET)
if(PNG_FOUND)
  atelier_alias(png PNG::PNG)
endif()

find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(AVIF QUIET IMPORTED_TARGET libavif)
  if(AVIF_FOUND)
    atelier_alias(avif PkgConfig::AVIF)
  endif()
  pkg_check_modules(ZIP QUIET IMPORTED_TARGET libzip)
  if(ZIP_FOUND)
    atelier_alias(zip PkgConfig::ZIP)
  endif()
  pkg_check_modules(LIBAV QUIET IMPORTED_TARGET libavformat libavcodec libavutil)
  if(LIBAV_FOUND)
    atelier_alias(libav PkgConfig::LIBAV)
  endif()
  pkg_check_modules(TOMLPP QUIET IMPORTED_TARGET tomlplusplus)
  if(TOMLPP_FOUND)
    atelier_alias(tomlplusplus PkgConfig::TOMLPP)
  endif()
endif()

find_path(TINYGLTF_INCLUDE tiny_gltf.h)
find_library(TINYGLTF_LIBRARY tinygltf)
if(TINYGLTF_INCLUDE AND TINYGLTF_LIBRARY)
  atelier_system_alias(tinygltf "${TINYGLTF_INCLUDE}" "${TINYGLTF_LIBRARY}")
endif()

# FBX. Found by its header: its own package file names build folders in some versions.
find_path(ASSIMP_INCLUDE assimp/scene.h)
find_library(ASSIMP_LIBRARY assimp)
if(ASSIMP_INCLUDE AND ASSIMP_LIBRARY)
  atelier_system_alias(assimp "${ASSIMP_INCLUDE}" "${ASSIMP_LIBRARY}")
else()
  message(STATUS "left out: reading of FBX (missing: libassimp-dev)")
endif()

find_package(nlohmann_json 3.10 QUIET)
if(nlohmann_json_FOUND)
  atelier_alias(nlohmann_json nlohmann_json::nlohmann_json)
endif()

find_package(CLI11 2.1 QUIET)
if(CLI11_FOUND)
  atelier_alias(cli11 CLI11::CLI11)
endif()

find_package(spdlog 1.8 QUIET)
if(spdlog_FOUND)
  atelier_alias(spdlog spdlog::spdlog)
endif()

find_package(embree 3 QUIET)

# Found by its header: CGAL's own package file changes compiler flags.
find_path(CGAL_INCLUDE CGAL/version.h)
find_library(GMP_LIBRARY gmp)
find_library(MPFR_LIBRARY mpfr)
if(CGAL_INCLUDE AND GMP_LIBRARY AND MPFR_LIBRARY)
  atelier_system_alias(cgal "${CGAL_INCLUDE}" "${MPFR_LIBRARY};${GMP_LIBRARY}")
endif()

# Found by its header too: PCL's own package file asks for VTK and every other thing that some part
# of it can use.
find_path(PCL_INCLUDE pcl/point_types.h PATH_SUFFIXES pcl-1.13 pcl-1.14 pcl-1.12)
find_library(PCL_COMMON pcl_common)
find_library(PCL_FILTERS pcl_filters)
find_library(PCL_SURFACE pcl_surface)
if(PCL_INCLUDE AND PCL_COMMON AND PCL_FILTERS AND PCL_SURFACE)
  atelier_system_alias(pcl "${PCL_INCLUDE};${EIGEN3_INCLUDE_DIR}"
    "${PCL_SURFACE};${PCL_FILTERS};${PCL_COMMON}")
endif()

# libtorch (1.13 of Debian, or 2.x: -DTORCH_ROOT=<where it is unpacked>). Found by its header: its own
# package file sets flags and asks for CUDA's toolkit and Caffe2. Its CUDA half is loaded by nobody's
# symbols but its own, so that the linker has to be told to keep it; what that half needs (cuDNN, ...)
# lies beside it, where the linker does not look.
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
    target_link_libraries(torch INTERFACE "-Wl,--no-as-needed,${TORCH_CUDA_LIBRARY},--as-needed"
      -Wl,--allow-shlib-undefined)
    if(C10_CUDA_LIBRARY AND CUDAToolkit_FOUND)
      target_link_libraries(torch INTERFACE "${C10_CUDA_LIBRARY}")
      target_include_directories(torch SYSTEM INTERFACE ${CUDAToolkit_INCLUDE_DIRS})
      target_compile_definitions(torch INTERFACE ATELIER_TORCH_CUDA=1)
    endif()
  endif()
endif()

find_package(GTest 1.11 QUIET)
find_package(benchmark 1.6 QUIET)
