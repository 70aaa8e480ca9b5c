// Networks in files: what comes back, and what is refused.
#include "itn/network_file.h"

#include <catch2/catch.hpp>
#include <functional>
#include <tuple>

#include "../support/temporary_folder.h"
#include "itn/error.h"
#include "itn/file.h"
#include "itn/shipped.h"
#include "network/training/judge.h"
#include "runtime/base/random.h"

namespace {

using namespace itn;
using Catch::Contains;

Network some_network() {
  Network network({"itn", 6, 4, {{"sigma_t", 20, 300, true}, {"albedo", 0.25, 1, false}}, 2, 0.1, 25});
  network.initialise(3);
  network.weights().back().values = {0.25f, -3};
  return network;
}

std::vector<float> outputs(Network& network) {
  std::vector<float> images(2 * network.image_values());
  for (std::size_t i = 0; i < images.size(); ++i) images[i] = static_cast<float>(random_uniform(1, 2, i));
  return network.forward(images, 2);
}

// The message for some_network()'s file after a change.
std::string message(const std::function<void(Safetensors&)>& change) {
  const TemporaryFolder folder;
  const std::string file = folder / "network.safetensors";
  static const Safetensors original = [] {
    const Network network = some_network();
    return Safetensors{network.weights(), network_metadata(network.description())};
  }();
  Safetensors content = original;
  change(content);
  write_file(file, safetensors_bytes(content, Precision::single));
  try {
    read_network(file);
  } catch (const InputError& error) {
    CHECK_THAT(error.what(), Contains(file));
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("A network comes back from its file with the same outputs to the bit, and its ranges") {
  const TemporaryFolder folder;
  Network network = some_network();
  write_network(folder / "a.safetensors", network, Precision::single);
  Network read = read_network(folder / "a.safetensors");
  CHECK(read.description() == network.description());
  CHECK(outputs(read) == outputs(network));
}

TEST_CASE("A network's distribution and its spread come back from its file, and others are input errors") {
  const TemporaryFolder folder;
  const std::string file = folder / "a.safetensors";
  NetworkDescription description = some_network().description();
  description.kind = "rn";
  description.distribution = true;
  description.spread = {1.25, 0.75};
  Network network(description);
  network.initialise(3);
  write_network(file, network, Precision::single);
  Network read = read_network(file);
  CHECK(read.description() == description);
  CHECK(outputs(read) == outputs(network));
  const auto refusal = [&](const std::string& name, const std::string& value) {
    Safetensors content{network.weights(), network_metadata(description)};
    content.metadata[name] = value;
    write_file(file, safetensors_bytes(content, Precision::single));
    try {
      read_network(file);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  CHECK_THAT(refusal("distribution", "cauchy"), Contains("'normal' is expected"));
  CHECK_THAT(refusal("spread", "[1]"), Contains("a spread above 0 for each output"));
  CHECK_THAT(refusal("spread", "[1, -1]"), Contains("a spread above 0 for each output"));
  CHECK_THAT(refusal("spread", "[1, \"x\"]"), Contains("no list of numbers"));
  CHECK_THAT(refusal("kind", "itn"), Contains("only rn learns a distribution"));
}

TEST_CASE("Bytes, without the weights that meet no pixel, are small and move the outputs by little") {
  const TemporaryFolder folder;
  Network network = some_network();
  write_network(folder / "a.safetensors", network, Precision::byte);
  write_network(folder / "b.safetensors", network, Precision::single);
  const auto size = [&](const char* name) { return static_cast<double>(read_file(folder / name).size()); };
  CHECK(size("a.safetensors") < 0.06 * size("b.safetensors"));  // images of 4 pixels: a quarter of a ninth, nearly
  Network read = read_network(folder / "a.safetensors");
  CHECK(read.description() == network.description());
  const std::vector<float> expected = outputs(network), found = outputs(read);
  for (std::size_t i = 0; i < expected.size(); ++i) CHECK(found[i] == Approx(expected[i]).margin(3e-2));
}

TEST_CASE("A network file of another kind, version or shape is an input error") {
  CHECK(message([](Safetensors&) {}) == "accepted");
  CHECK_THAT(message([](Safetensors& c) { c.metadata["version"] = "2"; }), Contains("version 2"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata["format"] = "pt"; }), Contains("holds 'pt'"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata.clear(); }), Contains("no metadata 'format'"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata["kind"] = "gan"; }), Contains("kind 'gan'"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata["channels"] = "3"; }), Contains("3 input channels"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata["luminance"] = "0"; }), Contains("luminance 0"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata["luminance"] = "1,5"; }), Contains("'luminance' is '1,5'"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata.erase("mm_per_unit"); }), Contains("'mm_per_unit'"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata["mm_per_unit"] = "-1"; }), Contains("scene units of -1"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata["size"] = "100"; }), Contains("100 pixels"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata["width"] = "65"; }), Contains("65 channels in its first stage"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata["width"] = "64"; }), Contains("copy the whole file"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata["size"] = "64 "; }), Contains("whole number"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata["outputs"] = "[{}]"; }), Contains("'outputs'"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata["outputs"] = "{"; }), Contains("'outputs'"));
  CHECK_THAT(
      message([](Safetensors& c) { c.metadata["outputs"] = R"([{"name":"g","low":1,"high":0,"logarithmic":false}])"; }),
      Contains("low below high"));
  CHECK_THAT(message([](Safetensors& c) { c.metadata["channels"] = "1"; }),
             Contains("'convolution0.weight' is 2 x 6 x 3 x 3, where 2 x 1 x 3 x 3 is expected"));
  CHECK_THAT(message([](Safetensors& c) { c.tensors[1].name = "bias"; }), Contains("no array 'convolution0.bias'"));
  CHECK_THAT(message([](Safetensors& c) { c.tensors.push_back({"more", {1}, {0.0f}}); }), Contains("17 arrays"));
}

TEST_CASE("A network file that is missing or damaged is an input error") {
  const TemporaryFolder folder;
  CHECK_THROWS_AS(read_network(folder / "none.safetensors"), InputError);
  const std::string file = folder / "a.safetensors";
  write_network(file, some_network(), Precision::byte);
  write_file(file, read_file(file).substr(0, read_file(file).size() / 2));
  CHECK_THROWS_AS(read_network(file), InputError);
}

TEST_CASE("The shipped networks are small") {
  CHECK(shipped_network().size() + shipped_photo_network().size() + shipped_photo_judge().size() < 10'000'000);
}

TEST_CASE("The shipped network is whole, and of the paper's structure") {
  const Network network = parse_network(shipped_network(), "shipped");
  CHECK(network.description().width == 16);
  CHECK(network.description().size == 64);
  CHECK(network.description().channels == 6);
  CHECK(network.description().mm_per_unit == 1);
}

TEST_CASE("The shipped network of photos sees the object alone, by a flash, and says how sure it is") {
  const std::string_view bytes = shipped_photo_network();
  const NetworkDescription network = parse_network(bytes, "shipped-photos").description();
  const NetworkDescription judge = parse_network(shipped_photo_judge(), "shipped-photos-judge").description();
  require_judge_of(network, judge, "shipped-photos-judge");
  CHECK(judge.limit > 0);
  CHECK(judge.limit < 1);
  CHECK(network.inputs == std::vector<std::string>{"rgb", "flash_rgb", "mask"});
  CHECK(network.exposure);
  CHECK(network.cut_out > 0);
  CHECK(network.distribution);
  CHECK(network.width == 16);
  CHECK(network.size == 128);
  CHECK(network.mm_per_unit == 1);
}
