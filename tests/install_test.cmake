# SPDX-License-Identifier: BSD-3-Clause
# Installs the library, builds the example against what was installed, and runs it on a short simulated flight.
#   cmake -DBUILD=... -DEXAMPLES=... -DWORK=... -DPROGRAM=... -DGENERATOR=... -DBUILD_TYPE=... -DCXX=...
#         [-DCXX_FLAGS=...] -P install_test.cmake
set(FRAMES 20)

function(run_step)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    string(JOIN " " command ${ARGN})
    message(FATAL_ERROR "${command}\nended with ${result}:\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK})  # what an earlier version installed must not help
run_step(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix --config ${BUILD_TYPE})
run_step(${CMAKE_COMMAND} -S ${EXAMPLES} -B ${WORK}/build -G ${GENERATOR} -DCMAKE_BUILD_TYPE=${BUILD_TYPE}
  -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_CXX_FLAGS=${CXX_FLAGS} -DCMAKE_PREFIX_PATH=${WORK}/prefix)
run_step(${CMAKE_COMMAND} --build ${WORK}/build --config ${BUILD_TYPE})
run_step(${PROGRAM} simulate street --frames ${FRAMES} --out ${WORK}/flight)

execute_process(
  COMMAND ${WORK}/build/minimal ${WORK}/flight ${WORK}/flight/camera.yaml ${WORK}/trajectory.txt
  RESULT_VARIABLE result OUTPUT_VARIABLE poses ERROR_VARIABLE errors)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "the example ended with ${result}: ${errors}")
endif()
string(REGEX MATCHALL "\n" lines "${poses}")
list(LENGTH lines count)
if(NOT count EQUAL FRAMES)
  message(FATAL_ERROR "the example printed ${count} poses of ${FRAMES}:\n${poses}")
endif()
file(STRINGS ${WORK}/trajectory.txt written REGEX "^[0-9]")
list(LENGTH written count)
if(NOT count EQUAL FRAMES)
  message(FATAL_ERROR "the example wrote ${count} poses of ${FRAMES}")
endif()

# The first flight makes the map, the second goes on from it, one over another street leaves it as it is.
set(AGAIN ${WORK}/build/fly_again)
set(VOCABULARY ${WORK}/prefix/share/roslam/models/roslam-orb.vocabulary)
run_step(${AGAIN} ${WORK}/flight ${WORK}/flight/camera.yaml ${VOCABULARY} ${WORK}/map.roslam)
run_step(${AGAIN} ${WORK}/flight ${WORK}/flight/camera.yaml ${VOCABULARY} ${WORK}/map.roslam)
run_step(${PROGRAM} simulate street --seed 2 --frames ${FRAMES} --out ${WORK}/elsewhere)
file(SHA256 ${WORK}/map.roslam before)
execute_process(
  COMMAND ${AGAIN} ${WORK}/elsewhere ${WORK}/elsewhere/camera.yaml ${VOCABULARY} ${WORK}/map.roslam
  RESULT_VARIABLE result OUTPUT_QUIET ERROR_VARIABLE errors)
file(SHA256 ${WORK}/map.roslam after)
if(NOT result EQUAL 1 OR NOT errors MATCHES "never met" OR NOT before STREQUAL after)
  message(FATAL_ERROR "a flight elsewhere ended with ${result}: ${errors}")
endif()

# A keyframe without what moves.
run_step(${WORK}/build/restore_scene ${WORK}/flight ${WORK}/flight/camera.yaml ${WORK}/prefix/share/roslam/models
  ${WORK}/restored)
if(NOT EXISTS ${WORK}/restored/0.png)
  message(FATAL_ERROR "the example restored no keyframe")
endif()

# A dense map.
run_step(${WORK}/build/dense_map ${WORK}/flight ${WORK}/flight/camera.yaml ${WORK}/prefix/share/roslam/models
  ${WORK}/mapped)
foreach(file map.ply map.bt)
  if(NOT EXISTS ${WORK}/mapped/${file})
    message(FATAL_ERROR "the example wrote no ${file}")
  endif()
endforeach()
