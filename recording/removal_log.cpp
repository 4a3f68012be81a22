// SPDX-License-Identifier: BSD-3-Clause
#include "recording/removal_log.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "recording/removal_image.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/thread_priority.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::recording {

namespace {
namespace fs = std::filesystem;

constexpr std::size_t kQueue = 30;        // frames with images that may wait to be written
constexpr std::size_t kLineQueue = 3000;  // lines that may wait; 1 to 3 kB each
constexpr std::size_t kStripImages = 8;
constexpr const char* kFullDisk = ": cannot be written in full; check the free space on the disk";
constexpr const char* kStrip = "removal.jpg";
constexpr const char* kVideo = "removal.avi";

// OpenCV does not report a full disk, but writes the length of the file into its header in the end.
bool is_whole_video(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::array<char, 8> header{};  // "RIFF" and the number of bytes that follow
  in.read(header.data(), header.size());
  std::uint32_t rest = 0;
  std::memcpy(&rest, header.data() + 4, sizeof rest);
  std::error_code error;
  return in && fs::file_size(file, error) == rest + header.size();
}
}  // namespace

void RemovalLog::remove_old(const fs::path& folder) {
  std::error_code error;
  for (const char* name : {kDescriptorFile, kMaskFolder, kStrip, kVideo}) {
    fs::remove_all(folder / name, error);
    if (error) {
      throw OutputError((folder / name).string() +
                        ": left by an earlier run and cannot be removed; choose another --out");
    }
  }
}

RemovalLog::RemovalLog(const Settings& settings) : settings_(settings), strip_(kStripImages) {
  remove_old(settings.folder);
  make_folder(settings.folder / kMaskFolder);
  lines_.open(settings.folder / kDescriptorFile, std::ios::binary);
  if (!lines_) throw OutputError((settings.folder / kDescriptorFile).string() + ": cannot open for writing");
  thread_ = std::jthread([this] {
    if (settings_.mode == Mode::kRealTime) lower_thread_priority(ThreadPriority::kLowest);
    work();
  });
}

RemovalLog::~RemovalLog() {
  const std::scoped_lock lock(mutex_);
  is_closed_ = true;
  changed_.notify_all();
}

void RemovalLog::add(const Frame& frame, const FrameResult& result) {
  Entry entry{{}, result, frame.colour.size(), strip_.wants()};
  if (entry.in_strip || settings_.with_video) entry.colour = frame.colour;
  std::unique_lock lock(mutex_);
  const auto has_room = [&] { return queue_.size() < kQueue || failure_; };
  if (settings_.mode == Mode::kDeterministic) {
    changed_.wait(lock, has_room);
  } else if (!has_room()) {
    // The disk is slower than the camera: of this frame only its line is kept, a few kilobytes in place of
    // megabytes.
    if (queue_.size() >= kLineQueue) {
      ++lines_dropped_;
      return;
    }
    lock.unlock();
    keep_line_only(entry);
    lock.lock();
  }
  queue_.push_back(std::move(entry));
  changed_.notify_all();
}

void RemovalLog::keep_line_only(Entry& entry) {
  const PointCounts removed = removed_by_class(entry.result, entry.image);
  entry.tally.add(entry.result, entry.image, removed);
  const DynamicObjects& dynamic = entry.result.dynamic_objects;
  if (!dynamic.objects.empty() && !dynamic.mask.empty()) ++entry.tally.masks_dropped;
  entry.line = descriptor_line(entry.result, entry.image, removed, "");
  entry.result = {};
  entry.colour.release();
}

void RemovalLog::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return is_closed_ || !queue_.empty(); });
    if (queue_.empty()) return;
    const Entry entry = std::move(queue_.front());
    queue_.pop_front();
    changed_.notify_all();
    if (failure_) continue;
    lock.unlock();
    std::exception_ptr failure;
    try {
      write(entry);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    failure_ = failure;
  }
}

void RemovalLog::write(const Entry& entry) {
  if (!entry.line.empty()) {
    tally_.merge(entry.tally);
    write_line(entry.line);
    return;
  }
  const FrameResult& result = entry.result;
  const PointCounts removed = removed_by_class(result, entry.image);
  tally_.add(result, entry.image, removed);
  std::string mask;
  if (!result.dynamic_objects.objects.empty() && !result.dynamic_objects.mask.empty()) {
    mask = mask_name(result.timestamp);
    roslam::write_image(settings_.folder / mask, object_image(result.dynamic_objects.objects, entry.image));
  }
  write_line(descriptor_line(result, entry.image, removed, mask));
  if (!entry.colour.empty()) add_to_images(entry);
}

void RemovalLog::write_line(const std::string& line) {
  lines_ << line << "\n";
  if (!lines_) throw OutputError((settings_.folder / kDescriptorFile).string() + kFullDisk);
}

void RemovalLog::add_to_images(const Entry& entry) {
  const cv::Mat image = removal_image(entry.colour, entry.result.dynamic_objects, entry.result.points,
                                      entry.result.removed_points);
  if (entry.in_strip) strip_.add(image);
  if (!settings_.with_video) return;
  if (!video_.isOpened()) {
    const auto file = settings_.folder / kVideo;
    const int motion_jpeg = cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
    if (!video_.open(file.string(), cv::CAP_OPENCV_MJPEG, motion_jpeg, settings_.fps, image.size()))
      throw OutputError(file.string() + ": cannot be written as a video");
  }
  video_.write(image);
}

void RemovalLog::finish() {
  {
    const std::scoped_lock lock(mutex_);
    is_closed_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
  tally_.lines_dropped = lines_dropped_;
  lines_.close();
  const bool has_video = video_.isOpened();
  video_.release();
  if (!failure_ && !lines_) {
    failure_ =
        std::make_exception_ptr(OutputError((settings_.folder / kDescriptorFile).string() + kFullDisk));
  }
  if (!failure_ && has_video && !is_whole_video(settings_.folder / kVideo))
    failure_ = std::make_exception_ptr(OutputError((settings_.folder / kVideo).string() + kFullDisk));
  if (failure_) {
    // On a full disk the trajectory needs the space more.
    remove_old(settings_.folder);
    std::rethrow_exception(failure_);
  }
  const std::vector<cv::Mat> images = strip_.images();
  if (images.empty()) return;
  constexpr int kColumns = 4;
  constexpr int kWidth = 400;  // pixels
  write_image(settings_.folder / kStrip, removal_strip(images, kColumns, kWidth),
              {cv::IMWRITE_JPEG_QUALITY, 88});
}

}  // namespace roslam::recording
