#include "runtime/wavefront/film.h"

#include <cmath>
#include <limits>

namespace itn {

Film::Film(const Device& device, int pixels, int images, int channels, bool luminance)
    : device_(device), pixels_(pixels), images_(images), channels_(channels), luminance_(luminance && channels == 3) {
  program_ = device.build("film.cl", {{"WIDTH", std::to_string(device.default_width())}});
  constexpr std::size_t least_pixels = 1 << 10;
  const std::size_t a_pixel = 4 * sizeof(float) * static_cast<std::size_t>(images * this->channels());
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
  std::vector<float> sums(n * 4);
  device_.download(sums_, sums);
  images.resize(static_cast<std::size_t>(images_));
  for (std::size_t i = 0; i < n; ++i) {
    const double sum = static_cast<double>(sums[4 * i]) + sums[4 * i + 1];
    const double squares = static_cast<double>(sums[4 * i + 2]) + sums[4 * i + 3];
    const double mean = sum / spp;
    const double variance =
        spp > 1 ? std::max(0.0, (squares - sum * mean) / (spp - 1.0)) / spp : std::numeric_limits<double>::infinity();
    Image& image = images[i % values / static_cast<std::size_t>(channels())];
    image.mean.push_back(static_cast<float>(mean));
    image.stderr_.push_back(static_cast<float>(std::sqrt(variance)));
  }
}

}  // namespace itn
