#include "python/src/arrays.h"

#include <memory>
#include <utility>

namespace itn::python {
namespace {

template <class Value>
nb::object owned(std::vector<Value>&& values, const std::vector<std::size_t>& shape) {
  auto kept = std::make_unique<std::vector<Value>>(std::move(values));
  Value* data = kept->data();
  const nb::capsule owner(kept.release(), [](void* p) noexcept { delete static_cast<std::vector<Value>*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, Value>(data, shape.size(), shape.data(), owner));
}

}  // namespace

nb::object numpy_array(std::vector<float>&& values, const std::vector<std::size_t>& shape) {
  return owned(std::move(values), shape);
}
nb::object numpy_array(std::vector<double>&& values, const std::vector<std::size_t>& shape) {
  return owned(std::move(values), shape);
}
nb::object numpy_array(std::vector<std::uint32_t>&& values, const std::vector<std::size_t>& shape) {
  return owned(std::move(values), shape);
}
nb::object numpy_array(std::vector<std::uint8_t>&& values, const std::vector<std::size_t>& shape) {
  return owned(std::move(values), shape);
}

std::vector<float> as_vector(const FloatArray& array) { return {array.data(), array.data() + array.size()}; }

}  // namespace itn::python
