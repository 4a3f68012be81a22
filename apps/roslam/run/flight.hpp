// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "apps/roslam/run/mavlink.hpp"
#include "apps/roslam/support/sources.hpp"
#include "recording/run_folder.hpp"
#include "roslam/slam/run.hpp"
#include "roslam/slam/slam.hpp"

namespace roslam::app {

/// What can be asked of a flight.
struct FlightArguments {
  SourceArguments source;
  std::string out;
  std::string config;
  bool deterministic = false;
  bool real_time = false;
  std::string model;       ///< weights in place of the shipped ones
  std::string vocabulary;  ///< words in place of the shipped ones
  bool no_loops = false;
  std::string map;      ///< to go on from; empty: none
  bool resume = false;  ///< go on with the run in `out`, whose results so far are kept
  bool localise_only = false;
  std::string dynamic;            ///< empty: as the options say
  std::string record;             ///< file to which a live camera is recorded; empty: none
  bool checkpoint_dense = false;  ///< save the dense map with each of them as well
  double checkpoint = 30.0;       ///< seconds between two saved maps; 0: none before the end
  bool video = false;
  std::optional<std::string> view;  ///< address and port of the web page; nothing: none
  bool no_dense = false;            ///< make no dense map
  bool restore = false;             ///< write the keyframes without what moves to the folder restored
  std::string models;               ///< folder of the networks that paint, in place of the shipped ones
  InferenceBackend backend = InferenceBackend::kAutomatic;  ///< what runs the networks
  MavlinkArguments mavlink;
  bool quiet = false;      ///< no progress
  bool overwrite = false;  ///< replace files in the folder that no run wrote
};

/// A flight that came to its end.
struct Flight {
  std::unique_ptr<FrameSource> source;
  std::unique_ptr<Slam> slam;
  recording::RunResults summary;
  recording::RunDescription description;
  std::size_t restored = 0;  ///< keyframes
  std::string recorded;      ///< in words, for --record
};

/// The options that the arguments ask for. Throws as read_options does.
Options options_of(const FlightArguments& arguments);

/// Flies through a source and writes what it finds to the folder `out`, also if the flight is interrupted or
/// fails. Without the weights of a network, or without a vocabulary, it flies without and says so. Throws
/// what the flight failed with, OutputError, or InputError if there is not a single pose.
Flight fly(const FlightArguments& arguments, const Options& options, const std::string& version,
           const std::stop_token& stop, const std::stop_token& urgent_stop = {});

}  // namespace roslam::app
