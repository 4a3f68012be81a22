// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>

#include "roslam/evaluation/markdown_table.hpp"

namespace roslam {

/// A page of text, tables and pictures in one file: it asks for nothing from elsewhere and needs no scripts.
/// All text is plain; what is special to HTML in it is shown as it is.
class HtmlPage {
 public:
  explicit HtmlPage(const std::string& title);

  void add_heading(const std::string& words);
  void add_text(const std::string& words);
  /// The first row is the head.
  void add_table(const std::vector<TableRow>& rows);
  /// picture: CV_8UC3, kept as JPEG.
  void add_picture(const cv::Mat& picture, const std::string& caption);
  /// A JPEG file as it is; nothing if it is not there.
  void add_picture_file(const std::filesystem::path& file, const std::string& caption);
  /// Text that is shown as it is once the reader asks for it.
  void add_hidden(const std::string& title, const std::string& text);

  /// The whole page.
  std::string html() const;

 private:
  void add_jpeg(std::string_view bytes, const std::string& caption);

  std::string title_;
  std::string body_;
};

/// Bytes as text by RFC 4648, section 4.
std::string base64(std::string_view bytes);

}  // namespace roslam
