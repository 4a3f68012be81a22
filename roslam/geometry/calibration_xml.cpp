// SPDX-License-Identifier: BSD-3-Clause
#include <string_view>

#include "roslam/common/error.hpp"
#include "roslam/geometry/calibration_file.hpp"

namespace roslam {

namespace {
constexpr int kMaxDepth = 16;  // of elements within each other

// The subset of XML that OpenCV writes: elements, attributes (ignored), text, comments.
class XmlReader {
 public:
  XmlReader(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  YAML::Node root() {
    skip_prologue();
    const Tag tag = get_tag();
    if (tag.name != "opencv_storage" || tag.is_end) fail();
    return tag.is_empty ? YAML::Node(YAML::NodeType::Map) : content_of(tag.name, 0);
  }

 private:
  struct Tag {
    std::string name;
    bool is_end = false;    // </name>
    bool is_empty = false;  // <name/>
  };

  [[noreturn]] void fail() const {
    throw InputError(name_ + ": not a valid XML file of OpenCV; write it with cv::FileStorage, or as YAML");
  }

  std::string_view up_to(std::string_view end) {
    const std::size_t found = text_.find(end, at_);
    if (found == std::string_view::npos) fail();
    const std::string_view result = text_.substr(at_, found - at_);
    at_ = found + end.size();
    return result;
  }

  bool skips(std::string_view begin, std::string_view end) {
    if (!text_.substr(at_).starts_with(begin)) return false;
    up_to(end);
    return true;
  }

  void skip_prologue() {
    while (true) {
      at_ = std::min(text_.find('<', at_), text_.size());
      if (!skips("<?", "?>") && !skips("<!--", "-->")) return;
    }
  }

  Tag get_tag() {
    if (at_ >= text_.size() || text_[at_] != '<') fail();
    ++at_;
    std::string_view inside = up_to(">");
    Tag tag;
    tag.is_end = inside.starts_with('/');
    if (tag.is_end) inside.remove_prefix(1);
    tag.is_empty = inside.ends_with('/');
    if (tag.is_empty) inside.remove_suffix(1);
    tag.name = inside.substr(0, inside.find_first_of(" \t\r\n"));
    if (tag.name.empty()) fail();
    return tag;
  }

  // Up to the end of the element.
  YAML::Node content_of(const std::string& name, int depth) {
    if (depth > kMaxDepth) fail();
    YAML::Node children;
    std::string text;
    while (true) {
      const std::size_t next = text_.find('<', at_);
      if (next == std::string_view::npos) fail();
      text += text_.substr(at_, next - at_);
      at_ = next;
      if (skips("<!--", "-->")) continue;
      const Tag tag = get_tag();
      if (tag.is_end) {
        if (tag.name != name) fail();
        return children.IsNull() ? YAML::Node(text) : children;
      }
      const YAML::Node child = tag.is_empty ? YAML::Node() : content_of(tag.name, depth + 1);
      const bool is_item = tag.name == "_";
      if (!children.IsNull() && children.IsSequence() != is_item) fail();
      is_item ? children.push_back(child) : children.force_insert(tag.name, child);
    }
  }

  std::string_view text_;
  const std::string& name_;
  std::size_t at_ = 0;
};
}  // namespace

YAML::Node nodes_of_xml(const std::string& text, const std::string& name) {
  return XmlReader(text, name).root();
}

}  // namespace roslam
