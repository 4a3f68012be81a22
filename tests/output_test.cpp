// SPDX-License-Identifier: BSD-3-Clause
// Output that cannot be written, interrupted runs: computed results are kept.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/mount.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <sstream>
#include <thread>
#include <utility>

#include "roslam/map_io/map_file.hpp"
#include "tests/street.hpp"

namespace roslam::street {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::array<const char*, 8> kResults{"trajectory.txt", "keyframes.txt", "map.ply",  "run.json",
                                              "trajectory.png", "dense.ply",     "dense.bt", "report.html"};

class Output : public Dataset {
 protected:
  Outcome run_to(const std::string& out) const {
    return run_program("run '" + data_.string() + "' --quiet --camera simulated --out '" + out + "'",
                       scratch_);
  }

  // Runs after some shell commands; all files that it leaves are those of a run that nothing hinders.
  void expect_whole_files(const std::string& before, const Outcome& outcome) const {
    expect_refused(outcome, {run_.string(), "cannot be written in full"});
    std::size_t files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(run_)) {
      if (!entry.is_regular_file()) continue;
      ++files;
      const fs::path whole = whole_ / fs::relative(entry.path(), run_);
      ASSERT_TRUE(fs::exists(whole)) << before << ": " << entry.path();
      const std::string bytes = content(entry.path());
      if (entry.path().filename() == "run.json") {
        EXPECT_FALSE(nlohmann::json::parse(bytes, nullptr, false).is_discarded());
      } else if (entry.path().filename() == "report.html") {
        EXPECT_NE(bytes.find("</html>"), std::string::npos);
      } else if (entry.path().filename() == "odometry.csv") {  // grows by whole lines
        EXPECT_TRUE(content(whole).starts_with(bytes)) << before;
        EXPECT_TRUE(bytes.ends_with('\n')) << before;
      } else if (entry.path().filename() == "trajectory.txt") {  // else as it grew during the run
        if (bytes != content(whole)) expect_poses_of(whole, bytes);
      } else {
        EXPECT_TRUE(bytes == content(whole)) << before << ": " << entry.path();
      }
    }
    EXPECT_GT(files, 0U) << before;
  }

  // Each line is a pose of the run, near where the map has it in the end.
  static void expect_poses_of(const fs::path& whole, const std::string& bytes) {
    const Trajectory poses = read_trajectory(whole).trajectory;
    EXPECT_TRUE(bytes.ends_with('\n'));
    std::istringstream text(bytes);
    std::string line;
    std::getline(text, line);  // the header
    for (std::size_t i = 0; std::getline(text, line); ++i) {
      std::istringstream numbers(line);
      double time = 0.0;
      Eigen::Vector3d position;
      ASSERT_TRUE(numbers >> time >> position.x() >> position.y() >> position.z()) << line;
      ASSERT_LT(i, poses.size());
      EXPECT_EQ(time, poses[i].timestamp);
      EXPECT_LT((position - poses[i].T_world_camera.translation()).norm(), 0.05);
    }
  }

  void make_whole_run() const {
    const Outcome outcome = run_to(whole_.string());
    ASSERT_EQ(outcome.code, 0) << outcome.error;
  }

  const fs::path whole_ = scratch_ / "whole";
};

TEST_F(Output, FolderThatCannotBeMadeIsNamed) {
  put(scratch_ / "file", "not a folder");
  for (const std::string& out : {(scratch_ / "file").string(), (scratch_ / "file/run").string(),
                                 std::string("/proc/roslam"), std::string("/dev/null/run")}) {
    expect_refused(run_to(out), {out, "choose another --out"});
  }
  EXPECT_EQ(content(scratch_ / "file"), "not a folder");
}

TEST_F(Output, DatasetIsNotWrittenInto) {
  put(data_ / "groundtruth.txt", "precious\n");
  expect_refused(run_to(data_.string()), {data_.string(), "is a dataset", "choose another --out"});
  EXPECT_EQ(content(data_ / "groundtruth.txt"), "precious\n");
}

TEST_F(Output, FileThatCannotBeWrittenIsNamedAndTheOthersAreWritten) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  for (const char* broken : {"trajectory.txt", "keyframes.txt", "map.ply", "trajectory.png"}) {
    fs::remove_all(run_);
    fs::create_directories(run_);
    fs::create_symlink("/dev/full", run_ / broken);
    expect_refused(run(), {(run_ / broken).string(), "cannot be written in full"});
    for (const char* file : kResults) {
      if (file == std::string(broken)) continue;
      EXPECT_GT(fs::file_size(run_ / file), 50u) << broken << " " << file;
    }
  }
}

TEST_F(Output, ReportThatCannotBeWrittenIsNoticedBeforeTheWork) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  fs::create_directories(run_);
  fs::create_symlink("/dev/full", run_ / "run.json");
  expect_refused(run(), {(run_ / "run.json").string(), "free space"});
}

TEST_F(Output, DiskThatFillsUpIsReported) {
  fs::create_directories(run_);
  if (mount("tmpfs", run_.c_str(), "tmpfs", 0, "size=12k") != 0)
    GTEST_SKIP() << "mounting is not allowed here";
  const Outcome outcome = run();
  const std::string trajectory = content(run_ / "trajectory.txt");
  EXPECT_EQ(umount(run_.c_str()), 0);
  expect_refused(outcome, {run_.string(), "free space"});
  EXPECT_EQ(std::count(trajectory.begin(), trajectory.end(), '\n'), static_cast<long>(kFrames) + 1);
}

TEST_F(Output, FilesOnAFullDiskAreWholeOrAbsent) {
  ASSERT_NO_FATAL_FAILURE(make_whole_run());
  fs::create_directories(run_);
  for (const char* size : {"size=16k", "size=400k"}) {
    if (mount("tmpfs", run_.c_str(), "tmpfs", 0, size) != 0) GTEST_SKIP() << "mounting is not allowed here";
    const Outcome outcome = run();
    expect_whole_files(size, outcome);
    EXPECT_EQ(umount(run_.c_str()), 0);
  }
}

TEST_F(Output, FilesBeyondTheLimitOfTheirSizeAreAbsentAndTheOthersWhole) {
  ASSERT_NO_FATAL_FAILURE(make_whole_run());
  for (const char* blocks : {"4", "400"}) {
    fs::remove_all(run_);
    const Outcome outcome = shell_in(
        scratch_, std::string("ulimit -f ") + blocks + "; '" ROSLAM_PROGRAM "' run '" + data_.string() +
                      "' --quiet --video --camera simulated --out '" + run_.string() + "'");
    expect_whole_files(blocks, outcome);
  }
}

TEST_F(Output, AReaderThatLeavesCostsNoResults) {
  for (const std::string reader : {"| true", "| head -n 1", "2>&1 | true"}) {
    fs::remove_all(run_);
    shell_in(scratch_, "('" ROSLAM_PROGRAM "' run '" + data_.string() +
                           "' --dynamic none --camera simulated --out '" + run_.string() + "'" +
                           (reader == "| true" ? " --json" : "") + "; echo $? >code) " + reader);
    EXPECT_EQ(content(scratch_ / "code"), "0\n") << reader;
    for (const char* file : kResults) EXPECT_TRUE(fs::exists(run_ / file)) << reader << file;
    EXPECT_EQ(report()["interrupted"], false);
  }
}

TEST_F(Output, AHangUpThatIsIgnoredStaysIgnored) {
  const Outcome outcome = shell_in(
      scratch_, "{ trap '' HUP; '" ROSLAM_PROGRAM "' run '" + data_.string() +
                    "' --quiet --camera simulated --out '" + run_.string() +
                    "' & process=$!; for i in 1 2 3 4 5 6 7 8; do kill -HUP $process; sleep 0.1; done; "
                    "wait $process; }");
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_EQ(report()["interrupted"], false);
  EXPECT_EQ(report()["frames"]["processed"], kFrames);
}

TEST_F(Output, StandardOutputThatIsFullIsReported) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  for (const std::string& arguments :
       {std::string("run --print-config"),
        "run '" + data_.string() + "' --camera simulated --quiet --out '" + run_.string() + "'",
        "run '" + data_.string() + "' --camera simulated --json --out '" + run_.string() + "'"}) {
    const Outcome outcome = run_program(arguments, scratch_, "/dev/full");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_NE(outcome.error.find("stdout"), std::string::npos) << outcome.error;
  }
}

TEST_F(Output, ResultsOfAnEarlierRunDoNotStay) {
  fs::create_directories(run_);
  put(run_ / "groundtruth.txt", "of somebody else\n");
  expect_refused(run(), {"groundtruth.txt", "--overwrite"});
  fs::remove_all(run_);
  EXPECT_EQ(run().code, 0);
  put(run_ / "groundtruth.txt", "of the earlier run\n");
  EXPECT_EQ(run().code, 0);
  EXPECT_FALSE(fs::exists(run_ / "groundtruth.txt"));
  EXPECT_EQ(content(run_ / "previous/groundtruth.txt"), "of the earlier run\n");
  EXPECT_TRUE(fs::exists(run_ / "trajectory.png"));
  fs::remove_all(data_ / "depth");
  EXPECT_EQ(run().code, 1);
  EXPECT_FALSE(fs::exists(run_ / "trajectory.png"));
  EXPECT_EQ(content(run_ / "trajectory.txt"), "# timestamp tx ty tz qx qy qz qw\n");
}

TEST_F(Output, NamesInAnotherEncodingDoNotCostTheRun) {
  const fs::path odd = scratch_ / "fl\xfcg";  // Latin-1
  fs::rename(data_, odd);
  const Outcome outcome = run_program(
      "run '" + odd.string() + "' --json --camera simulated --out '" + run_.string() + "'", scratch_);
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_EQ(report()["frames"]["tracked"], kFrames);
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["frames"]["tracked"], kFrames);
}

TEST_F(Output, JsonIsOneObject) {
  const Outcome outcome = run("--json");
  EXPECT_EQ(outcome.code, 0);
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["interrupted"], false);
  EXPECT_TRUE(json["error"].is_null());
}

class Interrupt : public Dataset, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    Dataset::SetUp();
    terminal_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (terminal_ < 0 || grantpt(terminal_) != 0 || unlockpt(terminal_) != 0)
      GTEST_SKIP() << "no pseudo terminal here";
    program_end_ = open(ptsname(terminal_), O_RDWR | O_NOCTTY | O_CLOEXEC);
    ASSERT_GE(program_end_, 0);
    process_ = start(program_end_);
    std::string progress;
    for (char byte = 0; progress.find("tracking") == std::string::npos; progress += byte)
      ASSERT_EQ(read(terminal_, &byte, 1), 1) << progress;
  }

  void TearDown() override {
    for (const int end : {program_end_, terminal_})
      if (end >= 0) close(end);
    Dataset::TearDown();
  }

  void expect_success() {
    int status = -1;
    ASSERT_EQ(waitpid(process_, &status, 0), process_);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
    EXPECT_EQ(report()["interrupted"], true);
  }

  // A long flight; its progress is shown on a terminal of the test.
  pid_t start(int progress) const {
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&files, progress, STDERR_FILENO);
    std::vector<std::string> words{"roslam", "run",   "simulated:street", "--traffic",
                                   "none",   "--out", run_.string(),      GetParam()};
    std::vector<char*> pointers;
    for (auto& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    std::vector<char*> variables;
    for (char** variable = environ; *variable != nullptr; ++variable) variables.push_back(*variable);
    std::string preload = "LD_PRELOAD=" ROSLAM_TEST_EARLY_THREAD;
    variables.push_back(preload.data());
    variables.push_back(nullptr);
    pid_t process = -1;
    EXPECT_EQ(posix_spawn(&process, ROSLAM_PROGRAM, &files, nullptr, pointers.data(), variables.data()), 0);
    posix_spawn_file_actions_destroy(&files);
    return process;
  }

  int terminal_ = -1;
  int program_end_ = -1;
  pid_t process_ = -1;
};

TEST_P(Interrupt, EndsSoonAndWritesWhatIsThere) {
  const auto asked = Clock::now();
  kill(process_, SIGINT);
  ASSERT_NO_FATAL_FAILURE(expect_success());
  EXPECT_LT(Clock::now() - asked, std::chrono::seconds(10));
  const auto json = report();
  EXPECT_GT(json["frames"]["tracked"], 0);
  EXPECT_EQ(trajectory().size(), json["frames"]["tracked"].get<std::size_t>());
  EXPECT_EQ(read_trajectory(run_ / "groundtruth.txt").trajectory.size(),
            json["frames"]["processed"].get<std::size_t>());
}

// The second signal ends the program at once; the trajectory is there all the same, up to the frame before.
// Of another kind than the first, as two pending signals of one kind are delivered as one.
TEST_P(Interrupt, ASecondOneEndsAtOnceAndLeavesTheTrajectory) {
  kill(process_, SIGINT);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const auto asked = Clock::now();
  kill(process_, SIGTERM);
  int status = 0;
  ASSERT_EQ(waitpid(process_, &status, 0), process_);
  EXPECT_LT(Clock::now() - asked, std::chrono::seconds(2)) << "0.15 s, and what a busy computer adds";
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_TRUE(WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 130) << WEXITSTATUS(status);
  EXPECT_FALSE(trajectory().empty());
  if (fs::exists(run_ / "map.roslam")) {
    EXPECT_GT(load_map(run_ / "map.roslam").map.keyframe_count(), 0U);
  }
}

// The kernel and the shell may each send the signal of a terminal that is closed, and neither asks to hurry.
TEST_P(Interrupt, AClosedTerminalEndsTheFlightOnceAndWritesEverything) {
  close(std::exchange(terminal_, -1));  // what is written to it fails from now on
  for (int i = 0; i < 5; ++i) {
    kill(process_, SIGHUP);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  ASSERT_NO_FATAL_FAILURE(expect_success());
  for (const std::string file : kResults)
    EXPECT_TRUE(fs::exists(run_ / file) || file == "dense.bt") << file;  // without a keyframe it is absent
}

INSTANTIATE_TEST_SUITE_P(Modes, Interrupt, testing::Values("--deterministic", "--real-time"),
                         [](const auto& tested) {
                           return std::string(tested.param) == "--real-time" ? "RealTime" : "Deterministic";
                         });

}  // namespace
}  // namespace roslam::street
