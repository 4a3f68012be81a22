// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/inertial_sample.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr std::string_view kBlanks = " \t\r\v\f,";

std::optional<InertialSample> parse(std::string_view line) {
  std::array<double, 7> values{};
  for (double& value : values) {
    const auto begin = line.find_first_not_of(kBlanks);
    if (begin == std::string_view::npos) return std::nullopt;
    line.remove_prefix(begin);
    // std::from_chars, unlike streams, does not depend on the locale.
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), value);
    if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
  }
  return InertialSample{values[0], {values[1], values[2], values[3]}, {values[4], values[5], values[6]}};
}
}  // namespace

InertialFile read_inertial_file(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw InputError(file.string() + ": cannot open the inertial samples");
  InertialFile result;
  std::string line;
  while (std::getline(in, line)) {
    const auto begin = line.find_first_not_of(kBlanks);
    if (begin == std::string::npos || line[begin] == '#') continue;
    if (const auto sample = parse(line)) {
      result.samples.push_back(*sample);
    } else {
      ++result.skipped;
    }
  }
  if (result.samples.empty())
    throw InputError(file.string() + ": no inertial sample; lines are 'timestamp wx wy wz ax ay az'");
  auto& samples = result.samples;
  std::stable_sort(samples.begin(), samples.end(),
                   [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  const auto repeated = std::unique(samples.begin(), samples.end(),
                                    [](const auto& a, const auto& b) { return a.timestamp == b.timestamp; });
  result.skipped += static_cast<std::size_t>(samples.end() - repeated);
  samples.erase(repeated, samples.end());
  return result;
}

}  // namespace roslam
