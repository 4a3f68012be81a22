// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/composition/person_cutout.hpp"

#include <algorithm>
#include <cctype>
#include <opencv2/imgproc.hpp>
#include <string_view>
#include <system_error>

#include "roslam/common/error.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::simulation {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMaskEnding = "_mask";
constexpr int kPerson = 128;    // a mask that was resized has values between 0 and 255 along its edges
constexpr int kMinHeight = 16;  // pixels; fewer are a speck, not a person

bool is_person_image(const fs::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool is_image = ending == ".jpg" || ending == ".jpeg" || ending == ".png";
  return is_image && !file.stem().string().ends_with(kMaskEnding);
}

cv::Mat required(const fs::path& file, const ImageFile& read) {
  if (!read.error.empty())
    throw InputError(file.string() + ": " + read.error + "; replace it or remove the person from the folder");
  return read.image;
}

std::string in_words(const cv::Size& size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

}  // namespace

std::vector<PersonFiles> people_in(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    throw InputError(folder.string() +
                     ": no such folder; give one with images of people, NAME.jpg and NAME_mask.png");
  }
  std::vector<PersonFiles> people;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const fs::path& file = entry.path();
    if (!is_person_image(file)) continue;
    people.push_back({file, folder / (file.stem().string() + std::string(kMaskEnding) + ".png")});
  }
  if (error) throw InputError(folder.string() + ": cannot be listed; check its permissions");
  if (people.empty()) {
    throw InputError(folder.string() +
                     ": holds no people; put images NAME.jpg or NAME.png there, each with NAME_mask.png, "
                     "255 = person");
  }
  std::sort(people.begin(), people.end(),
            [](const PersonFiles& a, const PersonFiles& b) { return a.image < b.image; });
  for (const auto& person : people) {
    if (fs::exists(person.mask, error)) continue;
    throw InputError(person.image.string() + ": has no mask " + person.mask.filename().string() +
                     " beside it; add one, 255 = person, or remove the image");
  }
  return people;
}

PersonCutout read_person(const PersonFiles& files) {
  const cv::Mat colour = required(files.image, read_colour_image(files.image));
  const cv::Mat mask = required(files.mask, read_label_image(files.mask));
  if (mask.size() != colour.size()) {
    throw InputError(files.mask.string() + ": is " + in_words(mask.size()) + " but its image " +
                     in_words(colour.size()) + " pixels; make the mask as large as the image");
  }
  const cv::Mat person = mask >= kPerson;
  const cv::Rect box = cv::boundingRect(person);
  if (box.height < kMinHeight) {
    throw InputError(files.mask.string() + ": marks no person at least " + std::to_string(kMinHeight) +
                     " pixels high; mark the person with 255");
  }
  return {files.image.stem().string(), colour(box).clone(), person(box).clone()};
}

}  // namespace roslam::simulation
