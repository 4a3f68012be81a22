// SPDX-License-Identifier: BSD-3-Clause
// Whole networks give the same bits on all processors, with any number of threads and after any other size.
#include <gtest/gtest.h>

#include <new>

#include "roslam/common/error.hpp"
#include "tests/network_hash.hpp"

namespace roslam {
namespace {

const std::string kSegmenter = std::string(ROSLAM_MODELS) + "/roslam-pspnet.onnx";
const std::string kRestorer = std::string(ROSLAM_MODELS) + "/roslam-restorer-person.onnx";

// Every processor has to give these: NEON is checked by the test network_bits_neon.
TEST(Bits, AreTheSameOnAllProcessors) {
  if (runnable_kernels().empty()) GTEST_SKIP() << "this processor has no fused multiply-add";
  for (const Kernels* kernels : runnable_kernels()) {
    for (const int threads : {1, 2, 3}) {
      EXPECT_EQ(network_hash(kSegmenter, *kernels, 96, 128, threads), ROSLAM_SEGMENTER_HASH) << kernels->name;
      EXPECT_EQ(network_hash(kRestorer, *kernels, 256, 256, threads), ROSLAM_RESTORER_HASH) << kernels->name;
    }
  }
}

TEST(Bits, DoNotDependOnTheSizesBefore) {
  const Kernels* kernels = best_kernels();
  if (kernels == nullptr) GTEST_SKIP() << "this processor has no fused multiply-add";
  NetworkRunner runner(plan_network(read_onnx(file_content(kSegmenter))), *kernels, 1);
  for (const auto& [rows, columns] : {std::pair(32, 32), std::pair(320, 64), std::pair(96, 128)})
    output_hash(runner, rows, columns);
  EXPECT_EQ(output_hash(runner, 96, 128), ROSLAM_SEGMENTER_HASH);
}

TEST(Size, IsRefusedIfTheNetworkDoesNotWorkAtIt) {
  const Kernels* kernels = best_kernels();
  if (kernels == nullptr) GTEST_SKIP() << "this processor has no fused multiply-add";
  NetworkRunner runner(plan_network(read_onnx(file_content(kSegmenter))), *kernels, 1);
  for (const auto& [rows, columns] : {std::pair(0, 32), std::pair(-1, 5), std::pair(100000, 32),
                                      std::pair(33, 64), std::pair(40, 50), std::pair(1, 1)})
    EXPECT_THROW(runner.prepare(rows, columns), ModelError) << rows << "x" << columns;
  EXPECT_THROW(runner.prepare(8192, 8192), std::bad_alloc);        // 6 GB
  EXPECT_EQ(output_hash(runner, 96, 128), ROSLAM_SEGMENTER_HASH);  // and it still runs
}

}  // namespace
}  // namespace roslam
