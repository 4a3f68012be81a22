# SPDX-License-Identifier: BSD-3-Clause
# Which parts are built: sets ROSLAM_HAS_SEMANTICS, _DENSE, _SIMULATION, _REALSENSE and _VIEW, and writes the version header.

# roslam_component(NAME remedy condition...): whether ROSLAM_<NAME> is built.
function(roslam_component name remedy)
  set(wanted ${ROSLAM_${name}})
  if(NOT wanted MATCHES "^(AUTO|ON|OFF)$")
    message(FATAL_ERROR "ROSLAM_${name} is '${wanted}'; it must be AUTO, ON or OFF")
  endif()
  set(is_found OFF)
  if(${ARGN})
    set(is_found ON)
  endif()
  if(wanted STREQUAL "ON" AND NOT is_found)
    message(FATAL_ERROR "ROSLAM_${name} is ON, but a package it needs was not found; install ${remedy}")
  endif()
  set(has ${is_found})
  if(wanted STREQUAL "OFF")
    set(has OFF)
  elseif(NOT is_found)
    message(STATUS "ROSLAM_${name}: not built, install ${remedy} for it")
  endif()
  set(ROSLAM_HAS_${name} ${has} PARENT_SCOPE)
endfunction()

roslam_component(SEMANTICS nothing TRUE)
roslam_component(DENSE liboctomap-dev octomap_FOUND)
roslam_component(SIMULATION libembree-dev embree_FOUND)
roslam_component(REALSENSE librealsense2-dev realsense2_FOUND)

roslam_component(VIEW libcpp-httplib-dev ROSLAM_HTTPLIB_FOUND)

# Modules of OpenCV that are optional within the component semantics: ROSLAM_HAS_OPENCV_DNN and ROSLAM_HAS_OPENCV_PHOTO.
foreach(module dnn photo)
  string(TOUPPER ${module} name)
  set(ROSLAM_HAS_OPENCV_${name} OFF)
  if(ROSLAM_HAS_SEMANTICS AND ROSLAM_OPENCV_DNN AND TARGET opencv_${module})
    set(ROSLAM_HAS_OPENCV_${name} ON)
  endif()
endforeach()

# Packages that recordings need, each for itself: ROSLAM_HAS_RECORDING lists those that are used.
set(ROSLAM_RECORDING_PACKAGES LZ4 BZ2 ZSTD SQLITE3)
include(${CMAKE_CURRENT_LIST_DIR}/recording_packages.cmake)
list(JOIN roslam_recording_missing " " missing)
roslam_component(RECORDINGS "${missing}" NOT missing)
set(ROSLAM_HAS_RECORDING "")
foreach(name ${ROSLAM_RECORDING_PACKAGES})
  if(TARGET roslam_recording::${name} AND NOT ROSLAM_RECORDINGS STREQUAL "OFF")
    list(APPEND ROSLAM_HAS_RECORDING ${name})
  endif()
endforeach()

foreach(name SEMANTICS DENSE)  # as C++ writes it
  if(ROSLAM_HAS_${name})
    set(ROSLAM_CONSTANT_${name} true)
  else()
    set(ROSLAM_CONSTANT_${name} false)
  endif()
endforeach()
configure_file(${CMAKE_CURRENT_LIST_DIR}/version.hpp.in ${PROJECT_BINARY_DIR}/generated/roslam/version.hpp @ONLY)
