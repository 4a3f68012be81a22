// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/datasets/inertial_lists.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "roslam/datasets/text_numbers.hpp"

namespace roslam::datasets {

namespace {
struct Row {
  double time = 0.0;
  std::vector<double> values;
};

// Lines of a time and as many finite numbers, in order of time.
std::vector<Row> read_rows(const std::filesystem::path& file, std::size_t values, double seconds,
                           Counts& notes) {
  std::vector<Row> rows;
  std::size_t skipped = 0;
  for_each_line(file, "is the dataset complete?", [&](std::size_t, std::string_view line) {
    const auto numbers = numbers_of(line);
    const bool is_row =
        numbers && numbers->size() >= values + 1 &&
        std::all_of(numbers->begin(), numbers->begin() + static_cast<std::ptrdiff_t>(values) + 1,
                    [](double number) { return std::isfinite(number); });
    if (is_row) {
      rows.push_back({numbers->front() * seconds, {numbers->begin() + 1, numbers->end()}});
    } else {
      ++skipped;
    }
  });
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.time < b.time; });
  const auto repeated =
      std::unique(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.time == b.time; });
  skipped += static_cast<std::size_t>(rows.end() - repeated);
  rows.erase(repeated, rows.end());
  count(notes, "line of " + file.filename().string() + " that is no sample, skipped", skipped);
  return rows;
}

Eigen::Vector3d vector_of(const Row& row, std::size_t first) {
  return {row.values[first], row.values[first + 1], row.values[first + 2]};
}
}  // namespace

std::vector<InertialSample> read_inertial_lists(const std::filesystem::path& gyroscope,
                                                const std::filesystem::path& accelerometer, double seconds,
                                                Counts& notes) {
  const auto rates = read_rows(gyroscope, 3, seconds, notes);
  const auto accelerations = read_rows(accelerometer, 3, seconds, notes);
  std::vector<InertialSample> samples;
  std::size_t next = 0;  // acceleration at or after the sample
  for (const Row& rate : rates) {
    while (next < accelerations.size() && accelerations[next].time < rate.time) ++next;
    if (next == accelerations.size()) break;
    const Row& after = accelerations[next];
    if (next == 0 && after.time > rate.time) continue;
    const Row& before = accelerations[next > 0 ? next - 1 : 0];
    const double gap = after.time - before.time;
    const double share = gap > 0.0 ? (rate.time - before.time) / gap : 1.0;
    samples.push_back(
        {rate.time, vector_of(rate, 0), (1.0 - share) * vector_of(before, 0) + share * vector_of(after, 0)});
  }
  count(notes, "sample of the gyroscope without one of the accelerometer, left out",
        rates.size() - samples.size());
  return samples;
}

std::vector<InertialSample> read_inertial_table(const std::filesystem::path& file, double seconds,
                                                Counts& notes) {
  std::vector<InertialSample> samples;
  for (const Row& row : read_rows(file, 6, seconds, notes))
    samples.push_back({row.time, vector_of(row, 0), vector_of(row, 3)});
  return samples;
}

}  // namespace roslam::datasets
