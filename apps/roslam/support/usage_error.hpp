// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace roslam::app {

/// Explains in one line why the program could not parse its arguments. An unknown command or option, with the
/// most similar that exists, takes precedence over what the parser found missing because of it.
std::string explain(const CLI::App& program, const CLI::ParseError& error);

}  // namespace roslam::app
