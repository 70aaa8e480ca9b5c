// Runs build/bin/itn as a user would and keeps what it says.
#pragma once
#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

// The scene of most tests.
inline const std::string ball = ITN_SOURCE_DIR "/tests/tool/data/ball.xml";

struct Result {
  int exit_code = -1;  // -signal when a signal ended it
  std::string output, error;
};

class Process {
 public:
  struct Options {
    std::map<std::string, std::string> environment{};  // added to this process's own
    bool ordinary_user = false;                        // give up root, which may write anywhere
    std::string output_file{};                         // standard output goes there instead of Result::output
    std::vector<int> closed{};                         // standard files that are not open
    std::map<int, std::uint64_t> limits{};             // of setrlimit(), both
  };

  Process(const std::vector<std::string>& arguments, const Options& options);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send(int signal_number) const;
  bool handles(int signal_number) const;  // has it installed a handler yet?
  double cpu_seconds() const;             // of all its threads so far
  Result wait();

 private:
  pid_t pid_ = -1;
  bool own_output_;
  std::string output_, error_;  // files
};

// Throws where the condition does not come true within two minutes.
void wait_until(const std::function<bool()>& condition);

Result run_itn(const std::vector<std::string>& arguments, const Process::Options& options = {});
