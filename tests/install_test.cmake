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

# A static library does not know where it was installed to; a program says so.
set(ENV{ROSLAM_MODEL_PATH} ${WORK}/prefix/share/roslam/models)
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

# The library does what the program does, bit for bit.
run_step(${PROGRAM} run ${WORK}/flight --camera ${WORK}/flight/camera.yaml --out ${WORK}/run)
execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files ${WORK}/trajectory.txt ${WORK}/run/trajectory.txt
  RESULT_VARIABLE differs)
if(differs)
  message(FATAL_ERROR "examples/minimal.cpp and roslam run wrote different trajectories")
endif()

# pkg-config finds what a compiler needs.
find_program(PKG_CONFIG pkg-config)
if(PKG_CONFIG)
  file(GLOB_RECURSE pc ${WORK}/prefix/roslam.pc)
  get_filename_component(pc_folder ${pc} DIRECTORY)
  set(ENV{PKG_CONFIG_PATH} ${pc_folder})
  execute_process(COMMAND ${PKG_CONFIG} --cflags --libs roslam RESULT_VARIABLE result OUTPUT_VARIABLE flags
    ERROR_VARIABLE errors OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "pkg-config does not find roslam: ${errors}")
  endif()
  separate_arguments(flags UNIX_COMMAND "${flags} ${CXX_FLAGS}")
  run_step(${CXX} -std=c++20 ${EXAMPLES}/minimal.cpp -o ${WORK}/minimal_by_pkg_config ${flags})
endif()

# The first session makes the map, the second continues it, one over another street leaves it as it is.
set(AGAIN ${WORK}/build/fly_again)
run_step(${AGAIN} ${WORK}/flight ${WORK}/flight/camera.yaml ${WORK}/map.roslam)
run_step(${AGAIN} ${WORK}/flight ${WORK}/flight/camera.yaml ${WORK}/map.roslam)
run_step(${PROGRAM} simulate street --seed 2 --frames ${FRAMES} --out ${WORK}/elsewhere)
file(SHA256 ${WORK}/map.roslam before)
execute_process(
  COMMAND ${AGAIN} ${WORK}/elsewhere ${WORK}/elsewhere/camera.yaml ${WORK}/map.roslam
  RESULT_VARIABLE result OUTPUT_QUIET ERROR_VARIABLE errors)
file(SHA256 ${WORK}/map.roslam after)
if(NOT result EQUAL 1 OR NOT errors MATCHES "no frame was localised" OR NOT before STREQUAL after)
  message(FATAL_ERROR "a flight elsewhere ended with ${result}: ${errors}")
endif()

# A keyframe without what moves.
run_step(${WORK}/build/restore_scene ${WORK}/flight ${WORK}/flight/camera.yaml ${WORK}/restored)
if(NOT EXISTS ${WORK}/restored/0.png)
  message(FATAL_ERROR "the example restored no keyframe")
endif()

# A dense map.
run_step(${WORK}/build/dense_map ${WORK}/flight ${WORK}/flight/camera.yaml ${WORK}/mapped)
foreach(file map.ply map.bt)
  if(NOT EXISTS ${WORK}/mapped/${file})
    message(FATAL_ERROR "the example wrote no ${file}")
  endif()
endforeach()
