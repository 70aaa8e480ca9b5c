#include "network/dataset/config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/base/json_text.h"
#include "runtime/scene/shapes/named_shapes.h"

namespace itn {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> shapes(bool for_testing) {
  std::vector<std::string> names;
  for (const NamedShape& shape : named_shapes())
    if (shape.for_testing == for_testing) names.push_back(shape.name);
  return names;
}

// The protocol of the paper and of the authors' code, at a size that a laptop renders in minutes.
DatasetConfig laptop() {
  DatasetConfig config;
  config.train.shapes = shapes(false);
  config.train.azimuths = {0, 30, 60, 90};
  config.train.materials = 100;
  config.test.shapes = shapes(true);
  config.test.azimuths = {10, 20, 40, 50, 70, 80};
  config.test.materials = 12;
  return config;
}

DatasetConfig preset(const std::string& name) {
  DatasetConfig config = laptop();
  if (name == "tiny") {
    config.size = 32;
    config.spp = 64;
    config.train.azimuths = {0, 60};
    config.train.materials = 40;
    config.test.azimuths = {30};
    config.test.materials = 4;
  } else if (name == "varied") {
    config.spp = 32;
    config.train = {};
    config.train.random_shapes = 3000;
    config.train.triangles = 10000;
    config.train.materials = 4;
    config.train.azimuth_range = {0, 90};
  } else if (name == "world") {
    config.spp = 64;
    config.in_colours = true;
    config.cameras = {{10, 80}, {-180, 180}};
    config.boundaries = {0.3, {0.05, 0.5}, {1.2, 1.6}};
    for (DatasetConfig::Side* side : {&config.train, &config.test}) {
      *side = {};
      side->triangles = 10000;
      side->azimuth_range = {-180, 180};
      side->zenith_range = {0, 70};
      side->lamps = 0.5;
    }
    config.train.random_shapes = 3000;
    config.train.materials = 4;
    config.test.shapes = shapes(true);
    config.test.random_shapes = 296;
    config.test.materials = 2;
  } else if (name == "paper") {
    config.size = 128;
    config.spp = 1024;
    config.train.materials = config.test.materials = 200;
  }
  return config;
}

// Defaults are left out, here and below, so that sets from before an option existed keep their hash.
Json side_json(const DatasetConfig::Side& side) {
  Json json{{"shapes", side.shapes},     {"random_shapes", side.random_shapes}, {"triangles", side.triangles},
            {"azimuths", side.azimuths}, {"azimuth_range", side.azimuth_range}, {"materials", side.materials}};
  if (side.albedos > 1) json["albedos"] = side.albedos;
  if (side.lamps > 0) json["lamps"] = side.lamps;
  if (side.pictures > 0) json["pictures"] = side.pictures;
  if (side.zenith_range) json["zenith_range"] = *side.zenith_range;
  if (side.environments.empty()) return json;
  json["environments"] = side.environments;
  json["environment_azimuths"] = side.environment_azimuths;
  return json;
}

Json boundary_json(const DatasetConfig& c) {
  if (c.boundaries)
    return {{"type", "drawn"},
            {"matched", c.boundaries->matched},
            {"alpha", c.boundaries->alpha},
            {"int_ior", c.boundaries->int_ior}};
  if (!c.boundary.rough) return {{"type", "matched"}};
  return {{"type", "rough"}, {"alpha", c.boundary.alpha}, {"int_ior", c.boundary.int_ior}};
}

Json as_json(const DatasetConfig& c) {
  Json json{{"size", c.size},
            {"spp", c.spp},
            {"seed", c.seed},
            {"longest_side_mm", c.longest_side_mm},
            {"boundary", boundary_json(c)},
            {"zenith", c.zenith},
            {"sigma_t", c.sigma_t},
            {"albedo", c.albedo},
            {"g", c.g},
            {"train", side_json(c.train)},
            {"test", side_json(c.test)}};
  if (!c.train.environments.empty() || !c.test.environments.empty()) json["environment_scale"] = c.environment_scale;
  if (c.cameras) json["camera"] = {{"elevation", c.cameras->elevation}, {"azimuth", c.cameras->azimuth}};
  if (c.in_colours) json["colours"] = "rgb";
  if (c.flash > 0) json["flash"] = c.flash;
  if (c.linear_sigma_t) json["sigma_t_scale"] = "linear";
  return json;
}

// Reads values by their keys, and knows afterwards which ones nobody asked for.
class Reader {
 public:
  Reader(const Json& json, std::string file, std::string place)
      : json_(json), file_(std::move(file)), place_(std::move(place)) {
    if (!json.is_object()) fail("", "an object { ... }");
  }

  [[noreturn]] void fail(const std::string& key, const std::string& need) const {
    const std::string at = place_.empty() || key.empty() ? place_ + key : place_ + "." + key;
    throw InputError(fmt::format("{}: {} is {}; need {}", file_, at.empty() ? "it" : at,
                                 key.empty() ? json_.dump() : json_.value(key, Json()).dump(), need));
  }

  template <class Value, class Valid>
  void read(const char* key, Value& value, const std::string& need, Valid&& valid) {
    know(key);
    const Json& j = at(key);
    try {
      Value read = j.get<Value>();
      if (!valid(read)) fail(key, need);
      value = std::move(read);
    } catch (const Json::exception&) {
      fail(key, need);
    }
  }
  void read_whole(const char* key, int& value, int low, int high) {
    know(key);
    const Json& j = at(key);
    if (!j.is_number_integer() || j < low || j > high)
      fail(key, fmt::format("a whole number from {} to {}", low, high));
    value = j;
  }
  void read_seed(const char* key, std::uint64_t& value) {
    know(key);
    const Json& j = at(key);
    if (!j.is_number_unsigned()) fail(key, "a whole number from 0 to 2^64 - 1");
    value = j;
  }
  void read_number(const char* key, double& value, double low, double high) {
    const std::string need = fmt::format("a number from {} to {}", low, high);
    if (!at(key).is_number()) fail(key, need);
    read(key, value, need, [&](double v) { return v >= low && v <= high; });
  }
  void read_range(const char* key, std::array<double, 2>& value, double low, double high) {
    const std::string need = fmt::format("two numbers from {} to {}, the smaller first", low, high);
    if (!is_list_of_numbers(at(key)) || at(key).size() != 2) fail(key, need);
    read(key, value, need, [&](const auto& v) { return v[0] >= low && v[0] <= v[1] && v[1] <= high; });
  }
  void read_azimuths(const char* key, std::vector<double>& value) {
    const std::string need = "a list of angles from -180 to 180";
    if (!is_list_of_numbers(at(key))) fail(key, need);
    read(key, value, need, [](const std::vector<double>& angles) {
      return std::all_of(angles.begin(), angles.end(), [](double a) { return a >= -180 && a <= 180; });
    });
  }
  // Is a key there that may be left out?
  bool has(const char* key) {
    know(key);
    return json_.contains(key);
  }
  const Json& object(const char* key) {
    know(key);
    return at(key);
  }
  void finish() const {
    for (const auto& [key, value] : json_.items())
      if (std::find(known_.begin(), known_.end(), key) == known_.end())
        throw InputError(fmt::format("{}: {}{}{} is not known; need one of: {}", file_, place_,
                                     place_.empty() ? "" : ".", key, fmt::join(known_, ", ")));
  }

 private:
  void know(const char* key) {
    if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.emplace_back(key);
  }
  static bool is_list_of_numbers(const Json& json) {
    return json.is_array() && std::all_of(json.begin(), json.end(), [](const Json& j) { return j.is_number(); });
  }

  // null where there is none: null in a file takes a key away (merge_patch).
  const Json& at(const char* key) const {
    static const Json none;
    return json_.contains(key) ? json_.at(key) : none;
  }

  const Json& json_;
  std::string file_, place_;
  std::vector<std::string> known_;
};

DatasetConfig::Side read_side(Reader& config, const std::string& file, const char* name) {
  DatasetConfig::Side side;
  Reader reader(config.object(name), file, name);
  reader.read("shapes", side.shapes, "a list of names", [](const auto&) { return true; });
  reader.read_whole("random_shapes", side.random_shapes, 0, 10000000);
  reader.read_whole("triangles", side.triangles, 100, 10000000);
  reader.read_azimuths("azimuths", side.azimuths);
  reader.read_range("azimuth_range", side.azimuth_range, -180, 180);
  reader.read_whole("materials", side.materials, 1, 10000000);
  if (reader.has("albedos")) reader.read_whole("albedos", side.albedos, 1, 16);
  if (reader.has("lamps")) reader.read_number("lamps", side.lamps, 0, 1);
  if (reader.has("pictures")) reader.read_number("pictures", side.pictures, 0, 1);
  if (reader.has("zenith_range")) reader.read_range("zenith_range", side.zenith_range.emplace(), 0, 89);
  if (reader.has("environments"))
    reader.read("environments", side.environments, "a list of image files, each once", [](auto files) {
      std::sort(files.begin(), files.end());
      return std::adjacent_find(files.begin(), files.end()) == files.end();
    });
  if (reader.has("environment_azimuths")) reader.read_azimuths("environment_azimuths", side.environment_azimuths);
  reader.finish();
  if (side.pictures > 0 && side.environments.empty()) reader.fail("pictures", "0, or `environments` to draw from");
  if (side.pictures > 0 && !side.azimuths.empty())
    reader.fail("pictures", "0, or \"azimuths\": [], so that lights are drawn");
  if (side.lamps + side.pictures > 1) reader.fail("pictures", "at most 1 together with lamps");
  if (side.environment_azimuths.empty()) reader.fail("environment_azimuths", "at least one angle");
  if (side.shapes.empty() && side.random_shapes == 0) reader.fail("shapes", "at least one, or random_shapes above 0");
  return side;
}

void read_boundary(const Json& json, const std::string& file, DatasetConfig& config) {
  Reader boundary(json, file, "boundary");
  std::string type;
  boundary.read("type", type, "\"matched\", \"rough\" or \"drawn\"",
                [](const std::string& t) { return t == "matched" || t == "rough" || t == "drawn"; });
  constexpr double least_alpha = 0.01, least_ior = 1.01, most_ior = 4;
  config.boundary.rough = type == "rough";
  if (type == "rough") {
    boundary.read_number("alpha", config.boundary.alpha, least_alpha, 1);
    boundary.read_number("int_ior", config.boundary.int_ior, least_ior, most_ior);
  } else if (type == "drawn") {
    boundary.read_number("matched", config.boundaries.emplace().matched, 0, 1);
    boundary.read_range("alpha", config.boundaries->alpha, least_alpha, 1);
    boundary.read_range("int_ior", config.boundaries->int_ior, least_ior, most_ior);
  }
  boundary.finish();
}

DatasetConfig from_json(const Json& json, const std::string& file) {
  DatasetConfig config;
  Reader reader(json, file, "");
  reader.read_whole("size", config.size, 8, 128);
  if ((config.size & (config.size - 1)) != 0) reader.fail("size", "8, 16, 32, 64 or 128");
  reader.read_whole("spp", config.spp, 2, 1 << 24);
  reader.read_seed("seed", config.seed);
  reader.read_number("longest_side_mm", config.longest_side_mm, 1e-6, 1e6);
  reader.read_number("zenith", config.zenith, 0, 89);
  if (reader.has("environment_scale")) reader.read_number("environment_scale", config.environment_scale, 1e-9, 1e9);
  reader.read_range("sigma_t", config.sigma_t, 1e-6, 1e6);
  reader.read_range("albedo", config.albedo, 0, 1);
  reader.read_range("g", config.g, -0.99, 0.99);

  read_boundary(reader.object("boundary"), file, config);
  if (reader.has("camera") && !reader.object("camera").is_null()) {
    Reader camera(reader.object("camera"), file, "camera");
    camera.read_range("elevation", config.cameras.emplace().elevation, 5, 85);
    camera.read_range("azimuth", config.cameras->azimuth, -180, 180);
    camera.finish();
  }
  const auto choice = [&](const char* key, const std::string& no, const std::string& yes) {
    std::string chosen = no;
    if (reader.has(key))
      reader.read(key, chosen, fmt::format("\"{}\" or \"{}\"", no, yes),
                  [&](const std::string& text) { return text == no || text == yes; });
    return chosen == yes;
  };
  config.in_colours = choice("colours", "luminance", "rgb");
  config.linear_sigma_t = choice("sigma_t_scale", "logarithmic", "linear");
  if (reader.has("flash")) reader.read_number("flash", config.flash, 0, 1e6);

  config.train = read_side(reader, file, "train");
  config.test = read_side(reader, file, "test");
  const bool several_albedos = config.train.albedos > 1 || config.test.albedos > 1;
  if (several_albedos && config.albedo[0] == config.albedo[1])
    reader.fail("albedo", "a range from which each of several `albedos` can be another");
  reader.finish();
  return config;
}

// Mesh and environment files are named from the configuration's folder.
void resolve(DatasetConfig::Side& side, const std::string& file) {
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  const auto path = [&](const std::string& name) { return (folder / name).lexically_normal().string(); };
  for (std::string& environment : side.environments) environment = path(environment);
  const std::vector<NamedShape>& named = named_shapes();
  for (std::string& shape : side.shapes)
    if (std::none_of(named.begin(), named.end(), [&](const NamedShape& n) { return n.name == shape; })) {
      if (std::filesystem::path(shape).extension().empty()) {
        std::vector<std::string> names;
        names.reserve(named.size());
        for (const NamedShape& n : named) names.push_back(n.name);
        throw InputError(fmt::format("{}: the shape {} is not known; need a mesh file, or one of: {}", file, shape,
                                     fmt::join(names, ", ")));
      }
      shape = path(shape);
    }
}

}  // namespace

const std::vector<std::string>& dataset_presets() {
  static const std::vector<std::string> names{"tiny", "laptop", "varied", "world", "paper"};
  return names;
}

DatasetConfig read_dataset_config(const std::string& name_or_file) {
  const std::vector<std::string>& presets = dataset_presets();
  const auto is_preset = [&](const std::string& name) {
    return std::find(presets.begin(), presets.end(), name) != presets.end();
  };
  if (is_preset(name_or_file)) return preset(name_or_file);
  if (!is_there(name_or_file))
    throw InputError(fmt::format("{}: no such file; need a JSON file, or one of the presets {}", name_or_file,
                                 fmt::join(presets, ", ")));
  auto patch = parse_json<Json>(read_file(name_or_file), name_or_file);
  std::string base = "laptop";
  if (patch.is_object() && patch.contains("preset")) {
    if (!patch["preset"].is_string() || !is_preset(patch["preset"]))
      throw InputError(fmt::format("{}: preset is {}; need one of: {}", name_or_file, patch["preset"].dump(),
                                   fmt::join(presets, ", ")));
    base = patch["preset"];
    patch.erase("preset");
  }
  if (!patch.is_object()) throw InputError(name_or_file + ": need an object { ... }");
  Json json = as_json(preset(base));
  if (patch.contains("boundary") && patch["boundary"].is_object() && patch["boundary"].contains("type"))
    json.erase("boundary");  // another kind has other numbers
  json.merge_patch(patch);
  DatasetConfig config = from_json(json, name_or_file);
  resolve(config.train, name_or_file);
  resolve(config.test, name_or_file);
  return config;
}

std::string to_json(const DatasetConfig& config) { return as_json(config).dump(); }

}  // namespace itn
