// SPDX-License-Identifier: BSD-3-Clause
// Files of format 1 as version 0.1.0 writes them: later ones must read every value and write the same bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "roslam/common/binary.hpp"
#include "roslam/map_io/map_file.hpp"
#include "roslam/place_recognition/vocabulary.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

const std::filesystem::path kFiles = ROSLAM_TEST_FILES;
const std::filesystem::path kMapFile = kFiles / "golden.map.roslam";
const std::filesystem::path kVocabularyFile = kFiles / "golden.vocabulary";

// Of the files, which never change.
constexpr std::size_t kMapBytes = 1685;
constexpr std::uint32_t kMapChecksum = 0x34b1decf;
constexpr std::size_t kVocabularyBytes = 348;
constexpr std::uint32_t kVocabularyChecksum = 0x2ddaa513;
constexpr std::uint64_t kVocabularyFingerprint = 0x88cfbe8677271ba0ULL;

constexpr std::size_t kHeaderBytes = 8 + 4 + 8 + 4;

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// --- The known content. All numbers are exact in binary, or quotients that IEEE 754 rounds in one way. ---

Camera known_camera() {
  Camera camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = 50.5;
  camera.fy = 51.25;
  camera.cx = 31.5;
  camera.cy = 23.75;
  camera.distortion = {0.0625, -0.03125, 0.001953125, -0.0009765625, 0.015625};
  camera.depth_units_per_metre = 1000.0;
  camera.fps = 15.0;
  return camera;
}

const std::vector<float> kScales{1.0F, 1.25F, 1.5625F};

Descriptor known_descriptor(std::uint64_t number) {
  return {0x0123456789abcdefULL + number, 0xfedcba9876543210ULL - number, number << 32U, ~number};
}

// A unit quaternion x y z w of whole numbers over their norm, and a translation.
SE3 known_motion(const std::array<double, 4>& q, double norm, const Eigen::Vector3d& translation) {
  return SE3::from_parts(Eigen::Quaterniond(q[3] / norm, q[0] / norm, q[1] / norm, q[2] / norm), translation);
}

// Three points, whose values differ from each other and from those of other keyframes.
std::shared_ptr<const ObservedFrame> known_view(std::uint8_t number, bool has_movable) {
  auto view = std::make_shared<ObservedFrame>();
  for (std::uint8_t i = 0; i < 3; ++i) {
    const auto k = static_cast<std::uint8_t>(10 * number + i);
    const auto value = static_cast<float>(k);
    view->pixels.emplace_back(1.5F + value, 2.25F + 0.5F * value);
    view->depths.push_back(i == 2 ? 0.0F : 1.0F + 0.125F * value);
    view->levels.push_back(static_cast<std::uint8_t>((number + i) % 3));
    view->angles.push_back(11.25F * static_cast<float>(i + 1) + value);
    view->colours.emplace_back(k, static_cast<std::uint8_t>(k + 50), static_cast<std::uint8_t>(k + 100));
    view->descriptors.push_back(known_descriptor(k));
    if (has_movable) view->is_movable.push_back(i == 1);
  }
  view->grid = FeatureGrid(view->pixels, {0.0, 0.0, 64.0, 48.0});
  return view;
}

Map known_map() {
  Map map(kScales);
  const auto add = [&](std::size_t frame, double time, const SE3& pose, std::uint8_t view, bool has_movable,
                       std::uint32_t submap, std::uint32_t session) {
    map.insert(Keyframe{{}, frame, time, pose, known_view(view, has_movable), {}, SubmapId{submap}, session});
  };
  add(3, 0.125, SE3(), 0, false, 0, 0);
  add((std::size_t{1} << 33U) + 5, 1305031102.375, known_motion({2, 4, 5, 6}, 9, {0.25, -0.5, 0.75}), 1, true,
      0, 0);
  add(0, 7.5, known_motion({1, 2, 4, 10}, 11, {-1.25, 2.5, -3.75}), 2, false, 1, 1);
  add(21, 8.75, known_motion({5, -3, 1, -1}, 6, {0.125, 0.0625, -8.0}), 3, false, 0, 1);

  Landmark landmark;
  landmark.position = {0.5, -1.5, 2.5};
  landmark.normal = {2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0};
  landmark.descriptor = known_descriptor(100);
  landmark.min_distance = 0.75F;
  landmark.max_distance = 3.5F;
  landmark.observations = {{KeyframeId{0}, 0}, {KeyframeId{1}, 2}, {KeyframeId{3}, 1}};
  landmark.created_by = KeyframeId{1};
  landmark.times_visible = 7;
  landmark.times_found = 5;
  landmark.contradicted = 1;
  landmark.colour = {201, 202, 203};
  map.insert(landmark);

  landmark.position = {-4.0, 0.25, 1024.0};
  landmark.normal = {0.0, 0.0, -1.0};
  landmark.descriptor = known_descriptor(101);
  landmark.min_distance = 0.0F;
  landmark.max_distance = 2000.0F;
  landmark.observations = {{KeyframeId{1}, 0}};
  landmark.created_by = KeyframeId{0};  // not the one that observes it
  landmark.times_visible = 1U << 20U;
  landmark.times_found = 1U << 10U;
  landmark.contradicted = 0;
  landmark.colour = {0, 128, 255};
  map.insert(landmark);

  landmark.position = {0.1, 0.2, 0.3};
  landmark.normal = {0.6, 0.8, 0.0};
  landmark.descriptor = known_descriptor(102);
  landmark.min_distance = 1.0F;
  landmark.max_distance = 1.0F;
  landmark.observations = {{KeyframeId{2}, 1}};
  landmark.created_by = KeyframeId{2};
  landmark.times_visible = 2;
  landmark.times_found = 3;
  landmark.contradicted = 4;
  landmark.colour = {5, 6, 7};
  map.insert(landmark);

  map.add_loop(KeyframeId{0}, KeyframeId{3}, known_motion({-2, 4, -5, 6}, 9, {1.5, 2.5, 3.5}));
  map.add_loop(KeyframeId{3}, KeyframeId{1}, known_motion({10, 1, 2, 4}, 11, {-0.5, 0.0, 0.5}));
  return map;
}

const std::vector<BagOfWords> kWords{{{1, 0.25F}, {4, 0.75F}}, {{0, 1.0F}}, {}, {{2, 0.5F}, {3, 0.5F}}};

SavedMap known_saved_map() {
  SavedMap saved;
  saved.camera = known_camera();
  saved.map = known_map();
  saved.vocabulary = kVocabularyFingerprint;
  saved.words = kWords;
  return saved;
}

constexpr std::uint64_t kOnes = ~std::uint64_t{0};

struct KnownNode {
  Descriptor median;
  std::uint32_t children;
  float weight;
};

// Two children of the root, of which the first has three children, of which the last has two. Words are
// numbered in the order of the leaves.
const std::vector<KnownNode> kNodes{{{0, 0, 0, 0}, 2, 0.0F},
                                    {{0, 0, 0, 0}, 3, 0.0F},
                                    {{kOnes, kOnes, kOnes, kOnes}, 0, 0.5F},  // word 0
                                    {{kOnes, 0, 0, 0}, 0, 0.25F},             // word 1
                                    {{0, kOnes, 0, 0}, 0, 0.0F},  // word 2, in all images of the training
                                    {{0, 0, kOnes, 0}, 2, 0.0F},  //
                                    {{0, 0, kOnes, 0x00000000ffffffff}, 0, 2.0F},   // word 3
                                    {{0, 0, kOnes, 0xffffffff00000000}, 0, 1.5F}};  // word 4
const std::vector<std::size_t> kNodeOfWord{2, 3, 4, 6, 7};

std::string known_vocabulary() {
  BinaryWriter writer;
  writer.put(static_cast<std::uint32_t>(kNodes.size()));
  for (const KnownNode& node : kNodes) {
    for (const std::uint64_t part : node.median) writer.put(part);
    writer.put(node.children);
    writer.put(node.weight);
  }
  return std::move(writer).bytes();
}

// --- Comparison ---

void expect_motion(const SE3& motion, const SE3& known) {
  EXPECT_EQ(motion.rotation().coeffs(), known.rotation().coeffs());
  EXPECT_EQ(motion.translation(), known.translation());
}

void expect_view(const ObservedFrame& view, const ObservedFrame& known) {
  EXPECT_EQ(view.pixels, known.pixels);
  EXPECT_EQ(view.depths, known.depths);
  EXPECT_EQ(view.levels, known.levels);
  EXPECT_EQ(view.angles, known.angles);
  EXPECT_EQ(view.colours, known.colours);
  EXPECT_EQ(view.descriptors, known.descriptors);
  EXPECT_EQ(view.is_movable, known.is_movable);
}

// Magic, version, length of the content and the checksum of the file.
void expect_header(const std::string& bytes, const std::string& magic, std::uint32_t known_checksum) {
  ASSERT_GT(bytes.size(), kHeaderBytes);
  BinaryReader reader(bytes, "golden file");
  EXPECT_EQ(reader.get_bytes(8), magic);
  EXPECT_EQ(reader.get<std::uint32_t>(), 1U) << "version";
  EXPECT_EQ(reader.get<std::uint64_t>(), bytes.size() - kHeaderBytes) << "length";
  EXPECT_EQ(reader.get<std::uint32_t>(), known_checksum) << "the file is another than that of the release";
}

class GoldenFiles : public testing::Test {
 protected:
  ~GoldenFiles() override { std::filesystem::remove(written_); }
  const std::filesystem::path written_ = scratch_path();
};

TEST_F(GoldenFiles, AreThoseOfTheRelease) {
  const std::string map = bytes_of(kMapFile);
  EXPECT_EQ(map.size(), kMapBytes);
  expect_header(map, "ROSLAMMP", kMapChecksum);
  const std::string vocabulary = bytes_of(kVocabularyFile);
  EXPECT_EQ(vocabulary.size(), kVocabularyBytes);
  expect_header(vocabulary, "ROSLAMVO", kVocabularyChecksum);
}

TEST_F(GoldenFiles, TheMapHasItsKeyframes) {
  const SavedMap saved = load_map(kMapFile);
  EXPECT_EQ(saved.name, kMapFile.string());
  EXPECT_EQ(saved.camera, known_camera());
  EXPECT_TRUE(std::ranges::equal(saved.map.scales(), kScales));
  EXPECT_EQ(saved.vocabulary, kVocabularyFingerprint);
  EXPECT_EQ(saved.words, kWords);
  EXPECT_EQ(saved.map.submaps(), (std::vector<SubmapId>{SubmapId{0}, SubmapId{1}}));
  EXPECT_EQ(saved.map.session(), 1U) << "the newest session";
  const Map known = known_map();
  ASSERT_EQ(saved.map.keyframe_slots(), 4U);
  ASSERT_EQ(saved.map.keyframe_count(), 4U);
  for (const KeyframeId id : known.keyframe_ids()) {
    SCOPED_TRACE(id.value);
    const Keyframe& a = *saved.map.find(id);
    const Keyframe& b = *known.find(id);
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.frame_index, b.frame_index);
    EXPECT_EQ(a.timestamp, b.timestamp);
    expect_motion(a.T_camera_world, b.T_camera_world);
    EXPECT_EQ(a.submap, b.submap);
    EXPECT_EQ(a.session, b.session);
    EXPECT_EQ(a.landmarks, b.landmarks);
    expect_view(*a.view, *b.view);
  }
}

TEST_F(GoldenFiles, AMapWithNoiseIsWrittenInVersionTwoAndReadAgain) {
  SavedMap saved = known_saved_map();
  saved.camera.depth_noise = DepthNoise{0.0625, 0.03125};
  ObservedFrame view = *saved.map.find(KeyframeId{1})->view;
  view.pixel_sigma = 0.75;
  view.depth_noise = DepthNoise{0.25, 0.5};
  saved.map.find(KeyframeId{1})->view = std::make_shared<const ObservedFrame>(view);
  save_map(written_, saved);
  const std::string bytes = bytes_of(written_);
  BinaryReader reader(bytes, "map");
  reader.get_bytes(8);
  EXPECT_EQ(reader.get<std::uint32_t>(), 2U);
  EXPECT_EQ(bytes.size(), kMapBytes + (2 + 4 * 3) * sizeof(double));
  const SavedMap again = load_map(written_);
  EXPECT_EQ(again.camera, saved.camera);
  EXPECT_EQ(again.map.find(KeyframeId{1})->view->pixel_sigma, 0.75);
  EXPECT_EQ(again.map.find(KeyframeId{1})->view->depth_noise, (DepthNoise{0.25, 0.5}));
  EXPECT_FALSE(again.map.find(KeyframeId{0})->view->pixel_sigma);
  EXPECT_FALSE(again.map.find(KeyframeId{0})->view->depth_noise);
  constexpr std::size_t kNoise = (2 + 4 * 3) * sizeof(double);
  const auto shorter = [&](std::size_t lost) {
    return decode_map(bytes.substr(kHeaderBytes, bytes.size() - kHeaderBytes - lost), "map");
  };
  for (std::size_t lost = 1; lost < kNoise; ++lost) EXPECT_ANY_THROW(shorter(lost)) << lost;
  EXPECT_FALSE(shorter(kNoise).camera.depth_noise);
}

TEST_F(GoldenFiles, TheMapHasItsLandmarksAndLoops) {
  const SavedMap saved = load_map(kMapFile);
  const Map known = known_map();
  ASSERT_EQ(saved.map.landmark_slots(), 3U);
  ASSERT_EQ(saved.map.landmark_count(), 3U);
  for (const LandmarkId id : known.landmark_ids()) {
    SCOPED_TRACE(id.value);
    const Landmark& a = *saved.map.find(id);
    const Landmark& b = *known.find(id);
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.position, b.position);
    EXPECT_EQ(a.normal, b.normal);
    EXPECT_EQ(a.descriptor, b.descriptor);
    EXPECT_EQ(a.min_distance, b.min_distance);
    EXPECT_EQ(a.max_distance, b.max_distance);
    EXPECT_EQ(a.created_by, b.created_by);
    EXPECT_EQ(a.times_visible, b.times_visible);
    EXPECT_EQ(a.times_found, b.times_found);
    EXPECT_EQ(a.contradicted, b.contradicted);
    EXPECT_EQ(a.colour, b.colour);
    ASSERT_EQ(a.observations.size(), b.observations.size());
    for (std::size_t i = 0; i < a.observations.size(); ++i) {
      EXPECT_EQ(a.observations[i].keyframe, b.observations[i].keyframe);
      EXPECT_EQ(a.observations[i].point, b.observations[i].point);
    }
  }
  const auto loops = saved.map.loops();
  const auto known_loops = known.loops();
  ASSERT_EQ(loops.size(), 2U);
  for (std::size_t i = 0; i < loops.size(); ++i) {
    EXPECT_EQ(loops[i].from, known_loops[i].from);
    EXPECT_EQ(loops[i].to, known_loops[i].to);
    EXPECT_LT((loops[i].T_to_from * known_loops[i].T_to_from.inverse()).log().norm(), 1e-15);
  }
}

TEST_F(GoldenFiles, TheMapIsWrittenAgainAsItWas) {
  const std::string golden = bytes_of(kMapFile);
  const SavedMap saved = load_map(kMapFile);
  EXPECT_TRUE(encode_map(saved) == golden.substr(kHeaderBytes));
  save_map(written_, saved);
  EXPECT_TRUE(bytes_of(written_) == golden);
  EXPECT_TRUE(encode_map(known_saved_map()) == golden.substr(kHeaderBytes)) << "the same from its content";
}

TEST_F(GoldenFiles, TheVocabularyHasItsWords) {
  const Vocabulary vocabulary = Vocabulary::load(kVocabularyFile);
  EXPECT_EQ(vocabulary.fingerprint(), kVocabularyFingerprint);
  ASSERT_EQ(vocabulary.words(), kNodeOfWord.size());
  for (WordId word = 0; word < kNodeOfWord.size(); ++word) {
    SCOPED_TRACE(word);
    const KnownNode& node = kNodes[kNodeOfWord[word]];
    EXPECT_EQ(vocabulary.weight(word), node.weight);
    EXPECT_EQ(vocabulary.word_of(node.median), word);
  }
  const auto median = [](WordId word) { return kNodes[kNodeOfWord[word]].median; };
  const auto bag = vocabulary.describe(std::vector{median(1), median(3), median(3), median(2), median(0)});
  ASSERT_EQ(bag.size(), 3U) << "word 2 has no weight";
  const BagOfWords known{{0, 0.5F / 4.75F}, {1, 0.25F / 4.75F}, {3, 4.0F / 4.75F}};
  for (std::size_t i = 0; i < bag.size(); ++i) {
    EXPECT_EQ(bag[i].first, known[i].first);
    EXPECT_FLOAT_EQ(bag[i].second, known[i].second);
  }
}

TEST_F(GoldenFiles, TheVocabularyIsWrittenAgainAsItWas) {
  const std::string golden = bytes_of(kVocabularyFile);
  const Vocabulary vocabulary = Vocabulary::load(kVocabularyFile);
  EXPECT_TRUE(vocabulary.content() == golden.substr(kHeaderBytes));
  EXPECT_TRUE(known_vocabulary() == golden.substr(kHeaderBytes)) << "the same from its content";
  vocabulary.save(written_);
  EXPECT_TRUE(bytes_of(written_) == golden);
}

// Made the files, once. Do not run it to make another test pass: a file in a new layout needs a new version
// of its format, and golden files beside these.
TEST_F(GoldenFiles, DISABLED_Generate) {
  const Vocabulary vocabulary = Vocabulary::decode(known_vocabulary(), "known vocabulary");
  vocabulary.save(kVocabularyFile);
  SavedMap saved = known_saved_map();
  saved.vocabulary = vocabulary.fingerprint();
  save_map(kMapFile, saved);
  std::cout << "fingerprint 0x" << std::hex << vocabulary.fingerprint() << '\n';
}

}  // namespace
}  // namespace roslam
