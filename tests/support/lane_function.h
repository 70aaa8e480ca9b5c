// A few lines of OpenCL C over REAL lanes, run over arrays on the default device at a chosen width.
#pragma once
#include <map>
#include <string>
#include <vector>

namespace itn::test {

using Columns = std::vector<std::vector<float>>;  // all of one length

struct LaneFunction {
  std::vector<std::string> includes;  // relative to kernels/; shared/vector.h comes by itself
  std::vector<std::string> inputs;    // names of const REAL variables
  std::vector<std::string> outputs;   // names of REAL variables that body assigns to
  std::string body;
  std::map<std::string, std::string> definitions{};  // beside WIDTH
  std::string functions{};                           // more OpenCL C, which body calls
};

// One column an output, row by row what body makes of the rows of the inputs. width: 1, 4, 8 or 16.
Columns run_lanes(const LaneFunction& function, int width, const Columns& inputs);

// count numbers (k + 1/2) / 2^23, as the renderer's generator gives them.
std::vector<float> uniform_numbers(std::size_t count, unsigned seed);

// count numbers uniform in [low, high].
std::vector<float> uniform_numbers(std::size_t count, unsigned seed, double low, double high);

}  // namespace itn::test
