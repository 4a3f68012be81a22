// SPDX-License-Identifier: BSD-3-Clause
// roslam run --view: the flight is the same whoever looks, and is saved, paused and stopped from the page.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "tests/http_client.hpp"
#include "tests/program.hpp"
#include "tests/scratch.hpp"
#include "tests/view_scene.hpp"

namespace roslam {
namespace {
namespace fs = std::filesystem;

// A port that was free a moment ago.
int free_port() {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
  socklen_t size = sizeof address;
  bind(fd, reinterpret_cast<sockaddr*>(&address), size);
  getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
  close(fd);
  return ntohs(address.sin_port);
}

class ViewedRun : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(scratch_); }
  void TearDown() override {
    if (run_.joinable()) {
      post("/stop");
      run_.join();
    }
    fs::remove_all(scratch_);
  }

  void start(const std::string& arguments) {
    fs::create_directories(scratch_ / "shell");
    run_ = std::jthread([this, arguments] { outcome_ = shell_in(scratch_ / "shell", arguments); });
  }

  static std::string command(const std::string& out, int frames) {
    return "'" ROSLAM_PROGRAM "' run simulated:hover --quiet --dynamic geometry --frames " +
           std::to_string(frames) + " --out '" + out + "'";
  }

  std::string with_view() const { return " --view 127.0.0.1:" + std::to_string(port_); }

  nlohmann::json health() const {
    const std::string body = ask(port_, "/health").body;
    return body.empty() ? nlohmann::json::object() : nlohmann::json::parse(body);
  }

  std::size_t frames() const { return health().value("frames", std::size_t{0}); }

  // Whether so many frames were processed within a minute.
  bool wait_for_frames(std::size_t count) const {
    for (int i = 0; i < 600 && frames() < count; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return frames() >= count;
  }

  int post(const std::string& path) const {
    const std::string page = ask(port_, "/").body;
    const auto at = page.find("name=\"token\" content=\"");
    if (at == std::string::npos) return 0;
    return ask(port_, path, {{"X-RO-SLAM-Token", page.substr(at + 22, 32)}}, "POST").status;
  }

  fs::path scratch_ = scratch_path();
  int port_ = free_port();
  Outcome outcome_;
  std::jthread run_;
};

TEST_F(ViewedRun, GivesTheSameBytesWhoeverLooks) {
  const std::string plain = (scratch_ / "plain").string(), viewed = (scratch_ / "viewed").string();
  ASSERT_EQ(shell_in(scratch_, command(plain, 20)).code, 0);
  start(command(viewed, 20) + with_view());
  ASSERT_TRUE(wait_for_frames(1));
  const RawConnection stuck(port_, 4096);  // never reads
  stuck.send("GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n");
  std::vector<RawConnection> slow;
  for (int i = 0; i < 50; ++i) {
    slow.emplace_back(port_);
    slow.back().send("GET / HT");
  }
  std::size_t map_bytes = 0, dense_bytes = 0, images = 0;
  while (health().value("phase", "") == "flying") {
    for (const char* path : {"/path", "/keyframes", "/points"})
      map_bytes += ask(port_, std::string(path) + "?since=0").body.size();
    dense_bytes += ask(port_, "/dense?since=0").body.size();
    images += ask(port_, "/frame.jpg").body.starts_with("\xff\xd8") ? 1 : 0;
  }
  run_.join();
  EXPECT_EQ(outcome_.code, 0) << outcome_.error;
  EXPECT_GT(map_bytes, 10000U) << "somebody has looked";
  EXPECT_GT(dense_bytes, 1000U);
  EXPECT_GT(images, 0U);
  for (const char* file : {"trajectory.txt", "keyframes.txt", "map.ply", "dense.ply"}) {
    const std::string bytes = content(scratch_ / "plain" / file);
    EXPECT_GT(bytes.size(), 100U) << file;
    EXPECT_TRUE(bytes == content(scratch_ / "viewed" / file)) << file << " differs";
  }
}

TEST_F(ViewedRun, IsPausedSavedAndStoppedFromThePage) {
  start(command((scratch_ / "run").string(), 3000) + " --checkpoint 0" + with_view());
  ASSERT_TRUE(wait_for_frames(5));
  EXPECT_EQ(post("/pause"), 200);
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));  // the frame that was being processed
  const std::size_t paused = frames();
  EXPECT_EQ(health()["phase"], "paused");
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  EXPECT_EQ(frames(), paused);
  EXPECT_FALSE(fs::exists(scratch_ / "run" / "map.roslam"));
  EXPECT_EQ(post("/save"), 200);
  for (int i = 0; i < 100 && !fs::exists(scratch_ / "run" / "map.roslam"); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_TRUE(fs::exists(scratch_ / "run" / "map.roslam"));
  EXPECT_EQ(post("/resume"), 200);
  EXPECT_TRUE(wait_for_frames(paused + 3));
  EXPECT_EQ(post("/stop"), 200);
  run_.join();
  EXPECT_EQ(outcome_.code, 0) << outcome_.error;
  const auto report = nlohmann::json::parse(content(scratch_ / "run" / "run.json"));
  EXPECT_TRUE(fs::exists(scratch_ / "run" / "trajectory.txt"));
  EXPECT_EQ(ask(port_, "/health").status, 0) << "the page has ended with the run";
}

TEST_F(ViewedRun, RefusesAPortInUseBeforeAnythingElse) {
  telemetry::StagedRun other;
  const telemetry::ViewServer server(telemetry::at_free_port(), other);
  port_ = server.port();
  const Outcome outcome = shell_in(scratch_, command((scratch_ / "run").string(), 5) + with_view());
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.error.find("port " + std::to_string(port_) + " is in use"), std::string::npos)
      << outcome.error;
  EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1);
  EXPECT_FALSE(fs::exists(scratch_ / "run"));
  EXPECT_EQ(shell_in(scratch_, command("run", 5) + " --view 127.0.0.1:nonsense").code, 1);
}

TEST_F(ViewedRun, IsShownAfterwards) {
  const std::string folder = (scratch_ / "run").string();
  ASSERT_EQ(shell_in(scratch_, command(folder, 12)).code, 0);
  start("echo $$ >pid && exec '" ROSLAM_PROGRAM "' view '" + folder + "' 127.0.0.1:" + std::to_string(port_));
  for (int i = 0; i < 100 && ask(port_, "/health").status == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(health()["phase"], "recorded");
  EXPECT_EQ(post("/stop"), 409) << "nothing to stop";
  const auto total = telemetry::number_at<std::uint32_t>(ask(port_, "/path?since=0").body, 20);
  const std::string trajectory = content(scratch_ / "run" / "trajectory.txt");
  std::size_t poses = 0;
  std::istringstream lines(trajectory);
  for (std::string line; std::getline(lines, line);) poses += line.starts_with('#') ? 0 : 1;
  EXPECT_EQ(total, poses);
  EXPECT_GT(ask(port_, "/dense?since=0").body.size(), 1000U);
  EXPECT_EQ(shell_in(scratch_, "kill -INT $(cat shell/pid)").code, 0);
  run_.join();
  EXPECT_EQ(outcome_.code, 0) << outcome_.error;
}

}  // namespace
}  // namespace roslam
