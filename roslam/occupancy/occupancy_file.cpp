// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/occupancy/occupancy_file.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <string_view>
#include <system_error>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr std::string_view kStates = "# Octomap OcTree binary file";  // first lines of .bt and .ot
constexpr std::string_view kProbabilities = "# Octomap OcTree file";
constexpr int kDepth = 16;  // of the smallest cells

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : name_(file.string()) {
    std::error_code error;
    std::ifstream in(file, std::ios::binary);
    if (!in || std::filesystem::is_directory(file, error))
      throw InputError(name_ + ": cannot be read; give the path of an OctoMap file (.bt, .ot)");
    bytes_.assign(std::istreambuf_iterator<char>(in), {});
  }

  OccupancyFile read() {
    read_header();
    const std::size_t begin = at_;
    std::size_t nodes = 0;
    if (count_ > 0) nodes = 1 + (file_.has_probabilities ? probabilities_below(0) : states_below(0));
    if (nodes != count_) fail("it has " + std::to_string(nodes) + " nodes, not " + std::to_string(count_));
    file_.nodes = bytes_.substr(begin, at_ - begin);
    return file_;
  }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw InputError(name_ + ": no usable OctoMap file, " + why);
  }

  std::string line() {
    const std::size_t end = bytes_.find('\n', at_);
    if (end == std::string::npos) fail("its header has no end");
    std::string result = bytes_.substr(at_, end - at_);
    at_ = end + 1;
    return result;
  }

  void read_header() {
    if (bytes_.empty()) fail("it is empty");
    if (bytes_.starts_with(kProbabilities)) {
      file_.has_probabilities = true;
    } else if (!bytes_.starts_with(kStates)) {
      fail("it does not begin with an OctoMap header");
    }
    std::string kind, word;
    while (word != "data") {
      std::istringstream words(line());
      word.clear();
      words >> word;
      if (word == "id") words >> kind;
      if (word == "size" && !(words >> count_)) fail("its header has no number of nodes");
      if (word == "res" && !(words >> file_.resolution)) fail("its header has no resolution");
    }
    if (kind != "OcTree") fail("it holds a tree of type '" + kind + "', not OcTree");
    if (!is_occupancy_resolution(file_.resolution)) fail("its resolution is not 0.001 to 10 metres");
  }

  std::uint8_t byte() {
    if (at_ >= bytes_.size()) fail("it ends too early");
    return static_cast<std::uint8_t>(bytes_[at_++]);
  }

  // Number of descendants of the node at the read position; two bits for each child: 1 free, 2 occupied, 3
  // has children.
  std::size_t states_below(int depth) {
    const unsigned low = byte(), states = low | static_cast<unsigned>(byte()) << 8;
    if (states == 0) fail("a node that should have children has none");
    std::size_t count = 0;
    for (unsigned child = 0; child < 8; ++child) {
      const unsigned state = states >> 2 * child & 3U;
      if (state == 0) continue;
      ++count;
      if (state == 3) count += states_below(below(depth));
    }
    return count;
  }

  // The same in .ot files: log odds, then one bit for each child.
  std::size_t probabilities_below(int depth) {
    if (bytes_.size() - at_ < sizeof(float)) fail("it ends too early");
    float value = 0.0F;
    std::memcpy(&value, bytes_.data() + at_, sizeof(float));
    at_ += sizeof(float);
    if (!std::isfinite(value)) fail("a node has no probability");
    const unsigned children = byte();
    if (children == 0 && depth == 0) fail("its tree has no cells");
    std::size_t count = 0;
    for (unsigned child = 0; child < 8; ++child)
      if ((children >> child & 1U) != 0)
        count += 1 + probabilities_below(depth == kDepth ? too_deep() : depth + 1);
    return count;
  }

  int below(int depth) { return depth + 1 == kDepth ? too_deep() : depth + 1; }
  int too_deep() const { fail("its tree is deeper than 16 levels"); }

  std::string name_;
  std::string bytes_;
  std::size_t at_ = 0;
  std::size_t count_ = 0;  // of nodes, by the header
  OccupancyFile file_;
};
}  // namespace

OccupancyFile read_occupancy_file(const std::filesystem::path& file) { return Reader(file).read(); }

std::string occupancy_header(bool has_probabilities, std::size_t nodes, double resolution) {
  std::ostringstream header;
  header.precision(std::numeric_limits<double>::max_digits10);
  header << (has_probabilities ? kProbabilities : kStates)
         << "\n# RO-SLAM, world frame, metres\nid OcTree\nsize " << nodes << "\nres " << resolution
         << "\ndata\n";
  return header.str();
}

bool is_occupancy_resolution(double resolution) { return resolution >= 0.001 && resolution <= 10.0; }

}  // namespace roslam
