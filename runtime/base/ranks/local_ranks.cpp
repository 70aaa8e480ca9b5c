#include "runtime/base/ranks/local_ranks.h"

#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <system_error>
#include <thread>
#include <utility>

#include "itn/error.h"
#include "runtime/base/parallel.h"
#include "runtime/base/ranks/work_queue.h"

namespace itn {
namespace {

std::string packed(const std::vector<std::string>& parts) {
  std::vector<std::uint64_t> sizes;
  std::string all;
  for (const std::string& part : parts) {
    sizes.push_back(part.size());
    all += part;
  }
  return bytes_of(sizes) + all;
}

// count: of the parts.
std::vector<std::string> unpacked(const std::string& all, std::size_t count) {
  const auto sizes = numbers_of<std::uint64_t>(all.substr(0, count * sizeof(std::uint64_t)));
  std::vector<std::string> parts;
  std::size_t at = count * sizeof(std::uint64_t);
  for (const std::uint64_t size : sizes) {
    parts.push_back(all.substr(at, size));
    at += size;
  }
  return parts;
}

// The other end is gone.
struct Gone {};

// Messages over one end of a pair of sockets.
class Line {
 public:
  explicit Line(int socket) : socket_(socket) {}
  ~Line() {
    if (socket_ >= 0) close(socket_);
  }
  Line(Line&& other) noexcept : socket_(std::exchange(other.socket_, -1)) {}
  Line& operator=(Line&&) = delete;

  // give_up(): asked now and then while one waits.
  template <class GiveUp>
  void send(const std::string& message, const GiveUp& give_up) const {
    const std::string all = bytes_of(std::vector<std::uint64_t>{message.size()}) + message;
    for (std::size_t at = 0; at < all.size();) {
      wait_for(POLLOUT, give_up);
      const ssize_t n = ::send(socket_, all.data() + at, all.size() - at, MSG_DONTWAIT | MSG_NOSIGNAL);
      if (n < 0 && errno != EAGAIN && errno != EINTR) throw Gone();
      if (n > 0) at += static_cast<std::size_t>(n);
    }
  }
  template <class GiveUp>
  std::string receive(const GiveUp& give_up) const {
    const std::uint64_t size = numbers_of<std::uint64_t>(receive_bytes(sizeof(std::uint64_t), give_up)).front();
    return receive_bytes(size, give_up);
  }
  bool has_message() const {
    pollfd of{socket_, POLLIN, 0};
    return poll(&of, 1, 0) > 0;
  }

 private:
  template <class GiveUp>
  void wait_for(short what, const GiveUp& give_up) const {
    constexpr int moment = 50;  // [ms]
    for (pollfd of{socket_, what, 0}; poll(&of, 1, moment) <= 0;)
      if (give_up()) throw Interrupted();
  }
  template <class GiveUp>
  std::string receive_bytes(std::size_t size, const GiveUp& give_up) const {
    std::string bytes(size, '\0');
    for (std::size_t at = 0; at < size;) {
      wait_for(POLLIN, give_up);
      const ssize_t n = recv(socket_, bytes.data() + at, size - at, MSG_DONTWAIT);
      if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) throw Gone();
      if (n > 0) at += static_cast<std::size_t>(n);
    }
    return bytes;
  }

  int socket_;
};

// The first has a line to each of the others, and passes on what these have for each other.
class LocalRanks : public StartedRanks {
 public:
  // lines: of the first to ranks 1, 2 ... with their processes; of another to the first alone.
  LocalRanks(int rank, int count, std::vector<Line> lines, std::vector<pid_t> processes,
             const std::atomic<bool>& cancel)
      : rank_(rank), count_(count), lines_(std::move(lines)), processes_(std::move(processes)), cancel_(cancel) {}

  int rank() const override { return rank_; }
  int count() const override { return count_; }
  void meet() override { gather(""); }

  std::vector<std::string> gather(const std::string& mine) override {
    if (!is_first()) {
      send(0, mine);
      return unpacked(receive(0), size_t(count_));
    }
    std::vector<std::string> all{mine};
    for (std::size_t k = 0; k < lines_.size(); ++k) all.push_back(receive(k));
    const std::string text = packed(all);
    for (std::size_t k = 0; k < lines_.size(); ++k) send(k, text);
    return all;
  }

  std::vector<std::string> exchange(const std::vector<std::string>& to_each) override {
    if (!is_first()) {
      send(0, packed(to_each));
      return unpacked(receive(0), size_t(count_));
    }
    std::vector<std::vector<std::string>> all{to_each};
    for (std::size_t k = 0; k < lines_.size(); ++k) all.push_back(unpacked(receive(k), size_t(count_)));
    std::vector<std::string> mine;
    for (std::size_t r = 0; r < all.size(); ++r) {
      std::vector<std::string> for_rank;
      for_rank.reserve(all.size());
      for (const std::vector<std::string>& from : all) for_rank.push_back(from[r]);
      if (r == 0)
        mine = std::move(for_rank);
      else
        send(r - 1, packed(for_rank));
    }
    return mine;
  }

  // The first answers from a thread of its own; nothing else uses its lines meanwhile.
  void hand_out(std::size_t count, std::size_t most, const Work& work) override {
    meet();
    if (is_first()) {
      WorkQueue queue(count, most, count_);
      std::exception_ptr failure;
      {
        std::jthread server([&](const std::stop_token& stop) {
          try {
            serve(queue, stop);
          } catch (...) {
            failure = std::current_exception();
          }
          served_ = true;
          served_.notify_one();
        });
        for (WorkRange range = queue.take(); range[0] < range[1]; range = queue.take()) work(range[0], range[1]);
        served_.wait(false);
      }
      served_ = false;
      if (failure) std::rethrow_exception(failure);
    } else {
      for (WorkRange range = ask(); range[0] < range[1]; range = ask()) work(range[0], range[1]);
    }
    meet();
  }

  Traffic traffic() const override { return traffic_; }

  // The others end without destructors of static objects: those of libraries wait for threads that began before the
  // copy was made, and are not in it (log4cplus, which OpenVDB brings).
  void leave() override {
    if (!is_first()) _exit(0);
    for (const pid_t process : processes_) waitpid(process, nullptr, 0);
  }
  [[noreturn]] void end_all(int exit_code) override {
    for (const pid_t process : processes_) kill(process, SIGKILL);
    for (const pid_t process : processes_) waitpid(process, nullptr, 0);
    _exit(other_code_ > 0 ? other_code_ : exit_code);
  }

 private:
  void send(std::size_t line, const std::string& message) {
    traffic_.messages += 1;
    traffic_.bytes += message.size();
    try {
      lines_[line].send(message, [&] { return cancel_.load(); });
    } catch (const Gone&) {
      fail(line);
    }
  }
  std::string receive(std::size_t line) {
    try {
      return lines_[line].receive([&] { return cancel_.load(); });
    } catch (const Gone&) {
      fail(line);
    }
  }
  [[noreturn]] void fail(std::size_t line) {
    if (!is_first()) throw Interrupted();  // it is the first's to say why
    int status = 0;
    waitpid(processes_[line], &status, 0);
    processes_.erase(processes_.begin() + static_cast<std::ptrdiff_t>(line));
    if (WIFEXITED(status)) other_code_ = WEXITSTATUS(status);
    throw ResultError("the process of another device has ended; the same command goes on from what is stored");
  }

  void serve(WorkQueue& queue, const std::stop_token& stop) {
    std::vector<bool> working(lines_.size(), true);
    for (std::size_t left = lines_.size(); left > 0 && !stop.stop_requested();) {
      bool idle = true;
      for (std::size_t k = 0; k < lines_.size(); ++k) {
        if (!working[k] || !lines_[k].has_message()) continue;
        idle = false;
        receive(k);
        const WorkRange range = queue.take();
        if (range[0] == range[1]) {
          working[k] = false;
          --left;
        }
        send(k, bytes_of(std::vector<std::uint64_t>(range.begin(), range.end())));
      }
      if (idle) std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  }
  WorkRange ask() {
    send(0, "");
    const auto range = numbers_of<std::uint64_t>(receive(0));
    return {range[0], range[1]};
  }

  int rank_, count_;
  std::vector<Line> lines_;
  std::vector<pid_t> processes_;
  const std::atomic<bool>& cancel_;
  Traffic traffic_;
  std::atomic<bool> served_{false};
  int other_code_ = 0;  // that another ended with
};

}  // namespace

std::unique_ptr<StartedRanks> start_local_ranks(int count, const std::atomic<bool>& cancel) {
  const std::string threads = std::to_string(std::max(1, static_cast<int>(core_count()) / count));
  for (const char* variable : {"POCL_MAX_PTHREAD_COUNT", "OMP_NUM_THREADS"}) setenv(variable, threads.c_str(), 0);
  std::vector<Line> lines;
  std::vector<pid_t> processes;
  const pid_t first = getpid();
  for (int rank = 1; rank < count; ++rank) {
    int ends[2];
    const bool paired = socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0;
    const pid_t process = paired ? fork() : -1;
    if (process < 0) {
      const std::string why = std::system_category().message(errno);
      for (const pid_t started : processes) kill(started, SIGKILL);
      throw ResultError("device: no process for each of the devices can be started: " + why);
    }
    if (process == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (getppid() != first) _exit(1);  // it is gone already
      lines.clear();
      close(ends[0]);
      lines.emplace_back(ends[1]);
      return std::make_unique<LocalRanks>(rank, count, std::move(lines), std::vector<pid_t>(), cancel);
    }
    close(ends[1]);
    lines.emplace_back(ends[0]);
    processes.push_back(process);
  }
  return std::make_unique<LocalRanks>(0, count, std::move(lines), std::move(processes), cancel);
}

}  // namespace itn
