// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>

namespace roslam {

/// A connection to a port of this computer that sends and receives bytes as they are.
class RawConnection {
 public:
  explicit RawConnection(int port, int receive_buffer = 0) : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    if (receive_buffer > 0) setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    is_connected_ = connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  RawConnection(RawConnection&& other) noexcept
      : fd_(std::exchange(other.fd_, -1)), is_connected_(other.is_connected_) {}
  RawConnection& operator=(RawConnection&&) = delete;
  ~RawConnection() {
    if (fd_ >= 0) ::close(fd_);
  }

  bool is_connected() const { return is_connected_; }

  /// False: the other side has closed the connection.
  bool send(const std::string& bytes) const {
    for (std::size_t sent = 0; sent < bytes.size();) {
      const auto count = ::send(fd_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return false;
      sent += static_cast<std::size_t>(count);
    }
    return true;
  }

  /// What comes until the other side closes, the text is among it, or the time is over.
  std::string receive(const std::string& until = {}, double seconds = 10.0) const {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    std::string received;
    char bytes[16384];
    while (until.empty() || received.find(until) == std::string::npos) {
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
      pollfd polled{fd_, POLLIN, 0};
      if (left.count() <= 0 || poll(&polled, 1, static_cast<int>(left.count())) <= 0) break;
      const auto count = recv(fd_, bytes, sizeof bytes, 0);
      if (count <= 0) {
        is_closed_ = true;
        break;
      }
      received.append(bytes, static_cast<std::size_t>(count));
    }
    return received;
  }

  /// Whether the other side was found to have closed the connection.
  bool is_closed() const { return is_closed_; }

 private:
  int fd_;
  bool is_connected_ = false;
  mutable bool is_closed_ = false;
};

/// An answer.
struct HttpAnswer {
  int status = 0;  ///< 0: none
  std::string head, body;

  /// Empty: there is no such field.
  std::string field(const std::string& name) const {
    const auto begin = head.find("\r\n" + name + ": ");
    if (begin == std::string::npos) return {};
    const auto value = begin + name.size() + 4;
    return head.substr(value, head.find("\r\n", value) - value);
  }
};

inline HttpAnswer parse_answer(const std::string& text) {
  HttpAnswer answer;
  const auto end = text.find("\r\n\r\n");
  if (!text.starts_with("HTTP/1.1 ") || end == std::string::npos) return answer;
  answer.status = std::atoi(text.c_str() + 9);
  answer.head = text.substr(0, end + 2);
  answer.body = text.substr(end + 4);
  return answer;
}

/// Asks once. fields: more than Host, which is 127.0.0.1 unless it is among them.
inline HttpAnswer ask(int port, const std::string& path, std::map<std::string, std::string> fields = {},
                      const std::string& method = "GET") {
  const RawConnection connection(port);
  fields.emplace("Host", "127.0.0.1:" + std::to_string(port));
  std::string request = method + " " + path + " HTTP/1.1\r\nConnection: close\r\n";
  for (const auto& [name, value] : fields) request += name + ": " + value + "\r\n";
  if (method == "POST") request += "Content-Length: 0\r\n";
  connection.send(request + "\r\n");
  return parse_answer(connection.receive());
}

}  // namespace roslam
