// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/mavlink/mavlink_link.hpp"

#include <charconv>
#include <limits>

#include "roslam/common/error.hpp"
#include "telemetry/mavlink/links.hpp"

namespace roslam::telemetry {

namespace {
constexpr std::string_view kUdpPrefix = "udp:", kSerialPrefix = "serial:";
constexpr const char* kForms =
    "give udp:HOST:PORT or serial:DEVICE:BAUD, such as udp:127.0.0.1:14550 or "
    "serial:/dev/ttyTHS1:921600";

std::optional<int> number_of(std::string_view digits, int most) {
  int value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size() || value < 1 || value > most)
    return std::nullopt;
  return value;
}

std::uint16_t port_of(std::string_view digits, const std::string& text) {
  const auto port = number_of(digits, std::numeric_limits<std::uint16_t>::max());
  if (!port)
    throw InputError("--mavlink " + text + ": '" + std::string(digits) + "' is no port; use 1 to 65535");
  return static_cast<std::uint16_t>(*port);
}

void read_udp(std::string_view rest, MavlinkAddress& address) {
  const bool is_bracketed = rest.substr(0, 1) == "[";
  const std::size_t host_end = is_bracketed ? rest.find(']') : rest.find(':');
  const std::size_t colon = rest.find(':', host_end == std::string_view::npos ? rest.size() : host_end);
  if (colon == std::string_view::npos || host_end == (is_bracketed ? 1 : 0) || colon > host_end + 1)
    throw InputError("--mavlink " + address.text + ": has no host and port; " + kForms);
  address.host = is_bracketed ? rest.substr(1, host_end - 1) : rest.substr(0, host_end);
  const std::string_view ports = rest.substr(colon + 1);
  const std::size_t second = ports.find(':');
  address.port = port_of(ports.substr(0, second), address.text);
  if (second != std::string_view::npos) address.local_port = port_of(ports.substr(second + 1), address.text);
}

void read_serial(std::string_view rest, MavlinkAddress& address) {
  address.kind = MavlinkAddress::Kind::kSerial;
  const std::size_t colon = rest.rfind(':');
  if (colon == std::string_view::npos || colon == 0)
    throw InputError("--mavlink " + address.text + ": has no device and baud rate; " + kForms);
  address.device = rest.substr(0, colon);
  const auto baud = number_of(rest.substr(colon + 1), std::numeric_limits<int>::max());
  if (!baud || !is_baud(*baud))
    throw InputError("--mavlink " + address.text + ": '" + std::string(rest.substr(colon + 1)) +
                     "' is no baud rate of a serial port; use one of " + bauds_in_words());
  address.baud = *baud;
}
}  // namespace

MavlinkAddress MavlinkAddress::from(const std::string& text) {
  MavlinkAddress address;
  address.text = text;
  const std::string_view all = address.text;
  if (all.substr(0, kUdpPrefix.size()) == kUdpPrefix) {
    read_udp(all.substr(kUdpPrefix.size()), address);
  } else if (all.substr(0, kSerialPrefix.size()) == kSerialPrefix) {
    read_serial(all.substr(kSerialPrefix.size()), address);
  } else {
    throw InputError("--mavlink " + text + ": is neither udp nor serial; " + kForms);
  }
  return address;
}

// A byte takes ten bits: one before and one after it.
std::optional<double> MavlinkAddress::capacity() const {
  return kind == Kind::kSerial ? std::optional(baud / 10.0) : std::nullopt;
}

std::unique_ptr<MavlinkLink> open_mavlink_link(const MavlinkAddress& address) {
  return address.kind == MavlinkAddress::Kind::kUdp ? open_udp_link(address) : open_serial_link(address);
}

}  // namespace roslam::telemetry
