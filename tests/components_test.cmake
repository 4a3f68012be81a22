# SPDX-License-Identifier: BSD-3-Clause
# Configures and builds the core as if Embree, OctoMap and OpenCV's dnn were not installed, as a shared library, checks what
# it links, and tracks a recording with it: with networks, and without.
#   cmake -DSOURCE=... -DWORK=... -DFLIGHT=... -DGENERATOR=... -DCXX=... -P components_test.cmake
function(run_step)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  if(NOT result EQUAL 0)
    string(JOIN " " command ${ARGN})
    message(FATAL_ERROR "${command}\nended with ${result}:\n${output}\n${errors}")
  endif()
  set(said "${output}${errors}" PARENT_SCOPE)
endfunction()

# check(NAME WHAT_IT_SAYS WHAT_IT_DOES_NOT_SAY CMAKE_OPTION...): builds the core with these options and tracks with it.
function(check name says says_not)
  run_step(${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK} -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${CXX}
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS_RELEASE=-O1 -DROSLAM_BUILD_APPS=OFF -DROSLAM_BUILD_TESTS=OFF
    -DROSLAM_BUILD_BENCHMARKS=OFF -DBUILD_SHARED_LIBS=ON
    -DCMAKE_DISABLE_FIND_PACKAGE_embree=ON -DCMAKE_DISABLE_FIND_PACKAGE_octomap=ON ${ARGN})
  if(NOT said MATCHES "ROSLAM_DENSE: not built" OR NOT said MATCHES "ROSLAM_SIMULATION: not built")
    message(FATAL_ERROR "the configuration does not say what is not built:\n${said}")
  endif()
  run_step(${CMAKE_COMMAND} --build ${WORK} --target roslam roslam_sensors)
  find_program(OBJDUMP objdump)
  if(OBJDUMP)
    run_step(${OBJDUMP} -p ${WORK}/library/libroslam.so)
    if(said MATCHES "NEEDED[ ]+(lib(octomap|octomath|embree|opencv_(dnn|photo|imgcodecs|videoio|highgui))[^\n]*)")
      message(FATAL_ERROR "${name}: the core library links ${CMAKE_MATCH_1}")
    endif()
  endif()
  run_step(${CXX} -std=c++20 -O1 -I${SOURCE} -I${WORK}/generated -isystem ${OPENCV_INCLUDE} -isystem ${EIGEN_INCLUDE}
    ${SOURCE}/examples/minimal.cpp -o ${WORK}/minimal -L${WORK}/library -Wl,-rpath,${WORK}/library -lroslam_sensors -lroslam
    -lopencv_core)
  run_step(${CMAKE_COMMAND} -E env ROSLAM_MODEL_PATH=${SOURCE}/models ${WORK}/minimal ${FLIGHT} simulated ${WORK}/trajectory.txt)
  if(NOT said MATCHES "built without the dense map" OR NOT said MATCHES "${says}" OR said MATCHES "${says_not}")
    message(FATAL_ERROR "${name}: the run does not say what it does without:\n${said}")
  endif()
  file(STRINGS ${WORK}/trajectory.txt poses REGEX "^[0-9]")
  list(LENGTH poses count)
  file(STRINGS ${FLIGHT}/rgb.txt frames REGEX "^[0-9]")
  list(LENGTH frames expected)
  math(EXPR least "${expected} * 8 / 10")
  if(count LESS least)
    message(FATAL_ERROR "${name}: ${count} of ${expected} frames were tracked")
  endif()
endfunction()

# The own inference engine labels without OpenCV's dnn.
check(labels "." "found by geometry alone" -DROSLAM_SEMANTICS=ON -DROSLAM_OPENCV_DNN=OFF)
# Without labels dynamic objects are found by geometry, as with --dynamic geometry.
check(bare "found by geometry alone" "the own inference engine" -DROSLAM_SEMANTICS=OFF -DROSLAM_RECORDINGS=OFF)
