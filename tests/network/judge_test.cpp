// Judges: what they are shown, how their limit is found, and which networks they can judge for.
#include "network/training/judge.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "itn/error.h"
#include "itn/network_file.h"
#include "network/model/threads.h"
#include "network/training/examples.h"
#include "tests/support/temporary_folder.h"

using namespace itn;
using Catch::Contains;

namespace {

constexpr int size = 16;
constexpr std::size_t pixels = size * size;

NetworkDescription judge_description() {
  NetworkDescription judge;
  judge.kind = judge_kind;
  judge.size = size;
  judge.width = 2;
  judge.inputs = {"rgb", "flash_rgb", "mask"};
  judge.channels = channels_of(judge.inputs);
  judge.exposure = true;
  judge.cut_out = 0.5;
  judge.outputs = outputs_of_judge(judge);
  return judge;
}

// Triangles of other sides in uneven light, each with its flash.
DatasetImages triangles(std::size_t count) {
  DatasetImages all;
  for (std::size_t k = 0; k < count; ++k) {
    SeenShape shape{{}, {}, std::vector<float>(pixels)};
    std::vector<float> light(3 * pixels), flash(3 * pixels);
    for (std::size_t i = 0; i < 3 * pixels; ++i) {
      const std::size_t x = i % size, y = i % pixels / size;
      light[i] = 0.1F + static_cast<float>((7 * x + 3 * y + i / pixels) % 5);
      flash[i] = 0.3F + static_cast<float>((2 * x + 6 * y + k) % 7);
      if (i < pixels && x >= 4 && y >= 3 && x + y < 17 + k) shape.mask[i] = 1;
    }
    all.images.emplace_back();
    all.radiance.push_back(light);
    all.flash.push_back(flash);
    all.errors.emplace_back(3 * pixels, 0.0F);
    all.flash_errors.emplace_back(3 * pixels, 0.0F);
    all.shapes.push_back(shape);
    all.shape_of.push_back(k);
    all.lights.push_back({0, 0, 1});
  }
  return all;
}

}  // namespace

TEST_CASE("a judge is shown the images as they are, and as many with one fault each, another at every look") {
  const DatasetImages images = triangles(6);
  const NetworkDescription judge = judge_description();
  const JudgedExamples examples(images, judge, {.mirrored = true, .seed = 5});
  NetworkDescription plain = judge;
  plain.kind = "rn";
  plain.outputs.clear();
  const DatasetExamples right(images, plain, {.mirrored = true, .seed = 5});
  REQUIRE(examples.count() == 2 * right.count());
  std::vector<float> seen(7 * pixels), as_it_is(7 * pixels);
  std::vector<double> truth(judge.outputs.size());
  std::vector<int> faults_seen(truth.size());
  for (std::uint64_t look = 0; look < 20; ++look)
    for (std::size_t i = 0; i < right.count(); ++i) {
      right.read(i, look, as_it_is, {});
      examples.read(i, look, seen, truth);
      CHECK(seen == as_it_is);
      CHECK(std::count(truth.begin(), truth.end(), 0.0) == static_cast<std::ptrdiff_t>(truth.size()));
      examples.read(right.count() + i, look, seen, truth);
      CHECK(truth[0] == 1);
      CHECK(std::accumulate(truth.begin(), truth.end(), 0.0) == 2);
      const auto fault = std::find(truth.begin() + 1, truth.end(), 1.0) - truth.begin();
      ++faults_seen[static_cast<std::size_t>(fault)];
      INFO(judge.outputs[static_cast<std::size_t>(fault)].name);
      CHECK((seen != as_it_is));
    }
  for (std::size_t f = 1; f < faults_seen.size(); ++f) CHECK(faults_seen[f] > 10);  // 240 looks at 8 faults
  CHECK(JudgedExamples(images, judge, {}, 8).count() == 9 * images.images.size());
}

namespace {

// Two shapes, of three images each.
DatasetImages known_triangles() {
  DatasetImages images = triangles(6);
  images.flash.clear();
  images.flash_errors.clear();
  for (std::size_t k = 0; k < 6; ++k) {
    images.shapes[k].nearness.assign(pixels, static_cast<float>(k / 3));
    images.shapes[k].normal.assign(3 * pixels, 0.0F);
    images.shape_of[k] = k / 3 * 3;
    images.radiance[k].resize(pixels);
    images.errors[k].resize(pixels);
  }
  return images;
}

NetworkDescription knowing_judge() {
  NetworkDescription judge;
  judge.kind = judge_kind;
  judge.size = size;
  judge.width = 2;
  judge.channels = 6;
  judge.outputs = outputs_of_judge(judge);
  return judge;
}

}  // namespace

TEST_CASE(
    "a judge that begins looks at what is hard to see first, and then more often; one that goes on at all alike") {
  const DatasetImages images = known_triangles();
  const NetworkDescription judge = knowing_judge();
  const JudgedExamples examples(images, judge, {.seed = 5}, 1, 20);
  std::vector<float> seen(6 * pixels);
  std::vector<double> truth(judge.outputs.size());
  std::map<std::string, int> first, later, alike;
  const JudgedExamples begun(images, judge, {.seed = 5});
  for (std::uint64_t look = 0; look < 40; ++look)
    for (std::size_t i = 6; i < 12; ++i) {
      examples.read(i, look, seen, truth);
      const auto fault = std::find(truth.begin() + 1, truth.end(), 1.0) - truth.begin();
      ++(look < 20 ? first : later)[judge.outputs[static_cast<std::size_t>(fault)].name];
      begun.read(i, look, seen, truth);
      ++alike[judge.outputs[static_cast<std::size_t>(std::find(truth.begin() + 1, truth.end(), 1.0) - truth.begin())]
                  .name];
    }
  CHECK(first.size() == 3);
  CHECK(first["light"] > first["displaced"] + first["others_shape"]);  // 8 to 4, of 120
  CHECK(later.size() == judge.outputs.size() - 1);
  CHECK(later["light"] > 2 * later["noisy"]);  // 8 to 1
  CHECK(alike.size() == judge.outputs.size() - 1);
  CHECK(alike["light"] < 60);  // of 240, 1 of 8

  // To one that sees two photos others are hard.
  const DatasetImages photos = triangles(6);
  const NetworkDescription of_photos = judge_description();
  const JudgedExamples of_two(photos, of_photos, {.seed = 5}, 1, 20);
  std::set<std::string> hard;
  for (std::uint64_t look = 0; look < 20; ++look)
    for (std::size_t i = 6; i < 12; ++i) {
      std::vector<double> faults(of_photos.outputs.size());
      std::vector<float> image(7 * pixels);
      of_two.read(i, look, image, faults);
      hard.insert(
          of_photos.outputs[static_cast<std::size_t>(std::find(faults.begin() + 1, faults.end(), 1.0) - faults.begin())]
              .name);
    }
  CHECK(hard == std::set<std::string>{"curve", "saturated", "mask", "others_flash"});
}

TEST_CASE("a batch has the same bits with any number of threads") {
  const DatasetImages images = triangles(6);
  const NetworkDescription judge = judge_description();
  const JudgedExamples examples(images, judge, {.mirrored = true, .noise = 1, .seed = 5});
  const Network network(judge);
  std::vector<std::size_t> all(examples.count());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const int before = threads();
  setenv("ITN_FORCE_THREADS", "1", 1);  // whatever cores there are
  set_threads(1);
  const Batch one = read_batch(examples, all, network, 3);
  set_threads(4);
  const Batch four = read_batch(examples, all, network, 3);
  set_threads(before);
  unsetenv("ITN_FORCE_THREADS");
  CHECK(one.images == four.images);
  CHECK(one.truth == four.truth);
}

TEST_CASE("a judge of known shapes is shown another's shape, and never one of the same by mistake") {
  const DatasetImages images = known_triangles();
  const NetworkDescription judge = knowing_judge();
  const JudgedExamples examples(images, judge, {.seed = 5});
  const auto others = static_cast<std::size_t>(
      std::find_if(judge.outputs.begin(), judge.outputs.end(), [](const auto& o) { return o.name == "others_shape"; }) -
      judge.outputs.begin());
  std::vector<float> seen(6 * pixels);
  std::vector<double> truth(judge.outputs.size());
  int found = 0;
  for (std::uint64_t look = 0; look < 30; ++look)
    for (std::size_t i = 6; i < 12; ++i) {
      examples.read(i, look, seen, truth);
      if (truth[others] != 1) continue;
      ++found;
      CHECK(seen[4 * pixels] == (i - 6 < 3 ? 1.0F : 0.0F));  // nearness
    }
  CHECK(found > 10);  // of 180 looks, 1 of 8
}

TEST_CASE("a judge's limit is what 5 % of the right images exceed, and what it finds of a fault is counted by it") {
  Predictions examples;
  examples.outputs = 3;  // doubt and two faults
  const auto add = [&](double doubt, std::vector<double> truth) {
    for (const double said : {doubt, 0.0, 0.0}) examples.predicted.push_back(said);
    examples.truth.insert(examples.truth.end(), truth.begin(), truth.end());
  };
  for (int i = 1; i <= 99; ++i) add(i / 100.0, {0, 0, 0});
  for (const double doubt : {0.2, 0.96, 0.97, 0.99}) add(doubt, {1, 1, 0});
  for (const double doubt : {0.1, 0.94}) add(doubt, {1, 0, 1});
  CHECK(judge_limit(examples) == 0.95);  // the 95th of 99
  const JudgeErrors errors = judge_errors(examples, 0.95);
  CHECK(errors.false_alarms == Approx(4 / 99.0));
  CHECK((errors.found == std::vector<double>{0.75, 0}));
  // Ten cannot tell which they are that one in twenty exceeds.
  examples.predicted.resize(30);
  examples.truth.resize(30);
  CHECK(judge_limit(examples) == 1);
}

TEST_CASE("a judge keeps its limit in its file, and doubts what is above it") {
  const TemporaryFolder folder;
  Network judge(judge_description());
  judge.initialise(1);
  judge.set_limit(0.25);
  CHECK_THROWS_AS(judge.set_limit(1.5), UsageError);
  write_network(folder / "judge.safetensors", judge, Precision::single);
  const NetworkDescription stored = read_network(folder / "judge.safetensors").description();
  CHECK(stored == judge.description());
  CHECK(is_judge(stored));
  CHECK_FALSE(is_plain(stored));

  std::vector<float> raw(stored.raw_outputs(), -5.0F);
  CHECK_FALSE(verdict_of(raw, stored).doubted);
  raw[0] = 1;
  const Verdict verdict = verdict_of(raw, stored);
  CHECK(verdict.doubted);
  CHECK(verdict.doubt == Approx(1 / (1 + std::exp(-1))));
}

TEST_CASE("a judge judges for networks that see what it sees") {
  const NetworkDescription judge = judge_description();
  NetworkDescription network = judge;
  network.kind = "rn";
  network.outputs = default_outputs();
  require_judge_of(network, judge, "j");
  CHECK_THROWS_WITH(require_judge_of(judge, network, "j"), Contains("is no judge"));
  network.cut_out = 0.6;  // each cuts the object out in the size that it learnt from,
  network.size *= 2;      // and sees as many pixels as there
  require_judge_of(network, judge, "j");
  network.cut_out = 0;
  CHECK_THROWS_WITH(require_judge_of(network, judge, "j"), Contains("the same --inputs, --channels, --exposure and"));
  network = judge;
  network.inputs = {"rgb", "mask"};
  CHECK_THROWS_AS(require_judge_of(network, judge, "j"), UsageError);
  network = judge;
  network.luminance = 3;  // the data sets may differ: each sees radiance over its own
  require_judge_of(network, judge, "j");
  NetworkDescription fewer = judge;
  fewer.outputs.pop_back();
  CHECK_THROWS_WITH(JudgedExamples(triangles(2), fewer), Contains("train it again"));
  NetworkDescription none = judge;
  none.outputs = default_outputs();
  CHECK_THROWS_WITH(Network(none), Contains("a judge has a doubt"));
}
