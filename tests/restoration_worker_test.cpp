// SPDX-License-Identifier: BSD-3-Clause
// Restoration in its own thread: it never blocks the tracker.
#include "roslam/workers/restoration_worker.hpp"

#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <thread>

#include "roslam/common/error.hpp"
#include "tests/restoration_scene.hpp"

namespace roslam::scene {
namespace {

// Blocks until released, as a slow network does; or throws.
class SlowInpainter : public Inpainter {
 public:
  cv::Mat inpaint(const cv::Mat& crop, const cv::Mat&, const cv::Rect&, Movable) override {
    std::unique_lock lock(mutex_);
    is_busy_ = true;
    changed_.notify_all();
    changed_.wait(lock, [&] { return !is_held_; });
    if (fails) throw ModelError("the network is ill");
    return cv::Mat(crop.size(), CV_8UC3, cv::Scalar::all(120));
  }
  void hold() {
    const std::scoped_lock lock(mutex_);
    is_held_ = true;
  }
  void wait_until_busy() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return is_busy_; });
  }
  void let_go() {
    const std::scoped_lock lock(mutex_);
    is_held_ = false;
    changed_.notify_all();
  }
  bool fails = false;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_held_ = false;
  bool is_busy_ = false;
};

class Worker : public testing::Test {
 protected:
  void start(Mode mode, const Options& options = {}) {
    worker_.emplace(
        stage_.camera(), options, mode, inpainter_,
        [this](const std::vector<KeyframeId>& ids) {
          const std::scoped_lock lock(mutex_);
          std::vector<KeyframePose> places;
          for (const KeyframeId id : ids)
            places.push_back({submaps_.count(id.value) > 0 ? submaps_.at(id.value) : SubmapId{0},
                              shift_ * places_.at(id.value)});
          return places;
        },
        [this](const RestoredKeyframe& keyframe) {
          const std::scoped_lock lock(mutex_);
          restored_.push_back(keyframe);
          if (taker_fails_) throw OutputError("nobody takes it");
        },
        [this](KeyframeId keyframe) {
          const std::scoped_lock lock(mutex_);
          left_.push_back(keyframe);
        });
  }

  // A keyframe with the person at some place.
  void submit(unsigned id, double person) {
    const SE3 T_camera_world = looking_from(0.02 * id, 0.0, 0.0);
    const View seen = stage_.show(room({kPerson.shifted(person)}), T_camera_world);
    Frame frame;
    frame.index = id;
    frame.timestamp = 0.5 * id;
    frame.colour = in_colour(seen.grey);
    frame.depth = seen.depth;
    DynamicObjects dynamic_objects;
    MovableObject object;
    ASSERT_TRUE(take_mask(object, seen.shows(kThing)));
    object.kind = Movable::kPerson;
    dynamic_objects.objects = {object};
    {
      const std::scoped_lock lock(mutex_);
      places_[id] = T_camera_world.inverse();
    }
    worker_->submit(KeyframeId{id}, frame, dynamic_objects);
  }

  double seen_share(std::size_t which) const {
    const RestoredImage& view = restored_.at(which).view;
    const auto hole = view.colour.total() - view.pixels_of(Provenance::kMeasured);
    return static_cast<double>(view.pixels_of(Provenance::kReprojected)) / static_cast<double>(hole);
  }

  Stage stage_;
  std::shared_ptr<SlowInpainter> inpainter_ = std::make_shared<SlowInpainter>();
  std::mutex mutex_;
  std::map<unsigned, SE3> places_;
  std::map<unsigned, SubmapId> submaps_;
  SE3 shift_;  // of all keyframes, as a correction of the map makes it
  std::vector<RestoredKeyframe> restored_;
  bool taker_fails_ = false;
  std::vector<KeyframeId> left_;  // dropped, or failed
  std::optional<RestorationWorker> worker_;
};

TEST_F(Worker, RestoresAtOnceFromTheKeyframesBefore) {
  start(Mode::kDeterministic);
  submit(1, 0.8);
  ASSERT_EQ(restored_.size(), 1U);
  EXPECT_EQ(seen_share(0), 0.0);
  submit(2, 0.0);
  ASSERT_EQ(restored_.size(), 2U);
  EXPECT_GT(seen_share(1), 0.9);
  EXPECT_EQ(restored_[1].keyframe, KeyframeId{2});
  EXPECT_EQ(worker_->dropped(), 0U);
  EXPECT_EQ(worker_->times().summary().at("restoration").count, 2U);
}

TEST_F(Worker, FollowsCorrectionsOfTheMap) {
  start(Mode::kDeterministic);
  submit(1, 0.8);
  shift_ = SE3(so3_exp({0.0, 0.4, 0.0}), {5.0, -3.0, 1.0});
  submit(2, 0.0);
  EXPECT_GT(seen_share(1), 0.9);
}

TEST_F(Worker, TakesNothingFromAnotherWorld) {
  start(Mode::kDeterministic);
  submaps_[1] = SubmapId{1};
  submit(1, 0.8);
  submit(2, 0.0);
  EXPECT_EQ(seen_share(1), 0.0);
  submaps_[1] = SubmapId{0};  // the worlds have met
  submit(3, 0.0);
  EXPECT_GT(seen_share(2), 0.9);
}

TEST_F(Worker, DropsTheOldestRatherThanToMakeAnybodyWait) {
  Options options;
  options.restoration.queue = 2;
  start(Mode::kRealTime, options);
  inpainter_->hold();
  submit(1, 0.0);
  inpainter_->wait_until_busy();
  for (unsigned id = 2; id <= 6; ++id) submit(id, 0.0);  // returns although the network does not
  inpainter_->let_go();
  worker_->drain();
  EXPECT_EQ(worker_->dropped(), 3U);
  ASSERT_EQ(restored_.size(), 3U);
  EXPECT_EQ(restored_[0].keyframe, KeyframeId{1});
  EXPECT_EQ(restored_[1].keyframe, KeyframeId{5});
  EXPECT_EQ(restored_[2].keyframe, KeyframeId{6});
  EXPECT_EQ(left_, (std::vector<KeyframeId>{KeyframeId{2}, KeyframeId{3}, KeyframeId{4}}));
}

TEST_F(Worker, TellsOfKeyframesThatNobodyCouldTake) {
  start(Mode::kDeterministic);
  taker_fails_ = true;
  submit(1, 0.0);
  EXPECT_EQ(left_, std::vector<KeyframeId>{KeyframeId{1}});
  EXPECT_EQ(worker_->faults(), (std::map<std::string, std::size_t>{{"nobody takes it", 1}}));
}

TEST_F(Worker, ANetworkThatFailsCostsAKeyframeAndNothingElse) {
  start(Mode::kDeterministic);
  inpainter_->fails = true;
  submit(1, 0.0);
  EXPECT_TRUE(restored_.empty());
  EXPECT_EQ(worker_->faults(), (std::map<std::string, std::size_t>{{"the network is ill", 1}}));
  EXPECT_EQ(left_, std::vector<KeyframeId>{KeyframeId{1}});
  inpainter_->fails = false;
  submit(2, 0.0);
  EXPECT_EQ(restored_.size(), 1U);
}

TEST_F(Worker, KeepsNoMoreKeyframesThanToldTo) {
  Options options;
  options.restoration.recent_sources = 1;
  start(Mode::kDeterministic, options);
  submit(1, 0.8);
  submit(2, 0.0);
  EXPECT_GT(seen_share(1), 0.9);
  submit(3, 0.0);  // only the second is left, which shows no more
  EXPECT_LT(seen_share(2), 0.5);
}

}  // namespace
}  // namespace roslam::scene
