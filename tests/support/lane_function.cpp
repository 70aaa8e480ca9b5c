#include "lane_function.h"

#include <algorithm>
#include <random>

#include "itn/device.h"

namespace itn::test {
namespace {

constexpr std::size_t largest_width = 16;

std::string source_of(const LaneFunction& f) {
  std::string text = "#include \"shared/vector.h\"\n";
  for (const auto& include : f.includes) text += "#include \"" + include + "\"\n";
  text += f.functions;
  text += "__kernel void run(__global const float* in_, __global float* out_, int count_) {\n";
  text += "INT at_ = (int)get_global_id(0) * WIDTH + LANE_INDEX;\n";
  for (std::size_t k = 0; k < f.inputs.size(); ++k)
    text += "const REAL " + f.inputs[k] + " = GATHER(in_, at_ + " + std::to_string(k) + " * count_);\n";
  for (const auto& output : f.outputs) text += "REAL " + output + ";\n";
  text += "{\n" + f.body + "\n}\n";
  for (std::size_t k = 0; k < f.outputs.size(); ++k)
    text += "SCATTER(out_, at_ + " + std::to_string(k) + " * count_, " + f.outputs[k] + ");\n";
  return text + "}\n";
}

}  // namespace

Columns run_lanes(const LaneFunction& function, int width, const Columns& inputs) {
  static const Device& device = *new Device;  // never destroyed: drivers may be gone before our static objects
  const std::size_t rows = inputs.at(0).size();
  const std::size_t padded = (rows + largest_width - 1) / largest_width * largest_width;
  std::vector<float> in, out(padded * function.outputs.size());
  for (const auto& column : inputs) {
    in.insert(in.end(), column.begin(), column.end());
    in.resize((in.size() + largest_width - 1) / largest_width * largest_width, column.back());
  }
  std::map<std::string, std::string> definitions = function.definitions;
  definitions["WIDTH"] = std::to_string(width);
  const cl::Program program =
      device.build("lane_function.cl", definitions, {{"lane_function.cl", source_of(function)}});
  cl::Kernel kernel(program, "run");
  const cl::Buffer in_buffer = device.upload(in, "inputs"), out_buffer = device.upload(out, "outputs");
  kernel.setArg(0, in_buffer);
  kernel.setArg(1, out_buffer);
  kernel.setArg(2, static_cast<int>(padded));
  device.launch(kernel, padded / static_cast<std::size_t>(width), 1);
  device.download(out_buffer, out);
  Columns result;
  for (std::size_t k = 0; k < function.outputs.size(); ++k) {
    const auto first = out.begin() + static_cast<std::ptrdiff_t>(k * padded);
    result.emplace_back(first, first + static_cast<std::ptrdiff_t>(rows));
  }
  return result;
}

std::vector<float> uniform_numbers(std::size_t count, unsigned seed) {
  std::mt19937 generator(seed);
  std::vector<float> u(count);
  for (auto& x : u) x = (static_cast<float>(generator() >> 9) + 0.5f) * 0x1p-23f;
  return u;
}

std::vector<float> uniform_numbers(std::size_t count, unsigned seed, double low, double high) {
  std::vector<float> u = uniform_numbers(count, seed);
  for (auto& x : u) x = static_cast<float>(low + (high - low) * x);
  return u;
}

}  // namespace itn::test
