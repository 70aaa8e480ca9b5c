// Losses of re-rendered images: their gradient is that of the image, their mean does not depend on the samples.
#include "network/dataset/rendered_loss.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "itn/error.h"
#include "itn/exr.h"
#include "network/dataset/dataset_mesh.h"
#include "tests/support/egg_set.h"

using namespace itn;

namespace {

const Device& device() {
  static const Device the_device;
  return the_device;
}

// One image of an egg.
struct Egg : EggSet {
  std::vector<float> target;

  Egg() {
    set.images.resize(1);
    RenderedLoss renderer(device(), set, folder / "", Operator::full, nullptr);
    target = renderer.render({{&set.images[0], {8, 0.9, 0.5}, 1, nullptr}}, 256).front().mean;
  }
  std::vector<RerenderedImage> batch(std::size_t count, const DatasetMaterial& material, std::uint64_t seed) const {
    std::vector<RerenderedImage> images;
    for (std::size_t i = 0; i < count; ++i) images.push_back({&set.images[0], material, seed + i, &target});
    return images;
  }
};

struct Mean {
  double value = 0, error = 0;
};

template <class Value>
Mean mean_of(const std::vector<LossGradient>& losses, Value&& value) {
  const auto n = static_cast<double>(losses.size());
  Mean m;
  for (const LossGradient& l : losses) m.value += value(l) / n;
  for (const LossGradient& l : losses) m.error += (value(l) - m.value) * (value(l) - m.value);
  m.error = std::sqrt(m.error / (n * (n - 1)));
  return m;
}

}  // namespace

TEST_CASE("the gradient of a re-rendered image's loss is its central difference, in 1/mm") {
  const Egg egg;
  RenderedLoss loss(device(), egg.set, egg.folder / "", Operator::full, nullptr);
  const DatasetMaterial at{5, 0.8, 0.3};
  const std::vector<LossGradient> losses = loss.evaluate(egg.batch(64, at, 1000), 16);
  const std::array<double, 3> step{0.5, 0.02, 0.05};
  for (std::size_t p = 0; p < 3; ++p) {
    DatasetMaterial more = at, less = at;
    (p == 0 ? more.sigma_t : p == 1 ? more.albedo : more.g) += step[p];
    (p == 0 ? less.sigma_t : p == 1 ? less.albedo : less.g) -= step[p];
    // common random numbers
    const std::vector<LossGradient> above = loss.evaluate(egg.batch(64, more, 1000), 16),
                                    below = loss.evaluate(egg.batch(64, less, 1000), 16);
    std::vector<LossGradient> difference = losses;
    for (std::size_t i = 0; i < losses.size(); ++i)
      difference[i].loss = (above[i].loss - below[i].loss) / (2 * step[p]) - losses[i].gradient[p];
    const Mean m = mean_of(difference, [](const LossGradient& l) { return l.loss; });
    const Mean g = mean_of(losses, [&](const LossGradient& l) { return l.gradient[p]; });
    CAPTURE(p, m.value, m.error, g.value, g.error);
    // 3.9 standard errors: 1e-4 each; the second-order error of the difference is below a hundredth.
    CHECK(std::abs(m.value) < 3.9 * m.error + 0.02 * std::abs(g.value));
    CHECK(std::abs(g.value) > 5 * g.error);  // or nothing would have been checked
  }
}

TEST_CASE("few samples and many give a loss and a gradient of the same mean") {
  const Egg egg;
  RenderedLoss loss(device(), egg.set, egg.folder / "", Operator::full, nullptr);
  const DatasetMaterial at{5, 0.8, 0.3};
  const std::vector<LossGradient> few = loss.evaluate(egg.batch(256, at, 0), 2),
                                  many = loss.evaluate(egg.batch(16, at, 5000), 32);
  for (std::size_t p = 0; p < 4; ++p) {
    const auto value = [&](const LossGradient& l) { return p == 3 ? l.loss : l.gradient[p]; };
    const Mean a = mean_of(few, value), b = mean_of(many, value);
    CAPTURE(p, a.value, a.error, b.value, b.error);
    CHECK(std::abs(a.value - b.value) < 3.9 * std::hypot(a.error, b.error));
  }
}

TEST_CASE("the losses over an image's two parts make up that of the whole") {
  const Egg egg;
  RenderedLoss loss(device(), egg.set, egg.folder / "", Operator::full, nullptr);
  const DatasetMaterial at{5, 0.8, 0.3};
  // A disk of pixels, and all the others: the windows overlap, the pixels do not.
  std::vector<float> inside, outside;
  for (int i = 0; i < 256; ++i) {
    inside.push_back(std::hypot(i % 16 - 7.5, i / 16 - 7.5) < 5 ? 1.0F : 0.0F);
    outside.push_back(1 - inside.back());
  }
  const auto evaluate = [&](const ObjectWindow* window, std::uint64_t seed) {
    std::vector<RerenderedImage> batch = egg.batch(256, at, seed);
    for (RerenderedImage& image : batch) image.window = window;
    return loss.evaluate(batch, 8);
  };
  const ObjectWindow a = object_window(inside, 16), b = object_window(outside, 16);
  REQUIRE((a.width == 10 && b.width == 16));
  const std::vector<LossGradient> whole = evaluate(nullptr, 0), in = evaluate(&a, 1000), out = evaluate(&b, 2000);
  const double share = std::accumulate(inside.begin(), inside.end(), 0.0) / 256;
  for (std::size_t p = 0; p < 4; ++p) {
    const auto value = [&](const LossGradient& l) { return p == 3 ? l.loss : l.gradient[p]; };
    const Mean all = mean_of(whole, value), i = mean_of(in, value), o = mean_of(out, value);
    const double error = std::hypot(all.error, share * i.error, (1 - share) * o.error);
    CAPTURE(p, all.value, i.value, o.value, error);
    CHECK(std::abs(share * i.value + (1 - share) * o.value - all.value) < 3.9 * error);
    CHECK(std::abs(all.value) > 5 * all.error);  // or nothing would have been checked
  }
}

TEST_CASE("a batch's losses are those of each alone; samples that make no equal groups are refused") {
  const Egg egg;
  RenderedLoss loss(device(), egg.set, egg.folder / "", Operator::single, nullptr);
  const std::vector<RerenderedImage> batch = egg.batch(3, {5, 0.8, 0.3}, 7);
  const std::vector<LossGradient> together = loss.evaluate(batch, 4);
  for (std::size_t i = 0; i < 3; ++i) {
    const LossGradient alone = loss.evaluate({batch[i]}, 4).front();
    CHECK(alone.loss == together[i].loss);
    CHECK(alone.gradient == together[i].gradient);
  }
  CHECK_THROWS_AS(loss.evaluate(batch, 1), UsageError);
  CHECK_THROWS_AS(loss.evaluate(batch, 17), UsageError);
}

TEST_CASE("an image in an environment is rendered again with the light that its set says") {
  EggSet egg;
  Bitmap picture{16, 9, 1, std::vector<float>(16 * 9, 0.2F)};
  picture.data[16 * 2 + 5] = 30;
  write_exr(egg.folder / "room.exr", {16, 9, {"Y"}, picture.data, {}});
  egg.set.lights.push_back({60, 0, {0, 0, 1}, Manifest::Environment{"room.exr", 1.5}});
  Manifest::Image image;
  image.light = 2;
  const DatasetMaterial material{8, 0.9, 0.5};
  RenderedLoss loss(device(), egg.set, egg.folder / "", Operator::full, nullptr);
  RenderOptions options;
  options.spp = 16;
  options.seed = 5;
  const Scene scene = dataset_scene(egg.set, dataset_mesh(egg.set.shapes[0], egg.folder / ""),
                                    environment_light(std::make_shared<const Bitmap>(picture), 60, 1.5), material);
  CHECK(loss.render({{&image, material, 5, nullptr}}, 16).front().mean == render(device(), scene, options).mean);
}
