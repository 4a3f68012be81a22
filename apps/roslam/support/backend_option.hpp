// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>

#include "roslam/inference/inference.hpp"

namespace roslam::app {

/// Adds --backend: what runs the networks.
inline void add_backend_option(CLI::App& command, InferenceBackend& backend) {
  const std::map<std::string, InferenceBackend> backends{{"auto", InferenceBackend::kAutomatic},
                                                         {"own", InferenceBackend::kOwn},
                                                         {"opencv", InferenceBackend::kOpenCv},
                                                         {"onnxruntime", InferenceBackend::kOnnxRuntime}};
  command
      .add_option("--backend", backend,
                  "What runs the networks; default auto: own where it has all layers, else ONNX Runtime "
                  "where built with it, else OpenCV")
      ->transform(CLI::CheckedTransformer(backends).description(""))
      ->type_name("auto|own|opencv|onnxruntime");
}

/// The backends of this build, as in "own (AVX2), opencv".
inline std::string backends_in_words() {
  const std::string own = own_instruction_set();
  std::string words = own.empty() ? "" : "own (" + own + ")";
  const auto append = [&](const char* name) { words += (words.empty() ? "" : ", ") + std::string(name); };
  if (has_onnx_runtime()) append("onnxruntime");
  if (has_opencv_dnn()) append("opencv");
  return words.empty() ? "none" : words;
}

}  // namespace roslam::app
