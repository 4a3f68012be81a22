// SPDX-License-Identifier: BSD-3-Clause
// Links that are addressed wrongly, fill up, vanish and come back.
#include "telemetry/mavlink/mavlink_link.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <termios.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "roslam/common/error.hpp"
#include "telemetry/mavlink/mavlink_frame.hpp"
#include "tests/scratch.hpp"
#include "tests/stand_in_autopilot.hpp"

namespace roslam::telemetry {
namespace {

using std::chrono::milliseconds;
namespace fs = std::filesystem;

std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string open_error(const std::string& text) {
  return error_of([&] { open_mavlink_link(MavlinkAddress::from(text)); });
}

#define EXPECT_SAYS(text, part)                                                             \
  do {                                                                                      \
    const std::string said = (text);                                                        \
    EXPECT_NE(said.find(part), std::string::npos) << "says: " << said << "\nnot: " << part; \
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;                                  \
  } while (false)

TEST(MavlinkAddress, ReadsBothKinds) {
  const MavlinkAddress udp = MavlinkAddress::from("udp:drone.local:14550");
  EXPECT_EQ(udp.kind, MavlinkAddress::Kind::kUdp);
  EXPECT_EQ(udp.host, "drone.local");
  EXPECT_EQ(udp.port, 14550);
  EXPECT_EQ(udp.local_port, 0);
  EXPECT_FALSE(udp.capacity());
  const MavlinkAddress both = MavlinkAddress::from("udp:127.0.0.1:14580:14540");
  EXPECT_EQ(both.port, 14580);
  EXPECT_EQ(both.local_port, 14540);
  const MavlinkAddress six = MavlinkAddress::from("udp:[fe80::1]:14550");
  EXPECT_EQ(six.host, "fe80::1");
  EXPECT_EQ(six.port, 14550);
  const MavlinkAddress serial = MavlinkAddress::from("serial:/dev/serial/by-id/usb-1:0:921600");
  EXPECT_EQ(serial.kind, MavlinkAddress::Kind::kSerial);
  EXPECT_EQ(serial.device, "/dev/serial/by-id/usb-1:0");
  EXPECT_EQ(serial.baud, 921600);
  EXPECT_DOUBLE_EQ(*serial.capacity(), 92160.0);
}

TEST(MavlinkAddress, SaysWhatIsWrong) {
  const auto error = [](const std::string& text) { return error_of([&] { MavlinkAddress::from(text); }); };
  for (const char* text : {"", "tcp:127.0.0.1:5760", "/dev/ttyTHS1", "UDP:1:2", "udp", "serial"})
    EXPECT_SAYS(error(text), "is neither udp nor serial; give udp:HOST:PORT or serial:DEVICE:BAUD");
  for (const char* text :
       {"udp:", "udp:host", "udp::14550", "udp:::1:5", "udp:[::1", "udp:[]:1", "udp:[::1]x:5"})
    EXPECT_SAYS(error(text), "has no host and port");
  for (const char* text : {"udp:host:", "udp:host:0", "udp:host:65536", "udp:host:x", "udp:host:1 ",
                           "udp:h:5:", "udp:h:5:-1", "udp:h:5:6:7"})
    EXPECT_SAYS(error(text), "is no port; use 1 to 65535");
  for (const char* text : {"serial:", "serial:/dev/ttyUSB0", "serial::57600"})
    EXPECT_SAYS(error(text), "has no device and baud rate");
  for (const char* text : {"serial:/dev/ttyUSB0:", "serial:/dev/ttyUSB0:x", "serial:/dev/ttyUSB0:-1",
                           "serial:/dev/ttyUSB0:12345", "serial:/dev/ttyUSB0:99999999999"})
    EXPECT_SAYS(error(text), "is no baud rate of a serial port; use one of 9600, ");
}

TEST(MavlinkAddress, KnowsTheBaudRateForALoad) {
  EXPECT_EQ(baud_for(100.0), 9600);
  EXPECT_EQ(baud_for(7400.0), 115200);  // 30 poses a second: 57600 carries 5760 bytes
  EXPECT_EQ(baud_for(9216.0), 115200);
  EXPECT_EQ(baud_for(9217.0), 230400);
  EXPECT_EQ(baud_for(1e9), 4000000);
}

TEST(UdpLink, SaysThatAHostIsNotKnown) {
  EXPECT_SAYS(open_error("udp:no-such-host.invalid:14550"), "the host is not known");
}

TEST(UdpLink, SaysThatALocalPortIsInUse) {
  const StandInAutopilot other(false);
  const std::string port = other.address().substr(other.address().rfind(':') + 1);
  EXPECT_SAYS(open_error("udp:127.0.0.1:9:" + port), "port " + port + " is in use");
}

// Waits for what must come, for longer than it ever takes.
bool comes(const std::function<bool()>& is_there) {
  for (int i = 0; i < 2000; ++i) {
    if (is_there()) return true;
    std::this_thread::sleep_for(milliseconds(10));
  }
  return false;
}

TEST(UdpLink, IsTakenUpAgainWhenTheHostListensAgain) {
  std::string address;
  {
    const StandInAutopilot gone(false);
    address = gone.address();
  }
  const auto link = open_mavlink_link(MavlinkAddress::from(address));
  const auto message = encode(HeartbeatMessage{}, {}, 0);
  EXPECT_TRUE(comes([&] {
    link->send(message);
    link->receive();
    return !link->fault().empty();
  }));
  EXPECT_EQ(link->losses(), 1U);
  for (int i = 0; i < 20; ++i) link->send(message);
  EXPECT_EQ(link->losses(), 1U);  // once, however many datagrams
  // Now somebody listens on that port.
  const int listener = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  at.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
  ASSERT_EQ(bind(listener, reinterpret_cast<sockaddr*>(&at), sizeof(at)), 0);
  EXPECT_TRUE(comes([&] {
    link->tend();
    return link->send(message) && link->fault().empty();
  }));
  std::uint8_t bytes[64];
  EXPECT_EQ(recv(listener, bytes, sizeof(bytes), MSG_DONTWAIT), static_cast<ssize_t>(message.size()));
  close(listener);
}

TEST(UdpLink, HearsAnswersOnTheSameSocket) {
  const StandInAutopilot autopilot(true);
  const auto link = open_mavlink_link(MavlinkAddress::from(autopilot.address()));
  link->send(encode(HeartbeatMessage{}, {}, 0));
  std::vector<std::uint8_t> bytes;
  EXPECT_TRUE(comes([&] { return !(bytes = link->receive()).empty(); }));
  EXPECT_EQ(MavlinkDecoder().add(bytes).size(), 1U);
}

// A serial port whose other end is in this program. Its name stays, as udev's names of devices do.
class PseudoTerminal {
 public:
  PseudoTerminal() { plug_in(); }
  ~PseudoTerminal() {
    unplug();
    fs::remove(name_);
  }

  void plug_in() {
    char device[256];
    int slave = -1;
    ASSERT_EQ(openpty(&master_, &slave, device, nullptr, nullptr), 0);
    close(slave);
    fcntl(master_, F_SETFL, O_NONBLOCK);
    fs::remove(name_);
    fs::create_symlink(device, name_);
  }
  void unplug() {
    if (master_ >= 0) close(master_);
    master_ = -1;
    fs::remove(name_);
  }

  std::vector<std::uint8_t> read_all() const {
    std::vector<std::uint8_t> all;
    std::uint8_t bytes[1024];
    for (ssize_t count = 0; (count = read(master_, bytes, sizeof(bytes))) > 0;)
      all.insert(all.end(), bytes, bytes + count);
    return all;
  }
  void write_all(const std::vector<std::uint8_t>& bytes) const {
    EXPECT_EQ(write(master_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  speed_t speed() const {
    termios settings{};
    EXPECT_EQ(tcgetattr(master_, &settings), 0);
    return cfgetospeed(&settings);
  }
  bool is_raw() const {
    termios settings{};
    tcgetattr(master_, &settings);
    return (settings.c_lflag & (ICANON | ECHO)) == 0 && (settings.c_oflag & OPOST) == 0;
  }
  std::string address(int baud = 921600) const {
    return "serial:" + name_.string() + ":" + std::to_string(baud);
  }

 private:
  fs::path name_ = scratch_path(".tty");
  int master_ = -1;
};

TEST(SerialLink, SetsBaudAndRawBytesAndCarriesBothWays) {
  PseudoTerminal terminal;
  const auto link = open_mavlink_link(MavlinkAddress::from(terminal.address(57600)));
  EXPECT_EQ(terminal.speed(), static_cast<speed_t>(B57600));
  EXPECT_TRUE(terminal.is_raw());
  EXPECT_TRUE(link->receive().empty());
  EXPECT_TRUE(link->fault().empty());
  StatusTextMessage text(MavlinkSeverity::kInfo, "\x03\x04\n\r\x11\x13\x7f");  // what a terminal would eat
  const auto frame = encode(text, {}, 10);
  EXPECT_TRUE(link->send(frame));
  EXPECT_EQ(terminal.read_all(), frame);
  terminal.write_all(frame);
  EXPECT_EQ(link->receive(), frame);
}

// Nobody reads: messages are dropped, whole ones, and nothing waits.
TEST(SerialLink, DropsWholeMessagesWhenItIsFull) {
  PseudoTerminal terminal;
  const auto link = open_mavlink_link(MavlinkAddress::from(terminal.address()));
  std::size_t taken = 0, dropped = 0;
  OdometryMessage message;
  for (int i = 0; i < 2000; ++i) {
    message.time_usec = static_cast<std::uint64_t>(i);
    message.quality = 50;
    (link->send(encode(message, {}, static_cast<std::uint8_t>(i))) ? taken : dropped) += 1;
  }
  EXPECT_GT(taken, 5U);
  EXPECT_GT(dropped, 1000U);
  EXPECT_TRUE(link->fault().empty());
  // Someone reads again: what was taken comes in whole frames.
  MavlinkDecoder decoder;
  std::size_t found = 0;
  for (int i = 0; i < 200; ++i) {
    found += decoder.add(terminal.read_all()).size();
    link->receive();  // passes on the rest of a message
  }
  EXPECT_EQ(found, taken);
  EXPECT_EQ(decoder.damaged_frames(), 0U);
  EXPECT_TRUE(link->send(encode(message, {}, 0)));
}

TEST(SerialLink, IsTakenUpAgainWhenTheDeviceComesBack) {
  PseudoTerminal terminal;
  const auto link = open_mavlink_link(MavlinkAddress::from(terminal.address()));
  const auto frame = encode(HeartbeatMessage{}, {}, 0);
  EXPECT_TRUE(link->send(frame));
  terminal.unplug();
  link->receive();
  EXPECT_FALSE(link->send(frame));
  EXPECT_FALSE(link->fault().empty());
  EXPECT_EQ(link->descriptor(), -1);
  EXPECT_EQ(link->losses(), 1U);
  link->tend();
  EXPECT_FALSE(link->send(frame));
  terminal.plug_in();
  EXPECT_TRUE(comes([&] {
    link->tend();
    return link->send(frame);
  }));
  EXPECT_TRUE(link->fault().empty());
  EXPECT_EQ(terminal.read_all(), frame);
  EXPECT_EQ(link->losses(), 1U);
}

TEST(SerialLink, SaysWhatIsWrongWithADevice) {
  EXPECT_SAYS(open_error("serial:/dev/no-such-device:57600"), "no such device; connect it");
  EXPECT_SAYS(open_error("serial:/dev/null:57600"), "is no serial port");
  const fs::path file = scratch_path(".txt");
  std::ofstream(file) << "text";
  EXPECT_SAYS(open_error("serial:" + file.string() + ":57600"), "is no serial port");
  fs::permissions(file, fs::perms::none);
  if (geteuid() != 0) {
    EXPECT_SAYS(open_error("serial:" + file.string() + ":57600"), "no permission; add the user to the group");
  } else {
    // As another user, in a process of its own that ends at once: a user who may do everything is never
    // refused.
    EXPECT_EXIT(
        {
          if (setegid(65534) != 0 || seteuid(65534) != 0) _exit(2);
          const std::string said = open_error("serial:" + file.string() + ":57600");
          _exit(said.find("no permission; add the user to the group") == std::string::npos ? 1 : 0);
        },
        testing::ExitedWithCode(0), "");
  }
  fs::remove(file);
}

}  // namespace
}  // namespace roslam::telemetry
