// Samples of several numbers at a glance: on the diagonal how often each number lies where, below it each pair of
// numbers against each other.
#pragma once
#include <string>
#include <vector>

namespace itn {

struct CornerNumber {
  std::string name;
  std::vector<double> samples;
  double low = 0, high = 0;  // an interval to shade
};

// An SVG picture to stand in a page. All have as many samples.
std::string corner_plot(const std::vector<CornerNumber>& numbers);

}  // namespace itn
