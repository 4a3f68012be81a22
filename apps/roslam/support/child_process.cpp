// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/child_process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"

namespace roslam::app {

namespace {
// The settings of posix_spawn, freed by the destructor.
class SpawnSettings {
 public:
  explicit SpawnSettings(const std::filesystem::path& log) {
    posix_spawn_file_actions_init(&files_);
    posix_spawn_file_actions_addopen(&files_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files_, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    constexpr mode_t kReadableByAll = 0644;
    posix_spawn_file_actions_addopen(&files_, STDERR_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                     kReadableByAll);
    posix_spawnattr_init(&attributes_);
    // In a process group of its own the child does not get the terminal's SIGINT as well: this process
    // forwards a stop, and a second signal would end the child at once.
    posix_spawnattr_setpgroup(&attributes_, 0);
    // This process blocks the signals of InterruptWatcher in its threads; the child must not inherit that.
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes_, &none);
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&files_);
    posix_spawnattr_destroy(&attributes_);
  }

  pid_t start(const std::filesystem::path& program, std::vector<std::string> arguments) const {
    std::vector<char*> pointers;
    for (auto& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    pid_t child = 0;
    const int error = posix_spawn(&child, program.c_str(), &files_, &attributes_, pointers.data(), environ);
    if (error != 0) throw OutputError(program.string() + ": cannot be started: " + std::strerror(error));
    return child;
  }

 private:
  posix_spawn_file_actions_t files_{};
  posix_spawnattr_t attributes_{};
};

std::string last_line(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string last;
  for (std::string line; std::getline(in, line);) {
    if (!line.empty()) last = line;
  }
  return last;
}

// The child is reaped only after the stop callback is gone, so that its process id cannot have been reused.
void wait_for_end(pid_t child, const std::stop_token& stop) {
  const std::stop_callback forward(stop, [child] { kill(child, SIGTERM); });
  siginfo_t info{};
  while (waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOWAIT) != 0 && errno == EINTR) {
  }
}
}  // namespace

ChildResult run_this_program(const std::vector<std::string>& arguments, const std::filesystem::path& log,
                             const std::stop_token& stop) {
  write_file(log, "");
  const auto program = std::filesystem::read_symlink("/proc/self/exe");
  std::vector<std::string> all{program.string()};
  all.insert(all.end(), arguments.begin(), arguments.end());
  const pid_t child = SpawnSettings(log).start(program, std::move(all));
  wait_for_end(child, stop);
  int status = 0;
  waitpid(child, &status, 0);
  ChildResult result;
  if (WIFEXITED(status)) result.code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  result.last_line = last_line(log);
  return result;
}

}  // namespace roslam::app
