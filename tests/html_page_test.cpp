// SPDX-License-Identifier: BSD-3-Clause
// Reports to look at.
#include "evaluation/plots/html_page.hpp"

#include <gtest/gtest.h>

#include "recording/image_strip.hpp"

namespace roslam {

using namespace evaluation;
using namespace recording;
namespace {

// The vectors of RFC 4648, section 10.
TEST(Base64, IsAsTheStandardHasIt) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64(std::string("\xff\x00\xfe", 3)), "/wD+");
}

TEST(HtmlPage, ShowsTextAsItIs) {
  HtmlPage page("a < b & \"c\"");
  page.add_text("<script>alert(1)</script>");
  page.add_table({{"name", "value"}, {"<x>", "1"}});
  const std::string html = page.html();
  EXPECT_NE(html.find("<h1>a &lt; b &amp; &quot;c&quot;</h1>"), std::string::npos);
  EXPECT_NE(html.find("<td>&lt;x&gt;</td><td>1</td>"), std::string::npos);
  EXPECT_EQ(html.find("<script"), std::string::npos);
}

TEST(HtmlPage, HoldsItsImages) {
  HtmlPage page("images");
  page.add_image(cv::Mat(20, 30, CV_8UC3, cv::Scalar(1, 2, 3)), "a \"image\"");
  page.add_image_file("/nowhere/there_is_none.jpg", "none");
  const std::string html = page.html();
  EXPECT_NE(html.find("alt=\"a &quot;image&quot;\" src=\"data:image/jpeg;base64,/9j/"), std::string::npos);
  EXPECT_EQ(html.find("none"), std::string::npos);
}

// However long the sequence, the images that stay are spread over it evenly.
TEST(ImageStrip, KeepsImagesSpreadOverTheSequence) {
  for (const int length : {1, 3, 4, 7, 8, 9, 16, 17, 100, 1000}) {
    ImageStrip strip(4);
    for (int i = 0; i < length; ++i)
      if (strip.wants()) strip.add(cv::Mat(1, 1, CV_32SC1, cv::Scalar(i)));
    std::vector<int> kept;
    for (const cv::Mat& image : strip.images()) kept.push_back(image.at<int>(0));
    ASSERT_EQ(kept.size(), static_cast<std::size_t>(std::min(length, 4))) << length;
    EXPECT_EQ(kept.front(), 0);
    for (std::size_t i = 1; i < kept.size(); ++i) {
      EXPECT_GE(kept[i] - kept[i - 1], std::max(1, length / 9)) << length;
      EXPECT_LE(kept[i] - kept[i - 1], std::max(1, length / 2)) << length;
    }
  }
}

}  // namespace
}  // namespace roslam
