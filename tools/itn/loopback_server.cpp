#include "tools/itn/loopback_server.h"

#include <fmt/format.h>
#include <sys/random.h>

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <condition_variable>
#include <list>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>

#include "itn/error.h"

namespace itn::tools {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using tcp = asio::ip::tcp;
using Code = boost::system::error_code;
using Clock = std::chrono::steady_clock;

constexpr std::uint32_t longest_header = 16 << 10;
constexpr std::uint64_t longest_body = 64 << 10;
constexpr std::size_t most_connections = 32;
constexpr auto request_limit = std::chrono::seconds(10), answer_limit = std::chrono::seconds(30);
constexpr auto poll = std::chrono::milliseconds(100);

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw ResultError("no random numbers for the token: the system refuses them");
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

// In a time that does not tell how much of it is right.
bool is_same(const std::string& given, const std::string& token) {
  unsigned different = given.size() == token.size() ? 0 : 1;
  for (std::size_t i = 0; i < token.size(); ++i)
    different |= static_cast<unsigned char>(i < given.size() ? given[i] : '\0') ^ static_cast<unsigned char>(token[i]);
  return different == 0;
}

// Only the escaped characters of parameter names matter here.
std::string unescaped(const std::string& text) {
  const auto digit = [](char c) {
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
  };
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escape = text[i] == '%' && i + 2 < text.size() && digit(text[i + 1]) >= 0 && digit(text[i + 2]) >= 0;
    out += escape ? static_cast<char>(16 * digit(text[i + 1]) + digit(text[i + 2])) : text[i];
    if (escape) i += 2;
  }
  return out;
}

std::map<std::string, std::string> query_of(const std::string& text) {
  std::map<std::string, std::string> query;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('&', at), text.size());
    const std::string part = text.substr(at, end - at);
    const std::size_t equals = std::min(part.find('='), part.size());
    query[unescaped(part.substr(0, equals))] = unescaped(part.substr(std::min(equals + 1, part.size())));
    at = end + 1;
  }
  return query;
}

WebResponse refusal(int status, const std::string& text) {
  return {status, "text/plain; charset=utf-8", text + "\n", ""};
}

}  // namespace

struct LoopbackServer::State {
  asio::io_context accepting;
  tcp::acceptor acceptor{accepting};
  Handler handler;
  std::string token = random_token();
  std::atomic<bool> stopping{false};

  // Each is talked to by a thread of its own.
  struct Connection {
    asio::io_context context;
    beast::tcp_stream stream{context};
    std::optional<Clock::time_point> waiting = Clock::now();  // for a request, since when
  };
  std::mutex mutex;  // of the list, and of `waiting`
  std::list<Connection> connections;
  std::condition_variable ended;

  int port() { return acceptor.local_endpoint().port(); }
  bool is_own_name(const std::string& host) {
    return host == fmt::format("127.0.0.1:{}", port()) || host == fmt::format("localhost:{}", port());
  }

  WebResponse answer(const http::request<http::string_body>& request) {
    const std::string host(request[http::field::host]), target(request.target());
    if (!is_own_name(host)) return refusal(421, "This is not the server of that name.");
    const std::string origin(request[http::field::origin]);
    if (!origin.empty() && origin != "http://" + host) return refusal(403, "Another page asks for this one.");
    const std::size_t question = std::min(target.find('?'), target.size());
    const std::string path = target.substr(0, question);
    const std::size_t slash = path.find('/', 1);
    if (path.empty() || path[0] != '/' || slash == std::string::npos || !is_same(path.substr(1, slash - 1), token))
      return refusal(403, "The token is missing or wrong: open the address that itn view has printed.");
    return handler({std::string(request.method_string()), path.substr(slash),
                    query_of(target.substr(std::min(question + 1, target.size()))), request.body()});
  }

  static http::response<http::string_body> response_of(WebResponse&& answer, unsigned version, bool keep_alive) {
    http::response<http::string_body> response(static_cast<http::status>(answer.status), version);
    response.set(http::field::content_type, answer.type);
    response.set(http::field::cache_control, "no-store");
    response.set("Content-Security-Policy",
                 "default-src 'self'; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
    response.set("Referrer-Policy", "no-referrer");  // the address holds the token
    response.set("X-Content-Type-Options", "nosniff");
    response.set("Cross-Origin-Resource-Policy", "same-origin");
    response.set("Cross-Origin-Opener-Policy", "same-origin");
    if (!answer.file_name.empty())
      response.set(http::field::content_disposition, fmt::format("attachment; filename=\"{}\"", answer.file_name));
    response.keep_alive(keep_alive);
    response.body() = std::move(answer.body);
    response.prepare_payload();
    return response;
  }

  // Runs what has been begun on the stream, and nothing else, to its end or its time limit.
  template <class Begin>
  Code wait_for(Connection& connection, std::chrono::seconds limit, const Begin& begin) {
    Code result;
    connection.stream.expires_after(limit);
    begin([&result](Code code, std::size_t) { result = code; });
    asio::io_context& context = connection.context;
    context.restart();
    while (!context.stopped()) {
      context.run_for(poll);
      if (stopping && !context.stopped()) connection.stream.cancel();
    }
    return result;
  }

  void set_waiting(Connection& connection, std::optional<Clock::time_point> since) {
    const std::lock_guard lock(mutex);
    connection.waiting = since;
  }

  void converse(Connection& connection) {
    beast::tcp_stream& stream = connection.stream;
    beast::flat_buffer buffer(longest_header + longest_body);
    for (bool alive = true; alive && !stopping;) {
      http::request_parser<http::string_body> parser;
      parser.header_limit(longest_header);
      parser.body_limit(longest_body);
      set_waiting(connection, Clock::now());
      const Code read =
          wait_for(connection, request_limit, [&](auto done) { http::async_read(stream, buffer, parser, done); });
      set_waiting(connection, std::nullopt);
      WebResponse made;
      if (read == http::error::header_limit || read == http::error::body_limit ||
          read == http::error::buffer_overflow) {
        made = refusal(413, "The request is too large.");
        alive = false;
      } else if (read && read.category() == make_error_code(http::error::bad_method).category() &&
                 read != http::error::end_of_stream && read != http::error::partial_message) {
        made = refusal(400, "This is no HTTP request.");
        alive = false;
      } else if (read) {
        break;
      } else {
        made = answer(parser.get());
        alive = parser.get().keep_alive() && made.status < 400;  // who is refused keeps no connection
      }
      http::response<http::string_body> response = response_of(std::move(made), 11, alive);
      if (parser.is_header_done() && parser.get().method() == http::verb::head) response.body().clear();
      if (wait_for(connection, answer_limit, [&](auto done) { http::async_write(stream, response, done); })) break;
    }
    Code ignored;
    stream.socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  void serve(std::list<Connection>::iterator connection) {
    try {
      converse(*connection);
    } catch (const std::exception&) {
      // A connection that fails, for lack of memory too, is its client's loss alone.
    }
    forget(connection);
  }

  void forget(std::list<Connection>::iterator connection) {
    const std::lock_guard lock(mutex);
    connections.erase(connection);
    ended.notify_all();
  }

  // Ends the connection whose request has been waited for longest: clients that send nothing, or slowly, keep no other
  // one out. False: each has its request.
  bool make_room(std::unique_lock<std::mutex>& lock) {
    Connection* longest = nullptr;
    for (Connection& c : connections)
      if (c.waiting && (!longest || *c.waiting < *longest->waiting)) longest = &c;
    if (!longest) return false;
    longest->waiting.reset();
    asio::post(longest->context, [longest] { longest->stream.cancel(); });
    return ended.wait_for(lock, poll, [&] { return connections.size() < most_connections; });
  }

  void accept() {
    std::list<Connection> made(1);
    const auto connection = made.begin();
    Code code;
    acceptor.accept(connection->stream.socket(), code);
    if (code) return;
    connection->stream.socket().set_option(tcp::no_delay(true), code);
    {
      std::unique_lock lock(mutex);
      if (connections.size() >= most_connections && !make_room(lock)) return;  // closed
      connections.splice(connections.end(), made);
    }
    try {
      std::thread([this, connection] { serve(connection); }).detach();
    } catch (const std::system_error&) {  // no more threads: closed
      forget(connection);
    }
  }
};

LoopbackServer::LoopbackServer(int port, Handler handler) : state_(std::make_unique<State>()) {
  state_->handler = std::move(handler);
  const tcp::endpoint here(asio::ip::address_v4::loopback(), static_cast<unsigned short>(port));
  Code code;
  state_->acceptor.open(here.protocol(), code);
  if (!code) state_->acceptor.set_option(tcp::acceptor::reuse_address(true), code);
  if (!code) state_->acceptor.bind(here, code);
  if (!code) state_->acceptor.listen(asio::socket_base::max_listen_connections, code);
  if (!code) state_->acceptor.non_blocking(true, code);
  if (code) throw ResultError(fmt::format("port {}: cannot be listened on; {}", port, code.message()));
}

LoopbackServer::~LoopbackServer() = default;

int LoopbackServer::port() const { return state_->port(); }
std::string LoopbackServer::address() const {
  return fmt::format("http://127.0.0.1:{}/{}/", state_->port(), state_->token);
}

void LoopbackServer::run(const std::atomic<bool>& stop) {
  State& s = *state_;
  while (!stop) {
    bool arrived = false;
    s.acceptor.async_wait(tcp::acceptor::wait_read, [&](Code code) { arrived = !code; });
    s.accepting.restart();
    while (!s.accepting.stopped()) {
      s.accepting.run_for(poll);
      if (stop && !s.accepting.stopped()) s.acceptor.cancel();
    }
    if (arrived) s.accept();
  }
  Code ignored;
  s.acceptor.close(ignored);
  s.stopping = true;
  std::unique_lock lock(s.mutex);
  s.ended.wait(lock, [&] { return s.connections.empty(); });
}

}  // namespace itn::tools
