set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "Build type" FORCE)
endif()

set(ATELIER_CUDA "AUTO" CACHE STRING "CUDA twins: AUTO (where nvcc is found), ON (required), OFF")
set(ATELIER_SANITIZE "" CACHE STRING "Sanitizers for our code, e.g. address,undefined or thread")
option(ATELIER_EXACT "No fused multiply-add, so that CPU and CUDA twins agree bit for bit" OFF)
option(ATELIER_FUZZ "Build libFuzzer targets (needs clang)" OFF)
option(ATELIER_COVERAGE "Instrument for gcov" OFF)
option(ATELIER_QUICK_CUDA "Compile kernels in half the time, to slower ones" OFF)
option(ATELIER_TESTS "Build the tests" ON)
option(ATELIER_BENCH "Build the benchmarks" ON)
option(ATELIER_PYTHON "Build the Python package, where pybind11 is found" ON)
set(ATELIER_LEAVE_OUT "" CACHE STRING "Commands (files of apps/commands) that are not built, nor what they alone need")

# Optimised but quick to link: line tables are enough for a stack trace.
set(ATELIER_LINE_TABLES 1 CACHE STRING "Debug information of RelWithDebInfo: 1 line tables, 0 none")
option(ATELIER_CHECKS "Assertions of libraries, and warnings as errors, in RelWithDebInfo: a tenth of the time of compiling" ON)
# What sanitizers watch is compiled in three quarters of the time at -O1, and slow either way.
if(ATELIER_SANITIZE)
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1")
else()
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g${ATELIER_LINE_TABLES}")
endif()
if(NOT ATELIER_CHECKS)
  string(APPEND CMAKE_CXX_FLAGS_RELWITHDEBINFO " -DNDEBUG")
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")

# Where there is memory GCC is told to collect its garbage late: a tenth of the time of compiling.
# Not where Clang's tools read the flags (scripts/lint).
option(ATELIER_LATE_GARBAGE "Let GCC use more memory and less time" ON)
cmake_host_system_information(RESULT cores QUERY NUMBER_OF_LOGICAL_CORES)
cmake_host_system_information(RESULT megabytes QUERY TOTAL_PHYSICAL_MEMORY)
math(EXPR megabytes_a_core "${megabytes} / ${cores}")
if(ATELIER_LATE_GARBAGE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND megabytes_a_core GREATER 6000)
  add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:--param=ggc-min-expand=400;--param=ggc-min-heapsize=1000000>")
  # Of targets whose units would take 2.7 GB that way, and save nothing: 1.9 GB.
  set(ATELIER_LARGE_UNITS "$<$<COMPILE_LANGUAGE:CXX>:--param=ggc-min-expand=60;--param=ggc-min-heapsize=262144>")
endif()

# Twelve sources are one translation unit: from nothing everything is built in half the time, and one
# changed source still in seconds. Two file-local things of one name may meet in a batch: the compiler
# says so. -DCMAKE_UNITY_BUILD=OFF compiles each source alone.
set(CMAKE_UNITY_BUILD ON CACHE BOOL "Compile sources in batches")
set(ATELIER_BATCH 12 CACHE STRING "Sources of one translation unit; more are built faster from nothing, with more memory")
set(CMAKE_UNITY_BUILD_BATCH_SIZE ${ATELIER_BATCH})

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  # ccache keeps nothing that uses precompiled headers unless it is told that their dates and macros
  # do not matter.
  set(launcher "${CMAKE_COMMAND};-E;env;CCACHE_SLOPPINESS=pch_defines,time_macros;CCACHE_DEPEND=1;${CCACHE_PROGRAM}")
  set(CMAKE_C_COMPILER_LAUNCHER "${launcher}")
  set(CMAKE_CXX_COMPILER_LAUNCHER "${launcher}")
  set(CMAKE_CUDA_COMPILER_LAUNCHER "${CCACHE_PROGRAM}")
endif()

find_program(MOLD_PROGRAM mold)
if(MOLD_PROGRAM AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 12.1)
  add_link_options(-fuse-ld=mold)
endif()

set(ATELIER_HAS_CUDA OFF)
if(NOT ATELIER_CUDA STREQUAL "OFF")
  include(CheckLanguage)
  check_language(CUDA)
  if(CMAKE_CUDA_COMPILER)
    if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES)
      # Byte code of Turing and of Hopper, whose clusters need their own, for every later card, and
      # machine code for Hopper. The preset dev leaves the last out: half the time of compiling.
      set(CMAKE_CUDA_ARCHITECTURES "75-virtual;90")
    endif()
    enable_language(CUDA)
    if(NOT CMAKE_CUDA20_STANDARD_COMPILE_OPTION)
      # CMake before 3.25.2 does not know that nvcc can.
      set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION "-std=c++20")
      set(CMAKE_CUDA20_EXTENSION_COMPILE_OPTION "-std=c++20")
    endif()
    set(CMAKE_CUDA_STANDARD 20)
    set(CMAKE_CUDA_STANDARD_REQUIRED ON)
    set(CMAKE_CUDA_RUNTIME_LIBRARY Static)
    find_package(CUDAToolkit REQUIRED)
    if(ATELIER_QUICK_CUDA AND CMAKE_CUDA_COMPILER_VERSION VERSION_GREATER_EQUAL 12.9)
      add_compile_options("$<$<COMPILE_LANGUAGE:CUDA>:-Ofc=max>")
    endif()
    set(ATELIER_HAS_CUDA ON)
  elseif(ATELIER_CUDA STREQUAL "ON")
    message(FATAL_ERROR "ATELIER_CUDA=ON, but no nvcc was found")
  else()
    message(STATUS "left out: CUDA twins (no nvcc)")
  endif()
endif()
