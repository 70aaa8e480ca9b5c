// The image loss to second order: its value by hand, its gradient by differences.
#include "runtime/training/expanded_image_loss.h"

#include <catch2/catch.hpp>
#include <cmath>

using namespace itn;

namespace {

// Two images of 2 x 2 pixels, of which the object covers two.
DatasetImages images() {
  DatasetImages images;
  images.images.resize(2);
  images.images[0].sigma_t = 50;
  images.images[0].albedo = 0.8;
  images.images[0].g = 0.4;
  images.images[1].sigma_t = 100;
  images.images[1].albedo = 0.5;
  images.images[1].g = 0.1;
  images.radiance = {{1, 3, 9, 9}, {2, 2, 9, 9}};
  images.errors = {{0.1F, 0.1F, 0.1F, 0.1F}, {0, 0, 0, 0}};
  images.shapes = {{{}, {}, {1, 1, 0, 0}}};
  images.shape_of = {0, 0};
  images.curvature = {{4, 1, -0.5, 9, 2, 3}, {1, 0, 0, 1, 0, 1}};
  return images;
}

}  // namespace

TEST_CASE("the expanded loss is the error's square in units of the image, of its object's mean square") {
  const DatasetImages set = images();
  const auto loss = make_expanded_image_loss(set, set);
  const std::vector<std::size_t> examples{0, 1};
  const std::vector<double> parameters{50 * std::exp(0.2), 0.7, 0.5, 100, 0.5, 0.4};
  // u = (.2, -.1, .1), object's mean square 5; u = (0, 0, .3), mean square 4.
  const double first = (4 * 0.04 + 9 * 0.01 + 3 * 0.01 + 2 * (1 * -0.02 - 0.5 * 0.02 - 2 * 0.01)) / 5,
               second = 0.09 / 4;
  CHECK(loss->evaluate(examples, parameters, 0).loss == Approx((first + second) / 2));
  CHECK(loss->validate(examples, parameters) == Approx((first + second) / 2));
  // Of a mirror image it is that of the original.
  CHECK(loss->validate(std::vector<std::size_t>{2, 3}, parameters) == loss->validate(examples, parameters));
}

TEST_CASE("the expanded loss's gradient is its central difference") {
  const DatasetImages set = images();
  const auto loss = make_expanded_image_loss(set, set);
  const std::vector<std::size_t> examples{1, 0};
  const std::vector<double> at{80, 0.6, 0.3, 70, 0.9, 0.2};
  const std::vector<double> gradient = loss->evaluate(examples, at, 0).gradient;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double step = 1e-5 * at[i];
    std::vector<double> more = at, less = at;
    more[i] += step;
    less[i] -= step;
    const double difference = (loss->validate(examples, more) - loss->validate(examples, less)) / (2 * step);
    CHECK(gradient[i] == Approx(difference).epsilon(1e-6));
  }
}

TEST_CASE("noise along what an image does not show makes no loss below 0") {
  DatasetImages set = images();
  set.curvature[0] = {1, 0, 0, -0.01, 0, 2};  // as the unbiased estimate may be
  const auto loss = make_expanded_image_loss(set, set);
  const std::vector<std::size_t> examples{0};
  CHECK(loss->validate(examples, std::vector<double>{50, 0.3, 0.4}) == Approx(0).margin(1e-12));
  CHECK(loss->validate(examples, std::vector<double>{50, 0.8, 0.5}) == Approx(2 * 0.01 / 5));
}
