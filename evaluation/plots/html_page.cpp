// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/plots/html_page.hpp"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "roslam/common/error.hpp"

namespace roslam::evaluation {

namespace {
constexpr int kQuality = 88;  // JPEG, in percent

constexpr auto kStyle = R"(
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 1200px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.6em; } h2 { font-size: 1.2em; margin-top: 2em; border-bottom: 1px solid #ddd; }
table { border-collapse: collapse; margin: 1em 0; } th, td { padding: .2em .9em; text-align: right; }
th:first-child, td:first-child { text-align: left; } th { border-bottom: 1px solid #999; }
tr:nth-child(even) td { background: #f6f6f6; }
figure { margin: 1em 0; } img { max-width: 100%; } figcaption { color: #555; }
pre { background: #f6f6f6; padding: 1em; overflow-x: auto; }
)";

// Bytes that are not UTF-8 are kept: browsers show a replacement character.
std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&') {
      result += "&amp;";
    } else if (c == '<') {
      result += "&lt;";
    } else if (c == '>') {
      result += "&gt;";
    } else if (c == '"') {
      result += "&quot;";
    } else {
      result += c;
    }
  }
  return result;
}

std::string element(const std::string& tag, const std::string& words) {
  return "<" + tag + ">" + escaped(words) + "</" + tag + ">";
}
}  // namespace

std::string base64(std::string_view bytes) {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < count ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kLetters[group >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

HtmlPage::HtmlPage(const std::string& title) : title_(title) {}

void HtmlPage::add_heading(const std::string& words) { body_ += element("h2", words) + "\n"; }

void HtmlPage::add_text(const std::string& words) { body_ += element("p", words) + "\n"; }

void HtmlPage::add_table(const std::vector<TableRow>& rows) {
  body_ += "<table>\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    body_ += "<tr>";
    for (const std::string& cell : rows[i]) body_ += element(i == 0 ? "th" : "td", cell);
    body_ += "</tr>\n";
  }
  body_ += "</table>\n";
}

void HtmlPage::add_image(const cv::Mat& image, const std::string& caption) {
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, kQuality}))
    throw Error("an image of the report could not be encoded as JPEG");
  add_jpeg({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, caption);
}

void HtmlPage::add_image_file(const std::filesystem::path& file, const std::string& caption) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  if (!bytes.empty()) add_jpeg(bytes, caption);
}

void HtmlPage::add_jpeg(std::string_view bytes, const std::string& caption) {
  body_ += "<figure><img alt=\"" + escaped(caption) + "\" src=\"data:image/jpeg;base64," + base64(bytes) +
           "\">" + element("figcaption", caption) + "</figure>\n";
}

void HtmlPage::add_hidden(const std::string& title, const std::string& text) {
  body_ += "<details>" + element("summary", title) + element("pre", text) + "</details>\n";
}

std::string HtmlPage::html() const {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">" + element("title", title_) +
         "<style>" + kStyle + "</style></head>\n<body>\n" + element("h1", title_) + "\n" + body_ +
         "</body>\n</html>\n";
}

}  // namespace roslam::evaluation
