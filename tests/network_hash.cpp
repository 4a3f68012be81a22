// SPDX-License-Identifier: BSD-3-Clause
// Prints the hash of network_hash.hpp for the kernels of this processor: network_hash MODEL ROWS COLUMNS
#include "tests/network_hash.hpp"

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  const roslam::Kernels* kernels = roslam::best_kernels();
  if (argc != 4 || kernels == nullptr) return 2;
  const auto hash = roslam::network_hash(argv[1], *kernels, std::atoi(argv[2]), std::atoi(argv[3]));
  std::printf("%s %016llx\n", kernels->name, static_cast<unsigned long long>(hash));
  return 0;
}
