// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string_view>

namespace roslam::telemetry {

/// A file of the page.
struct PageFile {
  std::string_view path;  ///< of its URL
  std::string_view type;
  std::string_view content;
};

/// The files of telemetry/view/page/, which are in the program.
std::span<const PageFile> page_files();

}  // namespace roslam::telemetry
