// Arrays between Python and the libraries: results move into numpy arrays, without a copy.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <vector>

namespace itn::python {

namespace nb = nanobind;

// Arrays that Python gives: C order, on the CPU.
using FloatArray = nb::ndarray<const float, nb::c_contig, nb::device::cpu>;

nb::object numpy_array(std::vector<float>&& values, const std::vector<std::size_t>& shape);
nb::object numpy_array(std::vector<double>&& values, const std::vector<std::size_t>& shape);
nb::object numpy_array(std::vector<std::uint32_t>&& values, const std::vector<std::size_t>& shape);
nb::object numpy_array(std::vector<std::uint8_t>&& values, const std::vector<std::size_t>& shape);

std::vector<float> as_vector(const FloatArray& array);

}  // namespace itn::python
