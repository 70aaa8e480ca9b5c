#include "runtime/render/wavefront/film.h"

#include <cmath>
#include <limits>

namespace itn {
namespace {

constexpr std::size_t floats_a_value = 6;  // two sums of three terms (kernels/film.cl)

// A sum of floats as two doubles, without rounding.
struct ExactSum {
  explicit ExactSum(const float* terms) {
    const double rest = static_cast<double>(terms[1]) + static_cast<double>(terms[2]);
    high = static_cast<double>(terms[0]) + rest;
    low = rest - (high - static_cast<double>(terms[0]));
  }

  double high, low;
};

// Sum of squared distances of n numbers from a mean that may be rounded. The sum of their squares and n times the
// mean's square may have all digits of a double in common.
double squared_distances(const ExactSum& sum, const ExactSum& squares, double mean, double n) {
  const double rest = std::fma(-n, mean, sum.high) + sum.low;  // n times what the mean lacks
  const double from_mean = std::fma(-mean, sum.high, squares.high) + (squares.low - mean * (sum.low + rest));
  return from_mean - rest * rest / n;
}

}  // namespace

Film::Film(const Device& device, int pixels, int images, int channels, bool luminance)
    : device_(device), pixels_(pixels), images_(images), channels_(channels), luminance_(luminance && channels == 3) {
  program_ = device.build("film.cl", {{"WIDTH", std::to_string(device.default_width())}});
  constexpr std::size_t least_pixels = 1 << 10;
  const std::size_t a_pixel = floats_a_value * sizeof(float) * static_cast<std::size_t>(images * this->channels());
  const std::size_t wanted = static_cast<std::size_t>(pixels);
  const Device::Elements sums = device.allocate_most(wanted, std::min(wanted, least_pixels), a_pixel, "film");
  pixels_ = static_cast<int>(sums.count);
  sums_ = sums.buffer;
}

void Film::add(const cl::Buffer& samples, int sample_size, std::size_t first_sample, int first_pixel, int pixels,
               int samples_a_pixel, bool fresh) {
  cl::Kernel kernel(program_, "accumulate");
  kernel.setArg(0, samples);
  kernel.setArg(1, static_cast<cl_uint>(first_sample));
  kernel.setArg(2, static_cast<cl_int>(samples_a_pixel));
  kernel.setArg(3, static_cast<cl_int>(sample_size));
  kernel.setArg(4, static_cast<cl_int>(images_));
  kernel.setArg(5, static_cast<cl_int>(channels_));
  kernel.setArg(6, static_cast<cl_int>(luminance_));
  kernel.setArg(7, static_cast<cl_int>(first_pixel));
  kernel.setArg(8, static_cast<cl_int>(pixels));
  kernel.setArg(9, static_cast<cl_int>(fresh));
  kernel.setArg(10, sums_);
  const std::size_t values = static_cast<std::size_t>(pixels) * static_cast<std::size_t>(images_ * this->channels());
  const auto width = static_cast<std::size_t>(device_.default_width());
  device_.launch_at_least(kernel, (values + width - 1) / width);
  device_.finish();
}

void Film::develop(int spp, int pixels, std::vector<Image>& images) {
  const std::size_t values = static_cast<std::size_t>(images_ * channels()),
                    n = static_cast<std::size_t>(pixels) * values;
  std::vector<float> sums(n * floats_a_value);
  device_.download(sums_, sums);
  images.resize(static_cast<std::size_t>(images_));
  for (std::size_t i = 0; i < n; ++i) {
    const ExactSum sum(&sums[floats_a_value * i]), squares(&sums[floats_a_value * i + floats_a_value / 2]);
    const double count = spp, mean = (sum.high + sum.low) / count;
    double variance = std::numeric_limits<double>::infinity();
    if (const double distances = squared_distances(sum, squares, mean, count); spp > 1 && !std::isnan(distances))
      variance = std::max(0.0, distances) / (count - 1) / count;
    Image& image = images[i % values / static_cast<std::size_t>(channels())];
    image.mean.push_back(static_cast<float>(mean));
    image.stderr_.push_back(static_cast<float>(std::sqrt(variance)));
  }
}

}  // namespace itn
