// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <string>

namespace roslam::app {

/// Characters in a line of the terminal: COLUMNS, else what the terminal on stdout reports, else 80; from 40
/// to 120.
std::size_t terminal_width();

/// Lays out --help in lines of a limited length. Footers are texts of paragraphs, of example commands and of
/// lists in two aligned columns, both indented.
class HelpFormatter : public CLI::Formatter {
 public:
  explicit HelpFormatter(std::size_t width) : width_(width) {}

  std::string make_description(const CLI::App* app) const override;
  std::string make_usage(const CLI::App* app, std::string name) const override;
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_subcommand(const CLI::App* command) const override;
  std::string make_footer(const CLI::App* app) const override;

 private:
  std::size_t width_;
};

}  // namespace roslam::app
