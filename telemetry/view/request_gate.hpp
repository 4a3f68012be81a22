// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "roslam/common/file_descriptor.hpp"
#include "telemetry/view/endpoint.hpp"

namespace roslam::telemetry {

/// A connection and what came over it and was not yet used.
struct Connection {
  FileDescriptor socket;
  std::string received;
  std::chrono::steady_clock::time_point deadline;  ///< of the header that is being received
};

/// What a gate lets through.
struct GateLimits {
  std::size_t header_bytes = 8192;
  std::size_t header_lines = 64;
  std::chrono::milliseconds header_time{3000};  ///< from its first byte to its last
  std::chrono::milliseconds idle_time{15000};   ///< between two requests
  std::size_t connections = 64;                 ///< that wait for a request; of more, the oldest is closed
  std::size_t requests = 32;                    ///< that wait for an answer; of more, the newest is refused
};

/// Listens and gathers the headers of requests on one thread, so that connections that send slowly, nothing
/// or too much hold up no other: only whole headers within the limits are handed on. Connections do not
/// block.
class RequestGate {
 public:
  /// Throws InputError if it cannot listen there, naming the remedy.
  RequestGate(const Endpoint& endpoint, const GateLimits& limits = {});
  ~RequestGate();

  int port() const { return port_; }

  /// The next connection with a whole header, whose bytes and those after it are in `received`; nothing once
  /// the gate is closed. May be called from several threads.
  std::optional<Connection> next();

  /// Takes back a connection whose request was answered, for another.
  void put_back(Connection connection);

  /// Closes all connections in the gate and ends next().
  void close();

  /// Of the gate's thread, so far.
  double cpu_seconds() const { return cpu_seconds_; }

 private:
  void work(const std::stop_token& stop);
  void accept_all();
  bool receive(Connection& connection);
  bool hand_on(Connection& connection);
  void take_returned();
  int wait_time() const;
  void wake();

  GateLimits limits_;
  FileDescriptor listener_;
  FileDescriptor wake_;
  int port_ = 0;
  // Used by the gate's thread.
  std::list<Connection> waiting_;
  std::optional<std::chrono::steady_clock::time_point> accept_after_;  // no connection is accepted before
  mutable std::mutex mutex_;                                           // guards what follows
  std::condition_variable changed_;
  std::deque<Connection> whole_;
  std::list<Connection> returned_;
  bool is_closed_ = false;
  std::atomic<double> cpu_seconds_ = 0.0;
  std::jthread thread_;
};

}  // namespace roslam::telemetry
