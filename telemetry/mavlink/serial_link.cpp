// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <thread>

#include "roslam/common/error.hpp"
#include "roslam/common/file_descriptor.hpp"
#include "telemetry/mavlink/links.hpp"
#include "telemetry/mavlink/mavlink_frame.hpp"

namespace roslam::telemetry {

namespace {
struct Baud {
  int rate;
  speed_t code;
};
constexpr std::array kBauds{Baud{9600, B9600},       Baud{19200, B19200},     Baud{38400, B38400},
                            Baud{57600, B57600},     Baud{115200, B115200},   Baud{230400, B230400},
                            Baud{460800, B460800},   Baud{500000, B500000},   Baud{576000, B576000},
                            Baud{921600, B921600},   Baud{1000000, B1000000}, Baud{1152000, B1152000},
                            Baud{1500000, B1500000}, Baud{2000000, B2000000}, Baud{2500000, B2500000},
                            Baud{3000000, B3000000}, Baud{3500000, B3500000}, Baud{4000000, B4000000}};

const Baud* baud_of(int rate) {
  const auto* found =
      std::find_if(kBauds.begin(), kBauds.end(), [rate](const Baud& one) { return one.rate == rate; });
  return found == kBauds.end() ? nullptr : found;
}

std::string remedy_for(int error) {
  switch (error) {
    case EACCES:
    case EPERM:
      return "no permission; add the user to the group of the device (sudo usermod -aG dialout $USER) and "
             "log "
             "in again";
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return "no such device; connect it, and see ls /dev/tty*";
    case EBUSY:
      return "in use by another program; end that first";
    case ENOTTY:
      return "is no serial port; see ls /dev/tty*";
    default:
      return std::system_category().message(error);
  }
}

class SerialLink : public MavlinkLink {
 public:
  explicit SerialLink(const MavlinkAddress& address) : address_(address) {
    if (const int error = open_port(); error != 0)
      throw InputError("--mavlink " + address.text + ": " + address.device + ": " + remedy_for(error));
  }

  // What was sent last has a moment to leave.
  ~SerialLink() override {
    constexpr int kTimes = 20;
    for (int i = 0; i < kTimes && (waiting() > 0 || !rest_.empty()); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      flush();
    }
    close_port();
  }

  // What waits in the buffers of the port is late when it arrives: a tenth of a second's worth is enough.
  bool send(std::span<const std::uint8_t> message) override {
    flush();
    if (!port_ || !rest_.empty()) return false;
    constexpr double kLongest = 0.1;  // seconds
    const auto room = std::max<std::size_t>(2 * kLongestMavlinkFrame,
                                            static_cast<std::size_t>(kLongest * *address_.capacity()));
    if (waiting() + message.size() > room) return false;
    const std::size_t sent = write_some(message);
    if (!port_ || sent == 0) return false;
    rest_.assign(message.begin() + static_cast<std::ptrdiff_t>(sent), message.end());
    return true;
  }

  std::vector<std::uint8_t> receive() override {
    flush();
    if (!port_) return {};
    std::array<std::uint8_t, 1024> bytes{};
    const ssize_t size = read(port_.get(), bytes.data(), bytes.size());
    if (size > 0) return {bytes.begin(), bytes.begin() + size};
    if (size == 0) lose(EIO);  // hung up
    if (size < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) lose(errno);
    return {};
  }

  void tend() override {
    constexpr auto kRetry = std::chrono::seconds(1);
    if (port_ || Clock::now() - lost_ < kRetry) return;
    lost_ = Clock::now();
    if (open_port() == 0) clear_fault();
  }

  bool is_datagram() const override { return false; }
  int descriptor() const override { return port_.get(); }

 private:
  // Returns the error number, or 0.
  int open_port() {
    FileDescriptor port(open(address_.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    if (!port) return errno;
    termios settings{};
    if (tcgetattr(port.get(), &settings) != 0) return errno;
    cfmakeraw(&settings);
    settings.c_cflag |= static_cast<tcflag_t>(CLOCAL | CREAD);
    settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB | PARENB);
    settings.c_cc[VMIN] = 1;  // else a read of nothing looks like a port that hung up
    settings.c_cc[VTIME] = 0;
    const speed_t speed = baud_of(address_.baud)->code;
    cfsetispeed(&settings, speed);
    cfsetospeed(&settings, speed);
    if (tcsetattr(port.get(), TCSANOW, &settings) != 0) return errno;
    termios in_effect{};
    if (tcgetattr(port.get(), &in_effect) != 0) return errno;
    if (cfgetospeed(&in_effect) != speed) return EINVAL;
    tcflush(port.get(), TCIOFLUSH);
    port_ = std::move(port);
    rest_.clear();
    return 0;
  }

  // Bytes that the port has not sent yet, as far as its driver tells.
  std::size_t waiting() const {
    int count = 0;
    const bool is_told = port_ && ioctl(port_.get(), TIOCOUTQ, &count) == 0 && count > 0;
    return is_told ? static_cast<std::size_t>(count) : 0;
  }

  std::size_t write_some(std::span<const std::uint8_t> bytes) {
    const ssize_t sent = write(port_.get(), bytes.data(), bytes.size());
    if (sent >= 0) return static_cast<std::size_t>(sent);
    if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) lose(errno);
    return 0;
  }

  // The rest of a message that was taken in part.
  void flush() {
    if (!port_ || rest_.empty()) return;
    const std::size_t sent = write_some(rest_);
    if (port_) rest_.erase(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(sent));
  }

  // Without what waits: closing would wait for a port that sends nothing.
  void close_port() {
    if (port_) tcflush(port_.get(), TCIOFLUSH);
    port_.reset();
    rest_.clear();
  }

  void lose(int error) {
    close_port();
    lost_ = Clock::now();
    note_fault(address_.device + ": " + std::system_category().message(error));
  }

  MavlinkAddress address_;
  FileDescriptor port_;
  std::vector<std::uint8_t> rest_;
  Clock::time_point lost_;
};
}  // namespace

std::unique_ptr<MavlinkLink> open_serial_link(const MavlinkAddress& address) {
  return std::make_unique<SerialLink>(address);
}

bool is_baud(int baud) { return baud_of(baud) != nullptr; }

int baud_for(double bytes_per_second) {
  constexpr double kBits = 10.0, kSpare = 0.8;  // of a byte; share of the rate
  const auto* found = std::find_if(kBauds.begin(), kBauds.end(), [&](const Baud& one) {
    return kSpare * one.rate >= kBits * bytes_per_second;
  });
  return found == kBauds.end() ? kBauds.back().rate : found->rate;
}

std::string bauds_in_words() {
  std::string words;
  for (const Baud& one : kBauds) words += (words.empty() ? "" : ", ") + std::to_string(one.rate);
  return words;
}

}  // namespace roslam::telemetry
