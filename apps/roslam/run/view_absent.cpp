// SPDX-License-Identifier: BSD-3-Clause
// In place of view_session.cpp and view.cpp in a program without the web page.
#include "apps/roslam/run/view_session.hpp"
#include "apps/roslam/support/commands.hpp"
#include "roslam/common/error.hpp"

namespace roslam::app {

struct ViewSession::Impl {};

void ViewSession::require_free(const std::string& endpoint) {
  throw InputError(
      "--view " + endpoint +
      ": this program was built without the web page; install libcpp-httplib-dev and build anew");
}

ViewSession::ViewSession(const Setup& setup) { require_free(setup.endpoint); }

ViewSession::~ViewSession() = default;
FrameSource& ViewSession::source() { throw UsageError("no web page"); }
std::stop_token ViewSession::stop_token() const { return {}; }
void ViewSession::add(const Frame&, const FrameResult&) {}
void ViewSession::begin_saving() {}

void add_view_command(CLI::App&) {}

}  // namespace roslam::app
