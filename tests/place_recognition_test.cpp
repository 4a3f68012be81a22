// SPDX-License-Identifier: BSD-3-Clause
// Vocabulary and keyframe database on descriptors whose words are known.
#include <gtest/gtest.h>

#include <fstream>
#include <numeric>
#include <random>
#include <set>

#include "roslam/common/binary.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/place_recognition/keyframe_database.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

constexpr int kThings = 64;  // that look different

// Images of objects whose descriptors are observed with some bits flipped.
class World {
 public:
  explicit World(std::uint64_t seed) : random_(seed) {
    for (auto& thing : things_) thing = {random_(), random_(), random_(), random_()};
  }

  Descriptor seen(int thing, int wrong_bits = 10) {
    Descriptor descriptor = things_[static_cast<std::size_t>(thing)];
    for (int i = 0; i < wrong_bits; ++i) {
      const std::uint64_t bit = random_() % kDescriptorBits;
      descriptor[bit / 64] ^= std::uint64_t{1} << (bit % 64);
    }
    return descriptor;
  }

  std::vector<Descriptor> image(const std::vector<int>& things, int wrong_bits = 10) {
    std::vector<Descriptor> result;
    for (const int thing : things) result.push_back(seen(thing, wrong_bits));
    return result;
  }

  // Sixteen objects, a different set in each image.
  std::vector<Descriptor> image(int number) {
    std::vector<int> things;
    for (int i = 0; i < 16; ++i) things.push_back((number * 5 + i * (1 + number % 3)) % kThings);
    return image(things);
  }

 private:
  std::mt19937_64 random_;
  std::array<Descriptor, kThings> things_;
};

class Places : public testing::Test {
 protected:
  Places() {
    for (int i = 0; i < 200; ++i) images_.push_back(world_.image(i % kThings));
  }
  ~Places() override { std::filesystem::remove_all(file_); }

  static ObservedFrame view(std::vector<Descriptor> descriptors) {
    ObservedFrame frame;
    frame.descriptors = std::move(descriptors);
    frame.pixels.resize(frame.descriptors.size());
    return frame;
  }

  World world_{5};
  std::vector<std::vector<Descriptor>> images_;
  const VocabularyOptions options_{.branching = 8, .depth = 2};
  const std::filesystem::path file_ = scratch_path(".bin");
};

TEST_F(Places, EachThingHasAWordOfItsOwn) {
  const Vocabulary vocabulary = Vocabulary::train(images_, options_);
  EXPECT_EQ(vocabulary.words(), 64U);
  std::set<WordId> words;
  int same = 0;
  for (int thing = 0; thing < kThings; ++thing) {
    const WordId word = vocabulary.word_of(world_.seen(thing, 0));
    words.insert(word);
    for (int i = 0; i < 10; ++i) same += vocabulary.word_of(world_.seen(thing)) == word ? 1 : 0;
  }
  EXPECT_GE(words.size(), 48U);
  EXPECT_GE(same, kThings * 9);
}

TEST_F(Places, TrainingRepeatsBitByBit) {
  const Vocabulary once = Vocabulary::train(images_, options_);
  EXPECT_EQ(once, Vocabulary::train(images_, options_));
  VocabularyOptions other = options_;
  other.seed = 2;
  EXPECT_NE(once.fingerprint(), Vocabulary::train(images_, other).fingerprint());
}

TEST_F(Places, RareWordsWeighMore) {
  std::vector<std::vector<Descriptor>> images;
  for (int i = 0; i < 32; ++i) images.push_back(world_.image({0, i < 16 ? 1 : 2, 3 + i, 3 + i}, 0));
  const Vocabulary vocabulary = Vocabulary::train(images, {.branching = 40, .depth = 1});
  const auto weight = [&](int thing) { return vocabulary.weight(vocabulary.word_of(world_.seen(thing, 0))); };
  EXPECT_FLOAT_EQ(weight(0), 0.0F);
  EXPECT_FLOAT_EQ(weight(1), std::log(2.0F));
  EXPECT_FLOAT_EQ(weight(3), std::log(32.0F));
  const BagOfWords bag = vocabulary.describe(world_.image({0, 1, 3, 3}, 0));
  ASSERT_EQ(bag.size(), 2U) << "a word that is everywhere tells nothing";
  double sum = 0.0;
  double most = 0.0;
  for (const auto& [word, share] : bag) {
    sum += static_cast<double>(share);
    most = std::max(most, static_cast<double>(share));
  }
  EXPECT_NEAR(sum, 1.0, 1e-6);
  EXPECT_NEAR(most, 2.0 * std::log(32.0) / (2.0 * std::log(32.0) + std::log(2.0)), 1e-6);
}

TEST_F(Places, SimilarityIsOneForTheSameAndNoneForOthers) {
  const BagOfWords a{{1, 0.5F}, {4, 0.5F}};
  const BagOfWords b{{2, 0.25F}, {4, 0.75F}};
  EXPECT_DOUBLE_EQ(similarity(a, a), 1.0);
  EXPECT_DOUBLE_EQ(similarity(a, b), 0.5);
  EXPECT_DOUBLE_EQ(similarity(a, {{2, 1.0F}}), 0.0);
  EXPECT_DOUBLE_EQ(similarity(a, {}), 0.0);
}

TEST_F(Places, AVocabularyIsReadAsItWasWritten) {
  const Vocabulary vocabulary = Vocabulary::train(images_, options_);
  vocabulary.save(file_);
  EXPECT_EQ(Vocabulary::load(file_), vocabulary);
}

// Invalid content with a valid checksum.
TEST_F(Places, ATreeWithLooseEndsIsRefused) {
  Vocabulary::train(images_, options_).save(file_);
  constexpr BinaryFormat kFormat{"ROSLAMVO", 1, "a vocabulary", 1 << 20};
  const std::string good = read_binary(file_, kFormat);
  constexpr std::size_t kChildren = 4 + 32;  // of the root
  constexpr std::size_t kNode = 32 + 8;
  for (const std::size_t at : {kChildren, kChildren + kNode, good.size() - 8}) {
    for (const char value : {char{0}, char{2}, static_cast<char>(200)}) {
      std::string bad = good;
      bad[at] = value;
      if (bad == good) continue;
      write_binary(file_, kFormat, bad);
      EXPECT_THROW(Vocabulary::load(file_), InputError) << at << ' ' << int{value};
    }
  }
  std::string bad = good;
  bad[good.size() - 1] = static_cast<char>(0xff);  // of the last weight: no number
  bad[good.size() - 2] = static_cast<char>(0xff);
  write_binary(file_, kFormat, bad);
  EXPECT_THROW(Vocabulary::load(file_), InputError);
  write_binary(file_, kFormat, std::string(4, '\0'));
  EXPECT_THROW(Vocabulary::load(file_), InputError);
}

TEST_F(Places, TooFewDescriptorsAreNamed) {
  const std::vector<std::vector<Descriptor>> few{{world_.seen(0)}};
  EXPECT_THROW(Vocabulary::train(few, options_), InputError);
  EXPECT_THROW(Vocabulary::train({}, options_), InputError);
}

TEST_F(Places, ProgressGoesFromNothingToAll) {
  double last = 0.0;
  Vocabulary::train(images_, options_, [&](double share) {
    EXPECT_GE(share, last);
    last = share;
  });
  EXPECT_DOUBLE_EQ(last, 1.0);
}

TEST_F(Places, FindsTheImageOfThePlace) {
  KeyframeDatabase index(std::make_shared<const Vocabulary>(Vocabulary::train(images_, options_)));
  for (std::uint32_t i = 0; i < kThings; ++i) {
    index.add(KeyframeId{i}, index.describe(view(world_.image(static_cast<int>(i)))));
  }
  EXPECT_EQ(index.size(), static_cast<std::size_t>(kThings));
  int right = 0;
  for (std::uint32_t i = 0; i < kThings; ++i) {
    const BagOfWords bag = index.describe(view(world_.image(static_cast<int>(i))));
    const auto found = index.similar(bag);
    ASSERT_FALSE(found.empty());
    if (found.front().keyframe == KeyframeId{i}) ++right;
    // Against the definition, without the inverted index.
    for (std::size_t k = 0; k < found.size(); ++k) {
      EXPECT_NEAR(found[k].similarity, similarity(bag, *index.find(found[k].keyframe)), 1e-12);
      if (k == 0) continue;
      EXPECT_LE(found[k].similarity, found[k - 1].similarity);
    }
  }
  EXPECT_GE(right, kThings - 4);
}

TEST_F(Places, WhatIsRemovedOrNotAcceptedIsNotFound) {
  KeyframeDatabase index(std::make_shared<const Vocabulary>(Vocabulary::train(images_, options_)));
  const BagOfWords bag = index.describe(view(world_.image(3)));
  index.add(KeyframeId{1}, bag);
  index.add(KeyframeId{7}, bag);
  index.add(KeyframeId{7}, bag);
  EXPECT_EQ(index.size(), 2U);
  EXPECT_EQ(index.similar(bag).size(), 2U);
  EXPECT_EQ(index.similar(bag).front().keyframe, KeyframeId{1});
  EXPECT_EQ(index.similar(bag, [](KeyframeId id) { return id.value > 1; }).front().keyframe, KeyframeId{7});
  index.remove(KeyframeId{1});
  index.remove(KeyframeId{1});
  index.remove(KeyframeId{100});
  EXPECT_EQ(index.find(KeyframeId{1}), nullptr);
  ASSERT_EQ(index.similar(bag).size(), 1U);
  EXPECT_NEAR(index.similar(bag).front().similarity, 1.0, 1e-6);
  EXPECT_TRUE(index.similar({}).empty());
}

TEST_F(Places, PointsOnThingsThatMayMoveAreNoWords) {
  const KeyframeDatabase index(std::make_shared<const Vocabulary>(Vocabulary::train(images_, options_)));
  ObservedFrame frame = view(world_.image({1, 2, 3, 4}));
  frame.is_movable = {false, true, true, false};
  EXPECT_EQ(index.describe(frame), index.describe(view({frame.descriptors[0], frame.descriptors[3]})));
  frame.is_movable.assign(4, true);
  EXPECT_TRUE(index.describe(frame).empty());
}

TEST(VocabularyOptions, NameTheFieldThatIsWrong) {
  const auto error_of = [](VocabularyOptions options) -> std::string {
    try {
      options.validate();
    } catch (const OptionsError& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_EQ(error_of({}), "");
  EXPECT_NE(error_of({.branching = 1}).find("branching"), std::string::npos);
  EXPECT_NE(error_of({.depth = 0}).find("depth"), std::string::npos);
  EXPECT_NE(error_of({.branching = 20, .depth = 6}).find("million"), std::string::npos);
  EXPECT_NE(error_of({.iterations = 0}).find("iterations"), std::string::npos);
}

}  // namespace
}  // namespace roslam
