// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>

#include "evaluation/plots/markdown_table.hpp"

namespace roslam::evaluation {

/// A self-contained page of text, tables and images, without external resources or scripts. All text is
/// plain: characters special to HTML are escaped.
class HtmlPage {
 public:
  explicit HtmlPage(const std::string& title);

  void add_heading(const std::string& words);
  void add_text(const std::string& words);
  /// The first row is the header.
  void add_table(const std::vector<TableRow>& rows);
  /// image: CV_8UC3, embedded as JPEG. Throws Error if it cannot be encoded.
  void add_image(const cv::Mat& image, const std::string& caption);
  /// Embeds a JPEG file unchanged; does nothing if it does not exist.
  void add_image_file(const std::filesystem::path& file, const std::string& caption);
  /// Preformatted text in a collapsed section.
  void add_hidden(const std::string& title, const std::string& text);

  /// The whole page.
  std::string html() const;

 private:
  void add_jpeg(std::string_view bytes, const std::string& caption);

  std::string title_;
  std::string body_;
};

/// Base64 encoding (RFC 4648, section 4).
std::string base64(std::string_view bytes);

}  // namespace roslam::evaluation
