// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dense/ply_reader.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
// A PLY type: its size in a binary file and its decoder. Size 0: unknown type.
struct Type {
  std::size_t size = 0;
  double (*read)(const char*) = nullptr;
};

template <typename Value>
constexpr Type type_of() {
  return {sizeof(Value), [](const char* bytes) {
            Value value;
            std::memcpy(&value, bytes, sizeof(Value));
            return static_cast<double>(value);
          }};
}

Type type_named(const std::string& name) {
  if (name == "float" || name == "float32") return type_of<float>();
  if (name == "double" || name == "float64") return type_of<double>();
  if (name == "uchar" || name == "uint8") return type_of<std::uint8_t>();
  if (name == "char" || name == "int8") return type_of<std::int8_t>();
  if (name == "ushort" || name == "uint16") return type_of<std::uint16_t>();
  if (name == "short" || name == "int16") return type_of<std::int16_t>();
  if (name == "uint" || name == "uint32") return type_of<std::uint32_t>();
  if (name == "int" || name == "int32") return type_of<std::int32_t>();
  return {};
}
}  // namespace

PlyReader::PlyReader(const std::filesystem::path& file) : name_(file.string()) {
  std::error_code error;
  std::ifstream in(file, std::ios::binary);
  if (!in || std::filesystem::is_directory(file, error))
    throw InputError(name_ + ": cannot be read; give the path of a PLY file");
  bytes_.assign(std::istreambuf_iterator<char>(in), {});
  read_header();
}

void PlyReader::fail(const std::string& why) const {
  throw InputError(name_ + ": no usable PLY file, " + why);
}

std::string_view PlyReader::line() {
  const std::size_t end = bytes_.find('\n', at_);
  if (end == std::string::npos) fail("its header has no end");
  std::string_view result = std::string_view(bytes_).substr(at_, end - at_);
  at_ = end + 1;
  if (!result.empty() && result.back() == '\r') result.remove_suffix(1);
  return result;
}

void PlyReader::read_header() {
  if (line() != "ply") fail("it does not begin with ply");
  bool has_format = false;
  while (true) {
    std::istringstream words{std::string(line())};
    std::string word;
    words >> word;
    if (word == "end_header") break;
    if (word == "comment") {
      std::string text;
      std::getline(words >> std::ws, text);
      comments_.push_back(text);
    }
    if (word == "format") {
      std::string format;
      words >> format;
      is_ascii_ = format == "ascii";
      if (!is_ascii_ && format != "binary_little_endian") fail("its format is " + format);
      has_format = true;
    } else if (word == "element") {
      PlyElement element;
      if (!(words >> element.name >> element.count)) fail("an element of its header has no count");
      elements_.push_back(element);
    } else if (word == "property") {
      PlyProperty property;
      words >> property.type;
      if (property.type == "list") words >> property.count_type >> property.type;
      if (!(words >> property.name) || elements_.empty()) fail("a property of its header is incomplete");
      for (const std::string& type : {property.type, property.count_type})
        if (!type.empty() && type_named(type).size == 0) fail("it has values of type " + type);
      elements_.back().properties.push_back(property);
    }
  }
  if (!has_format) fail("its header names no format");
  // Otherwise any count would be accepted, as such elements take no bytes.
  for (const PlyElement& element : elements_)
    if (element.properties.empty() && element.count > 0)
      fail("its element " + element.name + " has no properties");
}

double PlyReader::next(const std::string& type) {
  if (is_ascii_) return next_word();
  const Type t = type_named(type);
  if (bytes_.size() - at_ < t.size) fail("it ends too early");
  const double value = t.read(bytes_.data() + at_);
  at_ += t.size;
  return value;
}

double PlyReader::next_word() {
  constexpr std::string_view kSpace = " \t\r\n";
  at_ = bytes_.find_first_not_of(kSpace, at_);
  if (at_ == std::string::npos) {
    at_ = bytes_.size();
    fail("it ends too early");
  }
  const std::size_t end = std::min(bytes_.find_first_of(kSpace, at_), bytes_.size());
  double value = 0.0;
  const auto result = std::from_chars(bytes_.data() + at_, bytes_.data() + end, value);
  if (result.ec != std::errc{} || result.ptr != bytes_.data() + end)
    fail("'" + bytes_.substr(at_, std::min<std::size_t>(end - at_, 20)) + "' is not a number");
  at_ = end;
  return value;
}

}  // namespace roslam
