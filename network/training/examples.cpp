#include "network/training/examples.h"

#include <cmath>

#include "itn/error.h"
#include "network/model/threads.h"
#include "runtime/base/parallel.h"

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
  const auto read = [&](std::size_t i) {
    examples.read(indices[i], look, std::span(batch.images).subspan(i * values, values),
                  std::span(batch.truth).subspan(i * outputs, outputs));
  };
  parallel_for(indices.size(), read, static_cast<std::size_t>(threads()));
  if (!all_finite(batch.images) || !all_finite(batch.truth))
    throw InputError("among the examples are numbers that are not finite; render them again");
  return batch;
}

}  // namespace itn
