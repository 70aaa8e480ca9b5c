// Training data: images, and the parameters that they were made with.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "itn/network.h"

namespace itn {

class Examples {
 public:
  virtual ~Examples() = default;
  virtual std::size_t count() const = 0;
  // image: (channels, size, size), truth: one parameter for each output of the network. Always the same for an index
  // and a look: training looks at an example again every epoch, 0, 1, ..., and may see it a little changed. Several
  // threads read at once.
  virtual void read(std::size_t index, std::uint64_t look, std::span<float> image, std::span<double> truth) const = 0;
};

struct Batch {
  std::vector<float> images;  // (batch, channels, size, size)
  std::vector<double> truth;  // (batch, outputs)
};

// Throws InputError where a number is not finite: the network would turn such a pixel into 0, and nobody would notice.
Batch read_batch(const Examples& examples, std::span<const std::size_t> indices, const Network& network,
                 std::uint64_t look = 0);

}  // namespace itn
