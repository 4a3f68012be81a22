// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/removal_log.hpp"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "roslam/error.hpp"
#include "roslam/removal/removal_picture.hpp"
#include "roslam/sources/image_file.hpp"
#include "roslam/write_file.hpp"

namespace roslam {

namespace {
namespace fs = std::filesystem;

constexpr std::size_t kQueue = 30;  // frames that may wait to be written
constexpr std::size_t kStripPictures = 8;
constexpr const char* kFullDisk = ": cannot be written in full; check the free space on the disk";
constexpr const char* kStrip = "removal.jpg";
constexpr const char* kVideo = "removal.avi";
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

RemovalLog::RemovalLog(const Settings& settings) : settings_(settings), strip_(kStripPictures) {
  remove_old(settings.folder);
  make_folder(settings.folder / kMaskFolder);
  lines_.open(settings.folder / kDescriptorFile, std::ios::binary);
  if (!lines_) throw OutputError((settings.folder / kDescriptorFile).string() + ": cannot open for writing");
  thread_ = std::jthread([this] { work(); });
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
    // The line is what nobody can do without; it is small.
    entry.colour.release();
    entry.with_mask = false;
  }
  queue_.push_back(std::move(entry));
  changed_.notify_all();
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
  const FrameResult& result = entry.result;
  const PointCounts removed = removed_by_class(result, entry.picture);
  tally_.add(result, entry.picture, removed);
  std::string mask;
  if (!entry.with_mask) {
    ++tally_.masks_dropped;
  } else if (!result.removal.objects.empty() && !result.removal.mask.empty()) {
    mask = mask_name(result.timestamp);
    write_image(settings_.folder / mask, object_image(result.removal.objects, entry.picture));
  }
  lines_ << descriptor_line(result, entry.picture, removed, mask) << "\n";
  if (!lines_) {
    throw OutputError((settings_.folder / kDescriptorFile).string() + kFullDisk);
  }
  if (!entry.colour.empty()) write_picture(entry);
}

void RemovalLog::write_picture(const Entry& entry) {
  const cv::Mat picture =
      removal_picture(entry.colour, entry.result.removal, entry.result.points, entry.result.removed_points);
  if (entry.in_strip) strip_.add(picture);
  if (!settings_.with_video) return;
  if (!video_.isOpened()) {
    const auto file = settings_.folder / kVideo;
    const int motion_jpeg = cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
    if (!video_.open(file.string(), cv::CAP_OPENCV_MJPEG, motion_jpeg, settings_.fps, picture.size()))
      throw OutputError(file.string() + ": cannot be written as a video");
  }
  video_.write(picture);
}

void RemovalLog::finish() {
  {
    const std::scoped_lock lock(mutex_);
    is_closed_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
  lines_.close();
  video_.release();
  if (!failure_ && !lines_) {
    failure_ =
        std::make_exception_ptr(OutputError((settings_.folder / kDescriptorFile).string() + kFullDisk));
  }
  if (failure_) {
    // On a full disk the trajectory needs the room more.
    remove_old(settings_.folder);
    std::rethrow_exception(failure_);
  }
  const std::vector<cv::Mat> pictures = strip_.pictures();
  if (pictures.empty()) return;
  constexpr int kColumns = 4;
  constexpr int kWidth = 400;  // pixels
  write_image(settings_.folder / kStrip, removal_strip(pictures, kColumns, kWidth),
              {cv::IMWRITE_JPEG_QUALITY, 88});
}

}  // namespace roslam
