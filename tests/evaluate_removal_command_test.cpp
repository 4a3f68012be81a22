// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "tests/program.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A green wall of dots 2 m away, seen by a camera at rest; a red square, to the network a person, walks past.
class EvaluateRemoval : public testing::Test {
 protected:
  static constexpr int kFrames = 5;
  static constexpr int kActor = 80;  // pixels, side of the square

  EvaluateRemoval() : folder_(scratch_path()) {
    fs::remove_all(folder_);
    make_sequence("sequence", 10.0);
  }
  ~EvaluateRemoval() override { fs::remove_all(folder_); }

  static cv::Rect actor(int frame) { return {60 + 10 * frame, 70, kActor, kActor}; }
  static std::string name(int frame) { return std::to_string(frame) + ".png"; }

  void make_sequence(const std::string& sequence, double begin) const {
    for (const char* part : {"rgb", "depth", "instances"}) fs::create_directories(folder_ / sequence / part);
    std::ofstream rgb(folder_ / sequence / "rgb.txt");
    std::ofstream depth(folder_ / sequence / "depth.txt");
    for (int i = 0; i < kFrames; ++i) {
      cv::Mat colour(240, 320, CV_8UC3, cv::Scalar(0, 120, 0));
      cv::Mat metres(240, 320, CV_16UC1, cv::Scalar(2000));
      colour(actor(i)) = cv::Scalar(0, 0, 255);
      metres(actor(i)) = 1000;
      put_dots(colour, actor(i));
      put(sequence + "/rgb/" + name(i), colour);
      put(sequence + "/depth/" + name(i), metres);
      put(sequence + "/instances/" + name(i), actor_image(i, CV_16UC1, 0, 7));
      const std::string time = std::to_string(begin + 0.1 * i);
      rgb << time << " rgb/" << name(i) << "\n";
      depth << time << " depth/" << name(i) << "\n";
    }
    std::ofstream(folder_ / "camera.yaml") << "width: 320\nheight: 240\nfx: 200\nfy: 200\ncx: 160\ncy: 120\n"
                                           << "depth_units_per_metre: 1000\n";
  }

  // At places that do not repeat, so that they can be told apart; those on the actor go with it, dark red.
  static void put_dots(cv::Mat& colour, const cv::Rect& actor) {
    cv::RNG random(1);
    for (int i = 0; i < 400; ++i) {
      const cv::Rect dot(random.uniform(20, 295), random.uniform(20, 215), random.uniform(3, 7), 4);
      const int green = random.uniform(170, 255);
      if ((dot & actor).empty()) colour(dot) = cv::Scalar(0, green, 0);
      const cv::Rect carried(actor.x + dot.x % (kActor - 8), actor.y + dot.y % (kActor - 8), 4, 4);
      if (i < 60) colour(carried) = cv::Scalar(0, 0, 120);
    }
  }

  static cv::Mat actor_image(int frame, int type, int outside, int inside) {
    cv::Mat image(240, 320, type, cv::Scalar(outside));
    image(actor(frame)) = inside;
    return image;
  }

  void put(const std::string& file, const cv::Mat& image) const {
    cv::imwrite((folder_ / file).string(), image);
  }

  void put_labels(int outside, int inside) const {
    fs::create_directories(folder_ / "sequence/labels");
    for (int i = 0; i < kFrames; ++i)
      put("sequence/labels/" + name(i), actor_image(i, CV_8UC1, outside, inside));
  }

  void run_slam(const std::string& dynamic = "--dynamic labels --model '" ROSLAM_TEST_FILES
                                             "/colours.onnx'") const {
    const Outcome outcome = shell_in(
        folder_, "'" ROSLAM_PROGRAM "' run sequence --camera camera.yaml " + dynamic + " --quiet --out run");
    ASSERT_EQ(outcome.code, 0) << outcome.error;
  }

  Outcome evaluate(const std::string& arguments) const {
    return shell_in(folder_, "'" ROSLAM_PROGRAM "' evaluate removal " + arguments);
  }

  // Expects success and nothing on stderr.
  json figures(const std::string& source = "sequence") const {
    const Outcome outcome = evaluate(source + " --camera camera.yaml --run run --json");
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    EXPECT_EQ(outcome.error, "");
    return json::parse(outcome.out, nullptr, false);
  }

  void refuses(const std::string& words,
               const std::string& arguments = "sequence --camera camera.yaml --run run") const {
    const Outcome outcome = evaluate(arguments + " --quiet");
    EXPECT_EQ(outcome.code, 1) << words;
    EXPECT_NE(outcome.error.find(words), std::string::npos) << words << ": " << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    EXPECT_EQ(outcome.out, "");
  }

  fs::path some_mask() const { return fs::directory_iterator(folder_ / "run/masks")->path(); }

  void rewrite(const std::string& file, const std::string& from, const std::string& to) const {
    std::string text = content(folder_ / file);
    ASSERT_NE(text.find(from), std::string::npos) << from;
    std::ofstream(folder_ / file) << text.replace(text.find(from), from.size(), to);
  }

  const fs::path folder_;
};

TEST_F(EvaluateRemoval, TellsWhatSurvivesARun) {
  run_slam();
  const json found = figures();
  EXPECT_EQ(found["frames"]["compared"], kFrames);
  EXPECT_EQ(found["frames"]["unlike_run"], 0);
  EXPECT_GT(found["actor_points"]["removed"], 5);
  EXPECT_LT(found["actor_points"]["kept_share"], 0.02);
  EXPECT_LT(found["static_points"]["beyond"]["removed_share"], 0.05);
  EXPECT_GT(found["static_points"]["near"]["removed_share"], 0.3);
  EXPECT_NEAR(found["actor_pixel_share"].get<double>(), kActor * kActor / (320.0 * 240.0), 1e-9);
  EXPECT_GT(found["actor_pixel_recall"], 0.98);
  const Outcome table = evaluate("sequence --camera camera.yaml --run run --quiet");
  EXPECT_EQ(table.code, 0) << table.error;
  EXPECT_NE(table.out.find("| actors "), std::string::npos) << table.out;
  EXPECT_EQ(table.error, "");
}

TEST_F(EvaluateRemoval, KnowsActorsByAnyKindOfTruth) {
  run_slam();
  const json by_instances = figures();
  put_labels(255, 11);
  EXPECT_EQ(figures(), by_instances);  // the person is an actor, not at rest
  fs::remove_all(folder_ / "sequence/instances");
  EXPECT_EQ(figures(), by_instances);  // class person
  put_labels(0, 3);
  EXPECT_EQ(figures(), by_instances);  // actor 3
  put_labels(0, 255);
  EXPECT_EQ(figures(), by_instances);  // a mask
  put_labels(2, 13);
  EXPECT_EQ(figures(), by_instances);  // a car before a building
  std::ofstream(folder_ / "sequence/labels/labels.json") << "{}";
  refuses("sequence: has no truth of the dynamic objects");
}

TEST_F(EvaluateRemoval, WhatRestsIsNoPartOfTheScene) {
  run_slam();
  const json moving = figures();
  for (int i = 0; i < kFrames; ++i) put("sequence/instances/" + name(i), cv::Mat::zeros(240, 320, CV_16UC1));
  put_labels(255, 13);
  const json resting = figures();
  EXPECT_TRUE(resting["actor_points"]["kept_share"].is_null());
  EXPECT_EQ(resting["at_rest_points"], moving["actor_points"]);
  EXPECT_EQ(resting["static_points"]["removed"], moving["static_points"]["removed"]);
  EXPECT_EQ(resting["static_points"]["near"]["kept"], 0);
}

TEST_F(EvaluateRemoval, EverythingSurvivesWithoutRemoval) {
  run_slam("--dynamic none");
  const json found = figures();
  EXPECT_EQ(found["frames"]["compared"], kFrames);
  EXPECT_EQ(found["actor_points"]["kept_share"], 1.0);
  EXPECT_EQ(found["static_points"]["removed_share"], 0.0);
  EXPECT_EQ(found["removed_pixel_share"], 0.0);
}

TEST_F(EvaluateRemoval, LeavesOutFramesAndCountsThem) {
  run_slam();
  fs::resize_file(some_mask(), fs::file_size(some_mask()) / 2);
  EXPECT_EQ(figures()["frames"], json({{"compared", kFrames - 1},
                                       {"with_mask", kFrames - 1},
                                       {"without_truth", 0},
                                       {"without_mask", 1},
                                       {"not_in_run", 0},
                                       {"unlike_run", 0}}));
  fs::remove(some_mask());
  EXPECT_EQ(figures()["frames"]["without_mask"], 1);
  fs::remove(folder_ / "sequence/instances" / name(4));
  put("sequence/instances/" + name(3), cv::Mat::zeros(10, 10, CV_16UC1));
  EXPECT_GE(figures()["frames"]["without_truth"], 1);
  std::string lines = content(folder_ / "run/descriptors.jsonl");
  std::ofstream(folder_ / "run/descriptors.jsonl") << lines.substr(lines.find('\n') + 1);
  EXPECT_EQ(figures()["frames"]["not_in_run"], 1);
}

TEST_F(EvaluateRemoval, TellsWhatIsWrongWithTheRun) {
  run_slam();
  refuses("nowhere/run.json: cannot open it", "sequence --camera camera.yaml --run nowhere");
  fs::copy(folder_ / "run", folder_ / "copy", fs::copy_options::recursive);
  const auto restore = [&] {
    fs::remove_all(folder_ / "run");
    fs::copy(folder_ / "copy", folder_ / "run", fs::copy_options::recursive);
  };
  cv::imwrite(some_mask().string(), cv::Mat(20, 30, CV_8UC1, cv::Scalar(1)));
  refuses("is 30x20 but the image of that time 320x240 pixels");
  restore();
  rewrite("run/descriptors.jsonl", "\"kept_points\"", "\"others\"");
  refuses("run/descriptors.jsonl:1: is not a record");
  restore();
  fs::resize_file(folder_ / "run/descriptors.jsonl", fs::file_size(folder_ / "run/descriptors.jsonl") - 20);
  refuses("run/descriptors.jsonl:5: is not a record");
  fs::remove(folder_ / "run/descriptors.jsonl");
  refuses("run/descriptors.jsonl: cannot open it");
  restore();
  fs::remove_all(folder_ / "run/masks");
  refuses("mask of the run missing or unusable");
  restore();
  rewrite("run/run.json", "\"features\": 1000", "\"features\": \"many\"");
  refuses("run/run.json: orb.features has a value of the wrong type");
  restore();
  rewrite("run/run.json", "\"features\": 1000", "\"features\": 3");
  refuses("run/run.json: orb.features must be");
  rewrite("run/run.json", "\"options\"", "\"none\"");
  refuses("run/run.json: holds no options");
  fs::resize_file(folder_ / "run/run.json", 100);
  refuses("run/run.json: holds no options");
}

TEST_F(EvaluateRemoval, TellsARunOfAnotherSequence) {
  run_slam();
  make_sequence("later", 500.0);
  refuses("run: no frame can be compared with later; 5 x not in the run; give the SOURCE",
          "later --camera camera.yaml --run run");
  for (int i = 0; i < kFrames; ++i) {
    cv::Mat colour(240, 320, CV_8UC3);
    cv::RNG(i).fill(colour, cv::RNG::UNIFORM, 0, 255);
    put("sequence/rgb/" + name(i), colour);
  }
  refuses(
      "run: 5 of 5 frames of sequence have another number of points than the run counted; give the SOURCE");
}

TEST_F(EvaluateRemoval, TellsWhatIsWrongWithTheSource) {
  run_slam();
  refuses("nowhere: no such folder", "nowhere --camera camera.yaml --run run");
  refuses("sequence: needs --camera", "sequence --run run");
  refuses("colour image is 320x240 but the camera 640x480", "sequence --camera tum-fr1 --run run");
  refuses("simulated:nowhere: no such flight", "simulated:nowhere --run run");
  fs::remove_all(folder_ / "sequence/instances");
  refuses("sequence: has no truth of the dynamic objects");
}

TEST_F(EvaluateRemoval, KnowsWhatMovesInASimulatedFlight) {
  const std::string flight = "simulated:street --traffic heavy --frames 2 ";
  const Outcome run =
      shell_in(folder_, "'" ROSLAM_PROGRAM "' run " + flight + "--dynamic geometry --quiet --out run");
  ASSERT_EQ(run.code, 0) << run.error;
  const Outcome outcome = evaluate(flight + "--run run --json");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const json found = json::parse(outcome.out);
  EXPECT_EQ(found["frames"]["compared"], 2);
  EXPECT_EQ(found["frames"]["unlike_run"], 0);
  EXPECT_GT(found["actor_pixel_share"], 0.0);
  EXPECT_GT(found["at_rest_points"]["kept"].get<int>() + found["at_rest_points"]["removed"].get<int>(), 0);
}

TEST_F(EvaluateRemoval, WrongUsageIsTwoAndHelpTeachesByExample) {
  EXPECT_EQ(evaluate("").code, 2);
  EXPECT_EQ(evaluate("sequence --camera camera.yaml").code, 2);
  EXPECT_EQ(evaluate("simulated:street --run run --traffic some").code, 2);
  EXPECT_EQ(evaluate("simulated:street --run run --seed -1").code, 2);
  const Outcome help = evaluate("--help");
  EXPECT_EQ(help.code, 0);
  for (const char* words : {"--run", "Examples:", "instances/", "Exit code"}) {
    EXPECT_NE(help.out.find(words), std::string::npos) << words;
  }
}

}  // namespace
}  // namespace roslam
