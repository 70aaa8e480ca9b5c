// A line on the terminal that says how far a long job is.
#pragma once
#include <chrono>
#include <string>

namespace itn::tools {

// Shows nothing unless standard error is a terminal and `wanted`.
class Progress {
 public:
  // amount: how many units (paths, images) the whole job has; done: the fraction of it that was there already.
  Progress(std::string label, double amount, std::string unit, bool wanted, double done = 0);
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(double fraction);
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  std::string label_, unit_;
  double amount_, done_;
  bool shown_;
  Clock::time_point start_ = Clock::now(), last_{};
};

}  // namespace itn::tools
