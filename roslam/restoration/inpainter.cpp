// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/inpainter.hpp"

#include <string>

#include "roslam/common/error.hpp"
#include "roslam/common/resources.hpp"
#include "roslam/inference/image_planes.hpp"

namespace roslam {

namespace {
constexpr std::array kKinds{Movable::kPerson, Movable::kCar, Movable::kBicycle, Movable::kUnknown};

std::string file_for(Movable kind) { return "roslam-restorer-" + std::string(name_of(kind)) + ".onnx"; }

cv::Mat channel(cv::Mat& blob, int number) {
  return {kCropSide, kCropSide, CV_32FC1, blob.ptr<float>(0, number)};
}

// 1 x 5 x 256 x 256: RGB from 0 to 1, the hole and the square.
cv::Mat network_input(const cv::Mat& crop, const cv::Mat& hole, const cv::Rect& square) {
  const std::array sizes{1, 5, kCropSide, kCropSide};
  cv::Mat blob(static_cast<int>(sizes.size()), sizes.data(), CV_32FC1, cv::Scalar(0));
  write_rgb_planes(crop, blob);
  channel(blob, 3).setTo(1.0, hole);
  channel(blob, 4)(square & cv::Rect(0, 0, kCropSide, kCropSide)).setTo(1.0);
  return blob;
}

cv::Mat image_of(cv::Mat output) {
  std::array<cv::Mat, 3> channels;
  for (int c = 0; c < 3; ++c)
    channel(output, 2 - c).convertTo(channels[static_cast<std::size_t>(c)], CV_8U, 255.0);
  cv::Mat image;
  cv::merge(channels, image);
  return image;
}

bool is_image(const cv::Mat& blob) {
  return blob.dims == 4 && blob.size[0] == 1 && blob.size[1] == 3 && blob.size[2] == kCropSide &&
         blob.size[3] == kCropSide;
}
}  // namespace

GanInpainter::GanInpainter(const std::filesystem::path& folder, InferenceBackend backend) {
  for (std::size_t i = 0; i < kKinds.size(); ++i) {
    const auto file = folder / file_for(kKinds[i]);
    networks_[i] = {file, load_inference(file, backend)};
  }
}

cv::Mat GanInpainter::inpaint(const cv::Mat& crop, const cv::Mat& hole, const cv::Rect& square,
                              Movable kind) {
  CV_Assert(crop.type() == CV_8UC3 && crop.size() == cv::Size(kCropSide, kCropSide) &&
            hole.size() == crop.size());
  const Movable known = kind == Movable::kNone ? Movable::kUnknown : kind;
  const Network& network = networks_.at(static_cast<std::size_t>(known) - 1);
  const cv::Mat output = network.inference->run(network_input(crop, hole, square));
  if (!is_image(output)) {
    throw ModelError(
        network.file.string() +
        ": its output is not an image of 256x256 pixels; install the model that belongs to this version");
  }
  return image_of(output);
}

std::filesystem::path find_restoration_models() {
  std::filesystem::path folder;
  for (const Movable kind : kKinds) {
    const auto file = find_resource(file_for(kind));
    if (file.empty()) return {};
    folder = file.parent_path();
  }
  return folder;
}

}  // namespace roslam
