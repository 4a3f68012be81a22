// SPDX-License-Identifier: BSD-3-Clause
// A failing segmenter costs labels, not tracking; its faults are counted by name.
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/semantics/segmenter.hpp"
#include "roslam/slam/run.hpp"
#include "tests/street.hpp"

namespace roslam::street {
namespace {

constexpr int kPerson = 11;

class Scripted : public Segmenter {
 public:
  using Script = std::function<cv::Mat(const cv::Mat& image, int call)>;
  explicit Scripted(Script script) : script_(std::move(script)) {}
  Segmentation segment(const cv::Mat& image) override {
    Segmentation result;
    result.labels = script_(image, calls_++);
    result.confidence.fill(0.9F);
    return result;
  }

 private:
  Script script_;
  int calls_ = 0;
};

cv::Mat nothing(const cv::Mat& image) { return cv::Mat::zeros(image.size(), CV_8UC1); }

class SegmenterFaults : public testing::TestWithParam<Mode> {
 protected:
  // Runs the street and expects it to be tracked nearly whole, with the one fault.
  void expect_survived(const std::shared_ptr<Segmenter>& segmenter, const std::string& fault,
                       double timeout = 10.0) {
    TumSource source(kFolder, *camera_preset("simulated"));
    Options options;
    options.threads.segmentation_timeout = timeout;
    Slam slam(source.camera(), options, GetParam(), segmenter);
    const RunSummary summary = run_slam(source, slam);
    ASSERT_FALSE(summary.failure);
    EXPECT_GT(slam.frames(), 10U);
    EXPECT_GE(slam.trajectory().size(), slam.frames() - 1);
    const auto faults = slam.labelling_faults();
    std::size_t named = 0;
    for (const auto& [reason, count] : faults) {
      if (reason.find(fault) == std::string::npos) continue;
      ++named;
      EXPECT_GT(count, 0U);
    }
    EXPECT_EQ(named, 1U) << fault;
  }
};

TEST_P(SegmenterFaults, ThatThrows) {
  expect_survived(std::make_shared<Scripted>(
                      [](const cv::Mat&, int) -> cv::Mat { throw ModelError("weights are broken"); }),
                  "the segmenter failed: weights are broken");
}

TEST_P(SegmenterFaults, ThatGivesTheWrongSize) {
  expect_survived(
      std::make_shared<Scripted>([](const cv::Mat&, int) { return cv::Mat(3, 5, CV_8UC1, cv::Scalar(0)); }),
      "another size");
}

TEST_P(SegmenterFaults, ThatGivesNothing) {
  expect_survived(std::make_shared<Scripted>([](const cv::Mat&, int) { return cv::Mat(); }), "another size");
}

TEST_P(SegmenterFaults, ThatLabelsEverythingAsPerson) {
  expect_survived(std::make_shared<Scripted>([](const cv::Mat& image, int) {
                    return cv::Mat(image.size(), CV_8UC1, cv::Scalar(kPerson));
                  }),
                  "nearly everything is labelled as movable");
}

TEST_P(SegmenterFaults, ThatFlickers) {
  expect_survived(std::make_shared<Scripted>([](const cv::Mat& image, int call) {
                    cv::Mat labels = nothing(image);
                    if (call % 2 == 0) labels(cv::Rect(40, 40, 200, 300)) = kPerson;
                    return labels;
                  }),
                  "come and go");
}

TEST_P(SegmenterFaults, ThatHangs) {
  struct Gate {
    std::mutex mutex;
    std::condition_variable opened;
    bool is_open = false;
  };
  const auto gate = std::make_shared<Gate>();
  const auto segmenter = std::make_shared<Scripted>([gate](const cv::Mat& image, int call) {
    if (call >= 3) {
      std::unique_lock lock(gate->mutex);
      gate->opened.wait(lock, [&] { return gate->is_open; });
    }
    return nothing(image);
  });
  const auto open = [&] {
    const std::scoped_lock lock(gate->mutex);
    gate->is_open = true;
    gate->opened.notify_all();
  };
  if (GetParam() == Mode::kRealTime) {
    expect_survived(segmenter, "does not answer", 0.5);
    open();
    return;
  }
  // A clock must not decide the result: the answer is waited for, well beyond the timeout, or until cancel().
  for (const bool cancels : {false, true}) {
    gate->is_open = false;
    TumSource source(kFolder, *camera_preset("simulated"));
    Options options;
    options.threads.segmentation_timeout = 0.05;
    Slam slam(source.camera(), options, GetParam(), segmenter);
    std::stop_source stop;
    std::jthread later([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
      cancels ? void(stop.request_stop()) : open();
    });
    const RunSummary summary = run_slam(source, slam, {}, stop.get_token());
    later.join();
    EXPECT_FALSE(summary.failure);
    EXPECT_EQ(summary.interrupted, cancels);
    EXPECT_EQ(slam.frames() < 10U, cancels) << slam.frames();
    EXPECT_TRUE(cancels || slam.labelling_faults().empty());
    open();
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, SegmenterFaults, testing::Values(Mode::kDeterministic, Mode::kRealTime),
                         [](const auto& parameter) {
                           return parameter.param == Mode::kDeterministic ? "Deterministic" : "RealTime";
                         });

}  // namespace
}  // namespace roslam::street
