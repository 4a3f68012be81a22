// SPDX-License-Identifier: BSD-3-Clause
// Wrong cameras, configurations and arguments given to the program.
#include <gtest/gtest.h>

#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/street.hpp"

namespace roslam::street {
namespace {

class BadSettings : public Dataset {
 protected:
  std::string file(const std::string& text) const {
    put(scratch_ / "settings.yaml", text);
    return (scratch_ / "settings.yaml").string();
  }
};

std::string camera_with(const std::string& key, const std::string& value) {
  std::map<std::string, std::string> values{{"width", "640"},
                                            {"height", "480"},
                                            {"fx", "385"},
                                            {"fy", "385"},
                                            {"cx", "319.5"},
                                            {"cy", "239.5"},
                                            {"depth_units_per_metre", "1000"}};
  values[key] = value;
  std::string text;
  for (const auto& [name, entry] : values) text += name + ": " + entry + "\n";
  return text;
}

TEST_F(BadSettings, CameraFileAndKeyAreNamed) {
  for (const auto& [key, value] :
       std::vector<std::pair<std::string, std::string>>{{"fx", "0"},
                                                        {"fx", "-385"},
                                                        {"fy", ".nan"},
                                                        {"fx", ".inf"},
                                                        {"fx", "1e9"},
                                                        {"cx", ".nan"},
                                                        {"cy", "9999"},
                                                        {"width", "0"},
                                                        {"height", "-480"},
                                                        {"width", "640.5"},
                                                        {"width", "wide"},
                                                        {"fx", "[385]"},
                                                        {"fy", ""},
                                                        {"depth_units_per_metre", "0"},
                                                        {"depth_units_per_metre", "-1000"},
                                                        {"depth_units_per_metre", ".nan"},
                                                        {"fps", "0"},
                                                        {"fps", ".nan"},
                                                        {"distortion", "[.nan, 0]"},
                                                        {"distortion", "[1, 2, 3, 4, 5, 6]"},
                                                        {"distortion", "0.1"},
                                                        {"distortion", "[0.1, 0.2, 0.3]"},
                                                        {"distortion", "[900, -900, 900, 900, 900]"},
                                                        {"distortion", "[-5, 0]"},
                                                        {"focal_length", "385"}}) {
    expect_refused(run("", file(camera_with(key, value))), {"settings.yaml", key});
  }
  expect_refused(run("", file("width: 640\nheight: 480\nfx: 525\nfy: 525\ncx: 320\ncy: 240\n")),
                 {"settings.yaml", "no 'depth_units_per_metre'", "1000", "5000"});
  expect_refused(run("", file(camera_with("model", "omni"))),
                 {"settings.yaml", "omni", "use pinhole or fisheye"});
  expect_refused(run("", file(camera_with("model", "fisheye"))), {"settings.yaml", "k1 k2 k3 k4"});
  expect_refused(run("", file(camera_with("fx", "385\nfx: 400"))), {"settings.yaml", "'fx' is given twice"});
  expect_refused(run("", file("width: 640\n")), {"settings.yaml", "no 'height'; add it"});
  EXPECT_FALSE(fs::exists(run_));
}

TEST_F(BadSettings, CameraThatIsNoFileIsNamed) {
  expect_refused(run("", "kinect"), {"kinect", "preset", "tum-fr1"});
  expect_refused(run("", scratch_.string()), {scratch_.string()});
  expect_refused(run("", file("")), {"settings.yaml", "'key: value' lines"});
  expect_refused(run("", file("{unclosed")), {"settings.yaml", "not a valid YAML file"});
  expect_refused(run("", file("[a, b]: 1\n")), {"settings.yaml", "a key must be a word"});
  expect_refused(run("", file(std::string("\x00\x01\x02\xff", 4))), {"settings.yaml"});
  expect_refused(run("", ""), {data_.string(), "needs --camera"});
}

TEST_F(BadSettings, EveryPresetIsAccepted) {
  for (const auto& name : camera_preset_names()) EXPECT_NO_THROW(camera_preset(name)->validate()) << name;
}

TEST_F(BadSettings, ConfigurationFileAndKeyAreNamed) {
  for (const auto& [text, words] : std::vector<std::pair<std::string, std::string>>{
           {"orb:\n  features: 0\n", "orb.features"},
           {"orb:\n  features: many\n", "orb.features"},
           {"orb:\n  feature: 500\n", "orb.feature"},
           {"threads:\n  frame_queue: 0\n", "threads.frame_queue"},
           {"tracker:\n  min_inliers: .nan\n", "tracker.min_inliers"},
           {"keyframes:\n  max_interval: .nan\n", "keyframes.max_interval"},
           {"keyframes: 5\n", "keyframes"},
           {"[a]: 5\n", "a key must be a word"}}) {
    expect_refused(run("--config '" + file(text) + "'"), {"settings.yaml", words});
  }
  expect_refused(run("--config /no/such.yaml"), {"/no/such.yaml", "--print-config"});
  expect_refused(run("--config '" + scratch_.string() + "'"), {scratch_.string()});
  expect_refused(run("--print-config --config '" + file("orb:\n  features: 0\n") + "'"), {"orb.features"});
}

TEST_F(BadSettings, PrintedConfigurationReadsBack) {
  const Outcome printed = run_program("run --print-config", scratch_);
  EXPECT_EQ(printed.code, 0) << printed.error;
  const Outcome again = run_program("run --print-config --config '" + file(printed.out) + "'", scratch_);
  EXPECT_EQ(again.out, printed.out);
}

TEST_F(BadSettings, SimulatedFlightsAreCheckedToo) {
  const std::string out = " --quiet --out '" + run_.string() + "'";
  expect_refused(run("--frames 5"), {"--frames", "simulated flight"});
  expect_refused(run_program("run simulated:river" + out, scratch_), {"simulated:river", "simulated:street"});
  expect_refused(run_program("run simulated:street --camera tum-fr1" + out, scratch_), {"--camera tum-fr1"});
}

TEST_F(BadSettings, WrongUsageExitsWithTwo) {
  const std::string good =
      "run '" + data_.string() + "' --camera simulated --quiet --out '" + run_.string() + "' ";
  for (const std::string& arguments :
       {std::string(), std::string("fly"), std::string("run"),
        "run '" + data_.string() + "' --camera simulated",
        "run --camera simulated --out '" + run_.string() + "'", good + "--unknown", good + "another",
        good + "--deterministic --real-time", good + "--frames -1", good + "--frames few", good + "--seed x",
        good + "--seed -1", good + "--traffic dense"}) {
    const Outcome outcome = run_program(arguments, scratch_);
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_NE(outcome.error, "") << arguments;
  }
  EXPECT_EQ(run_program("run --help", scratch_).code, 0);
}

TEST_F(BadSettings, EvaluationSkipsAndCountsUnusableTruth) {
  fs::create_directories(run_);
  std::ostringstream truth;
  std::ostringstream estimate;
  for (int i = 0; i < 20; ++i) {
    estimate << i << " " << 0.1 * i << " " << 0.01 * i * i << " 0 0 0 0 1\n";
    const char* rotation = i == 5 ? "nan nan nan nan" : i == 6 ? "0 0 0 0" : i == 7 ? "2 0 0 2" : "0 0 0 1";
    truth << i << " " << 0.1 * i << " " << 0.01 * i * i << " 0 " << rotation << "\n";
  }
  put(data_ / "groundtruth.txt", truth.str());
  put(run_ / "trajectory.txt", estimate.str());
  const std::string both =
      "evaluate trajectory --truth '" + data_.string() + "' --estimate '" + run_.string() + "'";
  const Outcome outcome = run_program(both + " --json", scratch_);
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_NE(outcome.error.find("3 lines left out"), std::string::npos) << outcome.error;
  EXPECT_NEAR(nlohmann::json::parse(outcome.out)["median"]["ate_rmse_m"].get<double>(), 0.0, 1e-6);
  put(data_ / "groundtruth.txt", "1 0 0 0 nan nan nan nan\n2 0 0 0 3 3 3 3\n");
  expect_refused(run_program(both, scratch_), {"groundtruth.txt", "holds no pose"});
  put(run_ / "trajectory.txt", "# timestamp tx ty tz qx qy qz qw\n");
  put(data_ / "groundtruth.txt", estimate.str());
  expect_refused(run_program(both, scratch_), {"trajectory.txt", "holds no pose"});
}

}  // namespace
}  // namespace roslam::street
