# SPDX-License-Identifier: BSD-3-Clause
# The bits that network_hash gives under an emulator of another processor: PROGRAM, EMULATOR, MODELS, SEGMENTER_HASH and
# RESTORER_HASH are given.
foreach(case "roslam-pspnet.onnx;96;128;${SEGMENTER_HASH}" "roslam-restorer-person.onnx;256;256;${RESTORER_HASH}")
  list(GET case 0 model)
  list(GET case 1 rows)
  list(GET case 2 columns)
  list(GET case 3 expected)
  execute_process(COMMAND ${EMULATOR} ${PROGRAM} ${MODELS}/${model} ${rows} ${columns}
    OUTPUT_VARIABLE output RESULT_VARIABLE result OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT result EQUAL 0 OR NOT output STREQUAL "NEON ${expected}")
    message(FATAL_ERROR "${model}: got '${output}' (${result}), expected 'NEON ${expected}'")
  endif()
endforeach()
