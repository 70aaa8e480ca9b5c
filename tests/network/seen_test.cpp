// Networks that see more than luminance: what their input is made of, and files that say so.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/network_file.h"
#include "network/model/input.h"
#include "tests/support/temporary_folder.h"

using namespace itn;
using Catch::Contains;

namespace {

constexpr int size = 4;
constexpr std::size_t pixels = size * size;

NetworkDescription seeing(const std::vector<std::string>& inputs) {
  NetworkDescription description;
  description.size = size;
  description.luminance = 0.5;
  description.inputs = inputs;
  description.channels = channels_of(inputs);
  return description;
}

std::vector<float> numbered(std::size_t count, float first) {
  std::vector<float> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = first + static_cast<float>(i);
  return values;
}

float of_radiance(float value) { return std::log((value + 0.005F) / 0.505F); }

}  // namespace

TEST_CASE("the input has what the network sees, in the order of its names") {
  const NetworkDescription network = seeing({"rgb", "mask", "flash_rgb", "normal", "light"});
  CHECK(network.channels == 3 + 1 + 3 + 3 + 1);
  const std::vector<float> image = numbered(3 * pixels, 1), flash = numbered(3 * pixels, 100);
  SeenShape shape{std::vector<float>(3 * pixels, 0), numbered(pixels, 0), std::vector<float>(pixels, 1)};
  for (std::size_t i = 0; i < pixels; ++i) shape.normal[2 * pixels + i] = 1;
  shape.mask[3] = 0;
  const std::array<double, 3> light{0.6, 0, 0.8};
  std::vector<float> input(11 * pixels);
  network_input(network, {image, flash, &shape, &light}, input);
  for (std::size_t i = 0; i < 3 * pixels; ++i) {
    CHECK(input[i] == Approx(of_radiance(image[i])));
    CHECK(input[4 * pixels + i] == Approx(of_radiance(flash[i])));
    CHECK(input[7 * pixels + i] == shape.normal[i]);
  }
  for (std::size_t i = 0; i < pixels; ++i) {
    CHECK(input[3 * pixels + i] == (i == 3 ? 0 : 1));
    CHECK(input[10 * pixels + i] == Approx(0.8));
  }

  std::vector<float> mirrored = input;
  mirror_input(network, mirrored);
  for (std::size_t c = 0; c < 11; ++c)
    for (std::size_t i = 0; i < pixels; ++i) {
      const float sign = c == 7 ? -1.0F : 1.0F;  // the normals' x
      CHECK(mirrored[c * pixels + i] == sign * input[c * pixels + i / size * size + (size - 1 - i % size)]);
    }
}

TEST_CASE("what is missing is named, and so are inputs that cannot be") {
  const std::vector<float> image = numbered(3 * pixels, 1);
  std::vector<float> input(7 * pixels);
  const auto refusal = [&](const std::vector<std::string>& inputs, const Seen& seen) {
    const NetworkDescription network = seeing(inputs);
    return [=, &input] {
      network_input(network, seen, std::span(input).first(static_cast<std::size_t>(network.channels) * pixels));
    };
  };
  CHECK_THROWS_WITH(refusal({"rgb", "flash_rgb"}, {image})(), Contains("'flash_rgb'"));
  CHECK_THROWS_WITH(refusal({"rgb", "mask"}, {image})(), Contains("'mask'"));
  const SeenShape only_mask{{}, {}, std::vector<float>(pixels, 1)};
  CHECK_THROWS_WITH(refusal({"rgb", "normal"}, {image, {}, &only_mask})(), Contains("'normal'"));
  CHECK_THROWS_WITH(refusal({"rgb"}, {std::span(image).first(pixels)})(), Contains("image of 16 numbers"));
  CHECK_THROWS_WITH(channels_of({"luminance", "smell"}), Contains("'smell'"));
  CHECK_THROWS_WITH(channels_of({"luminance", "mask", "mask"}), Contains("twice"));
  CHECK_THROWS_WITH(channels_of({"mask"}), Contains("must see an image"));
  CHECK_THROWS_WITH(channels_of({"luminance", "rgb"}), Contains("either"));
  NetworkDescription wrong = seeing({"rgb", "mask"});
  wrong.channels = 6;
  CHECK_THROWS_AS(Network(wrong), UsageError);
  NetworkDescription alone = seeing({"rgb"});
  alone.cut_out = 0.5;
  CHECK_THROWS_WITH(Network(alone), Contains("must see a mask"));
  alone = seeing({"rgb", "mask", "normal"});
  alone.cut_out = 0.5;
  CHECK_THROWS_WITH(Network(alone), Contains("cannot see 'normal'"));
  alone = seeing({"rgb", "mask"});
  alone.cut_out = 1.5;
  CHECK_THROWS_WITH(Network(alone), Contains("0.01 to 1"));
}

TEST_CASE("a network that does not know exposures sees the same of an image by any") {
  NetworkDescription network = seeing({"rgb", "flash_rgb"});
  network.exposure = true;
  std::vector<float> image = numbered(3 * pixels, 1), flash = numbered(3 * pixels, 5), once(6 * pixels),
                     again(6 * pixels);
  network_input(network, {image, flash}, once);
  for (float& value : image) value *= 7;
  for (float& value : flash) value *= 0.2F;
  network_input(network, {image, flash}, again);
  for (std::size_t i = 0; i < once.size(); ++i) CHECK(again[i] == Approx(once[i]).margin(1e-5));
  const float mean = 24.5F;
  CHECK(once[0] == Approx(std::log((1 + 0.01F * mean) / (1.01F * mean))));
}

TEST_CASE("a network that sees the object alone sees the same whatever is around it") {
  NetworkDescription network = seeing({"rgb", "flash_rgb", "mask"});
  network.exposure = true;
  network.cut_out = 0.5;
  std::vector<float> image = numbered(3 * pixels, 1), flash = numbered(3 * pixels, 5), once(7 * pixels),
                     again(7 * pixels);
  SeenShape object{{}, {}, std::vector<float>(pixels, 0)};
  object.mask[5] = object.mask[6] = 1;
  network_input(network, {image, flash, &object}, once);
  for (std::vector<float>* radiance : {&image, &flash})
    for (std::size_t i = 0; i < radiance->size(); ++i)
      if (object.mask[i % pixels] == 0) (*radiance)[i] *= 30;
  network_input(network, {image, flash, &object}, again);
  CHECK(once == again);
  const float mean = (6 + 7 + 22 + 23 + 38 + 39) / 6.0F;
  CHECK(once[5] == Approx(std::log((6 + 0.01F * mean) / (1.01F * mean))));
  CHECK(once[0] == Approx(std::log(0.01F / 1.01F)));
  CHECK_THROWS_WITH(network_input(network, {image, flash}, once), Contains("'mask'"));
}

TEST_CASE("the square around an object goes with it, and is black beyond the picture") {
  const TemporaryFolder folder;
  // Three by two pixels of object, 1 to 6, in pictures that differ in size, place and all the rest.
  const auto write = [&](int width, int height, int left, int top, float around) {
    ExrImage picture{width, height, {"Y", "mask"}, {}, {}};
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const bool inside = x >= left && x < left + 3 && y >= top && y < top + 2;
        const auto number = static_cast<float>(1 + x - left + 3 * (y - top));
        picture.data.insert(picture.data.end(), {inside ? number : around, inside ? 1.0F : 0.0F});
      }
    write_exr(folder / "a.exr", picture);
    return cut_out(folder / "a.exr", 6, 0.5);
  };
  const auto radiance = [&](const CutOut& seen) {
    return read_resampled_radiance(folder / "a.exr", 6, 1, {}, "", &seen).value;
  };
  const CutOut inside = write(12, 9, 5, 4, 0.25F);
  const std::vector<float> all = radiance(inside);
  CHECK(inside.side == 6);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::size_t x = i % 6, y = i / 6;
    const bool object = x >= 2 && x < 5 && y >= 2 && y < 4;
    CHECK(inside.mask.mask[i] == (object ? 1 : 0));
    CHECK(all[i] == (object ? static_cast<float>(x - 1 + 3 * (y - 2)) : 0));
  }
  const CutOut corner = write(4, 20, 0, 0, 70);
  CHECK(corner.mask.mask == inside.mask.mask);
  CHECK(radiance(corner) == all);

  CHECK(share_of_object(corner.mask.mask) == 0.5);
  write_exr(folder / "a.exr", {5, 5, {"Y"}, std::vector<float>(25, 1), {}});
  CHECK_THROWS_WITH(radiance(corner), Contains("has 5 x 5 pixels, its mask 4 x 20"));
  write_exr(folder / "a.exr", {5, 5, {"Y"}, std::vector<float>(25, 0), {}});
  CHECK_THROWS_WITH(cut_out(folder / "a.exr", 6, 0.5), Contains("nothing in it is white"));
}

TEST_CASE("a network's file says what it sees; those of luminance alone say it by their channels, as ever") {
  const TemporaryFolder folder;
  for (const std::vector<std::string>& inputs :
       {std::vector<std::string>{"rgb", "flash_rgb", "mask"}, {"luminance", "mask"}}) {
    NetworkDescription description = seeing(inputs);
    description.exposure = inputs.size() == 2;
    description.cut_out = inputs.size() == 2 ? 0 : 0.4;
    Network network(description);
    network.initialise(1);
    write_network(folder / "a.safetensors", network, Precision::single);
    const Network read = read_network(folder / "a.safetensors");
    CHECK(read.description() == network.description());
    CHECK_FALSE(is_plain(read.description()));
  }
  NetworkDescription plain;
  plain.channels = 6;
  CHECK(network_metadata(plain).count("inputs") == 0);
  CHECK(inputs_of(plain) == std::vector<std::string>{"luminance", "normal", "nearness", "light"});
  CHECK(sees(plain, "light"));
  CHECK_FALSE(sees(plain, "mask"));
}

TEST_CASE("colours are read as planes, of a file's own channels or the flash's, and averaged down") {
  const TemporaryFolder folder;
  const std::string file = folder / "a.exr";
  ExrImage image{2 * size, 2 * size, {"B", "G", "R", "flash.B", "flash.G", "flash.R", "mask"}, {}, {}};
  for (int i = 0; i < 4 * size * size; ++i) {
    const bool left = i % (2 * size) < size;
    image.data.insert(image.data.end(), {3, 2, 1, 6, 5, 4, left ? 1.0F : 0.0F});
  }
  write_exr(file, image);
  const std::vector<float> own = read_resampled_radiance(file, size, 3).value,
                           flash = read_resampled_radiance(file, size, 3, {}, "flash.").value;
  for (std::size_t i = 0; i < 3 * pixels; ++i) {
    CHECK(own[i] == Approx(1.0 + static_cast<double>(i / pixels)));
    CHECK(flash[i] == Approx(4.0 + static_cast<double>(i / pixels)));
  }
  const SeenShape seen = read_mask(file, size);
  for (std::size_t i = 0; i < pixels; ++i) CHECK(seen.mask[i] == (i % size < size / 2 ? 1 : 0));
  CHECK_THROWS_WITH(read_resampled_radiance(file, size, 3, {}, "moon."), Contains("moon.R"));
  for (float& value : image.data) value = std::min(value, 0.4F);
  write_exr(file, image);
  CHECK_THROWS_WITH(read_mask(file, size), Contains("need the object in white"));
}
