#include "network/training/faults.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numbers>
#include <utility>

#include "itn/error.h"
#include "network/model/input.h"
#include "runtime/base/random.h"

namespace itn {

// From one stream, one after the other.
class Draws {
 public:
  Draws(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}

  double between(double low, double high) { return low + (high - low) * uniform(); }
  double normal() {
    const double u = uniform();
    return normal_from(u, uniform());
  }
  double sign() { return between(-1, 1) < 0 ? -1 : 1; }

 private:
  double uniform() { return random_uniform(seed_, stream_, next_++); }

  std::uint64_t seed_, stream_, next_ = 0;
};

namespace {

constexpr double usual_size = 64;  // [pixels], of which lengths are said below

std::size_t pixels_of(const Photographs& p) {
  return static_cast<std::size_t>(p.size) * static_cast<std::size_t>(p.size);
}

// each(plane) -> what takes its place
template <class Each>
void for_each_plane(std::vector<float>& planes, int size, const Each& each) {
  const auto pixels = static_cast<std::ptrdiff_t>(size) * size;
  for (auto first = planes.begin(); first != planes.end(); first += pixels) {
    const std::vector<float> made = each(std::vector<float>(first, first + pixels));
    std::copy(made.begin(), made.end(), first);
  }
}

// Each pixel becomes the one (x, y) pixels to the right and below, interpolated between the four nearest; beyond the
// edge the edge.
std::vector<float> shifted(const std::vector<float>& plane, int size, double x, double y) {
  std::vector<float> result(plane.size());
  const auto at = [&](int column, int row) {
    return static_cast<double>(
        plane[static_cast<std::size_t>(std::clamp(row, 0, size - 1) * size + std::clamp(column, 0, size - 1))]);
  };
  const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
  const double u = x - left, v = y - top;
  for (int row = 0; row < size; ++row)
    for (int column = 0; column < size; ++column) {
      const int c = column + left, r = row + top;
      result[static_cast<std::size_t>(row * size + column)] = static_cast<float>(
          (1 - v) * ((1 - u) * at(c, r) + u * at(c + 1, r)) + v * ((1 - u) * at(c, r + 1) + u * at(c + 1, r + 1)));
    }
  return result;
}

std::vector<float> transposed(const std::vector<float>& plane, int size) {
  std::vector<float> result(plane.size());
  for (int row = 0; row < size; ++row)
    for (int column = 0; column < size; ++column)
      result[static_cast<std::size_t>(column * size + row)] = plane[static_cast<std::size_t>(row * size + column)];
  return result;
}

// By a normal distribution of this standard deviation [pixels].
std::vector<float> blurred(std::vector<float> plane, int size, double deviation) {
  const int reach = static_cast<int>(std::ceil(3 * deviation));
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<float> rows(plane.size());
    for (int row = 0; row < size; ++row)
      for (int column = 0; column < size; ++column) {
        double sum = 0, weights = 0;
        for (int k = -reach; k <= reach; ++k) {
          const double weight = std::exp(-0.5 * k * k / (deviation * deviation));
          const int from = std::clamp(column + k, 0, size - 1);
          sum += weight * static_cast<double>(plane[static_cast<std::size_t>(row * size + from)]);
          weights += weight;
        }
        rows[static_cast<std::size_t>(row * size + column)] = static_cast<float>(sum / weights);
      }
    plane = transposed(rows, size);
  }
  return plane;
}

// The greatest value within so many rows and columns.
std::vector<float> grown(std::vector<float> plane, int size, int reach) {
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<float> rows(plane.size());
    for (int row = 0; row < size; ++row)
      for (int column = 0; column < size; ++column) {
        const auto begin = plane.begin() + static_cast<std::ptrdiff_t>(row) * size;
        rows[static_cast<std::size_t>(row * size + column)] =
            *std::max_element(begin + std::max(0, column - reach), begin + std::min(size, column + reach + 1));
      }
    plane = transposed(rows, size);
  }
  return plane;
}

bool is_empty(const std::vector<float>& mask) { return std::find(mask.begin(), mask.end(), 1.0F) == mask.end(); }

std::vector<float> inverted(std::vector<float> mask) {
  for (float& value : mask) value = 1 - value;
  return mask;
}

// All of the box around it.
std::vector<float> box_of(const std::vector<float>& mask, int size) {
  const WhiteBox box = box_around_white(mask, size, size);
  std::vector<float> filled(mask.size());
  for (int row = box.top; row <= box.bottom; ++row)
    for (int column = box.left; column <= box.right; ++column)
      filled[static_cast<std::size_t>(row * size + column)] = 1;
  return filled;
}

bool is_object(const Photographs& p, std::size_t i) {
  return p.shape.mask.empty() || p.shape.mask[i % pixels_of(p)] == 1;
}

double mean_over_object(const Photographs& p, const std::vector<float>& planes) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (!is_object(p, i)) continue;
    sum += static_cast<double>(planes[i]);
    count += 1;
  }
  return count > 0 ? sum / count : 0;
}

std::vector<float> with_flash(const Photographs& p) {
  std::vector<float> lit = p.image;
  for (std::size_t i = 0; i < p.flash.size(); ++i) lit[i] += p.flash[i];
  return lit;
}

// As who takes both pictures makes them: each by `each`, and then the difference.
template <class Each>
void change_both(Photographs& p, const Each& each) {
  std::vector<float> lit = with_flash(p);
  for (float& value : p.image) value = each(value);
  if (p.flash.empty()) return;
  for (std::size_t i = 0; i < lit.size(); ++i) p.flash[i] = each(lit[i]) - p.image[i];
}

void make_noisy(Photographs& p, Draws& draws, const Others& /*unused*/) {
  const double share = draws.between(0.1, 0.5);
  for (std::vector<float>* planes : {&p.image, &p.flash}) {
    const double deviation = share * mean_over_object(p, *planes);
    for (float& value : *planes) value += static_cast<float>(deviation * draws.normal());
  }
}

void blur(Photographs& p, Draws& draws, const Others& /*unused*/) {
  const double deviation = draws.between(1, 3) * p.size / usual_size;
  for (std::vector<float>* planes : {&p.image, &p.flash})
    for_each_plane(*planes, p.size,
                   [&](std::vector<float> plane) { return blurred(std::move(plane), p.size, deviation); });
}

void bend(Photographs& p, Draws& draws, const Others& /*unused*/) {
  const std::vector<float> lit = with_flash(p);
  const double white = std::max(1e-30, static_cast<double>(*std::max_element(lit.begin(), lit.end())));
  const double exponent = std::exp(draws.sign() * draws.between(0.4, 1));
  change_both(p, [&](float value) {
    return static_cast<float>(white * std::pow(std::max(0.0, static_cast<double>(value)) / white, exponent));
  });
}

void saturate(Photographs& p, Draws& draws, const Others& /*unused*/) {
  const std::vector<float> lit = with_flash(p);
  std::vector<float> of_object;
  for (std::size_t i = 0; i < lit.size(); ++i)
    if (is_object(p, i)) of_object.push_back(lit[i]);
  if (of_object.empty()) return;
  const auto rank = static_cast<std::ptrdiff_t>(draws.between(0.6, 0.95) * static_cast<double>(of_object.size()));
  std::nth_element(of_object.begin(), of_object.begin() + rank, of_object.end());
  const float white = of_object[static_cast<std::size_t>(rank)];
  change_both(p, [&](float value) { return std::min(value, white); });
}

void spoil_mask(Photographs& p, Draws& draws, const Others& /*unused*/) {
  const double kind = draws.between(0, 4), scale = p.size / usual_size;
  const int reach = std::max(1, static_cast<int>(std::lround(draws.between(2, 6) * scale)));
  std::vector<float> mask;
  if (kind < 1) {
    mask = grown(p.shape.mask, p.size, reach);
  } else if (kind < 2) {
    mask = inverted(grown(inverted(p.shape.mask), p.size, reach));
  } else if (kind < 3) {
    const double angle = draws.between(0, 2 * std::numbers::pi), length = draws.between(3, 9) * scale;
    mask = shifted(p.shape.mask, p.size, std::round(length * std::cos(angle)), std::round(length * std::sin(angle)));
  }
  p.shape.mask = mask.empty() || is_empty(mask) ? box_of(p.shape.mask, p.size) : std::move(mask);
}

void move_camera(Photographs& p, Draws& draws, const Others& /*unused*/) {
  const double angle = draws.between(0, 2 * std::numbers::pi), length = draws.between(1.5, 6.5) * p.size / usual_size;
  std::vector<float> lit = with_flash(p);
  for_each_plane(lit, p.size, [&](const std::vector<float>& plane) {
    return shifted(plane, p.size, length * std::cos(angle), length * std::sin(angle));
  });
  for (std::size_t i = 0; i < lit.size(); ++i) p.flash[i] = lit[i] - p.image[i];
}

// The same photo twice, the second brighter.
void leave_out_flash(Photographs& p, Draws& draws, const Others& /*unused*/) {
  const double brighter = draws.between(0.2, 2);
  for (std::size_t i = 0; i < p.flash.size(); ++i)
    p.flash[i] = static_cast<float>(brighter * static_cast<double>(p.image[i]) * (1 + 0.03 * draws.normal()));
}

void take_others_flash(Photographs& p, Draws& /*unused*/, const Others& others) { p.flash = others().flash; }

void change_exposure(Photographs& p, Draws& draws, const Others& /*unused*/) {
  const auto factor = static_cast<float>(std::exp(draws.sign() * draws.between(0.4, 1.2)));
  for (std::vector<float>* planes : {&p.image, &p.flash})
    for (float& value : *planes) value *= factor;
}

// By whole pixels: between them would be other normals at the object's rim.
void displace_shape(Photographs& p, Draws& draws, const Others& /*unused*/) {
  const double angle = draws.between(0, 2 * std::numbers::pi), length = draws.between(2, 6.5) * p.size / usual_size;
  const double x = std::round(length * std::cos(angle)), y = std::round(length * std::sin(angle));
  for (std::vector<float>* planes : {&p.shape.normal, &p.shape.nearness, &p.shape.mask})
    for_each_plane(*planes, p.size, [&](const std::vector<float>& plane) { return shifted(plane, p.size, x, y); });
}

void take_others_shape(Photographs& p, Draws& /*unused*/, const Others& others) { p.shape = others().shape; }

void turn_light(Photographs& p, Draws& draws, const Others& /*unused*/) {
  const double angle = draws.sign() * draws.between(20, 90) * std::numbers::pi / 180;
  const auto [x, y, z] = p.light;
  p.light = {std::cos(angle) * x - std::sin(angle) * y, std::sin(angle) * x + std::cos(angle) * y, z};
}

}  // namespace

// Lengths in pixels of images of 64.
const std::array<Fault, 12> faults{{
    // a standard deviation of a tenth to a half of the object's mean is added
    {"noisy", Fault::Needs::photo, 1, 1, make_noisy},
    // by a normal distribution of 1 to 3 pixels
    {"blurred", Fault::Needs::photo, 1, 1, blur},
    // radiance to the power of e^.4 to e, or one over that
    {"curve", Fault::Needs::photo, 1, 4, bend},
    // 5 to 40 % of the object are cut off in the brighter photo, the other alike
    {"saturated", Fault::Needs::photo, 1, 2, saturate},
    // grown or shrunk by 2 to 6 pixels, moved by 3 to 9, or the box around it
    {"mask", Fault::Needs::mask, 1, 2, spoil_mask},
    // by 1.5 to 6.5 pixels between the photo and the one with the flash
    {"moved", Fault::Needs::flash, 1, 1, move_camera},
    // of another object
    {"others_flash", Fault::Needs::flash, 1, 2, take_others_flash},
    // the second photo is the first, brighter, and a little noise
    {"no_flash", Fault::Needs::flash, 1, 1, leave_out_flash},
    // by a factor of e^.4 to e^1.2, or one over that
    {"exposure", Fault::Needs::exposure, 1, 1, change_exposure},
    // what is known of the shape is moved by 2 to 6.5 pixels
    {"displaced", Fault::Needs::shape, 2, 1, displace_shape},
    // of another object
    {"others_shape", Fault::Needs::shape, 2, 1, take_others_shape},
    // the known direction of the light is rotated about the vertical by 20 to 90 degrees
    {"light", Fault::Needs::light, 8, 1, turn_light},
}};

std::vector<Fault> faults_of(const NetworkDescription& network) {
  const Needs seen(network);
  const auto has = [&](Fault::Needs needs) {
    switch (needs) {
      case Fault::Needs::photo:
        return true;
      case Fault::Needs::exposure:
        return !network.exposure;
      case Fault::Needs::flash:
        return seen.flash;
      case Fault::Needs::mask:
        return seen.mask;
      case Fault::Needs::shape:
        return sees(network, "normal") || sees(network, "nearness");
      case Fault::Needs::light:
        return sees(network, "light");
    }
    return false;
  };
  std::vector<Fault> result;
  std::copy_if(faults.begin(), faults.end(), std::back_inserter(result),
               [&](const Fault& fault) { return has(fault.needs); });
  return result;
}

void spoil(Photographs& photographs, const Fault& fault, const Others& others, std::uint64_t seed,
           std::uint64_t stream) {
  const bool missing = (fault.needs == Fault::Needs::flash && photographs.flash.empty()) ||
                       (fault.needs == Fault::Needs::mask && photographs.shape.mask.empty()) ||
                       (fault.needs == Fault::Needs::shape && photographs.shape.normal.empty()) ||
                       (fault.needs == Fault::Needs::light && photographs.light == std::array<double, 3>{});
  if (missing) throw UsageError(std::string("fault '") + fault.name + "': needs what is not there of the photographs");
  Draws draws(seed, stream);
  fault.happens(photographs, draws, others);
}

}  // namespace itn
