// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/roslam/run/mavlink.hpp"
#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/output.hpp"
#include "evaluation/plots/markdown_table.hpp"
#include "recording/odometry_file.hpp"
#include "recording/recorded_run.hpp"
#include "telemetry/mavlink/mavlink_link.hpp"
#include "telemetry/mavlink/stream_check.hpp"

namespace roslam::app {

using namespace telemetry;
using evaluation::fixed;

namespace {
using Json = nlohmann::ordered_json;

constexpr auto kExamples = R"(Examples:
  roslam telemetry check flight
  roslam telemetry check flight --frame map --send-predicted --json

Prints what --mavlink would have sent in the flight of a run folder, by odometry.csv and its timestamps, and
whether it is what PX4 and ArduPilot demand (docs/autopilot.md): rates and gaps, resets, steps, covariances,
bytes a second. A run in real-time mode shows the frames that were dropped as well.
Exit code: 0 the flight was checked, whatever was found, 1 an error in the input, 2 wrong usage.)";

struct Arguments {
  std::filesystem::path run;
  MavlinkArguments mavlink;
  bool json = false;
};

std::vector<TrackingReport> reports_of(const std::filesystem::path& run) {
  std::vector<TrackingReport> reports;
  for (const recording::OdometryRow& row : recording::read_odometry_rows(run / "odometry.csv")) {
    TrackingReport& report = reports.emplace_back();
    report.timestamp = row.timestamp;
    report.state = row.state;
    report.no_pose = row.no_pose;
    report.odometry = row.odometry;
  }
  return reports;
}

Json json_of(const Spread& spread) {
  return {{"least", spread.least}, {"median", spread.median}, {"most", spread.most}};
}

Json json_of(const StreamCheck& check, const Arguments& arguments) {
  Json states = Json::object(), rules = Json::array();
  for (const StateShare& one : check.states)
    states[std::string(name_of(one.state))] = {{"frames", one.frames}, {"messages", one.messages}};
  for (const StreamRule& rule : check.rules)
    rules.push_back({{"autopilot", rule.autopilot},
                     {"demand", rule.demand},
                     {"found", rule.found},
                     {"met", rule.is_met}});
  return {{"run", arguments.run.string()},
          {"frame", arguments.mavlink.frame},
          {"duration_seconds", check.duration},
          {"states", states},
          {"messages", check.counts.odometry},
          {"predicted_unsent", check.counts.predicted_unsent},
          {"rate_hertz", check.rate},
          {"gaps_above_200_ms", check.long_gaps},
          {"longest_gap_seconds", check.longest_gap},
          {"longest_gap_tracking_seconds", check.longest_gap_tracking},
          {"resets", check.resets},
          {"map_jumps", check.counts.map_jumps},
          {"largest_step_metres", check.largest_step},
          {"largest_step_off_velocity_metres", check.largest_surprise},
          {"tilt_at_start_degrees", check.first_tilt},
          {"position_sigma_metres", json_of(check.position_sigma)},
          {"angle_sigma_radians", json_of(check.angle_sigma)},
          {"bytes_per_second", check.bytes_per_second},
          {"most_bytes_in_a_second", check.most_bytes},
          {"least_baud", baud_for(check.most_bytes)},
          {"texts", check.texts},
          {"rules", rules},
          {"ready", check.is_ready()}};
}

void print_tables(const StreamCheck& check) {
  std::vector<evaluation::TableRow> states{{"state", "frames", "ODOMETRY"}};
  for (const StateShare& one : check.states)
    states.push_back(
        {std::string(name_of(one.state)), std::to_string(one.frames), std::to_string(one.messages)});
  std::cout << evaluation::markdown_table(states) << "\n";
  const auto spread = [](const Spread& s) {
    return fixed(s.least, 4) + " / " + fixed(s.median, 4) + " / " + fixed(s.most, 4);
  };
  const std::vector<evaluation::TableRow> figures{
      {"figure", "value"},
      {"duration s", fixed(check.duration, 2)},
      {"rate while tracking Hz", fixed(check.rate, 1)},
      {"gaps above 200 ms", std::to_string(check.long_gaps)},
      {"longest gap ms", fixed(1e3 * check.longest_gap, 0)},
      {"longest gap while tracking ms", fixed(1e3 * check.longest_gap_tracking, 0)},
      {"resets", std::to_string(check.resets)},
      {"largest step m", fixed(check.largest_step, 3)},
      {"largest step off the velocity m", fixed(check.largest_surprise, 3)},
      {"sigma of position m, least / median / most", spread(check.position_sigma)},
      {"sigma of attitude rad, least / median / most", spread(check.angle_sigma)},
      {"bytes a second, mean", fixed(check.bytes_per_second, 0)},
      {"bytes a second, most", fixed(check.most_bytes, 0)},
      {"least baud rate", std::to_string(baud_for(check.most_bytes))}};
  std::cout << evaluation::markdown_table(figures) << "\n";
  std::vector<evaluation::TableRow> rules{{"autopilot: demand", "found", "met"}};
  for (const StreamRule& rule : check.rules)
    rules.push_back({rule.autopilot + ": " + rule.demand, rule.found, rule.is_met ? "yes" : "NO"});
  std::cout << evaluation::markdown_table(rules);
}

void check(const Arguments& arguments) {
  const std::vector<TrackingReport> reports = reports_of(arguments.run);
  OdometryStreamOptions options = stream_options(arguments.mavlink);
  options.is_inertial = recording::camera_of_run(arguments.run).imu.has_value();
  const StreamCheck result = check_stream(reports, options);
  if (arguments.json) {
    std::cout << json_of(result, arguments).dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    print_tables(result);
    for (const std::string& text : result.texts) std::cout << "text: " << text << "\n";
    std::cout << (result.is_ready() ? "verdict: what PX4 and ArduPilot demand is met\n"
                                    : "verdict: NOT all that PX4 and ArduPilot demand is met\n");
  }
  require_written_output();
}
}  // namespace

void add_telemetry_command(CLI::App& program) {
  CLI::App* telemetry = program.add_subcommand("telemetry", "What leaves the drone while it flies");
  telemetry->require_subcommand(1);
  CLI::App* command =
      telemetry->add_subcommand("check", "Print what an autopilot would have been sent in a run");
  const auto arguments = std::make_shared<Arguments>();
  command->footer(kExamples);
  command->add_option("RUN", arguments->run, "Folder that roslam run wrote")->required();
  add_stream_options(*command, arguments->mavlink);
  command->add_flag("--json", arguments->json, "Print one JSON object on stdout");
  command->callback([arguments] { check(*arguments); });
}

}  // namespace roslam::app
