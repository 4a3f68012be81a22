// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/view/request_gate.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <strings.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <string_view>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/common/stopwatch.hpp"
#include "roslam/common/thread_priority.hpp"

namespace roslam::telemetry {

namespace {
using Clock = std::chrono::steady_clock;
constexpr std::string_view kEndOfHeader = "\r\n\r\n";
constexpr auto kAcceptPause = std::chrono::milliseconds(100);

[[noreturn]] void fail(const Endpoint& endpoint, int error) {
  const std::string at = "--view " + endpoint.in_words() + ": ";
  if (error == EADDRINUSE)
    throw InputError(at + "port " + std::to_string(endpoint.port) +
                     " is in use by another program; end it or choose another port, such as " +
                     Endpoint{endpoint.address, endpoint.port + 1}.in_words());
  if (error == EACCES)
    throw InputError(at + "ports below 1024 need the rights of root; choose another, such as " +
                     Endpoint{endpoint.address, 8080}.in_words());
  if (error == EADDRNOTAVAIL)
    throw InputError(at + "this computer does not have that address; use one of `ip address`, or 0.0.0.0");
  throw InputError(at + "cannot listen there: " + std::strerror(error));
}

FileDescriptor listen_at(const Endpoint& endpoint) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int code =
      getaddrinfo(endpoint.address.c_str(), std::to_string(endpoint.port).c_str(), &hints, &found);
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(found, &freeaddrinfo);
  if (code != 0)
    throw InputError("--view " + endpoint.in_words() + ": no such address (" + gai_strerror(code) + ")");
  int error = 0;
  for (const addrinfo* at = found; at != nullptr; at = at->ai_next) {
    FileDescriptor socket(
        ::socket(at->ai_family, at->ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, at->ai_protocol));
    const int on = 1;  // not SO_REUSEPORT, with which a second program could take the same port
    setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (socket && bind(socket.get(), at->ai_addr, at->ai_addrlen) == 0 && listen(socket.get(), 64) == 0)
      return socket;
    error = errno;
  }
  fail(endpoint, error);
}

int port_of(const FileDescriptor& listener) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  getsockname(listener.get(), reinterpret_cast<sockaddr*>(&address), &size);
  std::array<char, NI_MAXSERV> port{};
  getnameinfo(reinterpret_cast<sockaddr*>(&address), size, nullptr, 0, port.data(), port.size(),
              NI_NUMERICSERV);
  return std::atoi(port.data());
}

// Best effort: who has sent too much may not read either.
void refuse(const Connection& connection, std::string_view status) {
  const std::string reply = "HTTP/1.1 " + std::string(status) +
                            "\r\nContent-Type: text/plain\r\nConnection: close\r\n"
                            "X-Content-Type-Options: nosniff\r\nContent-Length: 0\r\n\r\n";
  [[maybe_unused]] const auto sent =
      send(connection.socket.get(), reply.data(), reply.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  shutdown(connection.socket.get(), SHUT_WR);
}

// Fields that no request of the page has and that would make the answer larger, or the request.
bool has_refused_field(std::string_view header) {
  for (std::size_t begin = header.find("\r\n"); begin != std::string_view::npos;) {
    begin += 2;
    const auto end = header.find("\r\n", begin);
    const std::string line(header.substr(begin, end - begin));
    for (const char* name : {"Transfer-Encoding:", "Range:", "Expect:", "Upgrade:"})
      if (strncasecmp(line.c_str(), name, std::strlen(name)) == 0) return true;
    if (strncasecmp(line.c_str(), "Content-Length:", 15) == 0 &&
        line.find_first_not_of(" 0\t", 15) != std::string::npos)
      return true;
    begin = end;
  }
  return false;
}
}  // namespace

RequestGate::RequestGate(const Endpoint& endpoint, const GateLimits& limits)
    : limits_(limits),
      listener_(listen_at(endpoint)),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      port_(port_of(listener_)),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

RequestGate::~RequestGate() { close(); }

void RequestGate::wake() { eventfd_write(wake_.get(), 1); }

void RequestGate::close() {
  {
    const std::scoped_lock lock(mutex_);
    is_closed_ = true;
    whole_.clear();
    returned_.clear();
  }
  changed_.notify_all();
  thread_.request_stop();
  wake();
  if (thread_.joinable()) thread_.join();
}

std::optional<Connection> RequestGate::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return is_closed_ || !whole_.empty(); });
  if (is_closed_) return std::nullopt;
  Connection connection = std::move(whole_.front());
  whole_.pop_front();
  return connection;
}

void RequestGate::put_back(Connection connection) {
  {
    const std::scoped_lock lock(mutex_);
    if (is_closed_) return;
    returned_.push_back(std::move(connection));
  }
  wake();
}

void RequestGate::work(const std::stop_token& stop) {
  lower_thread_priority(ThreadPriority::kLow);
  std::vector<pollfd> polled;
  const Stopwatch watch;
  while (!stop.stop_requested()) {
    if (accept_after_ && Clock::now() >= *accept_after_) accept_after_.reset();
    polled = {{accept_after_ ? -1 : listener_.get(), POLLIN, 0}, {wake_.get(), POLLIN, 0}};
    for (const Connection& connection : waiting_) polled.push_back({connection.socket.get(), POLLIN, 0});
    if (poll(polled.data(), polled.size(), wait_time()) < 0 && errno != EINTR) break;
    eventfd_t count = 0;
    eventfd_read(wake_.get(), &count);
    const auto now = Clock::now();
    auto at = waiting_.begin();
    for (std::size_t i = 2; i < polled.size(); ++i) {
      const auto connection = at++;
      const bool stays = polled[i].revents == 0 ? now < connection->deadline : receive(*connection);
      if (!stays) waiting_.erase(connection);
    }
    take_returned();
    if (polled[0].revents != 0) accept_all();
    cpu_seconds_ = watch.seconds();
  }
  waiting_.clear();
  listener_.reset();
}

// Milliseconds to the first deadline, or until connections are accepted again; -1: there is none.
int RequestGate::wait_time() const {
  auto first = accept_after_.value_or(Clock::time_point::max());
  for (const Connection& connection : waiting_) first = std::min(first, connection.deadline);
  if (first == Clock::time_point::max()) return -1;
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(first - Clock::now());
  return static_cast<int>(std::clamp<std::int64_t>(left.count() + 1, 0, 60000));
}

void RequestGate::accept_all() {
  for (;;) {
    FileDescriptor socket(accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket) {
      if (errno != EMFILE && errno != ENFILE && errno != ENOBUFS && errno != ENOMEM) return;
      // Out of descriptors: the waiting ones are worth less than the flight's files. Where none waits, poll()
      // would return at once, again and again, as the connection that cannot be accepted stays in the queue.
      if (waiting_.empty())
        accept_after_ = Clock::now() + kAcceptPause;
      else
        waiting_.pop_front();
      return;
    }
    const int on = 1;
    setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    if (waiting_.size() >= limits_.connections) waiting_.pop_front();
    waiting_.push_back({std::move(socket), {}, Clock::now() + limits_.header_time});
  }
}

// False: the connection is not for the gate any more.
bool RequestGate::receive(Connection& connection) {
  std::array<char, 4096> bytes;
  const auto size = recv(connection.socket.get(), bytes.data(), bytes.size(), 0);
  if (size < 0) return errno == EAGAIN || errno == EINTR;
  if (size == 0) return false;
  if (connection.received.empty()) connection.deadline = Clock::now() + limits_.header_time;
  connection.received.append(bytes.data(), static_cast<std::size_t>(size));
  return !hand_on(connection);
}

// True: it was handed on or refused.
bool RequestGate::hand_on(Connection& connection) {
  const std::string& received = connection.received;
  const auto end = received.find(kEndOfHeader);
  const std::string_view header = std::string_view(received).substr(0, std::min(end, received.size()));
  const auto lines = static_cast<std::size_t>(std::count(header.begin(), header.end(), '\n'));
  if (header.size() > limits_.header_bytes || lines > limits_.header_lines) {
    refuse(connection, "431 Request Header Fields Too Large");
    return true;
  }
  if (end == std::string::npos) return false;
  if (has_refused_field(header)) {
    refuse(connection, "413 Content Too Large");
    return true;
  }
  {
    const std::scoped_lock lock(mutex_);
    if (whole_.size() >= limits_.requests) {
      refuse(connection, "503 Service Unavailable");
      return true;
    }
    whole_.push_back(std::move(connection));
  }
  changed_.notify_one();
  return true;
}

void RequestGate::take_returned() {
  std::list<Connection> returned;
  {
    const std::scoped_lock lock(mutex_);
    returned.swap(returned_);
  }
  for (Connection& connection : returned) {
    const bool is_begun = !connection.received.empty();
    if (is_begun && hand_on(connection)) continue;  // sent two requests at once
    connection.deadline = Clock::now() + (is_begun ? limits_.header_time : limits_.idle_time);
    if (waiting_.size() >= limits_.connections) waiting_.pop_front();
    waiting_.push_back(std::move(connection));
  }
}

}  // namespace roslam::telemetry
