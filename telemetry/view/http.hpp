// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <strings.h>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace roslam::telemetry {

/// Field names are equal whatever their case.
struct IgnoringCase {
  bool operator()(const std::string& a, const std::string& b) const {
    return strcasecmp(a.c_str(), b.c_str()) < 0;
  }
};

/// A request.
struct HttpRequest {
  std::string method;  ///< such as GET
  std::string path;    ///< without parameters, decoded
  std::multimap<std::string, std::string> parameters;
  std::multimap<std::string, std::string, IgnoringCase> fields;  ///< of the header

  /// Empty: there is none.
  std::string field(const std::string& name) const {
    const auto found = fields.find(name);
    return found == fields.end() ? "" : found->second;
  }
  std::string parameter(const std::string& name) const {
    const auto found = parameters.find(name);
    return found == parameters.end() ? "" : found->second;
  }
};

/// Sends a part of a stream; false: the reader has gone or is too slow.
using SendPart = std::function<bool(std::string_view part)>;

/// What is answered.
struct HttpReply {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
  std::vector<std::pair<std::string, std::string>> fields;  ///< of the header, more than the type
  std::function<bool(const SendPart& send)> stream;  ///< if set, in place of the body: called until false

  static HttpReply text(int status, std::string words) {
    HttpReply reply;
    reply.status = status;
    reply.body = std::move(words) + "\n";
    return reply;
  }
  static HttpReply json(std::string text) { return typed("application/json", std::move(text)); }
  static HttpReply typed(std::string type, std::string body) {
    HttpReply reply;
    reply.type = std::move(type);
    reply.body = std::move(body);
    return reply;
  }
};

/// Answers a request. Called by several threads at a time. What it throws becomes status 500.
using HttpHandler = std::function<HttpReply(const HttpRequest&)>;

}  // namespace roslam::telemetry
