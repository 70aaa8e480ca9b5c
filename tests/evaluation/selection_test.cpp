// The images that stand for all: of every shape, light and split their share, and each with the same probability.
#include "network/evaluation/selection.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <map>

using namespace itn;

namespace {

// 3 shapes x 2 lights x 12 materials.
std::vector<Manifest::Image> many() {
  std::vector<Manifest::Image> images;
  for (int material = 0; material < 12; ++material)
    for (int shape = 0; shape < 3; ++shape)
      for (int light = 0; light < 2; ++light) {
        Manifest::Image image;
        image.file = std::to_string(images.size());
        image.split = light == 0 ? Manifest::Split::unseen_shape : Manifest::Split::unseen_both;
        image.shape = shape;
        image.light = light;
        images.push_back(image);
      }
  return images;
}

}  // namespace

TEST_CASE("a choice has every combination of shape and light in proportion, and depends on the seed alone") {
  const std::vector<Manifest::Image> images = many();
  std::map<std::pair<int, int>, int> cells;
  const std::vector<Manifest::Image> chosen = choose(images, 24, 3);
  REQUIRE(chosen.size() == 24);
  for (const Manifest::Image& image : chosen) ++cells[{image.shape, image.light}];
  CHECK(cells.size() == 6);
  for (const auto& [cell, count] : cells) CHECK(count == 4);
  const auto files = [](const std::vector<Manifest::Image>& some) {
    std::string text;
    for (const Manifest::Image& image : some) text += image.file + " ";
    return text;
  };
  CHECK(files(chosen) == files(choose(images, 24, 3)));
  CHECK(files(chosen) != files(choose(images, 24, 4)));
  CHECK(files(choose(images, 100, 3)) == files(images));
}

TEST_CASE("every image is chosen with equal probability") {
  const std::vector<Manifest::Image> images = many();
  std::map<std::string, int> times;
  constexpr int seeds = 2000;
  for (std::uint64_t seed = 0; seed < seeds; ++seed)
    for (const Manifest::Image& image : choose(images, 7, seed)) ++times[image.file];
  const double expected = seeds * 7.0 / 72, deviation = std::sqrt(expected * (1 - 7.0 / 72));
  CHECK(times.size() == 72);
  for (const auto& [file, count] : times) {
    CAPTURE(file, count, expected);
    CHECK(std::abs(count - expected) < 4.5 * deviation);
  }
}

TEST_CASE("of each shape as many") {
  std::map<int, int> shapes;
  for (const Manifest::Image& image : choose_of_each_shape(many(), 5, 1)) ++shapes[image.shape];
  CHECK(shapes == std::map<int, int>{{0, 5}, {1, 5}, {2, 5}});
}
