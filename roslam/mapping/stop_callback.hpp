// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ceres/iteration_callback.h>

#include <functional>

namespace roslam {

/// Stops a Ceres solver with its current solution once should_stop returns true; it is asked after each step.
/// The function must outlive the callback.
class StopCallback : public ceres::IterationCallback {
 public:
  explicit StopCallback(const std::function<bool()>& should_stop) : should_stop_(should_stop) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return should_stop_() ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const std::function<bool()>& should_stop_;
};

}  // namespace roslam
