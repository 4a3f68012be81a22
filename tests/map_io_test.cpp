// SPDX-License-Identifier: BSD-3-Clause
// Map files: exact round trip, rejection of damaged files, merging of two maps.
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "roslam/common/binary.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/map_io/map_file.hpp"
#include "roslam/map_io/merge_maps.hpp"
#include "roslam/options/options.hpp"
#include "roslam/options/settings.hpp"
#include "tests/loop_scene.hpp"
#include "tests/scratch.hpp"

namespace roslam::scene {
namespace {

const std::vector<float> kScales{1.0F, 1.2F, 1.44F, 1.728F};

class Atlas : public testing::Test {
 protected:
  Atlas() {
    scene_.build_ring();
    std::vector<std::vector<Descriptor>> images;
    for (int i = 0; i < 60; ++i) images.push_back(scene_.view(WallFlight::on_ring(0.11 * i))->descriptors);
    vocabulary_ =
        std::make_shared<const Vocabulary>(Vocabulary::train(images, {.branching = 10, .depth = 3}));
  }
  ~Atlas() override { std::filesystem::remove_all(file_); }

  // A flight along a part of the ring, without drift; then some keyframes and landmarks are removed.
  SavedMap fly(double from, double to, double drift = 0.0) {
    WallFlight flight = scene_;
    Map map(kScales);
    KeyframeDatabase places(vocabulary_);
    for (double angle = from; angle < to; angle += 0.05) {
      const KeyframeId id = flight.fly_to(WallFlight::on_ring(angle), drift, map);
      places.add(id, places.describe(*map.find(id)->view));
    }
    map.remove_keyframe(KeyframeId{2}, KeyframeId{1});
    places.remove(KeyframeId{2});
    map.remove_landmark(LandmarkId{7});
    map.add_loop(KeyframeId{2}, KeyframeId{4},
                 map.T_camera_world(KeyframeId{4}) * map.T_camera_world(KeyframeId{2}).inverse());
    return SavedMap::of(flight.camera(), map, &places);
  }

  static std::string read(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  static std::string error_of(const std::function<void()>& action) {
    try {
      action();
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  }

  WallFlight scene_{11};
  std::shared_ptr<const Vocabulary> vocabulary_;
  const std::filesystem::path file_ = scratch_path(".roslam");
};

TEST_F(Atlas, IdsAreWithoutGapsAndNothingElseChanges) {
  const SavedMap saved = fly(0.0, 0.6);
  const Map& map = saved.map;
  EXPECT_EQ(map.keyframe_count(), map.keyframe_slots());
  EXPECT_EQ(map.landmark_count(), map.landmark_slots());
  EXPECT_EQ(saved.words.size(), map.keyframe_count());
  ASSERT_EQ(map.loops().size(), 1U);
  EXPECT_EQ(map.loops().front().from, KeyframeId{1}) << "the one that the removed one hangs on";
  EXPECT_EQ(map.loops().front().to, KeyframeId{3});
  for (const LandmarkId id : map.landmark_ids()) {
    for (const auto& [keyframe, point] : map.find(id)->observations)
      EXPECT_EQ(map.find(keyframe)->landmarks[point], id);
  }
}

TEST_F(Atlas, WhatIsWrittenIsReadBitByBit) {
  const SavedMap saved = fly(0.0, 0.6);
  save_map(file_, saved);
  const SavedMap loaded = load_map(file_);
  EXPECT_EQ(loaded.name, file_.string());
  EXPECT_EQ(loaded.camera, saved.camera);
  EXPECT_EQ(loaded.vocabulary, vocabulary_->fingerprint());
  EXPECT_EQ(loaded.words, saved.words);
  EXPECT_EQ(encode_map(loaded), encode_map(saved));
  ASSERT_EQ(loaded.map.keyframe_count(), saved.map.keyframe_count());
  for (const KeyframeId id : saved.map.keyframe_ids()) {
    const Keyframe& a = *saved.map.find(id);
    const Keyframe& b = *loaded.map.find(id);
    EXPECT_EQ(a.T_camera_world.matrix(), b.T_camera_world.matrix());
    EXPECT_EQ(a.timestamp, b.timestamp);
    EXPECT_EQ(a.landmarks, b.landmarks);
    EXPECT_EQ(a.view->descriptors, b.view->descriptors);
    EXPECT_EQ(a.view->depths, b.view->depths);
  }
  for (const LandmarkId id : saved.map.landmark_ids()) {
    const Landmark& a = *saved.map.find(id);
    const Landmark& b = *loaded.map.find(id);
    EXPECT_EQ(a.position, b.position);
    EXPECT_EQ(a.descriptor, b.descriptor);
    EXPECT_EQ(a.max_distance, b.max_distance);
    EXPECT_EQ(a.observations.size(), b.observations.size());
  }
}

TEST_F(Atlas, AnEmptyMapComesBackEmpty) {
  save_map(file_, SavedMap::of(scene_.camera(), Map(kScales), nullptr));
  const SavedMap loaded = load_map(file_);
  EXPECT_EQ(loaded.map.keyframe_count(), 0U);
  EXPECT_TRUE(loaded.map.submaps().empty());
}

TEST_F(Atlas, EveryTruncationAndEveryFlippedByteIsNoticed) {
  save_map(file_, fly(0.0, 0.25));
  const std::string good = read(file_);
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 300; ++trial) {
    const std::size_t at = trial < 100 ? static_cast<std::size_t>(trial) : random() % good.size();
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ (1 << (random() % 8)));
    write_file(file_, bad);
    EXPECT_NE(error_of([&] { load_map(file_); }).find(file_.string()), std::string::npos) << "byte " << at;
    write_file(file_, good.substr(0, at));
    EXPECT_NE(error_of([&] { load_map(file_); }).find(file_.string()), std::string::npos) << "length " << at;
  }
}

// As written by a faulty program: the checksum is valid and the content is not.
TEST_F(Atlas, ContentThatContradictsItselfGivesAnErrorOrAMap) {
  const std::string good = encode_map(fly(0.0, 0.25));
  std::mt19937_64 random(5);
  int refused = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    std::string bad = good;
    const std::size_t at = trial % 2 == 0 ? random() % 200 : random() % good.size();
    bad[at] = static_cast<char>(random());
    refused += error_of([&] { decode_map(bad, "map"); }).empty() ? 0 : 1;
  }
  EXPECT_GT(refused, 300);
  for (std::size_t length = 0; length < good.size(); length += 97)
    EXPECT_NE(error_of([&] { decode_map(good.substr(0, length), "map"); }), "") << length;
  EXPECT_NE(error_of([&] { decode_map(good + "x", "map"); }), "");
}

TEST_F(Atlas, SaysWhatIsWrongWithAFile) {
  const auto expect_error = [&](const std::string& part) {
    const std::string error = error_of([&] { load_map(file_); });
    EXPECT_NE(error.find(part), std::string::npos) << error;
    EXPECT_EQ(error.find(file_.string() + ": "), 0U) << error;
  };
  expect_error("no such file");
  write_file(file_, "");
  expect_error("empty");
  write_file(file_, "ply\nformat ascii 1.0\n");
  expect_error("not a map");
  std::filesystem::resize_file(file_, std::uintmax_t{2000} << 20);  // sparse
  expect_error("not a map");
  std::filesystem::resize_file(file_, std::uintmax_t{3000} << 20);
  expect_error("more than a map may have");
  vocabulary_->save(file_);
  expect_error("not a map");
  save_map(file_, fly(0.0, 0.25));
  std::string bytes = read(file_);
  bytes[8] = 5;
  write_file(file_, bytes);
  expect_error("version 5");
}

TEST_F(Atlas, KeepsTheLensModel) {
  SavedMap saved = fly(0.0, 0.25);
  const auto version = [&] { return static_cast<int>(read(file_)[8]); };
  save_map(file_, saved);
  const int before = version();
  EXPECT_LT(before, 3);
  for (const auto& [model, coefficients] : std::vector<std::pair<const char*, std::vector<double>>>{
           {"pinhole", {0.1, -0.05, 0.001, 0.002, 0.01, 0.02, -0.03, 0.04}},
           {"fisheye", {0.01, -0.002, 0.0003, -0.0004}}}) {
    saved.camera.set_lens(model, coefficients);
    save_map(file_, saved);
    EXPECT_EQ(version(), 3) << model;
    const SavedMap loaded = load_map(file_);
    EXPECT_EQ(loaded.camera.model, saved.camera.model);
    EXPECT_EQ(loaded.camera.distortion, saved.camera.distortion);
    EXPECT_EQ(encode_map(loaded), encode_map(saved));
    loaded.require_fits(saved.camera, kScales);
    Camera other = saved.camera;
    other.distortion[3] += 1e-4;
    EXPECT_NE(error_of([&] { loaded.require_fits(other, kScales); }), "") << model;
  }
  Camera pinhole = saved.camera;
  pinhole.model = LensModel::kPinhole;
  EXPECT_NE(error_of([&] { load_map(file_).require_fits(pinhole, kScales); }), "");
  saved.camera.set_lens("pinhole", {0.1, -0.05, 0.001, 0.002, 0.01});
  save_map(file_, saved);
  EXPECT_EQ(version(), before) << "earlier programs read what they know";
}

TEST_F(Atlas, AMapOfAnotherCameraIsRefused) {
  const SavedMap saved = fly(0.0, 0.25);
  saved.require_fits(scene_.camera(), kScales);
  Camera other = scene_.camera();
  other.fps = 15.0;
  saved.require_fits(other, kScales);
  other.fx += 1.0;
  EXPECT_NE(error_of([&] { saved.require_fits(other, kScales); }).find("another camera"), std::string::npos);
  EXPECT_NE(error_of([&] { saved.require_fits(scene_.camera(), {}); }).find("levels"), std::string::npos);
}

TEST_F(Atlas, WordsOfAnotherVocabularyAreMadeAnew) {
  SavedMap saved = fly(0.0, 0.25);
  KeyframeDatabase same(vocabulary_);
  saved.index(same);
  saved.vocabulary ^= 1;
  for (auto& bag : saved.words) bag = {{1, 1.0F}};
  KeyframeDatabase anew(vocabulary_);
  saved.index(anew);
  for (const KeyframeId id : saved.map.keyframe_ids()) {
    ASSERT_NE(same.find(id), nullptr);
    ASSERT_NE(anew.find(id), nullptr);
    EXPECT_EQ(*same.find(id), *anew.find(id));
  }
  // Words beyond the vocabulary, as of a file that was tampered with.
  KeyframeDatabase index(vocabulary_);
  index.add(KeyframeId{0}, {{0xfffffff0U, 1.0F}});
  EXPECT_EQ(index.size(), 0U);
}

TEST_F(Atlas, MapsThatOverlapBecomeOne) {
  const SavedMap first = fly(0.0, 1.5);
  // Another session, which began elsewhere and so has its own frame.
  SavedMap second = fly(1.0, 2.5);
  const SE3 T_theirs_ours = SE3::exp((Vector6d() << 3, -2, 1, 0.2, 0.3, -0.4).finished());
  for (const KeyframeId id : second.map.keyframe_ids()) {
    Keyframe& keyframe = *second.map.find(id);
    keyframe.T_camera_world = keyframe.T_camera_world * T_theirs_ours.inverse();
  }
  for (const LandmarkId id : second.map.landmark_ids()) {
    Landmark& landmark = *second.map.find(id);
    landmark.position = T_theirs_ours * landmark.position;
    landmark.normal = T_theirs_ours.rotation() * landmark.normal;
  }
  const SavedMap merged = merge_maps(first, second, vocabulary_, loop_settings(Options{}));
  EXPECT_EQ(merged.map.submaps().size(), 1U);
  EXPECT_EQ(merged.map.session(), 1U);
  EXPECT_EQ(merged.map.keyframe_count(), first.map.keyframe_count() + second.map.keyframe_count());
  EXPECT_LT(merged.map.landmark_count(), first.map.landmark_count() + second.map.landmark_count());
  // Each keyframe is where the camera was: at its place on the ring, in the coordinates of the first map.
  for (const KeyframeId id : merged.map.keyframe_ids()) {
    const Keyframe& keyframe = *merged.map.find(id);
    const double start = keyframe.session == 0 ? 0.0 : 1.0;
    const SE3 truth = WallFlight::on_ring(start + 0.05 * static_cast<double>(keyframe.frame_index));
    EXPECT_LT((truth * keyframe.T_camera_world.inverse()).translation().norm(), 0.05) << id.value;
  }
  save_map(file_, merged);
  EXPECT_EQ(encode_map(load_map(file_)), encode_map(merged));
}

TEST_F(Atlas, MapsThatContainOneAnotherAreNotMerged) {
  SavedMap whole = fly(0.0, 1.5);
  whole.name = "whole";
  SavedMap part = SavedMap::of(whole.camera, whole.map, nullptr);
  part.name = "part";
  const auto merge = [&](const SavedMap& first, const SavedMap& second) {
    return error_of([&] { merge_maps(first, second, vocabulary_, loop_settings(Options{})); });
  };
  EXPECT_EQ(merge(whole, part).find("part: whole contains all of its keyframes"), 0U);
  part.map.remove_keyframe(KeyframeId{0}, KeyframeId{1});
  part = SavedMap::of(whole.camera, part.map, nullptr);
  part.name = "part";
  EXPECT_EQ(merge(whole, part).find("part: whole contains all of its keyframes"), 0U);
  EXPECT_EQ(merge(part, whole).find("part: whole contains all of its keyframes"), 0U);
}

TEST_F(Atlas, KeyframesOfBothMapsAreInsertedOnce) {
  const SavedMap whole = fly(0.0, 1.5);
  const auto without = [&](bool is_left_out(std::size_t, std::size_t)) {
    SavedMap all = SavedMap::of(whole.camera, whole.map, nullptr);
    Map& map = all.map;
    const auto ids = map.keyframe_ids();
    const KeyframeId anchor = ids[ids.size() / 2];
    for (const KeyframeId id : ids) {
      if (is_left_out(id.index(), ids.size())) map.remove_keyframe(id, anchor);
    }
    return SavedMap::of(whole.camera, map, nullptr);
  };
  const SavedMap first = without([](std::size_t i, std::size_t n) { return i > 2 * n / 3; });
  const SavedMap second = without([](std::size_t i, std::size_t n) { return i < n / 3; });
  ASSERT_LT(first.map.keyframe_count(), whole.map.keyframe_count());
  ASSERT_LT(second.map.keyframe_count(), whole.map.keyframe_count());
  const SavedMap merged = merge_maps(first, second, vocabulary_, loop_settings(Options{}));
  EXPECT_EQ(merged.map.keyframe_count(), whole.map.keyframe_count());
  EXPECT_LE(merged.map.landmark_count(), whole.map.landmark_count() * 11 / 10);
  EXPECT_EQ(merged.map.submaps().size(), 1U);
  std::set<double> times;
  for (const KeyframeId id : merged.map.keyframe_ids()) {
    const Keyframe& keyframe = *merged.map.find(id);
    EXPECT_TRUE(times.insert(keyframe.timestamp).second);
    const SE3 truth = WallFlight::on_ring(0.05 * static_cast<double>(keyframe.frame_index));
    EXPECT_LT((truth * keyframe.T_camera_world.inverse()).translation().norm(), 0.05) << id.value;
  }
  save_map(file_, merged);
  EXPECT_EQ(encode_map(load_map(file_)), encode_map(merged));
}

TEST_F(Atlas, MapsThatDoNotOverlapAreNotMerged) {
  const SavedMap first = fly(0.0, 1.0);
  const SavedMap second = fly(3.0, 4.0);
  const std::string error =
      error_of([&] { merge_maps(first, second, vocabulary_, loop_settings(Options{})); });
  EXPECT_NE(error.find("no place of one is recognised in the other"), std::string::npos) << error;
}

}  // namespace
}  // namespace roslam::scene
