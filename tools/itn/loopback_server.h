// Serves a page to browsers on this machine and to nobody else.
#pragma once
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <string>

namespace itn::tools {

struct WebRequest {
  std::string method, path;  // path: behind the token, "/" alone for the page itself
  std::map<std::string, std::string> query;
  std::string body;
};

struct WebResponse {
  int status = 200;
  std::string type = "application/json", body;
  std::string file_name;  // not empty: the browser saves it under this name
};

// The server answers only those who know the token, which begins every path: anybody on the machine, and any page that
// a browser shows, can open a connection. So also the names under which it is reached (Host) and from where pages ask
// it (Origin) must be its own, requests are small, slow ones are cut off, and there are only so many connections at a
// time. What may be kept of an answer, and what the page may load, is said with it.
class LoopbackServer {
 public:
  // May be called by several threads at a time. Must not throw.
  using Handler = std::function<WebResponse(const WebRequest&)>;

  // port 0: any that is free. Throws ResultError: taken, or not allowed.
  LoopbackServer(int port, Handler handler);
  ~LoopbackServer();

  int port() const;
  std::string address() const;  // http://127.0.0.1:PORT/TOKEN/

  // Until it is set; polled ten times a second. Connections are then closed, also in the middle of an answer.
  void run(const std::atomic<bool>& stop);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace itn::tools
