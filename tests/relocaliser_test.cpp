// SPDX-License-Identifier: BSD-3-Clause
// The turns of relocalisation on a circular flight whose keyframes are known to show the frame or not.
#include "roslam/tracking/relocaliser.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "roslam/common/error.hpp"
#include "tests/loop_scene.hpp"

namespace roslam {
namespace {

constexpr int kKeyframes = 40;

class Relocalisation : public testing::Test {
 protected:
  Relocalisation() {
    flight_.build_ring();
    for (int i = 0; i < kKeyframes; ++i) {
      flight_.fly_to(scene::WallFlight::on_ring(angle_of(i)), 0.0, map_);
      all_.push_back(KeyframeId{static_cast<std::uint32_t>(i)});
    }
    for (const LandmarkId id : map_.landmark_ids()) map_.refresh(id);
  }

  static double angle_of(int keyframe) { return 2.0 * M_PI / kKeyframes * keyframe; }

  Relocaliser relocaliser() const {
    return {options_, GeometricVerifier(flight_.camera(), GeometricVerifier::Settings())};
  }

  // A place that no keyframe shows.
  std::shared_ptr<ObservedFrame> elsewhere() {
    scene::WallFlight other(99);
    other.build_ring();
    return other.view(scene::WallFlight::on_ring(1.0));
  }

  std::vector<KeyframeId> reversed() const { return {all_.rbegin(), all_.rend()}; }

  RelocaliserOptions options_{.tries = 3, .candidates = 5};
  scene::WallFlight flight_{7};
  Map map_{{1.0F, 1.2F}};
  std::vector<KeyframeId> all_;
};

TEST_F(Relocalisation, NeverVerifiesMoreKeyframesThanConfigured) {
  const auto frame = elsewhere();
  for (const int tries : {1, 2, 3, 7, 100}) {
    options_.tries = tries;
    Relocaliser relocaliser = this->relocaliser();
    for (int call = 0; call < 12; ++call) {
      for (const bool search_all : {false, true}) {
        ASSERT_FALSE(relocaliser.find(map_, *frame, all_, search_all));
        const auto chosen = relocaliser.chosen();
        EXPECT_LE(chosen.size(), static_cast<std::size_t>(tries));
        EXPECT_EQ(std::set<KeyframeId>(chosen.begin(), chosen.end()).size(), chosen.size()) << "one twice";
        EXPECT_EQ(chosen.front(), all_.front()) << "the most similar one is not the first";
      }
    }
  }
}

TEST_F(Relocalisation, JustAfterLossTriesTheBestAndTheNewest) {
  const auto frame = elsewhere();
  Relocaliser relocaliser = this->relocaliser();
  for (int loss = 0; loss < 2; ++loss) {
    std::set<KeyframeId> chosen;
    for (int call = 0; call < 5; ++call) {
      ASSERT_FALSE(relocaliser.find(map_, *frame, all_, false));
      if (call == 0) {
        const std::vector<KeyframeId> expected{all_[0], all_[kKeyframes - 1], all_[1]};
        EXPECT_TRUE(std::ranges::equal(relocaliser.chosen(), expected));
      }
      chosen.insert(relocaliser.chosen().begin(), relocaliser.chosen().end());
    }
    std::set<KeyframeId> expected(all_.begin(), all_.begin() + 5);
    expected.insert(all_.end() - 5, all_.end());
    EXPECT_EQ(chosen, expected);
    relocaliser.restart();
  }
}

TEST_F(Relocalisation, EveryKeyframeHasItsTurnInASearchOfAll) {
  const auto frame = elsewhere();
  for (const bool has_similar : {true, false}) {
    Relocaliser relocaliser = this->relocaliser();
    std::set<KeyframeId> chosen;
    // One of three is the best, one another similar one, one of any.
    const int calls = has_similar ? kKeyframes : (kKeyframes + 2) / 3;
    for (int call = 0; call < calls; ++call) {
      const std::span<const KeyframeId> similar(all_.data(), has_similar ? all_.size() : 0);
      ASSERT_FALSE(relocaliser.find(map_, *frame, similar, true));
      chosen.insert(relocaliser.chosen().begin(), relocaliser.chosen().end());
    }
    EXPECT_EQ(chosen.size(), all_.size());
  }
}

TEST_F(Relocalisation, FindsTheRightKeyframeWhateverItsRank) {
  const auto frame = flight_.view(scene::WallFlight::on_ring(angle_of(kKeyframes / 2) + 0.02));
  for (const auto& similar : {all_, reversed(), std::vector<KeyframeId>{}}) {
    Relocaliser relocaliser = this->relocaliser();
    Relocaliser again = this->relocaliser();
    std::optional<VerifiedMatch> match;
    int calls = 0;
    for (; !match && calls < kKeyframes; ++calls) {
      match = relocaliser.find(map_, *frame, similar, true);
      const auto same = again.find(map_, *frame, similar, true);
      ASSERT_EQ(match.has_value(), same.has_value());
      ASSERT_TRUE(std::ranges::equal(relocaliser.chosen(), again.chosen()));
      if (!match) continue;
      EXPECT_EQ(match->T_camera_world.matrix(), same->T_camera_world.matrix());
    }
    ASSERT_TRUE(match);
    EXPECT_LE(calls, similar.empty() ? kKeyframes / 6 + 1 : kKeyframes / 2 + 1);
    EXPECT_NEAR(match->matched_keyframe.value, kKeyframes / 2, 3);
    const SE3 truth = scene::WallFlight::on_ring(angle_of(kKeyframes / 2) + 0.02) *
                      scene::WallFlight::on_ring(0.0).inverse();
    const SE3 error = match->T_camera_world * map_.T_camera_world(all_.front()).inverse() * truth.inverse();
    EXPECT_LT(error.translation().norm(), 0.05);
  }
}

TEST(RelocaliserOptions, NameTheFieldThatIsWrong) {
  for (const auto& [options, field] : {std::pair<RelocaliserOptions, const char*>{{.tries = 0}, "tries"},
                                       {{.candidates = 0}, "candidates"},
                                       {{.min_inliers = 5}, "min_inliers"}}) {
    try {
      options.validate();
      ADD_FAILURE() << field;
    } catch (const OptionsError& error) {
      EXPECT_NE(std::string(error.what()).find(field), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace roslam
