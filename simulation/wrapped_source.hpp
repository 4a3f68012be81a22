// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "roslam/sensors/frame_source.hpp"

namespace roslam::simulation {

/// Gives what another source gives: a base for sources that change the frames of another.
class WrappedSource : public FrameSource {
 public:
  /// source must outlive the object.
  explicit WrappedSource(FrameSource& source) : source_(source) {}

  std::optional<Frame> next() override { return source_.next(); }
  using FrameSource::next;
  void interrupt() override { source_.interrupt(); }
  bool is_live() const override { return source_.is_live(); }
  const Camera& camera() const override { return source_.camera(); }
  std::optional<RightCamera> right() const override { return source_.right(); }
  std::optional<std::size_t> size() const override { return source_.size(); }
  std::map<std::string, std::size_t> skipped() const override { return source_.skipped(); }
  std::map<std::string, std::size_t> notes() const override { return source_.notes(); }
  std::map<std::string, std::size_t> skipped_depth() const override { return source_.skipped_depth(); }

 protected:
  FrameSource& source() const { return source_; }

 private:
  FrameSource& source_;
};

}  // namespace roslam::simulation
