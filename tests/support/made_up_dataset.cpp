#include "tests/support/made_up_dataset.h"

#include <cmath>
#include <filesystem>
#include <utility>

#include "network/dataset/stored_image.h"
#include "runtime/base/random.h"

namespace {

using namespace itn;

constexpr int size = made_up_size;

ExrImage shape_buffers(bool ball) {
  ExrImage buffers{size, size, {"normal.X", "normal.Y", "normal.Z", "depth", "mask"}, {}, {}};
  for (int i = 0; i < size * size; ++i) {
    const double x = (i % size + 0.5) / size * 2 - 1, y = (i / size + 0.5) / size * 2 - 1;
    const double square = ball ? x * x + y * y : 0.5;
    const bool hit = square < 1;
    const double z = hit ? std::sqrt(1 - square) : 1;
    for (const double value :
         {hit ? (ball ? x : std::sqrt(0.5)) : 0, hit && ball ? y : 0, z, 30 - (hit ? z : 0), hit ? 1.0 : 0.0})
      buffers.data.push_back(static_cast<float>(value));
  }
  return buffers;
}

ExrImage pixels_of(const Manifest::Image& image) {
  ExrImage pixels{size, size, {"Y", "stderr.Y"}, {}, {}};
  for (int i = 0; i < size * size; ++i) {
    const double contrast = std::log(image.sigma_t / 25) / std::log(12.0), sign = (i % size + i / size) % 2 ? -1 : 1;
    const double slope = image.g * (2.0 * (i % size) / size - 1);
    const double noise = 0.02 * random_normal(image.seed, 0, static_cast<std::uint64_t>(i));
    pixels.data.push_back(static_cast<float>(3 * std::exp(2 * image.albedo + sign * contrast + slope + noise)));
    pixels.data.push_back(0.01F);
  }
  return pixels;
}

}  // namespace

MadeUpDataset::MadeUpDataset(std::string to, int training, int validation) : folder(std::move(to)) {
  manifest.version = "0";
  manifest.hash = "00000000000000aa";
  manifest.complete = true;
  manifest.size = size;
  manifest.spp = 16;
  manifest.shapes = {{"ball", Manifest::Role::train, "shapes/ball.exr", Manifest::NamedMesh{"ball"}},
                     {"slope", Manifest::Role::test, "shapes/slope.exr", Manifest::NamedMesh{"slope"}}};
  manifest.lights = {{0, 0, {0, 0, 1}, {}}, {0, 60, {std::sqrt(0.75), 0, 0.5}, {}}};
  std::filesystem::create_directories(folder + "/images");
  std::filesystem::create_directories(folder + "/shapes");
  write_stored(folder, manifest, manifest.shapes[0], shape_buffers(true));
  write_stored(folder, manifest, manifest.shapes[1], shape_buffers(false));
  for (int i = 0; i < training + validation; ++i) {
    const auto index = static_cast<std::uint64_t>(i);
    Manifest::Image image;
    image.file = "images/" + std::to_string(i) + ".exr";
    image.split = i < training ? Manifest::Split::train : Manifest::Split::validation;
    image.light = i % 2;
    image.sigma_t = 25 * std::pow(12, random_uniform(1, 0, index));
    image.albedo = 0.3 + 0.65 * random_uniform(1, 1, index);
    image.g = 0.9 * random_uniform(1, 2, index);
    image.seed = index;
    write_stored(folder, manifest, image, pixels_of(image));
    manifest.images.push_back(image);
  }
  write_manifest();
}
