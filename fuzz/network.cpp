// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz/fuzz.hpp"
#include "roslam/inference/network_runner.hpp"
#include "roslam/inference/plan/onnx_graph.hpp"

namespace {
// Multiply-adds at 16x16 pixels, about: the fuzzer shall not wait for a network that is only large.
double work_of(const roslam::NetworkPlan& plan) {
  double work = 0.0;
  for (const auto& step : plan.steps)
    work += 256.0 * (static_cast<double>(step.weights.size()) + 64.0 * step.kernel * step.kernel);
  for (const auto& tensor : plan.tensors) work += 256.0 * tensor.channels * (1.0 + tensor.border);
  return work;
}
}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roslam;
  return fuzz::expect_result_or_error(data, size, [](std::string_view bytes) {
    NetworkPlan plan = plan_network(read_onnx(std::string(bytes)));
    const Kernels* kernels = best_kernels();
    if (kernels == nullptr || work_of(plan) > 1e8) return;
    NetworkRunner runner(std::move(plan), *kernels, 1);
    for (const int side : {16, 3}) {
      try {
        runner.prepare(side, side);
        runner.run();
      } catch (const ModelError&) {
      } catch (const std::bad_alloc&) {
      }
    }
  });
}
