// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "telemetry/view/http_server.hpp"
#include "telemetry/view/view_subject.hpp"

namespace roslam::telemetry {

/// Serves a page that shows a run, and its state for other programs (docs/view.md). While nobody looks it
/// does nothing; while somebody does, it takes a snapshot of the map at most once a second and less often if
/// that takes long. Never waits for the run, and the run never for it.
class ViewServer {
 public:
  struct Options {
    Endpoint endpoint;
    std::string token;        ///< empty: a random one
    std::size_t viewers = 4;  ///< pages at a time; more are refused
    HttpServer::Options http;
  };

  /// subject must outlive the server. Throws InputError if it cannot listen there.
  ViewServer(const Options& options, ViewSubject& subject);
  ~ViewServer();

  int port() const;

  /// For the user: the address of the page, with the token where one is needed.
  std::string url() const;
  const std::string& token() const;

  /// Pages that are open.
  std::size_t viewers() const;

  /// Processor time of its threads so far.
  double cpu_seconds() const;

  /// Lets the open pages know the last state, within half a second, and ends.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace roslam::telemetry
