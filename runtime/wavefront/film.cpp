#include "runtime/wavefront/film.h"

#include <cmath>
#include <limits>

namespace itn {

Film::Film(const Device& device, int pixels, int channels, bool luminance)
    : device_(device), pixels_(pixels), channels_(channels), luminance_(luminance && channels == 3) {
  program_ = device.build("film.cl", {});
  sums_ = device.upload(
      std::vector<float>(static_cast<std::size_t>(pixels) * static_cast<std::size_t>(this->channels()) * 4), "film");
}

void Film::add(const cl::Buffer& samples, std::size_t first_sample, int first_pixel, int pixels, int samples_a_pixel) {
  cl::Kernel kernel(program_, "accumulate");
  kernel.setArg(0, samples);
  kernel.setArg(1, static_cast<cl_uint>(first_sample));
  kernel.setArg(2, static_cast<cl_int>(samples_a_pixel));
  kernel.setArg(3, static_cast<cl_int>(channels_));
  kernel.setArg(4, static_cast<cl_int>(luminance_));
  kernel.setArg(5, static_cast<cl_int>(first_pixel));
  kernel.setArg(6, static_cast<cl_int>(pixels));
  kernel.setArg(7, sums_);
  device_.launch(kernel, static_cast<std::size_t>(pixels));
  device_.finish();
}

void Film::develop(int spp, Rendering& out) const {
  const std::size_t n = static_cast<std::size_t>(pixels_), channels = static_cast<std::size_t>(this->channels());
  std::vector<float> sums(n * channels * 4);
  device_.download(sums_, sums);
  out.channels = this->channels();
  out.spp = spp;
  out.mean.resize(n * channels);
  out.stderr_.resize(n * channels);
  out.mean_of_image.assign(channels, 0);
  out.stderr_of_mean.assign(channels, 0);
  for (std::size_t i = 0; i < n * channels; ++i) {
    const double sum = static_cast<double>(sums[4 * i]) + sums[4 * i + 1];
    const double squares = static_cast<double>(sums[4 * i + 2]) + sums[4 * i + 3];
    const double mean = sum / spp;
    const double variance =
        spp > 1 ? std::max(0.0, (squares - sum * mean) / (spp - 1.0)) / spp : std::numeric_limits<double>::infinity();
    out.mean[i] = static_cast<float>(mean);
    out.stderr_[i] = static_cast<float>(std::sqrt(variance));
    out.mean_of_image[i % channels] += mean / static_cast<double>(n);
    out.stderr_of_mean[i % channels] += variance / (static_cast<double>(n) * static_cast<double>(n));
  }
  for (double& variance : out.stderr_of_mean) variance = std::sqrt(variance);
}

}  // namespace itn
