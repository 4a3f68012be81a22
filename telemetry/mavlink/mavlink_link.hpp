// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/common/export.hpp"

namespace roslam::telemetry {

/// Where an autopilot is.
struct ROSLAM_EXPORT MavlinkAddress {
  enum class Kind { kUdp, kSerial };
  Kind kind = Kind::kUdp;
  std::string host;              ///< UDP: name or number
  std::uint16_t port = 0;        ///< UDP: to which is sent
  std::uint16_t local_port = 0;  ///< UDP: from which is sent; 0: any
  std::string device;            ///< serial
  int baud = 0;                  ///< serial
  std::string text;              ///< as given

  /// Reads udp:HOST:PORT, udp:HOST:PORT:LOCAL_PORT (a numeric IPv6 host in brackets) or serial:DEVICE:BAUD.
  /// Throws InputError.
  static MavlinkAddress from(const std::string& text);

  /// Bytes a second that the link carries; nothing if it is not known.
  std::optional<double> capacity() const;
};

/// Bytes to and from an autopilot. Nothing here waits: what the link does not take is dropped. A link that
/// is lost (a device that is unplugged, a host that refuses or cannot be reached) is taken up again by
/// tend(). Not thread safe.
class ROSLAM_EXPORT MavlinkLink {
 public:
  using Clock = std::chrono::steady_clock;

  MavlinkLink() = default;
  virtual ~MavlinkLink() = default;
  MavlinkLink(const MavlinkLink&) = delete;
  MavlinkLink& operator=(const MavlinkLink&) = delete;

  /// Sends a message as a whole or not at all; returns whether it was taken.
  virtual bool send(std::span<const std::uint8_t> message) = 0;

  /// The bytes that came, of one datagram at most; empty if none did.
  virtual std::vector<std::uint8_t> receive() = 0;

  /// Whether what receive() returns is a datagram: no message goes on in the next.
  virtual bool is_datagram() const = 0;

  /// Opens a link that was lost, once a second. To be called at least as often.
  virtual void tend() = 0;

  /// To wait for bytes with poll(); -1 while the link is lost.
  virtual int descriptor() const = 0;

  /// What is wrong at present, in words; empty: nothing.
  const std::string& fault() const { return fault_; }

  /// How often the link was lost.
  std::size_t losses() const { return losses_; }

 protected:
  void note_fault(std::string fault) {
    if (fault_.empty()) ++losses_;
    fault_ = std::move(fault);
  }
  void clear_fault() { fault_.clear(); }

 private:
  std::string fault_;
  std::size_t losses_ = 0;
};

/// The lowest baud rate of a serial port that carries so many bytes a second with a fifth to spare; the
/// highest there is if none does.
ROSLAM_EXPORT int baud_for(double bytes_per_second);

/// Opens a link. Throws InputError naming the address and the remedy: a host that is not known, a local port
/// in use, a device that is not there, without permission, in use or no serial port, a baud rate it does not
/// have. A network that cannot be reached yet is no error, but a link that is lost.
ROSLAM_EXPORT std::unique_ptr<MavlinkLink> open_mavlink_link(const MavlinkAddress& address);

}  // namespace roslam::telemetry
