#include "network/examples.h"

#include <cmath>

#include "runtime/base/error.h"

namespace itn {
namespace {

template <class Number>
bool all_finite(const std::vector<Number>& numbers) {
  bool finite = true;
  for (const Number number : numbers) finite &= std::isfinite(number);
  return finite;
}

}  // namespace

Batch read_batch(const Examples& examples, std::span<const std::size_t> indices, const Network& network,
                 std::uint64_t look) {
  const std::size_t values = network.image_values(), outputs = network.description().outputs.size();
  Batch batch{std::vector<float>(indices.size() * values), std::vector<double>(indices.size() * outputs)};
  for (std::size_t i = 0; i < indices.size(); ++i)
    examples.read(indices[i], look, std::span(batch.images).subspan(i * values, values),
                  std::span(batch.truth).subspan(i * outputs, outputs));
  if (!all_finite(batch.images) || !all_finite(batch.truth))
    throw InputError("among the examples are numbers that are not finite; render them again");
  return batch;
}

}  // namespace itn
