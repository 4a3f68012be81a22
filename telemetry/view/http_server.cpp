// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/view/http_server.hpp"

#include <httplib.h>
#include <poll.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "roslam/common/stopwatch.hpp"
#include "roslam/common/thread_priority.hpp"

namespace roslam::telemetry {

namespace {
using Clock = std::chrono::steady_clock;

// A connection as httplib reads and writes it. All that is read has been received already.
class ConnectionStream : public httplib::Stream {
 public:
  ConnectionStream(Connection& connection, const HttpServer::Options& options, const std::atomic<bool>& stop)
      : connection_(connection),
        options_(options),
        stop_(stop),
        deadline_(Clock::now() + options.answer_time) {}

  void set_endless() { deadline_ = Clock::time_point::max(); }

  // Whether the other side has closed the connection.
  bool is_gone() const {
    pollfd polled{socket(), POLLRDHUP, 0};
    return poll(&polled, 1, 0) > 0;
  }

  // Versions of httplib differ in which of these they have.
  bool is_readable() const { return !connection_.received.empty(); }
  bool wait_readable() const { return is_readable(); }
  bool is_writable() const { return wait_for(POLLOUT, 0); }
  bool wait_writable() const { return wait_for(POLLOUT, static_cast<int>(options_.send_time.count())); }
  bool is_peer_alive() const { return is_writable(); }
  time_t duration() const { return 0; }
  socket_t socket() const { return connection_.socket.get(); }
  void get_remote_ip_and_port(std::string& ip, int& port) const {
    ip.clear();
    port = 0;
  }
  void get_local_ip_and_port(std::string& ip, int& port) const { get_remote_ip_and_port(ip, port); }

  ssize_t read(char* bytes, std::size_t size) {
    const std::size_t taken = std::min(size, connection_.received.size());
    std::copy_n(connection_.received.begin(), taken, bytes);
    connection_.received.erase(0, taken);
    return static_cast<ssize_t>(taken);
  }

  ssize_t write(const char* bytes, std::size_t size) {
    for (std::size_t sent = 0; sent < size;) {
      const auto now = Clock::now();
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline_ - now);
      const auto patience = std::min<std::int64_t>(left.count(), options_.send_time.count());
      if (patience <= 0 || !wait_to_write(static_cast<int>(patience))) return -1;
      const auto count = send(socket(), bytes + sent, size - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (count < 0 && errno != EAGAIN && errno != EINTR) return -1;
      if (count > 0) sent += static_cast<std::size_t>(count);
    }
    return static_cast<ssize_t>(size);
  }

 private:
  // An error of the connection counts as an event; the call that follows tells of it.
  bool wait_for(short event, int milliseconds) const {
    pollfd polled{socket(), event, 0};
    return poll(&polled, 1, milliseconds) > 0 && (polled.revents & (POLLERR | POLLHUP)) == 0;
  }

  // In short steps, to end with the server.
  bool wait_to_write(int milliseconds) const {
    constexpr int kStep = 100;
    for (int waited = 0; waited < milliseconds && !stop_; waited += kStep) {
      if (wait_for(POLLOUT, std::min(kStep, milliseconds - waited))) return true;
      if (is_gone()) return false;
    }
    return false;
  }

  Connection& connection_;
  const HttpServer::Options& options_;
  const std::atomic<bool>& stop_;
  Clock::time_point deadline_;
};

HttpRequest request_of(const httplib::Request& request) {
  HttpRequest result;
  result.method = request.method;
  result.path = request.path;
  for (const auto& [name, value] : request.params) result.parameters.emplace(name, value);
  for (const auto& [name, value] : request.headers) result.fields.emplace(name, value);
  return result;
}

// Parses requests and writes answers; does not listen.
class Answerer : public httplib::Server {
 public:
  Answerer() {
    svr_sock_ = 0;  // streams end at once in a server that does not listen; it is not used otherwise
    set_keep_alive_max_count(1000);
    set_payload_max_length(0);
  }

  // False: the connection is at its end.
  bool answer(ConnectionStream& stream) {
    bool is_closed = false;
    const std::function<void(httplib::Request&)> prepare = [](httplib::Request& request) {
      request.headers.erase("Accept-Encoding");  // compression costs more than the page's network
    };
    return process(*this, stream, is_closed, prepare) && !is_closed;
  }

 private:
  template <typename Self>
  static bool process(Self& self, ConnectionStream& stream, bool& is_closed,
                      const std::function<void(httplib::Request&)>& prepare) {
    const std::string nowhere;
    if constexpr (requires { self.process_request(stream, false, is_closed, prepare); }) {
      return self.process_request(stream, false, is_closed, prepare);
    } else {
      return self.process_request(stream, nowhere, 0, nowhere, 0, false, is_closed, prepare);
    }
  }
};
}  // namespace

struct HttpServer::Impl {
  Impl(const Endpoint& endpoint, HttpHandler the_handler, const Options& the_options)
      : options(the_options),
        handler(std::move(the_handler)),
        gate(endpoint, the_options.gate),
        cpu_seconds(static_cast<std::size_t>(the_options.threads)) {}

  void work(std::atomic<double>& cpu);
  void fill(const HttpReply& reply, httplib::Response& response, const ConnectionStream& connection,
            const std::function<void()>& note_cpu);

  Options options;
  HttpHandler handler;
  std::atomic<bool> is_stopped = false;
  RequestGate gate;
  std::vector<std::atomic<double>> cpu_seconds;  // of each thread
  std::vector<std::jthread> threads;
};

HttpServer::HttpServer(const Endpoint& endpoint, HttpHandler handler, const Options& options)
    : impl_(std::make_unique<Impl>(endpoint, std::move(handler), options)) {
  for (std::atomic<double>& cpu : impl_->cpu_seconds)
    impl_->threads.emplace_back([this, &cpu] { impl_->work(cpu); });
}

HttpServer::~HttpServer() { stop(); }

int HttpServer::port() const { return impl_->gate.port(); }

void HttpServer::stop() {
  impl_->is_stopped = true;
  impl_->gate.close();
  for (std::jthread& thread : impl_->threads)
    if (thread.joinable()) thread.join();
}

double HttpServer::cpu_seconds() const {
  double sum = impl_->gate.cpu_seconds();
  for (const std::atomic<double>& cpu : impl_->cpu_seconds) sum += cpu;
  return sum;
}

void HttpServer::Impl::fill(const HttpReply& reply, httplib::Response& response,
                            const ConnectionStream& connection, const std::function<void()>& note_cpu) {
  response.status = reply.status;
  for (const auto& [name, value] : reply.fields) response.set_header(name.c_str(), value);
  if (!reply.stream) return response.set_content(reply.body, reply.type.c_str());
  response.set_chunked_content_provider(
      reply.type.c_str(),
      [this, note_cpu, &connection, stream = reply.stream](std::size_t, httplib::DataSink& sink) {
        if (is_stopped || connection.is_gone()) return false;
        const bool goes_on =
            stream([&sink](std::string_view part) { return sink.write(part.data(), part.size()); });
        note_cpu();
        if (!goes_on) sink.done();
        return goes_on;
      });
}

void HttpServer::Impl::work(std::atomic<double>& cpu) {
  lower_thread_priority(ThreadPriority::kLow);
  const Stopwatch watch;
  const auto note_cpu = [&] { cpu = watch.seconds(); };
  ConnectionStream* stream = nullptr;
  Answerer answerer;
  answerer.set_pre_routing_handler([&](const httplib::Request& request, httplib::Response& response) {
    HttpReply reply;
    try {
      reply = handler(request_of(request));
    } catch (const std::exception&) {
      reply = HttpReply::text(500, "the server failed");
    }
    if (reply.stream) stream->set_endless();
    fill(reply, response, *stream, note_cpu);
    return httplib::Server::HandlerResponse::Handled;
  });
  while (auto connection = gate.next()) {
    ConnectionStream connection_stream(*connection, options, is_stopped);
    stream = &connection_stream;
    if (answerer.answer(connection_stream) && !is_stopped) gate.put_back(std::move(*connection));
    note_cpu();
  }
}

}  // namespace roslam::telemetry
