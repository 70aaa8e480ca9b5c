// Random numbers that are a function of (seed, stream, index) and nothing else: there is no state to save, and a number
// does not depend on how many were drawn before it.
#pragma once
#include <cmath>
#include <cstdint>
#include <numbers>

namespace itn {

// The finalizer of SplitMix64 (Steele, Lea, Flood 2014, doi:10.1145/2714064.2660195): 64 well mixed bits.
inline std::uint64_t mixed_bits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

inline std::uint64_t random_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  return mixed_bits(mixed_bits(mixed_bits(seed) ^ stream) ^ index);
}

// Uniform on (0, 1): never 0 and never 1.
inline double random_uniform(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  return (static_cast<double>(random_bits(seed, stream, index) >> 12) + 0.5) * 0x1p-52;
}

// Normal with mean 0 and variance 1, from two numbers that are uniform on (0, 1) (Box and Muller 1958).
inline double normal_from(double u, double v) {
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

inline double random_normal(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  return normal_from(random_uniform(seed, stream, 2 * index), random_uniform(seed, stream, 2 * index + 1));
}

}  // namespace itn
