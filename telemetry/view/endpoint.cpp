// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/view/endpoint.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "roslam/common/error.hpp"

namespace roslam::telemetry {

namespace {
bool is_number(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

std::string without_brackets(const std::string& address) {
  const bool has = address.size() > 2 && address.front() == '[' && address.back() == ']';
  return has ? address.substr(1, address.size() - 2) : address;
}

int port_of(const std::string& digits, const std::string& text) {
  int port = -1;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  if (error != std::errc() || end != digits.data() + digits.size() || port < 0 || port > 65535)
    throw InputError("--view " + text + ": no port; give ADDRESS:PORT such as 127.0.0.1:8080");
  return port;
}
}  // namespace

std::string Endpoint::in_words() const {
  const bool is_v6 = address.find(':') != std::string::npos;
  return (is_v6 ? "[" + address + "]" : address) + ":" + std::to_string(port);
}

Endpoint parse_endpoint(const std::string& text) {
  Endpoint result;
  if (text.empty()) return result;
  if (is_number(text)) {
    result.port = port_of(text, text);
    return result;
  }
  std::string address = text;
  const auto colon = text.rfind(':');
  const bool is_bare_v6 = text.front() != '[' && text.find(':') != colon;
  if (colon != std::string::npos && !is_bare_v6 && text.back() != ']') {
    address = text.substr(0, colon);
    result.port = port_of(text.substr(colon + 1), text);
  }
  if (!address.empty()) result.address = without_brackets(address);
  if (result.address == "*") result.address = "0.0.0.0";
  return result;
}

bool is_loopback(const std::string& address) {
  const std::string bare = without_brackets(address);
  return bare == "localhost" || bare == "::1" || (is_numeric(bare) && bare.starts_with("127."));
}

std::string own_address() {
  ifaddrs* all = nullptr;
  std::string result = "127.0.0.1";
  if (getifaddrs(&all) != 0) return result;
  for (const ifaddrs* at = all; at != nullptr; at = at->ifa_next) {
    const bool is_out = (at->ifa_flags & IFF_UP) != 0 && (at->ifa_flags & IFF_LOOPBACK) == 0;
    if (!is_out || at->ifa_addr == nullptr || at->ifa_addr->sa_family != AF_INET) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto* address = reinterpret_cast<const sockaddr_in*>(at->ifa_addr);
    if (inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size()) == nullptr) continue;
    result = text.data();
    break;
  }
  freeifaddrs(all);
  return result;
}

bool is_numeric(const std::string& address) {
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  const std::string bare = without_brackets(address);
  return inet_pton(AF_INET, bare.c_str(), bytes.data()) == 1 ||
         inet_pton(AF_INET6, bare.c_str(), bytes.data()) == 1;
}

}  // namespace roslam::telemetry
