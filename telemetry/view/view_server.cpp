// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/view/view_server.hpp"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "roslam/common/error.hpp"
#include "telemetry/view/access.hpp"
#include "telemetry/view/map_feed.hpp"
#include "telemetry/view/page.hpp"
#include "telemetry/view/status_text.hpp"

namespace roslam::telemetry {

namespace {
using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::milliseconds;
constexpr Milliseconds kEventInterval{100};
constexpr Milliseconds kMapInterval{1000};      // between two snapshots
constexpr int kMapShare = 50;                   // a snapshot may take a fiftieth of the time between two
constexpr Milliseconds kInterest{2500};         // after a request for the map
constexpr Milliseconds kMapPatience{2000};      // of such a request, for the first snapshot
constexpr Milliseconds kKeepAlive{2000};        // between two events where nothing changes
constexpr std::size_t kPointsInReply = 100000;  // of surfaces: 0.6 MB
constexpr std::size_t kShortestToken = 16;

constexpr const char* kPolicy =
    "default-src 'self'; img-src 'self' blob:; object-src 'none'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";

template <typename T>
T number_in(const HttpRequest& request, const std::string& name, T otherwise = 0) {
  const std::string text = request.parameter(name);
  T number = otherwise;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? number : otherwise;
}

std::string binary_type() { return "application/octet-stream"; }
}  // namespace

struct ViewServer::Impl {
  Impl(const Options& the_options, ViewSubject& the_subject);
  ~Impl();

  HttpReply answer(const HttpRequest& request);
  HttpReply route(const HttpRequest& request);
  HttpReply page_file(const std::string& path) const;
  HttpReply events();
  HttpReply image(const HttpRequest& request);
  HttpReply execute(const std::string& path);
  bool send_event(std::uint64_t& seen, const SendPart& send);
  void want_map();
  ViewCounts counts() const;

  void work(const std::stop_token& stop);
  Milliseconds update_map();

  Options options;
  ViewSubject& subject;
  AccessPolicy access;
  MapFeed feed;
  std::atomic<std::size_t> viewers = 0, refused_viewers = 0, dropped_viewers = 0, refused_requests = 0;

  mutable std::mutex mutex;  // guards what follows
  std::condition_variable_any changed;
  std::string event;
  std::uint64_t event_number = 0;
  Clock::time_point map_wanted;  // when it was asked for
  std::uint64_t snapshots = 0;
  std::string loops = "[]";
  std::size_t loop_count = 0;
  bool is_finishing = false;

  std::jthread thread;
  std::unique_ptr<HttpServer> http;  // last: its threads use the rest
};

ViewServer::Impl::Impl(const Options& the_options, ViewSubject& the_subject)
    : options(the_options),
      subject(the_subject),
      access(the_options.endpoint.address, the_options.token.empty() ? random_token() : the_options.token) {
  if (access.token().size() < kShortestToken)
    throw InputError("ROSLAM_VIEW_TOKEN: has fewer than 16 characters; make one with: openssl rand -hex 16");
  http = std::make_unique<HttpServer>(
      options.endpoint, [this](const HttpRequest& request) { return answer(request); }, options.http);
  thread = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

ViewServer::Impl::~Impl() {
  {
    const std::scoped_lock lock(mutex);
    is_finishing = true;
  }
  thread.request_stop();
  changed.notify_all();
  http->stop();
}

ViewServer::ViewServer(const Options& options, ViewSubject& subject)
    : impl_(std::make_unique<Impl>(options, subject)) {}

ViewServer::~ViewServer() = default;

int ViewServer::port() const { return impl_->http->port(); }
const std::string& ViewServer::token() const { return impl_->access.token(); }
std::size_t ViewServer::viewers() const { return impl_->viewers; }
double ViewServer::cpu_seconds() const { return impl_->counts().cpu_seconds; }

std::string ViewServer::url() const {
  Endpoint shown{impl_->options.endpoint.address, port()};
  if (shown.address == "0.0.0.0" || shown.address == "::") shown.address = "ADDRESS-OF-THIS-COMPUTER";
  const std::string page = "http://" + shown.in_words() + "/";
  return impl_->access.needs_token() ? page + "?token=" + token() : page;
}

void ViewServer::finish() {
  std::unique_lock lock(impl_->mutex);
  impl_->is_finishing = true;
  impl_->changed.notify_all();
  impl_->changed.wait_for(lock, Milliseconds(500), [this] { return impl_->viewers == 0; });
}

HttpReply ViewServer::Impl::answer(const HttpRequest& request) {
  HttpReply reply;
  if (auto refusal = access.refuse(request)) {
    ++refused_requests;
    reply = std::move(*refusal);
  } else {
    reply = route(request);
  }
  reply.fields.insert(reply.fields.end(), {{"Content-Security-Policy", kPolicy},
                                           {"X-Content-Type-Options", "nosniff"},
                                           {"X-Frame-Options", "DENY"},
                                           {"Referrer-Policy", "no-referrer"},
                                           {"Cross-Origin-Resource-Policy", "same-origin"},
                                           {"Cache-Control", "no-store"}});
  return reply;
}

HttpReply ViewServer::Impl::route(const HttpRequest& request) {
  const std::string& path = request.path;
  if (request.method == "POST") return execute(path);
  if (request.method != "GET") return HttpReply::text(405, "only GET and POST");
  const auto since = number_in<std::uint32_t>(request, "since");
  if (path == "/events") return events();
  if (path == "/frame.jpg") return image(request);
  if (path == "/health") {
    HttpReply reply = HttpReply::json(health_json(subject.status()));
    if (health_of(subject.status()).status == "lost") reply.status = 503;
    return reply;
  }
  if (path == "/metrics")
    return HttpReply::typed("text/plain; version=0.0.4; charset=utf-8",
                            metrics_text(subject.status(), counts()));
  if (path == "/log") return HttpReply::json(log_json(subject.log(since)));
  if (path == "/dense")
    return HttpReply::typed(
        binary_type(),
        encode(subject.surface(SubmapId{number_in<std::uint32_t>(request, "submap", SubmapId::kNone)}, since,
                               kPointsInReply)));
  if (path == "/keyframes" || path == "/points" || path == "/path" || path == "/loops") want_map();
  if (path == "/keyframes") return HttpReply::typed(binary_type(), feed.keyframes(since));
  if (path == "/points") return HttpReply::typed(binary_type(), feed.points(since));
  if (path == "/path") return HttpReply::typed(binary_type(), feed.path(since));
  if (path == "/loops") {
    const std::scoped_lock lock(mutex);
    return HttpReply::json(loops);
  }
  return page_file(path);
}

HttpReply ViewServer::Impl::page_file(const std::string& path) const {
  for (const PageFile& file : page_files()) {
    if (path != file.path) continue;
    HttpReply reply = HttpReply::typed(std::string(file.type), std::string(file.content));
    if (path != "/") return reply;
    // The page hands the token back with what it posts; no other site can read it here.
    const auto place = reply.body.find("TOKEN");
    reply.body.replace(place, std::string_view("TOKEN").size(), access.token());
    if (access.needs_token()) reply.fields.emplace_back("Set-Cookie", access.cookie());
    return reply;
  }
  return HttpReply::text(404, "there is no such page");
}

HttpReply ViewServer::Impl::events() {
  if (++viewers > options.viewers) {
    --viewers;
    ++refused_viewers;
    HttpReply reply = HttpReply::text(503, "too many viewers; close another page");
    reply.fields.emplace_back("Retry-After", "10");
    return reply;
  }
  // Counts the viewer out, whichever way the stream ends.
  const std::shared_ptr<void> place(nullptr, [this](void*) {
    --viewers;
    ++dropped_viewers;
    const std::scoped_lock lock(mutex);
    changed.notify_all();
  });
  changed.notify_all();
  HttpReply reply;
  reply.type = "text/event-stream";
  reply.stream = [this, place, seen = std::uint64_t{0}](const SendPart& send) mutable {
    return send_event(seen, send);
  };
  return reply;
}

// Always the newest event: who reads slowly misses some, and nothing waits for him.
bool ViewServer::Impl::send_event(std::uint64_t& seen, const SendPart& send) {
  std::string text;
  bool is_last = false;
  {
    std::unique_lock lock(mutex);
    changed.wait_for(lock, kKeepAlive, [&] { return is_finishing || event_number != seen; });
    is_last = is_finishing;
    if (seen > 0) text = event;  // once more where nothing changed, so that the page knows of the link
    seen = std::max(event_number, std::uint64_t{1});
  }
  if (is_last || text.empty()) text = event_json(subject.status(), counts());
  return send("retry: 1000\ndata: " + text + "\n\n") && !is_last;
}

HttpReply ViewServer::Impl::image(const HttpRequest& request) {
  auto number = number_in<std::uint64_t>(request, "after");
  std::string jpeg = subject.image(number);
  if (jpeg.empty()) {
    HttpReply reply;
    reply.status = 204;
    return reply;
  }
  HttpReply reply = HttpReply::typed("image/jpeg", std::move(jpeg));
  reply.fields.emplace_back("X-Number", std::to_string(number));
  return reply;
}

HttpReply ViewServer::Impl::execute(const std::string& path) {
  static const std::pair<const char*, ViewCommand> kCommands[] = {{"/save", ViewCommand::kSave},
                                                                  {"/pause", ViewCommand::kPause},
                                                                  {"/resume", ViewCommand::kResume},
                                                                  {"/stop", ViewCommand::kStop}};
  for (const auto& [name, command] : kCommands) {
    if (path != name) continue;
    const std::string refusal = subject.execute(command);
    return refusal.empty() ? HttpReply::text(200, "done") : HttpReply::text(409, refusal);
  }
  return HttpReply::text(404, "there is no such command");
}

// Waits for a snapshot that is not older than a few seconds. The server's own thread makes it, as one of low
// priority must not hold the map.
void ViewServer::Impl::want_map() {
  std::unique_lock lock(mutex);
  const bool is_kept_up = Clock::now() - map_wanted < kInterest && snapshots > 0;
  map_wanted = Clock::now();
  if (is_kept_up) return;
  const std::uint64_t before = snapshots;
  changed.notify_all();
  changed.wait_for(lock, kMapPatience, [&] { return snapshots != before || is_finishing; });
}

ViewCounts ViewServer::Impl::counts() const {
  ViewCounts result;
  result.viewers = viewers;
  result.viewers_refused = refused_viewers;
  result.viewers_dropped = dropped_viewers;
  result.requests_refused = refused_requests;
  result.cpu_seconds = http->cpu_seconds() + cpu_seconds_of(const_cast<std::jthread&>(thread));
  result.map_revision = feed.revision();
  const std::scoped_lock lock(mutex);
  result.loops = loop_count;
  return result;
}

// How long until the next one.
Milliseconds ViewServer::Impl::update_map() {
  const auto begun = Clock::now();
  const auto map = subject.snapshot();
  if (map) feed.update(*map);
  const auto closed = subject.loops();
  const auto taken = std::chrono::duration_cast<Milliseconds>(Clock::now() - begun);
  const std::scoped_lock lock(mutex);
  ++snapshots;
  loops = loops_json(closed);
  loop_count = closed.size();
  changed.notify_all();
  return std::max(kMapInterval, kMapShare * taken);
}

void ViewServer::Impl::work(const std::stop_token& stop) {
  auto map_due = Clock::now();
  std::uint64_t known_map = 0;
  while (!stop.stop_requested()) {
    bool wants_map = false;
    {
      std::unique_lock lock(mutex);
      const auto is_wanted = [&] { return viewers > 0 || Clock::now() - map_wanted < kInterest; };
      if (!is_wanted()) {
        changed.wait(lock, stop, is_wanted);
        map_due = Clock::now();
      } else {
        changed.wait_for(lock, stop, kEventInterval, [] { return false; });
      }
      wants_map = Clock::now() - map_wanted < kInterest;
    }
    if (stop.stop_requested()) return;
    if ((wants_map || known_map == 0) && Clock::now() >= map_due) {
      map_due = Clock::now() + update_map();
      known_map = feed.revision();
    }
    if (viewers == 0) continue;
    std::string next = event_json(subject.status(), counts());
    const std::scoped_lock lock(mutex);
    if (is_finishing || next == event) continue;
    event = std::move(next);
    ++event_number;
    changed.notify_all();
  }
}

}  // namespace roslam::telemetry
