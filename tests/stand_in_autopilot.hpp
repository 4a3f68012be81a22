// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <limits>
#include <mutex>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "telemetry/mavlink/mavlink_frame.hpp"

namespace roslam::telemetry {

/// Whether it becomes true within 20 s.
inline bool comes(const std::function<bool()>& is_there) {
  for (int i = 0; i < 2000; ++i) {
    if (is_there()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

/// A UDP socket on this computer that speaks as PX4 does: a heartbeat a second, and ten times a second a
/// TIMESYNC with tc1 = 0 and ts1 = its time, whose answers give the offset of the other clock. Its own clock
/// is ahead by kAhead. Keeps what it hears.
class StandInAutopilot {
 public:
  static constexpr std::int64_t kAhead = 1'234'567'890'123;  // ns

  struct Heard {
    std::int64_t time = 0;  // ns, steady clock
    ReceivedMessage message;
  };

  explicit StandInAutopilot(bool speaks = true) : speaks_(speaks) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    constexpr int kBuffer = 1 << 20;
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &kBuffer, sizeof(kBuffer));
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address), size), 0);
    getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
  }
  ~StandInAutopilot() {
    thread_ = {};
    close(socket_);
  }

  std::string address() const { return "udp:127.0.0.1:" + std::to_string(port_); }

  std::vector<Heard> heard() const {
    const std::scoped_lock lock(mutex_);
    return heard_;
  }
  /// All bytes that came, as they came.
  std::vector<std::uint8_t> bytes() const {
    const std::scoped_lock lock(mutex_);
    return bytes_;
  }
  template <typename Message>
  std::vector<Message> all() const {
    std::vector<Message> result;
    for (const Heard& one : heard())
      if (const auto* message = std::get_if<Message>(&one.message.message)) result.push_back(*message);
    return result;
  }

  /// Of the other clock against this computer's steady clock, ns; that of the shortest way there and back.
  std::int64_t offset() const {
    std::int64_t best = std::numeric_limits<std::int64_t>::max(), offset = best;
    for (const Heard& one : heard()) {
      const auto* answer = std::get_if<TimesyncMessage>(&one.message.message);
      if (answer == nullptr || answer->tc1 == 0) continue;
      const std::int64_t sent = answer->ts1 - kAhead, way = one.time - sent;
      if (way < best) offset = answer->tc1 - (sent + way / 2);
      best = std::min(best, way);
    }
    return offset;
  }

  static std::int64_t now() {
    return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  }

 private:
  void work(const std::stop_token& stop) {
    MavlinkDecoder decoder;
    std::int64_t due = 0;
    for (std::uint8_t sequence = 0; !stop.stop_requested();) {
      pollfd file{socket_, POLLIN, 0};
      poll(&file, 1, 10);
      std::uint8_t bytes[2048];
      sockaddr_storage from{};
      socklen_t size = sizeof(from);
      const ssize_t count =
          recvfrom(socket_, bytes, sizeof(bytes), MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from), &size);
      const std::int64_t time = now();
      if (count > 0) {
        peer_ = from;
        peer_size_ = size;
        const std::scoped_lock lock(mutex_);
        for (const std::uint8_t byte : std::span(bytes).first(static_cast<std::size_t>(count)))
          bytes_.push_back(byte);
        for (const auto& one : decoder.add({bytes, static_cast<std::size_t>(count)}))
          heard_.push_back({time, one});
      }
      if (!speaks_ || peer_size_ == 0 || time < due) continue;
      due = time + 100'000'000;
      say(TimesyncMessage{0, now() + kAhead, 0, 0}, sequence);
      HeartbeatMessage heartbeat;
      heartbeat.autopilot = 12;  // PX4
      if (sequence++ % 10 == 0) say(heartbeat, sequence);
    }
  }

  void say(const MavlinkMessage& message, std::uint8_t sequence) const {
    const auto frame = encode(message, {1, 1}, sequence);
    sendto(socket_, frame.data(), frame.size(), 0, reinterpret_cast<const sockaddr*>(&peer_), peer_size_);
  }

  bool speaks_;
  int socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  int port_ = 0;
  sockaddr_storage peer_{};
  socklen_t peer_size_ = 0;
  mutable std::mutex mutex_;
  std::vector<Heard> heard_;
  std::vector<std::uint8_t> bytes_;
  std::jthread thread_;
};

}  // namespace roslam::telemetry
