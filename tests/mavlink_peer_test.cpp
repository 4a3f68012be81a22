// SPDX-License-Identifier: BSD-3-Clause
// What an independent implementation decodes of a simulated flight with a loss, a recovery and a closed loop
// (tests/mavlink_peer.mjs says how to install it), against the results of the pipeline and what
// docs/autopilot.md says of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>

#include "roslam/common/formatted.hpp"
#include "roslam/slam/run.hpp"
#include "simulation/simulated_source.hpp"
#include "telemetry/mavlink/mavlink_sender.hpp"
#include "tests/blinded_source.hpp"
#include "tests/decoded_mavlink.hpp"
#include "tests/mavlink_convention.hpp"
#include "tests/program.hpp"
#include "tests/scratch.hpp"
#include "tests/stand_in_autopilot.hpp"

namespace roslam::telemetry {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPackages = "ROSLAM_NODE_PACKAGES";
constexpr const char* kKeep = "ROSLAM_MAVLINK_FLIGHT";  // a file for the bytes of the flight
constexpr std::size_t kBlind = 33, kSees = 38;          // frames
constexpr GeodeticOrigin kOrigin{47.3977, -8.5456, 488.25};

// An autopilot and who sends to it.
struct Stream {
  Stream(bool speaks, const MavlinkSenderOptions& the_options, const MavlinkSender::Loops& loops)
      : autopilot(speaks),
        options(the_options),
        sender(MavlinkAddress::from(autopilot.address()), options, loops) {}

  StandInAutopilot autopilot;
  MavlinkSenderOptions options;
  MavlinkSender sender;
};

struct Flight {
  std::vector<TrackingReport> reports;
  std::vector<ClosedLoop> loops;
  std::int64_t begun = 0, ended = 0;  // ns, steady clock: before the first message and after the last
};

void write_bytes(const fs::path& file, const std::vector<std::uint8_t>& bytes) {
  std::ofstream(file, std::ios::binary) << std::string(bytes.begin(), bytes.end());
}

bool is_critical(const HeartbeatMessage& heartbeat) { return heartbeat.system_status == 5; }
bool is_loop(const StatusTextMessage& text) { return text.words().starts_with("RO-SLAM: loop closed"); }

template <typename Message>
bool is_heard(const Stream& stream, bool (*is_it)(const Message&)) {
  return comes([&] {
    const auto all = stream.autopilot.all<Message>();
    return std::any_of(all.begin(), all.end(), is_it);
  });
}

class MavlinkPeer : public testing::Test {
 protected:
  void SetUp() override {
    const char* packages = std::getenv(kPackages);
    if (packages == nullptr || !fs::exists(fs::path(packages) / "node_modules" / "node-mavlink"))
      GTEST_SKIP() << kPackages << " names no folder with node-mavlink; see tests/mavlink_peer.mjs";
    fs::create_directories(folder_);
    if (shell_in(folder_, "node --version").code != 0) GTEST_SKIP() << "node is not installed";
  }
  void TearDown() override { fs::remove_all(folder_); }

  // What the peer decodes of all that the autopilot heard.
  std::vector<ReceivedMessage> decoded(const StandInAutopilot& autopilot) const {
    const std::vector<std::uint8_t> bytes = autopilot.bytes();
    write_bytes(folder_ / "flight.bin", bytes);
    const fs::path script = fs::path(ROSLAM_TEST_FILES).parent_path() / "mavlink_peer.mjs";
    const Outcome outcome = shell_in(folder_, "node '" + script.string() + "' read flight.bin");
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    return messages_from(nlohmann::json::parse(outcome.out), bytes.size());
  }

  fs::path folder_ = scratch_path();
};

// A turn on the spot that ends where it began. The heartbeat while it is lost and the text of the loop, which
// come once a second, are waited for.
Flight fly(simulation::SimulatedSource& turn, Slam& slam,
           const std::vector<std::unique_ptr<Stream>>& streams) {
  simulation::BlindedSource source(turn, kBlind, kSees);
  Flight flight;
  bool is_loop_told = false;
  const RunSummary summary = run_slam(source, slam, [&](const Frame& frame, const FrameResult& result) {
    flight.reports.emplace_back(result);
    const bool is_told_now = !is_loop_told && !slam.loops().empty();
    for (const auto& stream : streams) {
      stream->sender.add(flight.reports.back());
      if (frame.index + 1 == kSees) {
        EXPECT_TRUE(is_heard(*stream, is_critical));
      }
      if (is_told_now) {
        EXPECT_TRUE(is_heard(*stream, is_loop));
      }
    }
    is_loop_told |= is_told_now;
  });
  EXPECT_FALSE(summary.failure);
  flight.loops = slam.loops();
  for (const auto& stream : streams) {
    EXPECT_TRUE(comes([&] {
      const auto texts = stream->autopilot.all<StatusTextMessage>();
      return std::count_if(texts.begin(), texts.end(), is_loop) == std::ssize(flight.loops);
    }));
    stream->sender.finish();
    EXPECT_TRUE(comes([&] { return stream->autopilot.heard().size() >= stream->sender.report().sent; }));
  }
  flight.ended = StandInAutopilot::now();
  return flight;
}

// The reset counter of each frame. That of the map also rises where a correction moves or turns the body by
// more than the options say.
std::vector<std::size_t> counters_of(const Flight& flight, const OdometryStreamOptions& options) {
  std::vector<std::size_t> counters;
  std::size_t jumps = 0;
  std::optional<Odometry> last;
  for (const TrackingReport& report : flight.reports) {
    const auto& odometry = report.odometry;
    if (options.frame == PoseFrame::kMap && odometry && last && last->resets == odometry->resets) {
      const SE3 then = last->T_map_odom * odometry->T_odom_body;
      const SE3 now = odometry->T_map_odom * odometry->T_odom_body;
      const double turned = now.rotation().angularDistance(then.rotation()) * 180.0 / std::numbers::pi;
      if ((now.translation() - then.translation()).norm() > options.map_jump || turned > options.map_turn)
        ++jumps;
    }
    if (odometry) last = odometry;
    counters.push_back(last ? (last->resets + jumps) % 256 : 0);
  }
  return counters;
}

std::uint64_t microseconds_of(const TrackingReport& report) {
  return static_cast<std::uint64_t>(std::llround(1e6 * report.timestamp));
}

void expect_poses(const std::vector<ReceivedMessage>& messages, const Flight& flight, const Stream& stream) {
  const OdometryStreamOptions& options = stream.options.stream;
  const auto counters = counters_of(flight, options);
  std::size_t at = 0;
  for (const ReceivedMessage& one : messages) {
    const auto* pose = std::get_if<OdometryMessage>(&one.message);
    if (pose == nullptr) continue;
    while (at < flight.reports.size() && !flight.reports[at].odometry) ++at;
    ASSERT_LT(at, flight.reports.size());
    SCOPED_TRACE("frame " + std::to_string(at));
    EXPECT_EQ(pose->time_usec, microseconds_of(flight.reports[at]));
    EXPECT_EQ(pose->reset_counter, counters[at]);
    EXPECT_EQ(pose->estimator_type, options.is_inertial ? 3 : 2);
    convention::expect_sent(*pose, options.frame, *flight.reports[at].odometry);
    if (testing::Test::HasFailure()) return;  // those of one message are enough to read
    ++at;
  }
}

// Poses and texts in the order in which they have to come: a pose for each frame that has one and for no
// other, and texts after it. Those of loops come once a second, wherever that is.
void expect_order(const std::vector<ReceivedMessage>& messages, const Flight& flight, const Stream& stream) {
  const auto counters = counters_of(flight, stream.options.stream);
  std::vector<std::string> expected, found, loops_expected, loops_found;
  bool has_had_pose = false, is_lost = false;
  for (std::size_t i = 0; i < flight.reports.size(); ++i) {
    const TrackingReport& report = flight.reports[i];
    const std::string counter = ", reset counter " + std::to_string(counters[i]);
    if (report.odometry) {
      expected.push_back("pose " + std::to_string(microseconds_of(report)));
      if (!has_had_pose) expected.push_back("5 RO-SLAM: tracking" + counter);
      if (is_lost) expected.push_back("5 RO-SLAM: tracking again" + counter);
      has_had_pose = true;
    } else if (has_had_pose && !is_lost) {
      expected.emplace_back("4 RO-SLAM: lost, place not recognised");
    }
    is_lost = has_had_pose && !report.odometry;
  }
  expected.emplace_back("5 RO-SLAM: run ended");
  for (const ClosedLoop& loop : flight.loops)
    loops_expected.push_back(formatted("6 RO-SLAM: loop closed, map moved by %.2f m", loop.moved));
  for (const ReceivedMessage& one : messages) {
    if (const auto* pose = std::get_if<OdometryMessage>(&one.message))
      found.push_back("pose " + std::to_string(pose->time_usec));
    if (const auto* text = std::get_if<StatusTextMessage>(&one.message))
      (is_loop(*text) ? loops_found : found)
          .push_back(std::to_string(text->severity) + " " + std::string(text->words()));
  }
  EXPECT_EQ(found, expected);
  EXPECT_EQ(loops_found, loops_expected);
}

// A heartbeat a second says how it is: standby, active with the first pose, critical from the text of the
// loss on.
void expect_heartbeats(const std::vector<ReceivedMessage>& messages, const Flight& flight) {
  int state = 3, count = 0;
  for (const ReceivedMessage& one : messages) {
    if (std::holds_alternative<OdometryMessage>(one.message)) state = 4;
    if (const auto* text = std::get_if<StatusTextMessage>(&one.message))
      state = text->words().starts_with("RO-SLAM: lost") ? 5 : state;
    const auto* heartbeat = std::get_if<HeartbeatMessage>(&one.message);
    if (heartbeat == nullptr) continue;
    ++count;
    EXPECT_EQ(heartbeat->type, 18) << "MAV_TYPE_ONBOARD_CONTROLLER";
    EXPECT_EQ(heartbeat->autopilot, 8) << "MAV_AUTOPILOT_INVALID";
    EXPECT_EQ(heartbeat->base_mode, 0);
    EXPECT_EQ(heartbeat->custom_mode, 0U);
    EXPECT_EQ(heartbeat->mavlink_version, 3);
    EXPECT_EQ(heartbeat->system_status, state) << "heartbeat " << count;
  }
  const double seconds = 1e-9 * static_cast<double>(flight.ended - flight.begun);
  EXPECT_LE(count, seconds + 2.0);
  EXPECT_GE(count, 0.5 * seconds) << "where other programs take all of the processor";
}

// Answers on the clock of this computer, and the origin three times; none where no autopilot speaks.
void expect_clock_and_origin(const std::vector<ReceivedMessage>& messages, const Flight& flight,
                             const Stream& stream, bool speaks) {
  const auto heard = stream.autopilot.heard();
  std::size_t answers = 0, origins = 0;
  for (std::size_t i = 0; i < messages.size(); ++i) {
    if (const auto* answer = std::get_if<TimesyncMessage>(&messages[i].message)) {
      ++answers;
      EXPECT_GE(answer->tc1, answer->ts1 - StandInAutopilot::kAhead) << "before it was asked";
      EXPECT_LE(answer->tc1, heard[i].time);
      EXPECT_EQ(answer->target_system, 1);
      EXPECT_EQ(answer->target_component, 1);
    }
    if (const auto* origin = std::get_if<GpsOriginMessage>(&messages[i].message)) {
      ++origins;
      EXPECT_EQ(origin->latitude, 473977000);
      EXPECT_EQ(origin->longitude, -85456000);
      EXPECT_EQ(origin->altitude, 488250);
      EXPECT_EQ(origin->target_system, 1);
      EXPECT_GE(origin->time_usec, static_cast<std::uint64_t>(flight.begun / 1000));
      EXPECT_LE(origin->time_usec, static_cast<std::uint64_t>(flight.ended / 1000));
    }
  }
  EXPECT_EQ(answers > 10, speaks) << answers;
  EXPECT_EQ(origins, speaks ? 3U : 0U);
}

TEST_F(MavlinkPeer, DecodesEveryMessageOfAFlight) {
  simulation::SimulatorOptions turn_options;
  turn_options.path = simulation::FlightPath::kHover;
  turn_options.traffic = simulation::TrafficLevel::kNone;
  turn_options.fps = 5.0;
  turn_options.frames = 100;
  simulation::SimulatedSource turn(turn_options);
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  Slam slam(
      turn.camera(), options, Mode::kDeterministic, nullptr,
      std::make_shared<const Vocabulary>(Vocabulary::load(ROSLAM_TEST_MODELS "/roslam-orb.vocabulary")));
  // Not in the origin and not level, so that no sign and no product is hidden by a zero.
  slam.set_initial_pose(
      SE3(Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.3, -0.5, 1).normalized())),
          {12.5, -3.25, 1.75}));
  MavlinkSenderOptions odom, map;
  odom.stream.mode = map.stream.mode = Mode::kDeterministic;
  odom.origin = kOrigin;
  map.stream.frame = PoseFrame::kMap;
  map.stream.map_jump = 0.01;  // metres: the loop moves the map by some centimetres
  map.stream.is_inertial = true;
  map.id = {7, 42};
  const auto loops = [&slam] { return slam.loops(); };
  const std::int64_t begun = StandInAutopilot::now();
  std::vector<std::unique_ptr<Stream>> streams;
  streams.push_back(std::make_unique<Stream>(true, odom, loops));
  streams.push_back(std::make_unique<Stream>(false, map, loops));
  Flight flight = fly(turn, slam, streams);
  flight.begun = begun;

  const auto& reports = flight.reports;
  EXPECT_EQ(reports.size(), turn_options.frames);
  EXPECT_FALSE(reports[kBlind].odometry) << "lost";
  EXPECT_TRUE(reports.back().odometry) << "recovered";
  EXPECT_EQ(reports.back().odometry->resets, 1U);
  EXPECT_FALSE(flight.loops.empty());
  EXPECT_GT(counters_of(flight, map.stream).back(), 1U) << "corrections that count as resets";
  for (const auto& stream : streams) {
    SCOPED_TRACE("messages of system " + std::to_string(stream->options.id.system));
    const auto messages = decoded(stream->autopilot);
    const auto heard = stream->autopilot.heard();
    EXPECT_EQ(messages.size(), stream->sender.report().sent);
    ASSERT_EQ(messages.size(), heard.size());
    for (std::size_t i = 0; i < messages.size(); ++i) {
      EXPECT_EQ(messages[i].sender, stream->options.id);
      EXPECT_EQ(messages[i].sequence, i % 256) << "a gap";
      EXPECT_EQ(messages[i].message, heard[i].message.message) << "decoded by the library";
    }
    expect_poses(messages, flight, *stream);
    expect_order(messages, flight, *stream);
    expect_heartbeats(messages, flight);
    expect_clock_and_origin(messages, flight, *stream, stream == streams.front());
  }
  if (const char* file = std::getenv(kKeep)) write_bytes(file, streams.front()->autopilot.bytes());
}

}  // namespace
}  // namespace roslam::telemetry
