// SPDX-License-Identifier: BSD-3-Clause
// The gate of the web page in a process that has no file descriptor left.
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <optional>
#include <thread>

#include "telemetry/view/request_gate.hpp"
#include "tests/descriptor_limit.hpp"
#include "tests/http_client.hpp"

namespace roslam::telemetry {
namespace {

TEST(RequestGate, RestsWithoutADescriptorAndAcceptsOnceThereIsOne) {
  RequestGate gate(Endpoint{"127.0.0.1", 0});
  std::optional<DescriptorLimit> limit(std::in_place);
  const RawConnection client(gate.port());  // takes the last one; the kernel completes the connection
  ASSERT_TRUE(client.is_connected());
  ASSERT_TRUE(client.send("GET / HTTP/1.1\r\n\r\n"));
  const double before = gate.cpu_seconds();
  std::this_thread::sleep_for(std::chrono::seconds(1));
  EXPECT_LT(gate.cpu_seconds() - before, 0.1) << "processor time of a second";
  limit.reset();
  auto request = std::async(std::launch::async, [&] { return gate.next(); });
  EXPECT_EQ(request.wait_for(std::chrono::seconds(20)), std::future_status::ready);
  gate.close();
  const auto connection = request.get();
  ASSERT_TRUE(connection);
  EXPECT_EQ(connection->received, "GET / HTTP/1.1\r\n\r\n");
}

}  // namespace
}  // namespace roslam::telemetry
