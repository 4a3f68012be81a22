// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <mutex>

#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "recording/run_contents.hpp"
#include "telemetry/view/access.hpp"
#include "telemetry/view/recorded_view.hpp"
#include "telemetry/view/view_server.hpp"

namespace roslam::app {

namespace {
constexpr std::size_t kMostPoints = 3'000'000;  // of each map: 50 MB in the browser

struct ViewArguments {
  std::filesystem::path run;
  std::string endpoint;
};

std::vector<telemetry::RecordedView::Point> points_of(const std::vector<recording::ColouredPoint>& points) {
  std::vector<telemetry::RecordedView::Point> result;
  result.reserve(points.size());
  for (const recording::ColouredPoint& point : points) result.push_back({point.position, point.colour});
  return result;
}

telemetry::RecordedView::Contents contents_of(const std::filesystem::path& folder) {
  const recording::RunContents run = recording::read_run_contents(folder, kMostPoints);
  telemetry::RecordedView::Contents contents;
  contents.run = telemetry::random_token();
  contents.source = run.source.name;
  contents.path = run.trajectory;
  if (const auto file = folder / "keyframes.txt"; std::filesystem::exists(file))
    contents.keyframes = read_trajectory(file).trajectory;
  contents.landmarks = points_of(run.landmarks);
  contents.dense = points_of(run.dense);
  std::ifstream image(folder / "removal.jpg", std::ios::binary);
  contents.image.assign(std::istreambuf_iterator<char>(image), {});
  contents.notes = run.notes;
  return contents;
}

void show(const ViewArguments& arguments) {
  const InterruptWatcher interrupt;
  telemetry::RecordedView view(contents_of(arguments.run));
  telemetry::ViewServer::Options options;
  options.endpoint = telemetry::parse_endpoint(arguments.endpoint);
  const telemetry::ViewServer server(options, view);
  std::cout << server.url() << "\nShows " << arguments.run.string() << " until it is ended by Ctrl-C.\n";
  std::cout.flush();
  require_written_output();
  std::mutex mutex;
  std::condition_variable_any stopped;
  std::unique_lock lock(mutex);
  stopped.wait(lock, interrupt.token(), [] { return false; });
}
}  // namespace

void add_view_command(CLI::App& program) {
  const auto arguments = std::make_shared<ViewArguments>();
  CLI::App* command = program.add_subcommand("view", "Show a run of earlier on a web page");
  command->footer(
      "Example:\n  roslam view flights/1\nA run in progress is shown by roslam run --view. The page is for "
      "this "
      "computer only; at another address it needs the\ntoken in the URL that is printed (docs/view.md).");
  command->add_option("RUN", arguments->run, "Folder that roslam run wrote")->required();
  command->add_option("ADDRESS:PORT", arguments->endpoint,
                      "Where the page is served; default 127.0.0.1:8080");
  command->callback([arguments] { show(*arguments); });
}

}  // namespace roslam::app
