// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace roslam {

struct StreamPairingOptions {
  std::int64_t half_interval = 16'666'667;  ///< ns; images that are farther apart do not belong together; > 0
  std::size_t most_waiting = 60;            ///< images of a stream that may wait; > 0
  /// An image is paired as soon as its partner is within a quarter of the interval, not when the next ones
  /// have shown that none is nearer. The same pairs, sooner, if both streams have the same rate.
  bool takes_close_at_once = false;
};

/// Pairs the images of a colour and a depth stream by their time stamps, which are of the same clock: each
/// colour image with the depth image nearest in time, within half a frame, that is not nearer to the next
/// colour image. A clock that goes back by more than a second has restarted if the next image confirms it: a
/// new segment begins. Images out of order, or with a stamp that those around contradict, are left out and
/// counted. Memory is bounded. Content: of an image, such as its pixels; movable. Not thread safe.
template <typename Content>
class StreamPairing {
 public:
  struct Image {
    std::int64_t stamp = 0;  ///< ns
    int segment = 0;         ///< restarts of the clock before it
    std::size_t index = 0;   ///< of the images of its stream that came, from 0
    Content content;
  };
  struct Pair {
    Image colour;
    std::optional<Image> depth;
    std::optional<std::int64_t> nearest;  ///< ns to the nearest depth image, where none belongs to it
  };

  StreamPairing() = default;
  explicit StreamPairing(const StreamPairingOptions& options) : options_(options) {}

  void add_colour(std::int64_t stamp, Content content) { add(stamp, std::move(content), colour_); }
  void add_depth(std::int64_t stamp, Content content) { add(stamp, std::move(content), depth_); }

  /// An image that came but cannot be used, so that indexes stay right.
  void skip_colour() { ++colour_.count; }

  /// The next colour image, in the order of time, once its depth image is known. no_more: nothing comes any
  /// more.
  std::optional<Pair> take(bool no_more = false) {
    if (!is_decided(no_more)) return std::nullopt;
    Pair pair{std::move(colour_.images.front()), std::nullopt, std::nullopt};
    colour_.images.pop_front();
    pair.depth = take_depth(pair.colour);
    if (!pair.depth) pair.nearest = distance_to_depth(pair.colour);
    return pair;
  }

  /// Both streams begin anew, such as when their clock has changed: images that wait are lost, and the next
  /// ones are of a new segment.
  void restart() {
    const int segment = restarts() + 1;
    for (Stream* stream : {&colour_, &depth_}) {
      if (!stream->images.empty()) stream->skipped[kAlone] += stream->images.size();
      stream->images.clear();
      stream->last.reset();
      stream->before.reset();
      stream->candidate.reset();
      stream->segment = segment;
    }
  }

  const StreamPairingOptions& options() const { return options_; }

  /// Images that were left out, by reason in words.
  const std::map<std::string, std::size_t>& skipped_colour() const { return colour_.skipped; }
  const std::map<std::string, std::size_t>& skipped_depth() const { return depth_.skipped; }

  /// Times that the clock restarted.
  int restarts() const { return std::max(colour_.segment, depth_.segment); }

 private:
  // The images of a stream that wait, and where its clock is.
  struct Stream {
    std::deque<Image> images;
    std::optional<std::int64_t> last, before;  // the newest stamp, and that of the image before
    std::optional<Image> candidate;            // may be the first after a restart of the clock
    int segment = 0;
    std::size_t count = 0;
    std::map<std::string, std::size_t> skipped;
  };

  static constexpr std::int64_t kClockRestart =
      1'000'000'000;                                       // ns back, from which a clock may have restarted
  static constexpr std::int64_t kOutlier = 5'000'000'000;  // ns that a clock may go on after a wrong stamp
  static constexpr const char* kAlone = "no image near in time";
  static constexpr const char* kBack = "image whose time stamp is not after that of the one before";

  // Later images, and those after a restart, come last.
  static std::pair<int, std::int64_t> order_of(const Image& image) { return {image.segment, image.stamp}; }
  static std::int64_t distance(std::int64_t a, std::int64_t b) { return a < b ? b - a : a - b; }

  // Whether the depth image of the first colour image that waits is known: one as late as could belong to it
  // has come, and so has the next colour image, to which it may belong instead.
  bool is_decided(bool no_more) const {
    if (colour_.images.empty()) return false;
    if (no_more || colour_.images.size() >= options_.most_waiting ||
        depth_.images.size() >= options_.most_waiting)
      return true;
    const Image& colour = colour_.images.front();
    if (options_.takes_close_at_once && has_close_depth(colour)) return true;
    const bool has_depth =
        !depth_.images.empty() &&
        order_of(depth_.images.back()) > std::pair(colour.segment, colour.stamp + options_.half_interval);
    return has_depth && colour_.images.size() > 1;
  }

  bool has_close_depth(const Image& colour) const {
    return std::any_of(depth_.images.begin(), depth_.images.end(), [&](const Image& depth) {
      return depth.segment == colour.segment &&
             distance(depth.stamp, colour.stamp) <= options_.half_interval / 2;
    });
  }

  // A clock that goes back has restarted if the next image confirms it; a single image from the future or the
  // past does not count.
  void add(std::int64_t stamp, Content content, Stream& stream) {
    Image image{stamp, 0, stream.count++, std::move(content)};
    auto candidate = std::exchange(stream.candidate, std::nullopt);
    if (!stream.last || image.stamp > *stream.last) {
      if (candidate) ++stream.skipped[kBack];
      return accept(std::move(image), stream);
    }
    if (*stream.last - image.stamp < kClockRestart) {
      stream.candidate = std::move(candidate);
      ++stream.skipped[kBack];
    } else if (stream.before && image.stamp > *stream.before && image.stamp - *stream.before < kOutlier) {
      ++stream.skipped["image with an implausible time stamp"];
      if (!stream.images.empty() && stream.images.back().stamp == *stream.last) stream.images.pop_back();
      stream.last = stream.before;
      accept(std::move(image), stream);
    } else if (candidate && image.stamp > candidate->stamp) {
      ++stream.segment;
      stream.last.reset();
      accept(std::move(*candidate), stream);
      accept(std::move(image), stream);
    } else {
      if (candidate) ++stream.skipped[kBack];
      stream.candidate = std::move(image);
    }
  }

  void accept(Image image, Stream& stream) {
    // A step back of about a second may be a restart to one of the streams only.
    const Stream& other = &stream == &colour_ ? depth_ : colour_;
    const bool is_near = other.last && distance(image.stamp, *other.last) < kClockRestart;
    if (stream.segment < other.segment && is_near) stream.segment = other.segment;
    image.segment = stream.segment;
    stream.before = std::exchange(stream.last, image.stamp);
    stream.images.push_back(std::move(image));
    if (stream.images.size() <= options_.most_waiting) return;
    ++stream.skipped[kAlone];
    stream.images.pop_front();
  }

  // The depth image nearest in time that is not nearer to the next colour image.
  std::optional<Image> take_depth(const Image& colour) {
    auto& depths = depth_.images;
    while (!depths.empty() &&
           order_of(depths.front()) < std::pair(colour.segment, colour.stamp - options_.half_interval)) {
      passed_depth_ = order_of(depths.front());
      depths.pop_front();
    }
    const auto is_near = [&](const Image& depth) {
      return depth.segment == colour.segment && distance(depth.stamp, colour.stamp) <= options_.half_interval;
    };
    auto nearest = depths.end();
    for (auto depth = depths.begin(); depth != depths.end(); ++depth) {
      if (!is_near(*depth)) continue;
      if (nearest == depths.end() ||
          distance(depth->stamp, colour.stamp) < distance(nearest->stamp, colour.stamp))
        nearest = depth;
    }
    if (nearest != depths.end() && !colour_.images.empty()) {
      const Image& next = colour_.images.front();
      if (next.segment == colour.segment &&
          distance(nearest->stamp, next.stamp) < distance(nearest->stamp, colour.stamp))
        nearest = depths.end();
    }
    if (nearest == depths.end()) return std::nullopt;
    passed_depth_ = order_of(*nearest);
    std::optional<Image> taken = std::move(*nearest);
    depths.erase(depths.begin(), std::next(nearest));
    return taken;
  }

  std::optional<std::int64_t> distance_to_depth(const Image& colour) const {
    std::optional<std::int64_t> nearest;
    const auto offer = [&](const std::pair<int, std::int64_t>& depth) {
      if (depth.first != colour.segment) return;
      const std::int64_t apart = distance(depth.second, colour.stamp);
      nearest = std::min(apart, nearest.value_or(apart));
    };
    if (passed_depth_) offer(*passed_depth_);
    for (const Image& depth : depth_.images) offer(order_of(depth));
    return nearest;
  }

  StreamPairingOptions options_;
  Stream colour_, depth_;
  std::optional<std::pair<int, std::int64_t>> passed_depth_;  // segment and stamp, taken or left behind
};

}  // namespace roslam
