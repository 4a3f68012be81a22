# SPDX-License-Identifier: BSD-3-Clause
# Precompiled headers: parsing Eigen and OpenCV is more than half of the time that a source takes to compile.
option(ROSLAM_PRECOMPILED_HEADERS "Parse common headers once; halves the time of a build" ON)

# roslam_precompile(target [HEADER...]): gives the target headers of its own.
function(roslam_precompile target)
  if(ROSLAM_PRECOMPILED_HEADERS)
    target_precompile_headers(${target} PRIVATE ${PROJECT_SOURCE_DIR}/cmake/precompiled.hpp ${ARGN})
  endif()
endfunction()

# roslam_precompiled_from(target other): shares those of another target, which is compiled with the same flags. It may
# define more macros than the other, not fewer.
function(roslam_precompiled_from target other)
  if(ROSLAM_PRECOMPILED_HEADERS)
    target_precompile_headers(${target} REUSE_FROM ${other})
  endif()
endfunction()

# Those that the libraries share.
file(WRITE ${PROJECT_BINARY_DIR}/precompiled.cpp "// Only carries precompiled headers.\n")
add_library(roslam_precompiled OBJECT EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/precompiled.cpp)
target_include_directories(roslam_precompiled SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS})
target_link_libraries(roslam_precompiled PRIVATE roslam_flags Eigen3::Eigen Threads::Threads)
roslam_precompile(roslam_precompiled)
