// SPDX-License-Identifier: BSD-3-Clause
#include <netdb.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "roslam/common/error.hpp"
#include "roslam/common/file_descriptor.hpp"
#include "telemetry/mavlink/links.hpp"

namespace roslam::telemetry {

namespace {
using Addresses = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

std::string words_of(int error) { return std::system_category().message(error); }

Addresses resolve(const char* host, std::uint16_t port, int family, int flags, const std::string& text) {
  addrinfo hints{};
  hints.ai_family = family;
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = flags | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host, std::to_string(port).c_str(), &hints, &found); error != 0)
    throw InputError("--mavlink " + text + ": the host is not known (" + gai_strerror(error) +
                     "); give its number, such as udp:192.168.1.10:14550");
  return {found, freeaddrinfo};
}

// The socket is connected: the kernel passes on nothing but what the host sends from that port, and tells
// when the host refuses.
class UdpLink : public MavlinkLink {
 public:
  explicit UdpLink(const MavlinkAddress& address) {
    const Addresses peer = resolve(address.host.c_str(), address.port, AF_UNSPEC, 0, address.text);
    peer_.ss_family = peer->ai_addr->sa_family;
    std::memcpy(&peer_, peer->ai_addr, peer->ai_addrlen);
    peer_size_ = peer->ai_addrlen;
    socket_ = FileDescriptor(socket(peer->ai_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (!socket_) throw InputError("--mavlink " + address.text + ": " + words_of(errno));
    const int yes = 1;
    setsockopt(socket_.get(), SOL_SOCKET, SO_BROADCAST, &yes, sizeof(yes));
    if (address.local_port != 0) bind_to(address, peer->ai_family);
    connect_again();
  }

  bool send(std::span<const std::uint8_t> message) override {
    if (!is_connected_) return false;
    ssize_t sent = ::send(socket_.get(), message.data(), message.size(), MSG_NOSIGNAL);
    // That is of a datagram before; this one was not sent yet.
    if (sent < 0 && is_of_peer(errno)) {
      lose(errno);
      sent = ::send(socket_.get(), message.data(), message.size(), MSG_NOSIGNAL);
    }
    if (sent >= 0) return true;
    if (errno != EAGAIN && errno != EWOULDBLOCK && errno != ENOBUFS) lose(errno);
    return false;
  }

  std::vector<std::uint8_t> receive() override {
    if (!is_connected_) return {};
    std::array<std::uint8_t, 2048> bytes{};
    const ssize_t size = recv(socket_.get(), bytes.data(), bytes.size(), 0);
    if (size < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) lose(errno);
    if (size <= 0) return {};
    clear_fault();
    return {bytes.begin(), bytes.begin() + size};
  }

  void tend() override {
    constexpr auto kQuiet = std::chrono::milliseconds(2500);  // more than two heartbeats
    if (fault().empty() || Clock::now() - lost_ < kQuiet) return;
    if (!is_connected_) {
      lost_ = Clock::now();
      connect_again();
    } else {
      clear_fault();  // nobody has refused for a while
    }
  }

  bool is_datagram() const override { return true; }
  int descriptor() const override { return is_connected_ ? socket_.get() : -1; }

 private:
  static bool is_of_peer(int error) {
    return error == ECONNREFUSED || error == EHOSTUNREACH || error == ENETUNREACH || error == EHOSTDOWN;
  }

  void bind_to(const MavlinkAddress& address, int family) {
    const Addresses local = resolve(nullptr, address.local_port, family, AI_PASSIVE, address.text);
    if (bind(socket_.get(), local->ai_addr, local->ai_addrlen) == 0) return;
    const std::string port = std::to_string(address.local_port);
    throw InputError("--mavlink " + address.text + ": port " + port +
                     (errno == EADDRINUSE
                          ? " is in use; end the program that has it, or leave the local port out"
                          : ": " + words_of(errno)));
  }

  void connect_again() {
    is_connected_ = connect(socket_.get(), reinterpret_cast<const sockaddr*>(&peer_), peer_size_) == 0;
    if (is_connected_) return clear_fault();
    lose(errno);
  }

  void lose(int error) {
    lost_ = Clock::now();
    note_fault(words_of(error));
  }

  FileDescriptor socket_;
  sockaddr_storage peer_{};
  socklen_t peer_size_ = 0;
  bool is_connected_ = false;
  Clock::time_point lost_;
};
}  // namespace

std::unique_ptr<MavlinkLink> open_udp_link(const MavlinkAddress& address) {
  return std::make_unique<UdpLink>(address);
}

}  // namespace roslam::telemetry
