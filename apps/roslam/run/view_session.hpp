// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "roslam/sensors/frame_source.hpp"
#include "roslam/slam/slam.hpp"

namespace roslam::app {

/// The web page of a flight, for as long as the flight lasts.
class ViewSession {
 public:
  struct Setup {
    std::string endpoint;  ///< ADDRESS:PORT; empty: the default
    std::string run;       ///< id
    std::string name;      ///< of the source, as the user named it
    const Slam& slam;
    FrameSource& source;
    std::stop_token stop;  ///< of the flight
    std::function<void()> save;
  };

  /// Prints the page's address on stderr. Throws InputError if the page cannot be served there, or in a
  /// program without it.
  explicit ViewSession(const Setup& setup);

  /// Throws as the constructor does, before anything else is begun.
  static void require_free(const std::string& endpoint);

  /// Tells open pages that the run has ended.
  ~ViewSession();
  ViewSession(const ViewSession&) = delete;
  ViewSession& operator=(const ViewSession&) = delete;

  /// The source of the flight, which the page may pause.
  FrameSource& source();

  /// Requested by that of the flight and by the page.
  std::stop_token stop_token() const;

  /// On the tracker's thread, after each frame.
  void add(const Frame& frame, const FrameResult& result);

  /// The flight is over, its results are being written.
  void begin_saving();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace roslam::app
