// The network's input from an image, its shape and its light.
#include "network/model/input.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "itn/error.h"
#include "itn/exr.h"
#include "network/training/dataset_examples.h"
#include "runtime/image/png.h"
#include "tests/support/made_up_dataset.h"
#include "tests/support/temporary_folder.h"

namespace {

using namespace itn;
using Catch::Contains;

constexpr std::size_t pixels = made_up_size * made_up_size;
const std::atomic<bool> go_on{false};

NetworkDescription network_of(int channels, double luminance = 1) {
  NetworkDescription description;
  description.channels = channels;
  description.size = made_up_size;
  description.luminance = luminance;
  return description;
}

// The message of reading a file after its image was changed.
std::string message(const std::string& file, const std::function<void(ExrImage&)>& change,
                    const std::function<void()>& read) {
  const ExrImage original = read_exr(file);
  ExrImage image = original;
  change(image);
  write_exr(file, image);
  std::string text = "accepted";
  try {
    read();
  } catch (const InputError& error) {
    CHECK_THAT(error.what(), Catch::StartsWith(file + ": "));
    text = error.what();
  }
  write_exr(file, original);
  return text;
}

}  // namespace

TEST_CASE("Luminance reaches the network as a logarithm that is 0 at the set's mean and ends in the dark") {
  const NetworkDescription network = network_of(1, 5);
  std::vector<float> luminance(pixels, 5), input(pixels);
  luminance[1] = 10;
  luminance[2] = 0;
  luminance[3] = -1;
  network_input(network, {luminance}, input);
  CHECK(input[0] == 0);
  CHECK(input[1] == Approx(std::log(2.01 / 1.01)));
  CHECK(input[2] == Approx(std::log(0.01 / 1.01)));
  CHECK(input[3] == input[2]);
}

TEST_CASE("Known shape and light: normals as they are, nearness about the object's mean, the cosine to the sun") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder.path(), 1, 1);
  const SeenShape shape = read_seen_shape(set.path("shapes/ball.exr"), made_up_size, set.manifest.hash);
  const std::array<double, 3> light{0.6, 0, 0.8};
  const std::vector<float> luminance(pixels, 1);
  std::vector<float> input(6 * pixels);
  network_input(network_of(6), {luminance, {}, &shape, &light}, input);
  double nearness = 0;
  int on_ball = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const double x = (static_cast<double>(i % made_up_size) + 0.5) / 4 - 1;
    const double y = (static_cast<double>(i / made_up_size) + 0.5) / 4 - 1, z = std::sqrt(1 - x * x - y * y);
    CAPTURE(i, x, y);
    if (x * x + y * y < 1) {
      CHECK(input[pixels + i] == Approx(x));
      CHECK(input[2 * pixels + i] == Approx(y));
      CHECK(input[3 * pixels + i] == Approx(z));
      CHECK(input[5 * pixels + i] == Approx(0.6 * x + 0.8 * z).margin(1e-6));
      // Depth is 30 - z: nearness differs from z by the same everywhere.
      CHECK(input[4 * pixels + i] - z == Approx(input[4 * pixels + 27] - shape.normal[2 * pixels + 27]).margin(1e-5));
      nearness += input[4 * pixels + i];
      ++on_ball;
    } else {  // a floor whose normal is (0, 0, 1)
      CHECK(input[pixels + i] == 0);
      CHECK(input[4 * pixels + i] == 0);
      CHECK(input[5 * pixels + i] == Approx(0.8));
    }
  }
  CHECK(on_ball > 40);
  CHECK(nearness / on_ball == Approx(0).margin(1e-5));
}

TEST_CASE("A mirror image is what the mirrored scene would show: shape, normals, light") {
  // A roof whose left side is bright: two slopes, the sun on the left.
  const float s = std::sqrt(0.5F);
  std::vector<float> normal(3 * pixels), depth(pixels), mask(pixels, 1), luminance(pixels);
  const auto roof = [&](bool turned) {
    for (std::size_t i = 0; i < pixels; ++i) {
      const std::size_t x = i % made_up_size, from_eaves = turned ? made_up_size - 1 - x : x;
      const bool bright = from_eaves < 3;  // the ridge is off the middle
      normal[i] = bright != turned ? -s : s;
      normal[2 * pixels + i] = s;
      depth[i] = static_cast<float>(from_eaves);
      luminance[i] = bright ? 2.0F : 0.5F;
    }
    return seen_shape(normal, depth, mask, made_up_size, "roof");
  };
  const auto input_of = [&](bool turned) {
    const SeenShape shape = roof(turned);
    const std::array<double, 3> light{turned ? 0.6 : -0.6, 0, 0.8};
    std::vector<float> input(6 * pixels);
    network_input(network_of(6), {luminance, {}, &shape, &light}, input);
    return input;
  };
  std::vector<float> mirrored = input_of(false);
  const std::vector<float> expected = input_of(true);
  CHECK(mirrored != expected);
  mirror_input(network_of(6), mirrored);
  for (std::size_t i = 0; i < expected.size(); ++i) CHECK(mirrored[i] == Approx(expected[i]).margin(1e-6));
  CHECK(mirrored[5 * pixels] != Approx(mirrored[5 * pixels + made_up_size - 1]));  // or nothing would have been checked
}

TEST_CASE("Colours become luminance as the renderer weighs them") {
  const TemporaryFolder folder;
  ExrImage image{2, 2, {"R", "G", "B"}, {}, {}};
  for (int i = 0; i < 4; ++i) image.data.insert(image.data.end(), {1, 2, 4});
  write_exr(folder / "a.exr", image);
  for (const float value : read_luminance(folder / "a.exr", 2))
    CHECK(value == Approx(0.212671 + 2 * 0.715160 + 4 * 0.072169));
}

TEST_CASE("Images of more pixels are averaged, of fewer interpolated") {
  const TemporaryFolder folder;
  const auto row = [&](const std::vector<float>& values, int size) {
    const int from = static_cast<int>(values.size());
    ExrImage image{from, from, {"Y"}, {}, {}};
    for (int y = 0; y < from; ++y) image.data.insert(image.data.end(), values.begin(), values.end());
    write_exr(folder / "a.exr", image);
    const std::vector<float> all = read_resampled_luminance(folder / "a.exr", size).value;
    REQUIRE(all.size() == static_cast<std::size_t>(size * size));
    std::vector<float> first(all.begin(), all.begin() + size);
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x)
        CHECK(all[static_cast<std::size_t>(y * size + x)] == Approx(first[static_cast<std::size_t>(x)]));
    return first;
  };
  CHECK(row({1, 5, 2, 9}, 4) == std::vector<float>{1, 5, 2, 9});
  CHECK(row({1, 5, 2, 8}, 2) == std::vector<float>{3, 5});
  CHECK(row({1, 5}, 4) == std::vector<float>{1, 2, 4, 5});
  const std::vector<float> three_of_four = row({3, 6, 9, 0}, 3);
  for (std::size_t i = 0; i < 3; ++i)
    CHECK(three_of_four[i] == Approx(std::array{(3 + 6 / 3.0) / (4 / 3.0), 7.5, (9 / 3.0 + 0) / (4 / 3.0)}[i]));
  // Rows are not columns.
  write_exr(folder / "a.exr", {2, 2, {"Y"}, {1, 2, 3, 4}, {}});
  CHECK(read_resampled_luminance(folder / "a.exr", 2).value == std::vector<float>{1, 2, 3, 4});
  write_exr(folder / "a.exr", {4, 1, {"Y"}, {1, 2, 3, 4}, {}});
  CHECK_THROWS_WITH(read_resampled_luminance(folder / "a.exr", 2), Contains("4 x 1 pixels, need a square image"));
  write_exr(folder / "a.exr", {2, 2, {"Y"}, {1, 2, NAN, 4}, {}});
  CHECK_THROWS_WITH(read_resampled_luminance(folder / "a.exr", 4), Contains("pixel 0, 1: is nan"));
}

TEST_CASE("Errors of an image of more pixels are averaged as independent, of fewer nobody knows them") {
  const TemporaryFolder folder;
  const auto errors = [&](int size) {
    const std::vector<float> result = read_resampled_luminance(folder / "photo.exr", size).errors;
    REQUIRE(result.size() == static_cast<std::size_t>(size * size));
    for (const float error : result) CHECK(error == result[0]);
    return result[0];
  };
  ExrImage image{8, 8, {"Y", "stderr.Y"}, {}, {}};
  for (int i = 0; i < 64; ++i) image.data.insert(image.data.end(), {i % 2 == 0 ? 1.0F : 3.0F, 0.5F});
  write_exr(folder / "photo.exr", image);
  CHECK(errors(8) == 0.5F);
  CHECK(errors(4) == 0.25F);  // of four pixels
  CHECK(errors(16) == 0);
  image.channels = {"Y", "other"};
  write_exr(folder / "photo.exr", image);
  CHECK(errors(8) == 0);
}

TEST_CASE("Shape buffers of other sizes: what is seen at the middle of a pixel") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder.path(), 1, 1);
  const std::string file = set.path("shapes/ball.exr"), hash = set.manifest.hash;
  const SeenShape shape = read_seen_shape(file, made_up_size, hash);
  const auto same = [](const SeenShape& a, const SeenShape& b) {
    return a.normal == b.normal && a.nearness == b.nearness && a.mask == b.mask;
  };
  CHECK(same(read_resampled_seen_shape(file, made_up_size, hash), shape));
  constexpr std::size_t fine = 2 * made_up_size;
  const SeenShape finer = read_resampled_seen_shape(file, fine, hash);
  REQUIRE(finer.normal.size() == 3 * fine * fine);
  for (std::size_t y = 0; y < fine; ++y)
    for (std::size_t x = 0; x < fine; ++x) {
      const std::size_t to = y * fine + x, from = y / 2 * made_up_size + x / 2;
      CHECK(finer.mask[to] == shape.mask[from]);
      CHECK(finer.nearness[to] == shape.nearness[from]);
      CHECK(finer.normal[2 * fine * fine + to] == shape.normal[2 * pixels + from]);
    }
}

TEST_CASE("Images that are not what the network needs are input errors that name file and reason") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder.path(), 1, 1);
  const std::string file = set.path("images/0.exr"), hash = set.manifest.hash;
  const auto says = [&](const std::function<void(ExrImage&)>& change) {
    return message(file, change, [&] { read_luminance(file, made_up_size, hash); });
  };
  CHECK(says([](ExrImage&) {}) == "accepted");
  CHECK_THAT(says([](ExrImage& i) { i.data[2 * 11] = NAN; }), Contains("pixel 3, 1: is nan"));
  CHECK_THAT(says([](ExrImage& i) { i.data[2 * 11] = INFINITY; }), Contains("pixel 3, 1: is inf"));
  CHECK(says([](ExrImage& i) { i.data[1] = NAN; }) == "accepted");  // a standard error is not looked at
  CHECK_THAT(says([](ExrImage& i) { i.channels[0] = "Z"; }),
             Contains("no channel Y, nor R, G and B; only Z, stderr.Y") || Contains("only stderr.Y, Z"));
  CHECK_THAT(says([](ExrImage& i) { i.channels[0] = "R"; }), Contains("has no channel G"));
  CHECK_THAT(says([](ExrImage& i) { i.width = 4, i.height = 16; }), Contains("has 4 x 16 pixels, need 8 x 8"));
  CHECK_THAT(says([](ExrImage& i) { i.header["hash"] = "b"; }), Contains("another data set (hash b, need 0"));
  CHECK_THAT(says([](ExrImage& i) { i.header.clear(); }), Contains("hash none"));
}

TEST_CASE("Shape buffers that are not what the network needs are input errors that name file and reason") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder.path(), 1, 1);
  const std::string file = set.path("shapes/ball.exr");
  const auto says = [&](const std::function<void(ExrImage&, std::size_t centre)>& change) {
    return message(
        file, [&](ExrImage& image) { change(image, 5 * 27); },
        [&] { read_seen_shape(file, made_up_size, set.manifest.hash); });
  };
  const auto channel = [](const ExrImage& image, const char* name) {
    return static_cast<std::size_t>(image.channel(name));
  };
  CHECK(says([](ExrImage&, std::size_t) {}) == "accepted");
  CHECK(says([&](ExrImage& i, std::size_t) { i.data[channel(i, "depth")] = INFINITY; }) == "accepted");  // off the ball
  CHECK_THAT(says([&](ExrImage& i, std::size_t at) { i.data[at + channel(i, "depth")] = NAN; }),
             Contains("pixel 3, 3: depth is nan"));
  CHECK_THAT(says([&](ExrImage& i, std::size_t at) { i.data[at + channel(i, "mask")] = 0.5F; }),
             Contains("pixel 3, 3: mask is 0.5, need 0 or 1"));
  CHECK_THAT(says([&](ExrImage& i, std::size_t at) { i.data[at + channel(i, "normal.Z")] = 0; }),
             Contains("pixel 3, 3: the normal has the length"));
  CHECK_THAT(says([&](ExrImage& i, std::size_t) { i.data[channel(i, "normal.X")] = NAN; }),
             Contains("pixel 0, 0: the normal has the length nan"));
  CHECK_THAT(says([&](ExrImage& i, std::size_t) {
               for (std::size_t p = 0; p < pixels; ++p) i.data[5 * p + channel(i, "mask")] = 0;
             }),
             Contains("no object can be seen"));
  CHECK_THAT(says([&](ExrImage& i, std::size_t) { i.channels[channel(i, "normal.Y")] = "N"; }),
             Contains("has no channel normal.Y"));
  CHECK_THAT(says([](ExrImage& i, std::size_t) { i.header["hash"] = "b"; }), Contains("another data set"));
}

TEST_CASE("Sizes that do not fit and shapes that are not known are usage errors") {
  std::vector<float> luminance(pixels), input(pixels), all(6 * pixels);
  CHECK_THROWS_AS(network_input(network_of(1), {std::span(luminance).first(9)}, input), UsageError);
  CHECK_THROWS_AS(network_input(network_of(6), {luminance}, input), UsageError);
  CHECK_THROWS_WITH(network_input(network_of(6), {luminance}, all), Contains("shape"));
}

TEST_CASE("Examples of a data set: its split, in the network's channels, with the truth by the outputs' names") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder.path(), 3, 2);
  const DatasetImages images =
      read_images(set.folder, set.manifest, Manifest::Split::validation, {.shapes = true}, go_on);
  NetworkDescription network = network_of(6, mean_luminance(images));
  network.outputs = {{"g", 0, 1, false}, {"sigma_t", 20, 300, true}};
  const DatasetExamples examples(images, network);
  REQUIRE(examples.count() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const Manifest::Image& source = set.manifest.images[3 + i];
    std::vector<float> image(6 * pixels), expected(6 * pixels);
    std::vector<double> truth(2);
    examples.read(i, 0, image, truth);
    CHECK(truth == std::vector<double>{source.g, source.sigma_t});
    const SeenShape shape = read_seen_shape(set.path("shapes/ball.exr"), made_up_size);
    const std::vector<float> luminance = read_luminance(set.path(source.file), made_up_size);
    const std::array<double, 3>& light = set.manifest.lights[static_cast<std::size_t>(source.light)].direction;
    network_input(network, {luminance, {}, &shape, &light}, expected);
    CHECK(image == expected);
  }
  double sum = 0;
  for (const int i : {3, 4})
    for (const float value :
         read_luminance(set.path(set.manifest.images[static_cast<std::size_t>(i)].file), made_up_size))
      sum += value;
  CHECK(mean_luminance(images) == Approx(sum / 2 / pixels));
}

TEST_CASE("A network's ranges are the default ones, wider where the data set goes beyond them") {
  DatasetImages images;
  images.images.resize(2);
  images.images[0].sigma_t = 500;
  images.images[0].albedo = 0.6;
  images.images[0].g = 0.5;
  images.images[1].sigma_t = 50;
  images.images[1].albedo = 0.2;
  images.images[1].g = -0.5;
  const std::vector<OutputRange> ranges = output_ranges(images), defaults = default_outputs();
  CHECK(ranges[0].low == defaults[0].low);
  CHECK(ranges[0].high == 500);
  CHECK(ranges[1].low == 0.2);
  CHECK(ranges[1].high == defaults[1].high);
  CHECK(ranges[2].low == -0.5);
  CHECK(ranges[2].high == defaults[2].high);
}

TEST_CASE("Mirror images follow the images; noise is another at every look, and of the images' standard errors") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder.path(), 30, 1);
  DatasetImages images = read_images(set.folder, set.manifest, Manifest::Split::train, {.shapes = true}, go_on);
  for (auto& errors : images.errors) errors.assign(pixels, 0.01F);
  for (auto& luminance : images.radiance) luminance.assign(pixels, 1);
  const auto look = [&](const DatasetExamples& examples, std::size_t index, std::uint64_t number) {
    std::vector<float> image(6 * pixels);
    std::vector<double> truth(3);
    examples.read(index, number, image, truth);
    return image;
  };
  const NetworkDescription network = network_of(6);
  const DatasetExamples plain(images, network), mirrored(images, network, {.mirrored = true});
  CHECK(mirrored.count() == 2 * plain.count());
  std::vector<float> image = look(plain, 3, 0);
  CHECK(look(mirrored, 3, 0) == image);
  mirror_input(network, image);
  CHECK(look(mirrored, plain.count() + 3, 0) == image);
  CHECK(look(plain, 3, 0) == look(plain, 3, 1));

  const DatasetExamples noisy(images, network, {.noise = 2, .seed = 5});
  CHECK(look(noisy, 3, 0) == look(noisy, 3, 0));
  CHECK(look(noisy, 3, 0) != look(noisy, 3, 1));
  const std::vector<float> clean = look(plain, 3, 0), changed = look(noisy, 3, 7);
  CHECK(std::equal(clean.begin() + pixels, clean.end(), changed.begin() + pixels));
  // The input is a logarithm, of slope 1 / (1 + 0.01 m) at luminance 1; the strength is uniform below 2: of mean square
  // 4 / 3.
  double square = 0, count = 0;
  for (std::uint64_t number = 0; number < 100; ++number)
    for (std::size_t i = 0; i < pixels; ++i) {
      square += std::pow((look(noisy, 3, number)[i] - clean[i]) * (1 + 0.01 * network.luminance) / 0.01, 2);
      ++count;
    }
  CHECK(square / count == Approx(4.0 / 3).epsilon(0.3));  // of 100 strengths: 9 % (one standard error)
}

TEST_CASE("A split without images, black images and outputs that images do not have are refused") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder.path(), 1, 1);
  CHECK_THROWS_WITH(read_images(set.folder, set.manifest, Manifest::Split::unseen_both, {}, go_on),
                    Contains("manifest.json: has no images of the split unseen_both"));
  DatasetImages images = read_images(set.folder, set.manifest, Manifest::Split::train, {}, go_on);
  CHECK_THROWS_WITH(DatasetExamples(images, network_of(6)), Contains("shapes"));
  NetworkDescription network = network_of(1);
  network.outputs = {{"sigma_s", 1, 2, false}};
  CHECK_THROWS_WITH(DatasetExamples(images, network), Contains("no parameter 'sigma_s'"));
  images.radiance[0].assign(pixels, 0);
  CHECK_THROWS_WITH(mean_luminance(images), Contains("black"));
  const std::atomic<bool> stop{true};
  CHECK_THROWS_AS(read_images(set.folder, set.manifest, Manifest::Split::train, {}, stop), Interrupted);
}

TEST_CASE("Examples of several data sets are those of each, with its own shapes and lights") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 5, 3);
  const auto read = [&](Manifest::Split split) {
    return read_images(set.folder, set.manifest, split, {.shapes = true}, go_on);
  };
  const DatasetImages first = read(Manifest::Split::train);
  DatasetImages second = read(Manifest::Split::validation);
  std::swap(second.shapes[0], second.shapes[1]);
  std::swap(second.lights[0], second.lights[1]);
  DatasetImages both;
  append(both, first);
  append(both, second);
  const NetworkDescription network = network_of(6);
  const DatasetExamples joined(both, network), one(first, network), other(second, network);
  REQUIRE(joined.count() == 8);
  for (std::size_t i = 0; i < 8; ++i) {
    std::vector<float> image(6 * pixels), expected(6 * pixels);
    std::vector<double> truth(3), expected_truth(3);
    joined.read(i, 0, image, truth);
    if (i < 5)
      one.read(i, 0, expected, expected_truth);
    else
      other.read(i - 5, 0, expected, expected_truth);
    CHECK(image == expected);
    CHECK(truth == expected_truth);
  }
}

TEST_CASE("a photo says which share of it, or of the object, is saturated, and how noisy it is") {
  const TemporaryFolder folder;
  const std::string file = folder / "a.png";
  std::vector<std::uint8_t> grey(8 * 8 * 3, 128);
  std::fill_n(grey.begin(), 8 * 2 * 3, 255);  // two rows of eight
  write_png(file, 8, 8, grey);
  const ResampledImage noisy = read_resampled_luminance(file, 4), alone = read_resampled_radiance(file, 4, 1);
  CHECK(noisy.value == alone.value);
  CHECK(noisy.saturated == 0.25);
  CHECK(alone.saturated == 0.25);
  CHECK(alone.errors.empty());
  // A step of 1/255 at the least, of four pixels each.
  REQUIRE(noisy.errors.size() == 16);
  for (const float error : noisy.errors) CHECK((error > 1 / (255 * std::sqrt(12.0F) * 4) && error < 0.02F));
  std::vector<float> object(64);
  for (const std::size_t pixel : {8, 9, 16, 17}) object[pixel] = 1;  // half of it in the second row
  const CutOut seen = cut_out(object, 8, 8, 4, 0.5, "object");
  CHECK(read_resampled_radiance(file, 4, 1, {}, "", &seen).saturated == 0.5);
  write_exr(folder / "a.exr", {2, 2, {"Y"}, {1, 2, 3, 4}, {}});
  CHECK(read_resampled_luminance(folder / "a.exr", 2).saturated == 0);
}

TEST_CASE("a photo that is black or below 0 is refused, noise around black is not") {
  const TemporaryFolder folder;
  const auto read = [&](const std::vector<float>& values) {
    write_exr(folder / "a.exr", {2, 2, {"Y"}, values, {}});
    return read_resampled_luminance(folder / "a.exr", 2).value;
  };
  CHECK(read({1, 2, 3, -0.01F}).size() == 4);
  CHECK_THROWS_WITH(read({1, 2, 3, -4}), Contains("a.exr: its values below 0"));
  CHECK_THROWS_WITH(read({-1, -2, -3, -4}), Contains("below 0"));
  CHECK_THROWS_WITH(read({0, 0, 0, 0}), Contains("is black"));
}

TEST_CASE("buffers of an object that no pixel of the network sees are refused") {
  const TemporaryFolder folder;
  constexpr int size = 32;
  ExrImage buffers{size, size, {"normal.X", "normal.Y", "normal.Z", "depth", "mask"}, {}, {}};
  for (int i = 0; i < size * size; ++i) {
    const float seen = i == 0 ? 1 : 0;
    buffers.data.insert(buffers.data.end(), {0, 0, seen, 30, seen});
  }
  write_exr(folder / "a.exr", buffers);
  CHECK(read_resampled_seen_shape(folder / "a.exr", size).mask[0] == 1);
  CHECK_THROWS_WITH(read_resampled_seen_shape(folder / "a.exr", 8), Contains("smaller than a pixel of the 8 x 8"));
}
