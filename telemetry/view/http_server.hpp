// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "telemetry/view/endpoint.hpp"
#include "telemetry/view/http.hpp"
#include "telemetry/view/request_gate.hpp"

namespace roslam::telemetry {

/// Answers HTTP requests on threads of low priority. Requests have no body. Whoever does not take an answer
/// is dropped, so that each thread is free again within seconds, but for streams to those who read them.
class HttpServer {
 public:
  struct Options {
    GateLimits gate;
    int threads = 12;                              ///< each answers one request at a time; a stream is one
    std::chrono::milliseconds send_time{3000};     ///< without progress, after which a reader is dropped
    std::chrono::milliseconds answer_time{20000};  ///< for an answer that is not a stream, in all
  };

  /// Throws InputError if it cannot listen there.
  HttpServer(const Endpoint& endpoint, HttpHandler handler) : HttpServer(endpoint, std::move(handler), {}) {}
  HttpServer(const Endpoint& endpoint, HttpHandler handler, const Options& options);
  ~HttpServer();

  int port() const;

  /// Ends all connections. A stream's function is not called any more.
  void stop();

  /// Processor time of its threads so far.
  double cpu_seconds() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace roslam::telemetry
