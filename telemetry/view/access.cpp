// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/view/access.hpp"

#include <unistd.h>

#include <array>
#include <random>
#include <utility>

#include "telemetry/view/endpoint.hpp"

namespace roslam::telemetry {

namespace {
constexpr const char* kTokenField = "X-RO-SLAM-Token";
constexpr const char* kCookie = "roslam_view=";

// Of HOST:PORT, without the port. It does not matter: a tunnel or a container may have changed it.
std::string name_in(const std::string& host) {
  const auto colon = host.rfind(':');
  const auto bracket = host.rfind(']');
  const bool has_port = colon != std::string::npos && (bracket == std::string::npos || colon > bracket);
  return has_port ? host.substr(0, colon) : host;
}

std::string own_host_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? std::string(name.data()) : std::string();
}

std::string cookie_in(const std::string& cookies) {
  for (std::size_t begin = 0; begin < cookies.size();) {
    auto end = cookies.find(';', begin);
    if (end == std::string::npos) end = cookies.size();
    while (begin < end && cookies[begin] == ' ') ++begin;
    const std::string cookie = cookies.substr(begin, end - begin);
    if (cookie.starts_with(kCookie)) return cookie.substr(std::string(kCookie).size());
    begin = end + 1;
  }
  return {};
}
}  // namespace

std::string random_token() {
  static constexpr const char* kDigits = "0123456789abcdef";
  std::random_device device;  // of the operating system
  std::string token;
  for (int word = 0; word < 4; ++word) {
    const std::uint32_t bits = device();
    for (unsigned shift = 0; shift < 32; shift += 4) token += kDigits[bits >> shift & 15U];
  }
  return token;
}

bool is_equal_in_constant_time(const std::string& a, const std::string& b) {
  volatile unsigned char difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size() && !b.empty(); ++i)
    difference = static_cast<unsigned char>(
        difference | (static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i % b.size()])));
  return difference == 0;
}

AccessPolicy::AccessPolicy(const std::string& address, std::string token)
    : address_(address), token_(std::move(token)), needs_token_(!is_loopback(address)) {}

// An address in digits cannot be made to mean another, and names without a dot or below .local are not
// given out to sites.
bool AccessPolicy::is_own_name(const std::string& host) const {
  const std::string name = name_in(host);
  if (name == "localhost" || name == address_) return true;
  if (!needs_token_) return is_loopback(name);
  const std::string own = own_host_name();
  return is_numeric(name) || (!own.empty() && (name == own || name == own + ".local"));
}

bool AccessPolicy::has_token(const HttpRequest& request) const {
  std::string bearer = request.field("Authorization");
  if (bearer.starts_with("Bearer ")) bearer.erase(0, 7);
  bool has = false;  // all are compared, in whichever place it is
  for (const std::string& given :
       {cookie_in(request.field("Cookie")), request.parameter("token"), request.field(kTokenField), bearer})
    has |= is_equal_in_constant_time(given, token_);
  return has;
}

std::optional<HttpReply> AccessPolicy::refuse(const HttpRequest& request) const {
  if (request.fields.count("Host") != 1 || !is_own_name(request.field("Host")))
    return HttpReply::text(421, "this server is not of that name; use its address");
  const std::string host = request.field("Host");
  if (const std::string origin = request.field("Origin");
      !origin.empty() && origin != "http://" + host && origin != "https://" + host)
    return HttpReply::text(403, "pages of other sites may not use this server");
  const std::string site = request.field("Sec-Fetch-Site");
  if (request.path != "/" && (site == "cross-site" || site == "same-site"))
    return HttpReply::text(403, "pages of other sites may not use this server");
  if (needs_token_ && !has_token(request))
    return HttpReply::text(401, "use the address with the token that was printed when the run began");
  if (request.method == "POST" && !is_equal_in_constant_time(request.field(kTokenField), token_))
    return HttpReply::text(403, std::string("needs the token in the field ") + kTokenField);
  return std::nullopt;
}

std::string AccessPolicy::cookie() const { return kCookie + token_ + "; Path=/; HttpOnly; SameSite=Strict"; }

}  // namespace roslam::telemetry
