// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/mavlink/mavlink_sender.hpp"

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <deque>
#include <mutex>
#include <stop_token>
#include <thread>

#include "roslam/common/error.hpp"
#include "roslam/common/file_descriptor.hpp"
#include "roslam/common/formatted.hpp"
#include "roslam/common/thread_priority.hpp"
#include "telemetry/mavlink/autopilot_watch.hpp"

namespace roslam::telemetry {

namespace {
using Clock = std::chrono::steady_clock;
constexpr std::size_t kRoom = 64;          // frames that may wait
constexpr std::size_t kMostWarnings = 20;  // of a run
constexpr auto kSecond = std::chrono::seconds(1);

// A frame and when its pose was known.
struct Waiting {
  TrackingReport report;
  Clock::time_point known;
};
}  // namespace

class MavlinkSender::Impl {
 public:
  Impl(const MavlinkAddress& address, const MavlinkSenderOptions& options, Loops loops);
  ~Impl() { finish(); }

  void add(const TrackingReport& report);
  void finish();
  MavlinkReport report() const;
  std::vector<std::string> take_warnings();

 private:
  void work(const std::stop_token& stop);
  void wait();
  void wake() const;
  void receive();
  void take(const ReceivedMessage& received);
  void answer(const TimesyncMessage& question, MavlinkId from);
  void send_reports();
  bool send(const MavlinkMessage& message);
  void say(MavlinkSeverity severity, const std::string& words) { send(StatusTextMessage(severity, words)); }
  void each_second();
  void check_camera(Clock::time_point now);
  void tell_loops();
  void note_link();
  void warn(const std::string& words);

  MavlinkAddress address_;
  MavlinkSenderOptions options_;
  Loops loops_;
  FileDescriptor wake_{eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)};

  // By the sender's thread.
  std::unique_ptr<MavlinkLink> link_;
  OdometryStream stream_;
  MavlinkDecoder decoder_;
  AutopilotWatch watch_;
  std::uint8_t sequence_ = 0;
  Clock::time_point due_ = Clock::now();  // when the next heartbeat is
  std::optional<Clock::time_point> last_frame_;
  std::size_t loops_told_ = 0;
  bool is_camera_lost_ = false, was_link_lost_ = false;

  mutable std::mutex mutex_;  // guards what follows
  std::deque<Waiting> waiting_;
  bool is_finished_ = false;
  MavlinkReport report_;
  StageTimes times_;
  std::vector<std::string> warnings_;
  std::size_t all_warnings_ = 0;
  std::jthread thread_;  // last, so that it ends before what it uses goes away
};

MavlinkSender::Impl::Impl(const MavlinkAddress& address, const MavlinkSenderOptions& options, Loops loops)
    : address_(address),
      options_(options),
      loops_(std::move(loops)),
      stream_(options.stream),
      watch_(address.kind, options) {
  options.validate();
  if (!wake_) throw MemoryError("--mavlink " + address.text + ": too many files are open");
  link_ = open_mavlink_link(address);
  report_.address = address.text;
  report_.frame = options.stream.frame;
  const double load = options.bytes_per_second();
  if (const int baud = baud_for(load); address.capacity() && address.baud < baud)
    warn(formatted("%.1f kB a second are to be sent, ", load / 1e3) +
         formatted("and the port carries %.1f: poses will be dropped; use ", *address.capacity() / 1e3) +
         std::to_string(baud) + " baud or more");
  thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

void MavlinkSender::Impl::add(const TrackingReport& report) {
  {
    const std::scoped_lock lock(mutex_);
    if (is_finished_) return;
    waiting_.push_back({report, Clock::now()});
    if (waiting_.size() > kRoom) {
      waiting_.pop_front();
      ++report_.frames_dropped;
    }
  }
  wake();
}

void MavlinkSender::Impl::finish() {
  {
    const std::scoped_lock lock(mutex_);
    is_finished_ = true;
  }
  thread_.request_stop();
  wake();
  if (thread_.joinable()) thread_.join();
}

MavlinkReport MavlinkSender::Impl::report() const {
  const std::scoped_lock lock(mutex_);
  MavlinkReport report = report_;
  const auto summaries = times_.summary();
  if (const auto found = summaries.find("pose to packet"); found != summaries.end())
    report.from_pose = found->second;
  return report;
}

std::vector<std::string> MavlinkSender::Impl::take_warnings() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(warnings_, {});
}

void MavlinkSender::Impl::warn(const std::string& words) {
  const std::scoped_lock lock(mutex_);
  if (++all_warnings_ <= kMostWarnings) warnings_.push_back("mavlink " + address_.text + ": " + words);
}

// A byte counter that poll() sees: it cannot be full, and nobody waits for it.
void MavlinkSender::Impl::wake() const { eventfd_write(wake_.get(), 1); }

void MavlinkSender::Impl::work(const std::stop_token& stop) {
  raise_thread_priority();  // microseconds of work a frame, and a pose is worth less the later it is
  while (true) {
    const bool is_last = stop.stop_requested();
    if (!is_last) wait();
    link_->tend();
    note_link();
    receive();
    send_reports();
    if (Clock::now() >= due_) each_second();
    if (is_last) break;
  }
  say(MavlinkSeverity::kNotice, "RO-SLAM: run ended");
}

// Until there is something to send or to read, or a heartbeat is due.
void MavlinkSender::Impl::wait() {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(due_ - Clock::now());
  const auto timeout = std::clamp<std::chrono::milliseconds::rep>(left.count(), 0, 1000);
  std::array<pollfd, 2> files{pollfd{wake_.get(), POLLIN, 0}, pollfd{link_->descriptor(), POLLIN, 0}};
  poll(files.data(), files.size(), static_cast<int>(timeout));
  eventfd_t count = 0;
  eventfd_read(wake_.get(), &count);
}

void MavlinkSender::Impl::receive() {
  constexpr int kMost = 64;  // reads before poses have their turn
  for (int i = 0; i < kMost; ++i) {
    const std::vector<std::uint8_t> bytes = link_->receive();
    if (bytes.empty()) break;
    for (const ReceivedMessage& received : decoder_.add(bytes)) take(received);
    if (link_->is_datagram()) decoder_.clear();
  }
  const std::scoped_lock lock(mutex_);
  report_.damaged = decoder_.damaged_frames();
  report_.signed_frames = decoder_.signed_frames();
}

void MavlinkSender::Impl::take(const ReceivedMessage& received) {
  if (received.sender == options_.id) return;  // an echo
  {
    const std::scoped_lock lock(mutex_);
    ++report_.received;
  }
  if (const auto* question = std::get_if<TimesyncMessage>(&received.message))
    answer(*question, received.sender);
  const auto* heartbeat = std::get_if<HeartbeatMessage>(&received.message);
  if (heartbeat == nullptr) return;
  watch_.hear(*heartbeat, received.sender);
  const std::scoped_lock lock(mutex_);
  report_.autopilot = watch_.system();
}

// On the clock of time_usec, at once: the way of the message counts twice.
void MavlinkSender::Impl::answer(const TimesyncMessage& question, MavlinkId from) {
  const auto is_for = [](std::uint8_t target, std::uint8_t own) { return target == 0 || target == own; };
  if (question.tc1 != 0 || !is_for(question.target_system, options_.id.system) ||
      !is_for(question.target_component, options_.id.component))
    return;
  if (!send(TimesyncMessage{CompanionClock::now_nanoseconds(), question.ts1, from.system, from.component}))
    return;
  const std::scoped_lock lock(mutex_);
  ++report_.timesync_answered;
}

void MavlinkSender::Impl::send_reports() {
  while (true) {
    Waiting next;
    {
      const std::scoped_lock lock(mutex_);
      if (waiting_.empty()) return;
      next = std::move(waiting_.front());
      waiting_.pop_front();
    }
    last_frame_ = next.known;
    if (is_camera_lost_) say(MavlinkSeverity::kNotice, "RO-SLAM: images again");
    is_camera_lost_ = false;
    for (const MavlinkMessage& message : stream_.add(next.report)) {
      const bool is_pose = std::holds_alternative<OdometryMessage>(message);
      const bool is_sent = send(message);
      if (!is_pose) continue;
      const std::scoped_lock lock(mutex_);
      if (is_sent) {
        times_.add("pose to packet", std::chrono::duration<double>(Clock::now() - next.known).count());
      } else {
        ++report_.odometry_dropped;
      }
    }
    const std::scoped_lock lock(mutex_);
    report_.stream = stream_.counts();
  }
}

bool MavlinkSender::Impl::send(const MavlinkMessage& message) {
  const std::vector<std::uint8_t> frame = encode(message, options_.id, sequence_);
  const bool is_sent = link_->send(frame);
  if (is_sent) ++sequence_;
  const std::scoped_lock lock(mutex_);
  if (is_sent) {
    ++report_.sent;
    report_.bytes += frame.size();
  } else {
    ++report_.dropped;
  }
  return is_sent;
}

void MavlinkSender::Impl::each_second() {
  const auto now = Clock::now();
  due_ = std::max(due_ + kSecond, now);
  check_camera(now);
  HeartbeatMessage heartbeat;
  heartbeat.system_status =
      static_cast<std::uint8_t>(is_camera_lost_ ? MavlinkState::kCritical : stream_.state());
  send(heartbeat);
  if (const auto doubt = watch_.doubt()) warn(*doubt);
  if (const auto origin = watch_.next_origin()) send(*origin);
  tell_loops();
}

void MavlinkSender::Impl::check_camera(Clock::time_point now) {
  if (options_.stream.mode == Mode::kDeterministic || is_camera_lost_ || !last_frame_ ||
      now - *last_frame_ < options_.camera_silence)
    return;
  is_camera_lost_ = true;
  say(MavlinkSeverity::kCritical,
      formatted("RO-SLAM: no images for %.1f s", std::chrono::duration<double>(now - *last_frame_).count()));
}

void MavlinkSender::Impl::tell_loops() {
  if (!loops_) return;
  const std::vector<ClosedLoop> loops = loops_();
  constexpr std::size_t kMost = 3;  // texts at once
  for (std::size_t i = std::max(loops_told_, loops.size() - std::min(loops.size(), kMost)); i < loops.size();
       ++i)
    say(MavlinkSeverity::kInfo, loops[i].merges_submaps
                                    ? "RO-SLAM: submaps merged"
                                    : formatted("RO-SLAM: loop closed, map moved by %.2f m", loops[i].moved));
  loops_told_ = std::max(loops_told_, loops.size());
}

void MavlinkSender::Impl::note_link() {
  const bool is_lost = !link_->fault().empty();
  if (is_lost && !was_link_lost_)
    warn("the link is lost: " + link_->fault() + "; it is tried again each second");
  if (!is_lost && was_link_lost_) warn("the link is back");
  was_link_lost_ = is_lost;
  const std::scoped_lock lock(mutex_);
  report_.link_losses = link_->losses();
}

MavlinkSender::MavlinkSender(const MavlinkAddress& address, const MavlinkSenderOptions& options, Loops loops)
    : impl_(std::make_unique<Impl>(address, options, std::move(loops))) {}

MavlinkSender::~MavlinkSender() = default;

void MavlinkSender::add(const TrackingReport& report) { impl_->add(report); }

void MavlinkSender::finish() { impl_->finish(); }

MavlinkReport MavlinkSender::report() const { return impl_->report(); }

std::vector<std::string> MavlinkSender::take_warnings() { return impl_->take_warnings(); }

}  // namespace roslam::telemetry
