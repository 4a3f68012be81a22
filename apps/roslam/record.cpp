// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <mutex>
#include <thread>

#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/live_camera.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/progress.hpp"
#include "apps/roslam/support/replaces_only.hpp"
#include "apps/roslam/support/sources.hpp"

namespace roslam::app {

namespace {
struct RecordArguments {
  SourceArguments source;
  std::string out;
  double seconds = 0.0;
  bool quiet = false;
};

// A recording that is read and written at once would be destroyed.
void require_another_file(const RecordArguments& arguments) {
  std::error_code error;
  const std::filesystem::path out(arguments.out), folder = out.has_parent_path() ? out.parent_path() : ".";
  const std::filesystem::path& source = arguments.source.name;
  if (std::filesystem::equivalent(source, out, error) ||
      (std::filesystem::is_directory(source, error) && std::filesystem::equivalent(source, folder, error)))
    throw InputError("--out " + arguments.out +
                     ": is the source itself, or in its folder; choose another file");
}

// Requests a stop after a time, or when another one is requested: a camera that is lost gives no frame to end
// at.
class TimedStop {
 public:
  TimedStop(const std::stop_token& other, double seconds)
      : forward_(other, [this] { source_.request_stop(); }),
        timer_([this, seconds](const std::stop_token& end) {
          std::mutex mutex;
          std::condition_variable_any wake;
          std::unique_lock lock(mutex);
          wake.wait_for(lock, end, std::chrono::duration<double>(seconds), [] { return false; });
          if (!end.stop_requested()) source_.request_stop();
        }) {}
  std::stop_token token() const { return source_.get_token(); }

 private:
  std::stop_source source_;
  std::stop_callback<std::function<void()>> forward_;
  std::jthread timer_;
};

std::size_t record(FrameSource& source, SourceRecorder& recorder, const RecordArguments& arguments,
                   const std::stop_token& stop) {
  Progress progress(source.size(), arguments.quiet);
  std::optional<double> first;
  std::size_t frames = 0;
  while (auto frame = source.next(stop)) {
    recorder.add(*frame, stop);
    ++frames;
    progress.show(frames, "recorded");
    if (recorder.recorder().has_failed()) break;
    if (!first) first = frame->timestamp;
    if (!source.is_live() && arguments.seconds > 0.0 && frame->timestamp - *first >= arguments.seconds) break;
  }
  return frames;
}

void execute(RecordArguments arguments) {
  settle_imu(arguments.source);
  if (arguments.source.name.empty()) throw CLI::RequiredError("SOURCE");
  require_another_file(arguments);
  const auto source = open_source(arguments.source);
  const InterruptWatcher interrupt;
  SourceRecorder recorder(*source, arguments.out);
  const bool is_timed = source->is_live() && arguments.seconds > 0.0;
  std::optional<TimedStop> timed;
  if (is_timed) timed.emplace(interrupt.token(), arguments.seconds);
  const std::size_t frames =
      record(*source, recorder, arguments, is_timed ? timed->token() : interrupt.token());
  recorder.close();
  if (frames == 0 && !interrupt.token().stop_requested())
    throw InputError(arguments.source.name + ": no frame could be recorded" + in_words(source->skipped()));
  std::printf("frames: %zu\n", frames);
  print_counts("skipped: ", source->skipped());
  print_counts("without depth: ", source->skipped_depth());
  print_counts("note: ", source->notes());
  std::printf("%s\n", recorder.in_words().c_str());
  require_written_output();
}
}  // namespace

void add_record_command(CLI::App& program) {
  const auto arguments = std::make_shared<RecordArguments>();
  CLI::App* command = program.add_subcommand(
      "record", "Record a camera, or convert another source, to an MCAP file without loss");
  command->footer(
      "Examples:\n"
      "  roslam record realsense --out flight.mcap\n"
      "  roslam record rgbd_dataset_freiburg1_rpy --camera tum-fr1 --out rpy.mcap\n"
      "roslam run FILE repeats the flight: the camera, its calibration, inertial samples and true poses are "
      "in "
      "the file,\n"
      "in the topics of ROS 2 drivers. A file whose end is missing, as after a power cut, is read as far as "
      "it "
      "is whole.\n"
      "Ctrl-C ends the recording.\n"
      "Exit code: 0 success, 1 an error in the input or a full disk, 2 wrong usage.");
  add_source_options(*command, arguments->source);
  add_stream_option(*command, arguments->source);
  add_topic_options(*command, arguments->source);
  add_mount_option(*command, arguments->source);
  command->add_option("--out", arguments->out, "File to write (.mcap)")
      ->required()
      ->check(ReplacesOnly({"\x89MCAP0\r\n"}));
  command->add_option("--seconds", arguments->seconds, "End after that time; 0: at the end of the source")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  add_flight_options(*command, arguments->source);
  command->add_flag("--quiet", arguments->quiet, "Print no progress");
  command->callback([arguments] { execute(*arguments); });
}

}  // namespace roslam::app
