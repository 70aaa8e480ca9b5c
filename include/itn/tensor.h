// An array of numbers with a name and a shape: what weights are, and what a safetensors file holds.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace itn {

struct Tensor {
  std::string name;
  std::vector<std::size_t> shape;  // row-major: the last index runs fastest
  std::vector<float> values;       // as many as the product of the shape
};

inline std::size_t count_of(const std::vector<std::size_t>& shape) {
  std::size_t count = 1;
  for (const std::size_t extent : shape) count *= extent;
  return count;
}

}  // namespace itn
