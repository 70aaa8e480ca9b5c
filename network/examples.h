// What is learnt from: images, and the parameters that they were made with.
#pragma once
#include <cstddef>
#include <span>

namespace itn {

class Examples {
 public:
  virtual ~Examples() = default;
  virtual std::size_t count() const = 0;
  // image: (channels, size, size), truth: one parameter for each output of the network. Always the same for an index.
  virtual void read(std::size_t index, std::span<float> image, std::span<double> truth) const = 0;
};

}  // namespace itn
