// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "telemetry/view/http.hpp"

namespace roslam::telemetry {

/// 128 random bits in hexadecimal digits.
std::string random_token();

/// Whether two texts are equal, in a time that does not tell where they differ.
bool is_equal_in_constant_time(const std::string& a, const std::string& b);

/// Who may ask what. Refuses
/// - a Host that is a name other than those of this computer: a page of another site whose name was made to
///   resolve to this address (DNS rebinding),
/// - what a page of another site asked for (Origin, Sec-Fetch-Site),
/// - all without the token where the address is not loopback, and whatever changes anything (POST) unless it
///   carries the token in the field X-RO-SLAM-Token, which no other site can set or read.
class AccessPolicy {
 public:
  /// address: that the server listens at.
  AccessPolicy(const std::string& address, std::string token);

  /// Nothing: the request may be answered.
  std::optional<HttpReply> refuse(const HttpRequest& request) const;

  bool needs_token() const { return needs_token_; }
  const std::string& token() const { return token_; }

  /// The field of a reply that makes a browser send the token from now on; it is unreadable for scripts.
  std::string cookie() const;

 private:
  bool is_own_name(const std::string& host) const;
  bool has_token(const HttpRequest& request) const;

  std::string address_;
  std::string token_;
  bool needs_token_;
};

}  // namespace roslam::telemetry
