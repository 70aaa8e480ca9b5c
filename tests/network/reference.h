// The network's layers once more, in double and as plain as can be: the reference for the fast ones in float. Its own
// gradients are checked against finite differences (reference_test.cpp).
#pragma once
#include <cstddef>
#include <vector>

namespace reference {

using Numbers = std::vector<double>;

struct Shape {
  std::size_t batch, in, out, size;  // square images of so many pixels a side

  std::size_t input() const { return batch * in * size * size; }
  std::size_t output() const { return batch * out * size * size; }
  std::size_t weights() const { return out * in * 9; }
  std::size_t pooled_size() const { return size > 1 ? size / 2 : 1; }
  std::size_t pooled() const { return batch * out * pooled_size() * pooled_size(); }
};

// Calls visit(input index, weight index, output index) for every product of a 3x3 convolution with zero padding.
template <class Visit>
void for_each_product(const Shape& s, Visit visit) {
  for (std::size_t n = 0; n < s.batch; ++n)
    for (std::size_t o = 0; o < s.out; ++o)
      for (std::size_t i = 0; i < s.in; ++i)
        for (std::size_t y = 0; y < s.size; ++y)
          for (std::size_t x = 0; x < s.size; ++x)
            for (std::size_t ky = 0; ky < 3; ++ky)
              for (std::size_t kx = 0; kx < 3; ++kx) {
                const std::size_t from_y = y + ky - 1, from_x = x + kx - 1;  // -1 wraps to a large number
                if (from_y >= s.size || from_x >= s.size) continue;
                visit(((n * s.in + i) * s.size + from_y) * s.size + from_x, ((o * s.in + i) * 3 + ky) * 3 + kx,
                      ((n * s.out + o) * s.size + y) * s.size + x);
              }
}

inline Numbers convolve(const Shape& s, const Numbers& input, const Numbers& weights, const Numbers& bias) {
  Numbers output(s.output());
  for (std::size_t i = 0; i < output.size(); ++i) output[i] = bias[i / (s.size * s.size) % s.out];
  for_each_product(s, [&](std::size_t i, std::size_t w, std::size_t o) { output[o] += input[i] * weights[w]; });
  return output;
}

struct Gradients {
  Numbers input, weights, bias;
};

inline Gradients convolve_backward(const Shape& s, const Numbers& input, const Numbers& weights,
                                   const Numbers& output_gradient) {
  Gradients gradients{Numbers(s.input()), Numbers(s.weights()), Numbers(s.out)};
  for (std::size_t i = 0; i < output_gradient.size(); ++i)
    gradients.bias[i / (s.size * s.size) % s.out] += output_gradient[i];
  for_each_product(s, [&](std::size_t i, std::size_t w, std::size_t o) {
    gradients.input[i] += output_gradient[o] * weights[w];
    gradients.weights[w] += output_gradient[o] * input[i];
  });
  return gradients;
}

inline Numbers relu(Numbers map) {
  for (double& x : map) x = x > 0 ? x : 0;
  return map;
}

inline Numbers relu_backward(const Numbers& output, Numbers output_gradient) {
  for (std::size_t i = 0; i < output.size(); ++i)
    if (!(output[i] > 0)) output_gradient[i] = 0;
  return output_gradient;
}

// The pixel of the map that each pooled pixel is; itself if the image has one pixel. The first of equal ones.
inline std::vector<std::size_t> greatest_of_four(const Shape& s, const Numbers& map) {
  std::vector<std::size_t> from;
  for (std::size_t plane = 0; plane < s.batch * s.out; ++plane)
    for (std::size_t y = 0; y < s.pooled_size(); ++y)
      for (std::size_t x = 0; x < s.pooled_size(); ++x) {
        const std::size_t corner = (plane * s.size + 2 * y) * s.size + 2 * x;
        std::size_t greatest = corner;
        if (s.size > 1)
          for (const std::size_t other : {corner + 1, corner + s.size, corner + s.size + 1})
            if (map[other] > map[greatest]) greatest = other;
        from.push_back(greatest);
      }
  return from;
}

inline Numbers pool(const Shape& s, const Numbers& map) {
  Numbers pooled;
  for (const std::size_t from : greatest_of_four(s, map)) pooled.push_back(map[from]);
  return pooled;
}

inline Numbers pool_backward(const Shape& s, const Numbers& map, const Numbers& pooled_gradient) {
  Numbers gradient(map.size());
  const std::vector<std::size_t> from = greatest_of_four(s, map);
  for (std::size_t i = 0; i < from.size(); ++i) gradient[from[i]] += pooled_gradient[i];
  return gradient;
}

// One stage: convolution, ReLU, pooling.
struct Stage {
  Numbers map, output;  // after ReLU; after pooling
};

inline Stage stage(const Shape& s, const Numbers& input, const Numbers& weights, const Numbers& bias) {
  Stage result;
  result.map = relu(convolve(s, input, weights, bias));
  result.output = pool(s, result.map);
  return result;
}

inline Gradients stage_backward(const Shape& s, const Numbers& input, const Numbers& weights, const Stage& forward,
                                const Numbers& output_gradient) {
  const Numbers map_gradient = relu_backward(forward.map, pool_backward(s, forward.map, output_gradient));
  return convolve_backward(s, input, weights, map_gradient);
}

}  // namespace reference
