// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/view/view_server.hpp"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <utility>

#include "roslam/common/error.hpp"
#include "telemetry/view/access.hpp"
#include "telemetry/view/map_feed.hpp"
#include "telemetry/view/page.hpp"
#include "telemetry/view/status_text.hpp"
#include "telemetry/view/view_feed.hpp"

namespace roslam::telemetry {

namespace {
constexpr std::size_t kPointsInReply = 100000;  // of surfaces: 0.6 MB
constexpr int kRepeat = 4;                      // times half a second without an event
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

// It stands in the page, in cookies and in addresses.
bool is_plain(char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

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
  ViewCounts counts() const;

  Options options;
  ViewSubject& subject;
  AccessPolicy access;
  std::atomic<std::size_t> refused_viewers = 0, dropped_viewers = 0, refused_requests = 0;
  std::unique_ptr<HttpServer> http;
  std::atomic<const HttpServer*> running = nullptr;  // once its threads may ask for it
  ViewFeed feed;
};

ViewServer::Impl::Impl(const Options& the_options, ViewSubject& the_subject)
    : options(the_options),
      subject(the_subject),
      access(the_options.endpoint.address, the_options.token.empty() ? random_token() : the_options.token),
      feed(the_subject, [this] { return counts(); }) {
  const std::string& token = access.token();
  if (token.size() < kShortestToken || !std::all_of(token.begin(), token.end(), is_plain))
    throw InputError(
        "ROSLAM_VIEW_TOKEN: is not of 16 or more letters and digits; make one with: openssl rand -hex 16");
  http = std::make_unique<HttpServer>(
      options.endpoint, [this](const HttpRequest& request) { return answer(request); }, options.http);
  running = http.get();
}

ViewServer::Impl::~Impl() {
  feed.finish();
  http->stop();
}

ViewServer::ViewServer(const Options& options, ViewSubject& subject)
    : impl_(std::make_unique<Impl>(options, subject)) {}

ViewServer::~ViewServer() = default;

int ViewServer::port() const { return impl_->http->port(); }
const std::string& ViewServer::token() const { return impl_->access.token(); }
std::size_t ViewServer::viewers() const { return impl_->feed.viewers(); }
double ViewServer::cpu_seconds() const { return impl_->counts().cpu_seconds; }

std::string ViewServer::url() const {
  Endpoint shown{impl_->options.endpoint.address, port()};
  if (shown.address == "0.0.0.0" || shown.address == "::") shown.address = own_address();
  const std::string page = "http://" + shown.in_words() + "/";
  return impl_->access.needs_token() ? page + "?token=" + token() : page;
}

void ViewServer::finish() { impl_->feed.finish(); }

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
  if (path == "/keyframes") return HttpReply::typed(binary_type(), feed.map().keyframes(since));
  if (path == "/points") return HttpReply::typed(binary_type(), feed.map().points(since));
  if (path == "/path") return HttpReply::typed(binary_type(), feed.map().path(since));
  if (path == "/loops") return HttpReply::json(feed.loops());
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
  feed.add_viewer();
  // Counts the viewer out, whichever way the stream ends.
  const std::shared_ptr<void> place(nullptr, [this](void*) { feed.remove_viewer(); });
  if (feed.viewers() > options.viewers) {
    ++refused_viewers;
    HttpReply reply = HttpReply::text(503, "too many viewers; close another page");
    reply.fields.emplace_back("Retry-After", "10");
    return reply;
  }
  HttpReply reply;
  reply.type = "text/event-stream";
  reply.stream = [this, place, number = std::uint64_t{0}, repeats = 0](const SendPart& send) mutable {
    bool is_last = false;
    const std::uint64_t before = number;
    const std::string event = feed.next_event(number, is_last);
    // Once in a while also where nothing changes, so that pages know of the link.
    if (number == before && !is_last && ++repeats < kRepeat) return true;
    repeats = 0;
    const bool is_sent = send("retry: 1000\ndata: " + event + "\n\n");
    if (!is_sent) ++dropped_viewers;
    return is_sent && !is_last;
  };
  return reply;
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

ViewCounts ViewServer::Impl::counts() const {
  ViewCounts result = feed.map_counts();
  result.viewers = feed.viewers();
  result.viewers_refused = refused_viewers;
  result.viewers_dropped = dropped_viewers;
  result.requests_refused = refused_requests;
  const HttpServer* server = running;
  result.cpu_seconds = feed.cpu_seconds() + (server != nullptr ? server->cpu_seconds() : 0.0);
  return result;
}

}  // namespace roslam::telemetry
