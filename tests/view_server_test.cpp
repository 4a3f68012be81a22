// SPDX-License-Identifier: BSD-3-Clause
// What the web page shows: events, the bytes of the map, state for other programs, viewers.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <thread>

#include "telemetry/view/map_feed.hpp"
#include "telemetry/view/recorded_view.hpp"
#include "telemetry/view/revised.hpp"
#include "telemetry/view/status_text.hpp"
#include "tests/http_client.hpp"
#include "tests/view_scene.hpp"

namespace roslam::telemetry {
namespace {

constexpr std::size_t kHeader = 24;

MapSnapshot small_map() {
  MapSnapshot map;
  map.main_submap = SubmapId{2};
  for (std::uint32_t i = 0; i < 3; ++i) {
    const SE3 pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.3 * i, Eigen::Vector3d::UnitY())),
                   {1.0 * i, 2.0, -0.5});
    map.keyframes.push_back({KeyframeId{10 + i}, SubmapId{2}, 0.1 * i, pose});
    map.path.push_back({0.1 * i, pose});
  }
  map.landmarks.push_back({LandmarkId{5}, SubmapId{2}, {1.0F, -2.0F, 3.5F}, {10, 20, 30}});
  map.landmarks.push_back({LandmarkId{9}, SubmapId{1}, {4.0F, 5.0F, 6.0F}, {1, 2, 3}});
  return map;
}

TEST(RevisedRecords, GivesWhatChangedSince) {
  Revised<int> records;
  using Records = std::vector<std::pair<std::uint32_t, int>>;
  records.replace(Records{{1, 10}, {3, 30}, {5, 50}});
  const auto all = records.since(0, 100);
  EXPECT_TRUE(all.is_all);
  EXPECT_EQ(all.changes.size(), 3U);
  records.replace(Records{{1, 10}, {4, 40}, {5, 51}});
  const auto some = records.since(all.revision, 100);
  EXPECT_FALSE(some.is_all);
  std::map<std::uint32_t, std::pair<bool, int>> changes;
  for (const auto& change : some.changes) changes[change.key] = {change.is_gone, change.record};
  EXPECT_EQ(changes, (std::map<std::uint32_t, std::pair<bool, int>>{
                         {3, {true, 30}}, {4, {false, 40}}, {5, {false, 51}}}));
  EXPECT_TRUE(records.since(some.revision, 100).changes.empty());
  EXPECT_EQ(records.since(0, 100).changes.size(), 3U) << "what is gone is not told to who has nothing";
  records.replace(Records{{3, 30}});
  const auto back = records.since(some.revision, 100);
  EXPECT_EQ(back.changes.size(), 4U);
}

TEST(RevisedRecords, ComesInParts) {
  Revised<int> records;
  std::vector<std::pair<std::uint32_t, int>> all;
  for (std::uint32_t i = 0; i < 10; ++i) all.emplace_back(i, static_cast<int>(i));
  records.replace(all);
  std::vector<int> got;
  std::uint32_t revision = 0;
  for (bool has_more = true; has_more;) {
    const auto part = records.since(revision, 4);
    EXPECT_LE(part.changes.size(), 4U);
    EXPECT_EQ(part.is_all, revision == 0);
    for (const auto& change : part.changes) got.push_back(change.record);
    revision = part.revision;
    has_more = part.has_more;
  }
  EXPECT_EQ(got, (std::vector{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_TRUE(records.since(revision + 5, 100).is_all) << "the reader knows another server";
}

class Page : public testing::Test {
 protected:
  HttpAnswer get(const std::string& path) const { return ask(server_.port(), path); }

  StagedRun run_;
  ViewServer server_{at_free_port(), run_};
};

TEST_F(Page, GivesTheBytesOfTheMap) {
  const MapSnapshot map = small_map();
  run_.map_ = std::make_shared<const MapSnapshot>(map);
  const std::string keyframes = get("/keyframes?since=0").body;
  ASSERT_EQ(keyframes.size(), kHeader + 3 * 36);
  EXPECT_EQ(number_at<std::uint32_t>(keyframes, 0), 1U);
  EXPECT_EQ(number_at<std::uint32_t>(keyframes, 8), 3U);
  EXPECT_EQ(number_at<std::uint32_t>(keyframes, 12), 2U);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t at = kHeader + 36 * i;
    const SE3& pose = map.keyframes[i].T_world_camera;
    EXPECT_EQ(number_at<std::uint32_t>(keyframes, at), map.keyframes[i].id.value);
    EXPECT_EQ(number_at<std::uint32_t>(keyframes, at + 4), 2U);
    for (int k = 0; k < 3; ++k)
      EXPECT_EQ(number_at<float>(keyframes, at + 8 + 4 * static_cast<std::size_t>(k)),
                static_cast<float>(pose.translation()[k]));
    EXPECT_NEAR(number_at<float>(keyframes, at + 20), pose.rotation().w(), 1e-6);
    EXPECT_NEAR(number_at<float>(keyframes, at + 28), pose.rotation().y(), 1e-6);
  }
  const std::string points = get("/points?since=0").body;
  ASSERT_EQ(points.size(), kHeader + 2 * 24);
  EXPECT_EQ(number_at<std::uint32_t>(points, kHeader), 5U);
  EXPECT_EQ(number_at<std::uint32_t>(points, kHeader + 4), 2U);
  EXPECT_EQ(number_at<float>(points, kHeader + 16), 3.5F);
  EXPECT_EQ(points.substr(kHeader + 20, 4), std::string("\x1e\x14\x0a\0", 4)) << "red, green, blue";
  EXPECT_EQ(number_at<std::uint32_t>(points, kHeader + 24 + 4), 1U);
  const std::string path = get("/path?since=0").body;
  ASSERT_EQ(path.size(), kHeader + 3 * 16);
  EXPECT_EQ(number_at<std::uint32_t>(path, 20), 3U);
  EXPECT_EQ(number_at<float>(path, kHeader + 2 * 16 + 4), 2.0F);
  const auto revision = std::to_string(number_at<std::uint32_t>(points, 4));
  EXPECT_EQ(get("/points?since=" + revision).body.size(), kHeader) << "nothing changed";
  EXPECT_EQ(get("/points?since=x&since=-1").body.size(), points.size());
}

TEST(Surfaces, AreEncoded) {
  auto block = std::make_shared<SurfaceBlock>();
  block->index = {-1, 2, 3};
  block->points = {{{1, 2, 3}, {10, 20, 30}}, {{255, 0, 128}, {1, 2, 3}}};
  SurfaceChanges changes;
  changes.submap = SubmapId{7};
  changes.side = 0.4;
  changes.revision = 99;
  changes.has_more = true;
  changes.blocks = {block};
  const std::string bytes = encode(changes);
  ASSERT_EQ(bytes.size(), kHeader + 16 + 2 * 6);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 0), 2U);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 4), 99U);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 12), 7U);
  EXPECT_EQ(number_at<float>(bytes, 16), 0.4F);
  EXPECT_EQ(number_at<std::int32_t>(bytes, kHeader), -1);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, kHeader + 12), 2U);
  EXPECT_EQ(bytes.substr(kHeader + 16), std::string("\1\2\3\x1e\x14\x0a\xff\0\x80\3\2\1", 12));
}

TEST(RecordedRuns, GiveAllTheirPointsInBlocks) {
  RecordedView::Contents contents;
  for (int i = 0; i < 300; ++i)
    contents.dense.push_back({{0.01F * static_cast<float>(i) - 1.0F, 0.5F, -7.25F}, {30, 20, 10}});
  contents.dense.push_back({{std::nanf(""), 0.0F, 0.0F}, {0, 0, 0}});
  const RecordedView view(contents);
  std::vector<float> x;
  SurfaceChanges part;
  do {
    part = view.surface(part.submap, part.revision, 100);
    for (const auto& block : part.blocks) {
      for (const auto& point : block->points) {
        x.push_back(static_cast<float>(block->index[0]) +
                    (static_cast<float>(point.position[0]) + 0.5F) / 256.0F);
        EXPECT_EQ(block->index[2], -8);
        EXPECT_EQ(point.colour, cv::Vec3b(30, 20, 10));
      }
    }
  } while (part.has_more);
  ASSERT_EQ(x.size(), 300U);
  std::sort(x.begin(), x.end());
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(x[i], 0.01F * static_cast<float>(i) - 1.0F, 0.004F);
}

nlohmann::json event_in(const std::string& text) {
  const auto begin = text.find("data: ");
  return nlohmann::json::parse(text.substr(begin + 6, text.find('\n', begin) - begin - 6));
}

std::string begin_events(const RawConnection& viewer, double seconds = 5.0) {
  viewer.send("GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n");
  return viewer.receive("}", seconds);
}

TEST_F(Page, SendsEventsThatTellTheState) {
  const RawConnection viewer(server_.port());
  const std::string text = begin_events(viewer);
  EXPECT_EQ(parse_answer(text).field("Content-Type"), "text/event-stream");
  const auto event = event_in(text);
  EXPECT_EQ(event["run"], "first");
  EXPECT_EQ(event["health"], "ok");
  EXPECT_EQ(event["viewers"], 1);
  EXPECT_EQ(event["can"], nlohmann::json({"save", "stop"}));
  {
    const std::scoped_lock lock(run_.mutex_);
    run_.status_.state = TrackingState::kLost;
    run_.status_.frame = 4711;
  }
  EXPECT_NE(viewer.receive("4711").find("4711"), std::string::npos);
}

TEST_F(Page, CostsNothingWhileNobodyLooks) {
  run_.map_ = std::make_shared<const MapSnapshot>(small_map());
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  get("/health");
  get("/metrics");
  get("/");
  EXPECT_EQ(run_.snapshots, 0);
  EXPECT_EQ(run_.images, 0);
}

TEST_F(Page, RefusesAFifthViewerUntilOneLeaves) {
  std::vector<RawConnection> viewers;
  for (int i = 0; i < 4; ++i) {
    viewers.emplace_back(server_.port());
    EXPECT_EQ(parse_answer(begin_events(viewers.back())).status, 200);
  }
  const HttpAnswer fifth = get("/events");
  EXPECT_EQ(fifth.status, 503);
  EXPECT_FALSE(fifth.field("Retry-After").empty());
  EXPECT_EQ(get("/health").status, 200);
  viewers.pop_back();  // although the state of the run does not change
  for (int i = 0; i < 100 && server_.viewers() == 4; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(server_.viewers(), 3U);
  const RawConnection next(server_.port());
  EXPECT_EQ(parse_answer(begin_events(next)).status, 200);
}

TEST(SlowViewers, AreDropped) {
  StagedRun run;
  run.status_.source = std::string(200000, 's');  // so that events fill what is between the two
  ViewServer::Options options = at_free_port();
  options.http.send_time = std::chrono::milliseconds(300);
  const ViewServer server(options, run);
  const RawConnection viewer(server.port(), 4096);
  viewer.send("GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n");
  const auto wait_for = [&](std::size_t viewers) {
    for (int i = 0; i < 200 && server.viewers() != viewers; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      const std::scoped_lock lock(run.mutex_);
      ++run.status_.frame;
    }
    return server.viewers() == viewers;
  };
  EXPECT_TRUE(wait_for(1));
  EXPECT_TRUE(wait_for(0)) << "never reads";
  EXPECT_EQ(ask(server.port(), "/health").status, 200);
}

TEST_F(Page, TextOfRecordingsIsDataAndNothingElse) {
  const std::string script = "/camera/<script>alert(1)</script>\"\n\r\nX-Evil: 1\xff";
  {
    const std::scoped_lock lock(run_.mutex_);
    run_.status_.source = script;
    run_.log_ = {{1, 0.0, true, script}};
  }
  const RawConnection viewer(server_.port());
  const std::string text = begin_events(viewer);
  EXPECT_EQ(text.find("\r\nX-Evil"), std::string::npos);
  EXPECT_EQ(event_in(text)["source"].get<std::string>().substr(0, 31), script.substr(0, 31));
  const HttpAnswer log = get("/log?since=0");
  EXPECT_EQ(log.field("Content-Type"), "application/json");
  EXPECT_TRUE(nlohmann::json::parse(log.body).is_array());
  EXPECT_EQ(get("/").body.find("<script>alert"), std::string::npos);
}

TEST_F(Page, TellsItsHealth) {
  auto health = [&] { return nlohmann::json::parse(get("/health").body); };
  EXPECT_EQ(health()["status"], "ok");
  EXPECT_TRUE(health()["reasons"].empty());
  const auto with = [&](const std::function<void(ViewStatus&)>& change) {
    StagedRun fresh;
    ViewStatus status = fresh.status_;
    change(status);
    return health_of(status);
  };
  EXPECT_EQ(with([](auto& s) { s.latency = 0.5; }).status, "degraded");
  EXPECT_EQ(with([](auto& s) { s.since_frame = 3.0; }).reasons,
            std::vector<std::string>{"no frame for 3.0 s"});
  EXPECT_EQ(with([](auto& s) { s.recent_drops = 0.5; }).status, "degraded");
  EXPECT_EQ(with([](auto& s) { s.quality = 0.1; }).status, "degraded");
  EXPECT_EQ(with([](auto& s) { s.state = TrackingState::kPredicted; }).status, "degraded");
  EXPECT_EQ(with([](auto& s) { s.warnings = {"dark"}; }).reasons, std::vector<std::string>{"dark"});
  EXPECT_EQ(with([](auto& s) { s.state = TrackingState::kRecentlyLost; }).status, "lost");
  EXPECT_EQ(with([](auto& s) { s.phase = RunPhase::kEnded; }).status, "ended");
  {
    const std::scoped_lock lock(run_.mutex_);
    run_.status_.state = TrackingState::kLost;
  }
  EXPECT_EQ(get("/health").status, 503);
  EXPECT_EQ(health()["status"], "lost");
}

TEST_F(Page, GivesMetricsInTheFormatOfPrometheus) {
  {
    const std::scoped_lock lock(run_.mutex_);
    run_.status_.processed = 1234567;
    run_.status_.latency = 0.0123;
  }
  const HttpAnswer answer = get("/metrics");
  EXPECT_EQ(answer.field("Content-Type"), "text/plain; version=0.0.4; charset=utf-8");
  ASSERT_EQ(answer.body.back(), '\n');
  std::istringstream lines(answer.body);
  std::map<std::string, double> values;
  std::map<std::string, std::string> types;
  const std::regex sample(R"re(([a-zA-Z_:][a-zA-Z0-9_:]*)(\{[a-z]+="[^"\\]*"\})? (-?[0-9.e+-]+))re");
  const std::regex comment(R"(# (HELP|TYPE) ([a-zA-Z_:][a-zA-Z0-9_:]*) (.+))");
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (line.front() == '#') {
      ASSERT_TRUE(std::regex_match(line, match, comment)) << line;
      if (match[1] == "HELP") continue;
      EXPECT_TRUE(types.emplace(match[2], match[3]).second) << line;
      continue;
    }
    ASSERT_TRUE(std::regex_match(line, match, sample)) << line;
    EXPECT_EQ(types.count(match[1]), 1U) << line << ": type after its sample";
    EXPECT_TRUE(values.emplace(match[1].str() + match[2].str(), std::stod(match[3])).second) << line;
  }
  for (const auto& [name, type] : types) EXPECT_EQ(type == "counter", name.ends_with("_total")) << name;
  EXPECT_EQ(values.at("roslam_frames_total"), 1234567.0);
  EXPECT_EQ(values.at("roslam_latency_seconds"), 0.0123);
  EXPECT_EQ(values.at("roslam_health{status=\"ok\"}"), 1.0);
  EXPECT_EQ(values.at("roslam_health{status=\"lost\"}"), 0.0);
}

TEST(Restart, IsSeenByTheRunInTheEvents) {
  StagedRun first, second;
  second.status_.run = "second";
  ViewServer::Options options = at_free_port();
  {
    ViewServer server(options, first);
    options.endpoint.port = server.port();
    const RawConnection viewer(server.port());
    EXPECT_EQ(event_in(begin_events(viewer))["run"], "first");
    {
      const std::scoped_lock lock(first.mutex_);
      first.status_.phase = RunPhase::kEnded;
    }
    server.finish();
    EXPECT_NE(viewer.receive().find("\"phase\":\"ended\""), std::string::npos);
    EXPECT_TRUE(viewer.is_closed());
  }
  const ViewServer server(options, second);  // at the same port at once
  const RawConnection viewer(server.port());
  EXPECT_EQ(event_in(begin_events(viewer))["run"], "second");
}

}  // namespace
}  // namespace roslam::telemetry
