#include "tests/tool/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "itn/file.h"

namespace {

std::string temporary_file() {
  std::string name = (std::filesystem::temp_directory_path() / "itn_test_XXXXXX").string();
  const int descriptor = mkstemp(name.data());
  if (descriptor < 0) throw std::runtime_error("cannot create " + name);
  close(descriptor);
  return name;
}

void redirect(const std::string& file, int descriptor) {
  const int opened = open(file.c_str(), O_WRONLY);
  if (opened < 0 || dup2(opened, descriptor) < 0) _exit(127);
}

}  // namespace

Process::Process(const std::vector<std::string>& arguments, const Options& options)
    : own_output_(options.output_file.empty()),
      output_(own_output_ ? temporary_file() : options.output_file),
      error_(temporary_file()) {
  std::vector<char*> argv{const_cast<char*>("itn")};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  // Opened here: an ordinary user may not reach the build folder by its path.
  const int binary = open(ITN_BINARY, O_RDONLY);
  if (binary < 0) throw std::runtime_error("cannot open " ITN_BINARY);
  pid_ = fork();
  if (pid_ == 0) {
    redirect(output_, STDOUT_FILENO);
    redirect(error_, STDERR_FILENO);
    signal(SIGHUP, SIG_DFL);  // as from a terminal, whatever (nohup) the tests were started by
    for (const int descriptor : options.closed) close(descriptor);
    for (const auto& [name, value] : options.environment) setenv(name.c_str(), value.c_str(), 1);
    for (const auto& [resource, most] : options.limits) {
      const rlimit limit{most, most};
      setrlimit(static_cast<__rlimit_resource>(resource), &limit);
    }
    if (options.ordinary_user && geteuid() == 0 && (setgid(65534) != 0 || setuid(65534) != 0)) _exit(127);
    fexecve(binary, argv.data(), environ);
    _exit(127);
  }
  close(binary);
  if (pid_ < 0) throw std::runtime_error("cannot start a process");
}

Process::~Process() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  if (own_output_) unlink(output_.c_str());
  unlink(error_.c_str());
}

void Process::send(int signal_number) const { kill(pid_, signal_number); }

bool Process::handles(int signal_number) const {
  // Until it has become another program, it has the handlers of this one.
  std::error_code none;
  const auto program = std::filesystem::read_symlink("/proc/" + std::to_string(pid_) + "/exe", none);
  if (none || program == std::filesystem::read_symlink("/proc/self/exe")) return false;
  std::ifstream file("/proc/" + std::to_string(pid_) + "/status");
  for (std::string line; std::getline(file, line);)
    if (line.rfind("SigCgt:", 0) == 0) return std::stoull(line.substr(7), nullptr, 16) >> (signal_number - 1) & 1;
  return false;
}

double Process::cpu_seconds() const {
  std::ifstream file("/proc/" + std::to_string(pid_) + "/stat");
  std::string text;
  std::getline(file, text, ')');  // the name, which may hold blanks
  double user = 0, system = 0;
  for (int field = 3; field <= 15 && file >> text; ++field) {
    if (field == 14) user = std::stod(text);
    if (field == 15) system = std::stod(text);
  }
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

void wait_until(const std::function<bool()>& condition) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point end = Clock::now() + std::chrono::minutes(2);
  while (!condition()) {
    if (Clock::now() > end) throw std::runtime_error("what the test waits for has not come true in two minutes");
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

Result Process::wait() {
  int status = 0;
  if (waitpid(pid_, &status, 0) != pid_) throw std::runtime_error("waitpid failed");
  pid_ = -1;
  Result result;
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  if (own_output_) result.output = itn::read_file(output_);
  result.error = itn::read_file(error_);
  return result;
}

Result run_itn(const std::vector<std::string>& arguments, const Process::Options& options) {
  return Process(arguments, options).wait();
}
