#include "runtime/base/child_process.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <limits>

#include "itn/error.h"

namespace itn {
namespace {

std::uint64_t address_space() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

void limit(int resource, std::uint64_t most) {
  rlimit both{};
  if (getrlimit(static_cast<__rlimit_resource>(resource), &both) != 0) return;
  both.rlim_cur = std::min<rlim_t>(both.rlim_max, most);
  setrlimit(static_cast<__rlimit_resource>(resource), &both);
}

void write_all(int fd, const std::string& bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t n = write(fd, bytes.data() + at, bytes.size() - at);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) _exit(2);
    at += static_cast<std::size_t>(n);
  }
}

[[noreturn]] void be_the_child(int fd, const std::function<std::string()>& work, const ChildLimits& limits,
                               std::uint64_t bytes_now) {
  // The parent says what went wrong; a library that writes to the terminal, or a core file, says nothing more.
  if (const int nowhere = open("/dev/null", O_WRONLY); nowhere >= 0) {
    dup2(nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);
  }
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGXCPU}) std::signal(signal, SIG_DFL);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, limits.seconds);
  limit(RLIMIT_AS, bytes_now + limits.bytes);
  std::string answer;
  char done = 'n';
  try {
    answer = work();
    done = 'y';
  } catch (const std::bad_alloc&) {
    answer = fmt::format("takes more than {} GiB to read", limits.bytes >> 30);
  } catch (const std::exception& error) {
    answer = error.what();
  } catch (...) {
    answer = "cannot be read";
  }
  write_all(fd, answer);
  write_all(fd, std::string(1, done));  // apart: the answer may be large
  _exit(0);
}

enum class Time { left, over };

Time read_all(int fd, unsigned seconds, std::string& bytes) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point end = Clock::now() + std::chrono::seconds(seconds);
  std::array<char, 1 << 16> part{};
  for (;;) {
    pollfd waited{fd, POLLIN, 0};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left <= 0) return Time::over;
    const int ready = poll(&waited, 1, static_cast<int>(std::min<std::int64_t>(left, std::numeric_limits<int>::max())));
    if (ready == 0 || (ready < 0 && errno == EINTR)) continue;
    const ssize_t n = read(fd, part.data(), part.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return Time::left;
    bytes.append(part.data(), static_cast<std::size_t>(n));
  }
}

}  // namespace

std::string in_child_process(const std::function<std::string()>& work, const ChildLimits& limits) {
  const std::uint64_t bytes_now = address_space();
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0)
    throw ResultError(std::string("cannot make a pipe to read a file through: ") + std::strerror(errno));
  const pid_t child = fork();
  if (child < 0) {
    close(ends[0]);
    close(ends[1]);
    throw ResultError(std::string("cannot start a process to read a file in: ") + std::strerror(errno));
  }
  if (child == 0) {
    close(ends[0]);
    be_the_child(ends[1], work, limits, bytes_now);
  }
  close(ends[1]);
  std::string answer;
  const Time time = read_all(ends[0], limits.wall_seconds, answer);
  if (time == Time::over) kill(child, SIGKILL);
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (time == Time::over) throw InputError(fmt::format("takes more than {} s to read", limits.wall_seconds));
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
    throw InputError(fmt::format("takes more than {} s to read", limits.seconds));
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || answer.empty())
    throw InputError("crashes its reader: it is broken");
  const bool done = answer.back() == 'y';
  answer.pop_back();
  if (!done) throw InputError(answer);
  return answer;
}

}  // namespace itn
