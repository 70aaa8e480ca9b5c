#include "runtime/inverse/image_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/base/parallel.h"
#include "runtime/base/random.h"

namespace itn {
namespace {

constexpr std::array<int, 3> radii{1, 3, 8};
constexpr std::size_t throws = 399;  // of signs
constexpr double rare = 0.0025;      // such structure is not by chance: of 400 right scenes one is called wrong
constexpr double tolerance = 0.15;   // of chi-square: noise is known no better
constexpr double tolerance_of_many = 0.5;
constexpr double sure = 3;            // standard errors
constexpr double heaviest_tails = 3;  // standard error of chi-square, over that of normal noise

// Sums of products of a residual's pixels that are not farther apart than each radius, channel with channel.
std::array<double, radii.size()> products(const WhiteResidual& residual, const std::vector<double>& value) {
  std::array<double, radii.size()> result{};
  const int width = residual.width, height = residual.height;
  const auto channels = static_cast<std::size_t>(residual.channels), stride = static_cast<std::size_t>(width) + 1;
  std::vector<double> table(stride * (static_cast<std::size_t>(height) + 1), 0);  // sums of all above and to the left
  for (std::size_t c = 0; c < channels; ++c) {
    const auto at = [&](int x, int y) {
      return value[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
                       channels +
                   c];
    };
    const auto corner = [&](int x, int y) -> double& {
      return table[static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x)];
    };
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        corner(x + 1, y + 1) = at(x, y) + corner(x, y + 1) + corner(x + 1, y) - corner(x, y);
    for (std::size_t r = 0; r < radii.size(); ++r)
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
          const int left = std::max(0, x - radii[r]), right = std::min(width, x + radii[r] + 1);
          const int top = std::max(0, y - radii[r]), bottom = std::min(height, y + radii[r] + 1);
          const double around =
              corner(right, bottom) - corner(left, bottom) - corner(right, top) + corner(left, top) - at(x, y);
          result[r] += at(x, y) * around;
        }
  }
  return result;
}

std::array<double, radii.size()> products(const std::vector<WhiteResidual>& residuals) {
  std::array<double, radii.size()> sum{};
  for (const WhiteResidual& residual : residuals) {
    const auto of_image = products(residual, residual.value);
    for (std::size_t r = 0; r < radii.size(); ++r) sum[r] += of_image[r];
  }
  return sum;
}

// Each pixel with another sign, or not.
std::vector<WhiteResidual> with_signs(std::vector<WhiteResidual> residuals, std::uint64_t seed, std::uint64_t stream) {
  std::uint64_t bits = 0, drawn = 0;
  for (WhiteResidual& residual : residuals) {
    const auto channels = static_cast<std::size_t>(residual.channels);
    for (std::size_t pixel = 0; pixel < residual.value.size() / channels; ++pixel) {
      if (drawn % 64 == 0) bits = random_bits(seed, stream, drawn / 64);
      if ((bits >> (drawn++ % 64)) & 1)
        for (std::size_t c = 0; c < channels; ++c) residual.value[pixel * channels + c] *= -1;
    }
  }
  return residuals;
}

}  // namespace

bool ImageFit::looks_alike() const { return chance > rare; }

int ImageFit::size() const {
  if (!noise_known) return 0;
  const double range = tolerance + sure * chi_square_stderr;
  return chi_square > 1 + range ? 1 : chi_square < 1 - range ? -1 : 0;
}

bool ImageFit::fits() const {
  if (many_unknowns) return chi_square <= 1 + tolerance_of_many + sure * chi_square_stderr;
  return looks_alike() && size() == 0;
}

ImageFit image_fit(const std::vector<WhiteResidual>& residuals, bool noise_known, std::uint64_t seed) {
  ImageFit fit;
  fit.noise_known = noise_known;
  double sum = 0, pixels = 0, square = 0;
  for (const WhiteResidual& residual : residuals) {
    const auto channels = static_cast<std::size_t>(residual.channels);
    for (std::size_t i = 0; i < residual.value.size(); i += channels) {
      double of_pixel = 0;
      for (std::size_t c = 0; c < channels; ++c) {
        of_pixel += residual.value[i + c] * residual.value[i + c];
        fit.values += residual.value[i + c] != 0;
      }
      pixels += of_pixel > 0;
      sum += of_pixel;
      square += of_pixel * of_pixel;
    }
  }
  if (pixels < 2) return fit;
  fit.chi_square = sum / fit.values;
  // From the pixels themselves, but of few pixels one that is far off would excuse itself.
  fit.chi_square_stderr = std::min(std::sqrt(std::max(0.0, square - sum * sum / pixels)) / fit.values,
                                   heaviest_tails * std::sqrt(2 / pixels));

  std::vector<std::array<double, radii.size()>> thrown(throws);
  parallel_for(throws, [&](std::size_t k) { thrown[k] = products(with_signs(residuals, seed, k)); });
  std::array<double, radii.size()> deviation{};
  for (const auto& t : thrown)
    for (std::size_t r = 0; r < radii.size(); ++r) deviation[r] += t[r] * t[r] / throws;
  for (double& d : deviation) d = std::sqrt(d);
  const auto largest = [&](const std::array<double, radii.size()>& of) {
    double most = -1e300;
    for (std::size_t r = 0; r < radii.size(); ++r) most = std::max(most, deviation[r] > 0 ? of[r] / deviation[r] : 0.0);
    return most;
  };
  fit.structure = largest(products(residuals));
  double as_much = 0;
  for (const auto& t : thrown) as_much += largest(t) >= fit.structure;
  fit.chance = (1 + as_much) / (1 + throws);
  return fit;
}

std::string words(const ImageFit& fit) {
  const std::string size = fit.noise_known
                               ? fmt::format("{:.3g} times the variance that the noise explains", fit.chi_square)
                               : std::string("of unknown noise");
  if (fit.many_unknowns && fit.fits())
    return fmt::format(
        "The images found fit: what is left of the targets has {:.3g} times the variance of their noise.",
        fit.chi_square);
  if (!fit.looks_alike())
    return fmt::format(
        "NOT a fit: what is left of the targets is no noise, neighbouring pixels are alike in it "
        "({:.0f} standard deviations more than noise is; {}). Shape, light, boundary, camera or another assumption is "
        "not that of the targets, or the parameters are wrong: their intervals do not hold.",
        fit.structure, size);
  if (fit.size() > 0) return fmt::format("NOT a fit: what is left of the targets looks like noise, but has {}.", size);
  if (fit.size() < 0)
    return fmt::format("NOT a fit: what is left of the targets is less than the noise that was said of them, {}.",
                       size);
  return fit.noise_known ? fmt::format("The image found fits: what is left of the targets is their noise ({}).", size)
                         : "The image found fits: what is left of the targets looks like noise.";
}

nlohmann::ordered_json to_json(const ImageFit& fit) {
  nlohmann::ordered_json json{{"fits", fit.fits()}};
  json["chi_square"] =
      fit.noise_known || fit.many_unknowns ? nlohmann::ordered_json(fit.chi_square) : nlohmann::ordered_json();
  json["chi_square_stderr"] =
      fit.noise_known || fit.many_unknowns ? nlohmann::ordered_json(fit.chi_square_stderr) : nlohmann::ordered_json();
  json["structure"] = fit.structure;
  json["chance"] = fit.chance;
  json["values"] = fit.values;
  return json;
}

}  // namespace itn
