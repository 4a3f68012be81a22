// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/run/view_session.hpp"

#include <cstdlib>
#include <iostream>
#include <optional>
#include <utility>

#include "apps/roslam/support/pausable_source.hpp"
#include "telemetry/view/flight_view.hpp"
#include "telemetry/view/view_server.hpp"

namespace roslam::app {

namespace {
telemetry::FlightView::Setup view_setup(const ViewSession::Setup& setup, PausableSource& source,
                                        std::stop_source& stop) {
  telemetry::FlightView::Setup result;
  result.run = setup.run;
  result.source = setup.name;
  result.in_source = setup.source.size().value_or(0);
  result.save = setup.save;
  result.stop = [&stop] { stop.request_stop(); };
  if (!setup.source.is_live()) result.pause = [&source](bool is_paused) { source.pause(is_paused); };
  return result;
}

telemetry::ViewServer::Options view_options(const std::string& endpoint) {
  telemetry::ViewServer::Options options;
  options.endpoint = telemetry::parse_endpoint(endpoint);
  if (const char* token = std::getenv("ROSLAM_VIEW_TOKEN"); token != nullptr) options.token = token;
  return options;
}
}  // namespace

struct ViewSession::Impl {
  explicit Impl(const Setup& setup)
      : forward(setup.stop, [this] { stop.request_stop(); }),
        source(setup.source, setup.slam.mode() == Mode::kRealTime),
        view(setup.slam, view_setup(setup, source, stop)),
        server(view_options(setup.endpoint), view) {}

  std::stop_source stop;
  std::stop_callback<std::function<void()>> forward;
  PausableSource source;
  telemetry::FlightView view;
  telemetry::ViewServer server;  // last: its threads use the rest
};

ViewSession::ViewSession(const Setup& setup) : impl_(std::make_unique<Impl>(setup)) {
  std::cerr << "view: " << impl_->server.url() << "\n";
}

void ViewSession::require_free(const std::string& endpoint) {
  const telemetry::RequestGate gate(telemetry::parse_endpoint(endpoint));
}

ViewSession::~ViewSession() {
  impl_->view.set_phase(telemetry::RunPhase::kEnded);
  impl_->server.finish();
}

FrameSource& ViewSession::source() { return impl_->source; }
std::stop_token ViewSession::stop_token() const { return impl_->stop.get_token(); }
void ViewSession::add(const Frame& frame, const FrameResult& result) { impl_->view.add(frame, result); }
void ViewSession::begin_saving() { impl_->view.set_phase(telemetry::RunPhase::kSaving); }

}  // namespace roslam::app
