// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "apps/roslam/run/flight.hpp"

namespace roslam::app {

/// Prints what a flight found and what was doubtful about it.
void print_summary(const Flight& flight, const FlightArguments& arguments);

/// Prints how many keyframes were restored, for --restore.
void print_restoration(const Flight& flight);

}  // namespace roslam::app
