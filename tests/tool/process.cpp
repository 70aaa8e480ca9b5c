#include "tests/tool/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>

#include "runtime/image/file.h"

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
    for (const auto& [name, value] : options.environment) setenv(name.c_str(), value.c_str(), 1);
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
