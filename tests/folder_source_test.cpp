// SPDX-License-Identifier: BSD-3-Clause
// What all folders of datasets have in common: the order of frames, and files that are no data.
#include "tests/dataset_scene.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

class AnyFolder : public DatasetFolder {};

TEST_F(AnyFolder, FramesWhoseTimeDoesNotIncreaseAreLeftOut) {
  FolderListing listing{"a folder", small_camera(), {}};
  int n = 0;
  for (const auto& [time, segment] : std::vector<std::pair<double, int>>{
           {1.0, 0}, {2.0, 0}, {2.0, 0}, {1.5, 0}, {std::nan(""), 0}, {3.0, 0}, {0.5, 1}, {0.6, 0}}) {
    const fs::path file = folder_ / (std::to_string(n) + ".png");
    write_colour(file, cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(n++)));
    listing.frames.push_back({time, segment, file, {}, {}, std::nullopt});
  }
  listing.frames[1].T_world_camera = SE3(Eigen::Quaterniond::Identity(), {std::nan(""), 0, 0});
  listing.inertial = {{-1.0, {}, {}}, {0.5, {}, {}}, {1.5, {}, {}}, {4.0, {}, {}}};
  FolderSource source(listing);
  const auto frames = all_frames(source);
  ASSERT_EQ(frames.size(), 4u);
  EXPECT_EQ(source.size(), 8u);
  const int images[] = {0, 1, 5, 6};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(frames[i].index, i);
    EXPECT_EQ(frames[i].colour.at<cv::Vec3b>(9, 9)[0], images[i]);
    EXPECT_EQ(source.files(i).colour.stem(), std::to_string(images[i]));
  }
  EXPECT_EQ(frames[3].segment, 1);
  EXPECT_FALSE(frames[1].T_world_camera);
  EXPECT_EQ(frames[0].inertial.size(), 1u);  // not that of two seconds before
  EXPECT_EQ(frames[1].inertial.size(), 1u);
  EXPECT_EQ(source.skipped().at("colour image without a time"), 1u);
  EXPECT_EQ(source.skipped().at("colour image with a time that is not later than that of the one before"),
            3u);
  EXPECT_TRUE(source.skipped_depth().empty());  // there is none at all

  listing.frames[0].depth = folder_ / "0.png";
  EXPECT_THROW(FolderSource{listing}, CalibrationError);  // of which unit?
  listing.frames.clear();
  EXPECT_THROW(FolderSource{listing}, InputError);
}

TEST_F(AnyFolder, HostileFilesAreRefusedWithOneLine) {
  EXPECT_EQ(dataset_format(folder_ / "absent"), std::nullopt);
  EXPECT_NE(refused().find("is no dataset that is known"), std::string::npos);
  fs::create_directories(folder_ / "mav0/cam0");
  fs::create_symlink("/dev/zero", folder_ / "mav0/cam0/data.csv");
  EXPECT_NE(refused({}, DatasetUse::kImages).find("cannot open it"), std::string::npos);
  put("mav0/cam0/sensor.yaml", std::string(50'000, '['));
  EXPECT_NE(refused({}, DatasetUse::kImages).find("not a valid YAML file"), std::string::npos);
  put("mav0/cam0/sensor.yaml", "intrinsics: [61, 58, 30.5, 25]\nresolution: [1e30, .nan]\nT_BS: {data: [" +
                                   std::string("1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}\n"));
  fs::remove(folder_ / "mav0/cam0/data.csv");
  put("mav0/cam0/data.csv", "1,../../../etc/passwd\n");
  EXPECT_NE(refused({}, DatasetUse::kImages).find("'resolution'"), std::string::npos);
  const auto source = open_dataset(folder_, small_camera(), DatasetUse::kImages);
  EXPECT_FALSE(source->next());
  EXPECT_EQ(source->skipped().size(), 1u);
}

}  // namespace
}  // namespace roslam
