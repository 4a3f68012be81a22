// SPDX-License-Identifier: BSD-3-Clause
// Who may ask the web page what, and hostile requests.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <thread>

#include "roslam/common/error.hpp"
#include "telemetry/view/access.hpp"
#include "telemetry/view/endpoint.hpp"
#include "telemetry/view/page.hpp"
#include "tests/http_client.hpp"
#include "tests/view_scene.hpp"

namespace roslam::telemetry {
namespace {

using Fields = std::map<std::string, std::string>;

TEST(Endpoint, IsReadFromText) {
  const auto text = [](const std::string& given) { return parse_endpoint(given).in_words(); };
  EXPECT_EQ(text(""), "127.0.0.1:8080");
  EXPECT_EQ(text("8081"), "127.0.0.1:8081");
  EXPECT_EQ(text(":8081"), "127.0.0.1:8081");
  EXPECT_EQ(text("0.0.0.0"), "0.0.0.0:8080");
  EXPECT_EQ(text("192.168.4.1:80"), "192.168.4.1:80");
  EXPECT_EQ(text("[::1]:9000"), "[::1]:9000");
  EXPECT_EQ(text("::1"), "[::1]:8080");
  for (const char* wrong : {"127.0.0.1:", "127.0.0.1:http", "99999", "1.2.3.4:70000", "1.2.3.4:-1"})
    EXPECT_THROW(parse_endpoint(wrong), InputError) << wrong;
}

TEST(Endpoint, KnowsWhatOnlyThisComputerReaches) {
  for (const char* address : {"127.0.0.1", "127.3.2.1", "localhost", "::1", "[::1]"})
    EXPECT_TRUE(is_loopback(address)) << address;
  for (const char* address : {"0.0.0.0", "::", "192.168.1.1", "127.example.org", "example.org"})
    EXPECT_FALSE(is_loopback(address)) << address;
}

TEST(Access, TokensAreRandomAndComparedAsAWhole) {
  std::set<std::string> tokens;
  for (int i = 0; i < 100; ++i) tokens.insert(random_token());
  EXPECT_EQ(tokens.size(), 100U);
  for (const std::string& token : tokens) EXPECT_EQ(token.size(), 32U);
  EXPECT_TRUE(is_equal_in_constant_time("abc", "abc"));
  for (const char* other : {"", "ab", "abd", "abcabc", "abc "})
    EXPECT_FALSE(is_equal_in_constant_time(other, "abc")) << other;
  EXPECT_FALSE(is_equal_in_constant_time("abc", ""));
}

class Page : public testing::Test {
 protected:
  StagedRun run_;
  ViewServer server_{at_free_port(), run_};
  int port_ = server_.port();
};

TEST_F(Page, IsServedWithoutAnythingOfOtherSites) {
  const HttpAnswer page = ask(port_, "/");
  EXPECT_EQ(page.status, 200);
  EXPECT_NE(page.body.find(server_.token()), std::string::npos);
  EXPECT_EQ(page.field("X-Content-Type-Options"), "nosniff");
  EXPECT_TRUE(page.field("Content-Security-Policy").starts_with("default-src 'self'"));
  EXPECT_EQ(page.field("Content-Security-Policy").find("unsafe"), std::string::npos);
  EXPECT_TRUE(page.field("Access-Control-Allow-Origin").empty());
  ASSERT_GE(page_files().size(), 5U);
  for (const PageFile& file : page_files()) {
    EXPECT_EQ(ask(port_, std::string(file.path)).status, 200) << file.path;
    std::string text(file.content);
    const std::string name = "http://www.w3.org/2000/svg";  // of a language, not a place
    if (const auto at = text.find(name); at != std::string::npos) text.erase(at, name.size());
    for (const char* outside : {"http://", "https://", "url(", "src=\"//", "@import", "innerHTML", "eval(",
                                "document.write", "insertAdjacentHTML", "onclick=", " style="})
      EXPECT_EQ(text.find(outside), std::string::npos) << file.path << " has " << outside;
  }
}

TEST_F(Page, RefusesNamesOfOtherSites) {
  for (const char* host : {"evil.example", "127.0.0.1.evil.example", "evil.example:8080", "", "192.168.1.5",
                           "localhost.evil.example", "[::2]"})
    EXPECT_EQ(ask(port_, "/", {{"Host", host}}).status, 421) << host;
  for (const char* host : {"localhost", "localhost:9999", "127.0.0.1", "[::1]:80"})
    EXPECT_EQ(ask(port_, "/", {{"Host", host}}).status, 200) << host;
  const RawConnection twice(port_);
  twice.send("GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\nConnection: close\r\n\r\n");
  EXPECT_EQ(parse_answer(twice.receive()).status, 421);
}

TEST_F(Page, RefusesWhatPagesOfOtherSitesAskFor) {
  const std::string own = "http://127.0.0.1:" + std::to_string(port_);
  EXPECT_EQ(ask(port_, "/keyframes", {{"Origin", "http://evil.example"}}).status, 403);
  EXPECT_EQ(ask(port_, "/keyframes", {{"Origin", "null"}}).status, 403);
  EXPECT_EQ(ask(port_, "/health", {{"Sec-Fetch-Site", "cross-site"}}).status, 403);
  EXPECT_EQ(ask(port_, "/health", {{"Origin", own}, {"Sec-Fetch-Site", "same-origin"}}).status, 200);
  const Fields cross{{"Origin", "http://evil.example"}, {"X-RO-SLAM-Token", server_.token()}};
  EXPECT_EQ(ask(port_, "/stop", cross, "POST").status, 403);
  EXPECT_TRUE(run_.commands_.empty());
}

TEST_F(Page, NeedsTheTokenForWhateverChangesAnything) {
  EXPECT_EQ(ask(port_, "/stop", {}, "POST").status, 403);
  EXPECT_EQ(ask(port_, "/stop", {{"X-RO-SLAM-Token", std::string(32, '0')}}, "POST").status, 403);
  EXPECT_EQ(ask(port_, "/stop?token=" + server_.token(), {}, "POST").status, 403) << "a link is not enough";
  EXPECT_EQ(ask(port_, "/stop", {{"Cookie", "roslam_view=" + server_.token()}}, "POST").status, 403);
  EXPECT_EQ(ask(port_, "/stop", {{"X-RO-SLAM-Token", server_.token()}}).status, 404) << "GET changes nothing";
  EXPECT_TRUE(run_.commands_.empty());
  EXPECT_EQ(ask(port_, "/save", {{"X-RO-SLAM-Token", server_.token()}}, "POST").status, 200);
  EXPECT_EQ(ask(port_, "/stop", {{"X-RO-SLAM-Token", server_.token()}}, "POST").status, 200);
  EXPECT_EQ(ask(port_, "/reboot", {{"X-RO-SLAM-Token", server_.token()}}, "POST").status, 404);
  EXPECT_EQ(run_.commands_, (std::vector{ViewCommand::kSave, ViewCommand::kStop}));
}

TEST(PageForOthers, NeedsTheTokenForAll) {
  StagedRun run;
  ViewServer::Options options = at_free_port();
  options.endpoint.address = "0.0.0.0";
  options.token = "0123456789abcdef";
  const ViewServer server(options, run);
  const int port = server.port();
  EXPECT_EQ(server.url(),
            "http://" + own_address() + ":" + std::to_string(port) + "/?token=0123456789abcdef");
  EXPECT_TRUE(is_numeric(own_address()));
  for (const char* path :
       {"/", "/view.js", "/events", "/health", "/metrics", "/keyframes", "/?token=0123456789"})
    EXPECT_EQ(ask(port, path).status, 401) << path;
  EXPECT_EQ(ask(port, "/", {{"Cookie", "roslam_view=0123456789abcdeF"}}).status, 401);
  const HttpAnswer page = ask(port, "/?token=" + options.token);
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.field("Set-Cookie"), "roslam_view=" + options.token + "; Path=/; HttpOnly; SameSite=Strict");
  EXPECT_EQ(ask(port, "/view.js", {{"Cookie", "a=b; roslam_view=" + options.token}}).status, 200);
  EXPECT_EQ(ask(port, "/metrics", {{"Authorization", "Bearer " + options.token}}).status, 200);
  EXPECT_EQ(
      ask(port, "/metrics", {{"Authorization", "Bearer " + options.token}, {"Host", "evil.example"}}).status,
      421);
  options.token = "short";
  EXPECT_THROW(ViewServer(options, run), InputError);
  options.token = "0123456789abcdef\"><script>";
  EXPECT_THROW(ViewServer(options, run), InputError);
}

TEST_F(Page, HasNoFilesButItsOwn) {
  for (const char* path :
       {"/../../etc/passwd", "/..%2f..%2fetc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd",
        "/page/index.html", "/view.js/../../x", "/view.js%00.html", "/.git/config"}) {
    const HttpAnswer answer = ask(port_, path);
    EXPECT_TRUE(answer.status == 404 || answer.status == 400) << path << ": " << answer.status;
    EXPECT_EQ(answer.body.find("root:"), std::string::npos);
  }
}

TEST_F(Page, RefusesLongHeadersManyLinesBodiesAndUnknownMethods) {
  EXPECT_EQ(ask(port_, "/", {{"X-Long", std::string(1 << 20U, 'a')}}).status % 431, 0);  // or closed
  Fields many;
  for (int i = 0; i < 100; ++i) many.emplace("X-" + std::to_string(i), "a");
  EXPECT_EQ(ask(port_, "/", many).status, 431);
  EXPECT_EQ(ask(port_, std::string(9000, '/')).status, 431);
  EXPECT_EQ(ask(port_, "/", {{"Content-Length", "5000000000"}}).status, 413);
  EXPECT_EQ(ask(port_, "/save", {{"Transfer-Encoding", "chunked"}}, "POST").status, 413);
  EXPECT_EQ(ask(port_, "/view.js", {{"Range", "bytes=0-1,0-1,0-1"}}).status, 413);
  for (const char* method : {"PUT", "DELETE", "OPTIONS", "HEAD", "PATCH"})
    EXPECT_EQ(ask(port_, "/", {}, method).status, 405) << method;
  const RawConnection nonsense(port_);
  nonsense.send(std::string("\0\1\2 nonsense\r\n\r\n", 16));
  EXPECT_EQ(parse_answer(nonsense.receive()).status, 400);
  EXPECT_EQ(ask(port_, "/").status, 200);
}

TEST(SlowConnections, AreClosedAndHoldUpNobody) {
  StagedRun run;
  ViewServer::Options options = at_free_port();
  options.http.gate.header_time = std::chrono::milliseconds(700);
  const ViewServer server(options, run);
  std::vector<RawConnection> slow;
  for (int i = 0; i < 50; ++i) {
    slow.emplace_back(server.port());
    ASSERT_TRUE(slow.back().is_connected());
    slow.back().send("GET / HTTP/1.1\r\nHost: local");
  }
  EXPECT_EQ(ask(server.port(), "/").status, 200) << "while fifty others send slowly";
  std::size_t closed = 0;
  for (int second = 0; second < 20 && closed < slow.size(); ++second) {
    closed = 0;
    for (RawConnection& connection : slow) {
      if (!connection.is_closed()) connection.send("h");
      connection.receive({}, 0.005);
      closed += connection.is_closed() ? 1 : 0;
    }
  }
  EXPECT_EQ(closed, slow.size()) << "although each sends a byte now and then";
  EXPECT_EQ(ask(server.port(), "/").status, 200);
}

TEST(ManyConnections, AreBounded) {
  StagedRun run;
  const ViewServer server(at_free_port(), run);
  std::vector<RawConnection> idle;
  for (int i = 0; i < 200; ++i) idle.emplace_back(server.port());
  EXPECT_EQ(ask(server.port(), "/").status, 200);
  const auto closed = std::count_if(idle.begin(), idle.end(), [](const RawConnection& connection) {
    connection.receive({}, 0.01);
    return connection.is_closed();
  });
  EXPECT_GE(closed, 200 - 64);
}

TEST(PortInUse, IsOneErrorThatNamesPortAndRemedy) {
  StagedRun run;
  const ViewServer first(at_free_port(), run);
  ViewServer::Options options;
  options.endpoint.port = first.port();
  try {
    const ViewServer second(options, run);
    FAIL() << "two servers at one port";
  } catch (const InputError& error) {
    const std::string words = error.what();
    EXPECT_NE(words.find("port " + std::to_string(first.port()) + " is in use"), std::string::npos) << words;
    EXPECT_NE(words.find(std::to_string(first.port() + 1)), std::string::npos) << words;
    EXPECT_EQ(words.find('\n'), std::string::npos);
  }
  options.endpoint = {"192.0.2.1", 8080};
  EXPECT_THROW(ViewServer(options, run), InputError) << "not an address of this computer";
}

}  // namespace
}  // namespace roslam::telemetry
