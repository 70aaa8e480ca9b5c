#include "network/dataset/manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/base/json_text.h"

namespace itn {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* SCHEMA = "itn.dataset/1";
constexpr int MOST_PIXELS = 1 << 14;  // of a side

template <class Enum>
using Names = std::vector<std::pair<const char*, Enum>>;

const Names<Manifest::Role> ROLES{{"train", Manifest::Role::train}, {"test", Manifest::Role::test}};
const Names<Manifest::Split> SPLITS{{"train", Manifest::Split::train},
                                    {"validation", Manifest::Split::validation},
                                    {"unseen_light", Manifest::Split::unseen_light},
                                    {"unseen_shape", Manifest::Split::unseen_shape},
                                    {"unseen_both", Manifest::Split::unseen_both}};

template <class Enum>
const char* name_of(const Names<Enum>& names, Enum value) {
  for (const auto& [name, named] : names)
    if (named == value) return name;
  throw std::logic_error("manifest: a value without a name");
}

// A value in the file, and where it stands: what every message starts with.
class Node {
 public:
  Node(const Json& json, std::string file, std::string path = "")
      : json_(json), file_(std::move(file)), path_(std::move(path)) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: {}{}{}", file_, path_, path_.empty() ? "" : ": ", what));
  }
  [[noreturn]] void fail_need(const std::string& need) const {
    fail(
        fmt::format("got {}, need {}", json_.dump(-1, ' ', false, Json::error_handler_t::replace).substr(0, 60), need));
  }

  bool has(const char* key) const { return json_.is_object() && json_.contains(key); }
  Node operator[](const char* key) const {
    if (!json_.is_object()) fail_need("an object");
    if (!json_.contains(key)) fail(fmt::format("has no \"{}\"", key));
    return {json_.at(key), file_, path_.empty() ? key : path_ + "." + key};
  }
  std::vector<Node> list() const {
    if (!json_.is_array()) fail_need("a list");
    std::vector<Node> nodes;
    for (std::size_t i = 0; i < json_.size(); ++i) nodes.emplace_back(json_[i], file_, fmt::format("{}[{}]", path_, i));
    return nodes;
  }

  const Json& json() const { return json_; }
  bool boolean() const {
    if (!json_.is_boolean()) fail_need("true or false");
    return json_.get<bool>();
  }
  std::string text() const {
    if (!json_.is_string() || json_.get_ref<const std::string&>().empty()) fail_need("a text");
    return json_.get<std::string>();
  }
  double number(double low, double high, const char* need) const {
    // A comparison with NaN is false; JSON has none anyway.
    if (!json_.is_number() || !(json_.get<double>() >= low && json_.get<double>() <= high)) fail_need(need);
    return json_.get<double>();
  }
  double positive(const char* need) const {
    return number(std::numeric_limits<double>::min(), std::numeric_limits<double>::max(), need);
  }
  int whole(int low, int high) const {
    if (!json_.is_number_integer() || json_.get<double>() < low || json_.get<double>() > high)
      fail_need(fmt::format("a whole number from {} to {}", low, high));
    return json_.get<int>();
  }
  int index(std::size_t count, const char* of) const {
    if (!json_.is_number_integer() || json_.get<double>() < 0 || json_.get<double>() >= static_cast<double>(count))
      fail_need(fmt::format("the index of one of {} {}", count, of));
    return json_.get<int>();
  }
  std::uint64_t seed() const {
    if (!json_.is_number_unsigned()) fail_need("a whole number from 0 to 2^64 - 1");
    return json_.get<std::uint64_t>();
  }
  template <class Enum>
  Enum one_of(const Names<Enum>& names) const {
    std::string all;
    for (const auto& [name, value] : names) {
      if (json_ == name) return value;
      all += (all.empty() ? "" : ", ") + std::string(name);
    }
    fail_need("one of " + all);
  }
  // A file below the data set's folder: the folder may be moved, and nothing outside of it is read or written.
  std::string file() const {
    const std::filesystem::path path = text();
    bool inside = path.is_relative() && path.has_filename();
    for (const auto& part : path) inside &= part != "..";
    if (!inside) fail_need("a file below the data set's folder");
    return path.string();
  }

 private:
  const Json& json_;
  std::string file_, path_;
};

Manifest::Boundary boundary_of(const Node& node) {
  const Node type = node["type"];
  if (type.json() == "matched") return {};
  if (type.json() != "rough") type.fail_need("\"matched\" or \"rough\"");
  return {true, node["alpha"].positive("a roughness above 0"),
          node["int_ior"].number(1, std::numeric_limits<double>::max(), "an index of refraction of 1 or more")};
}

Manifest::Shape shape_of(const Node& node, bool cameras) {
  Manifest::Shape shape{node["name"].text(), node["role"].one_of(ROLES), cameras ? "" : node["buffers"].file(), {}};
  const Node mesh = node["mesh"];
  if (mesh.has("named"))
    shape.mesh = Manifest::NamedMesh{mesh["named"].text()};
  else if (mesh.has("random"))
    shape.mesh =
        Manifest::RandomMesh{mesh["random"].seed(), mesh["triangles"].whole(4, std::numeric_limits<int>::max())};
  else if (mesh.has("file"))
    shape.mesh = Manifest::FileMesh{mesh["file"].file()};
  else
    mesh.fail_need("one with \"named\", \"random\" or \"file\"");
  return shape;
}

Manifest::Light light_of(const Node& node) {
  Manifest::Light light;
  light.azimuth = node["azimuth"].number(-360, 360, "an angle of -360 to 360 degrees");
  if (node.has("lamps"))
    light.lamps = node["lamps"].seed();
  else if (node.has("environment"))
    light.environment = {node["environment"].file(), node["scale"].positive("a number above 0")};
  else
    light.zenith = node["zenith"].number(0, 90, "an angle of 0 to 90 degrees");
  const Node direction = node["direction"];
  const std::vector<Node> parts = direction.list();
  if (parts.size() != 3) direction.fail_need("three numbers");
  double square = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    light.direction[i] = parts[i].number(-2, 2, "a number from -1 to 1");
    square += light.direction[i] * light.direction[i];
  }
  if (std::fabs(square - 1) > 1e-3) direction.fail_need("a direction of length 1");
  return light;
}

std::array<double, 3> three(const Node& node, double low, double high, const char* need) {
  const std::vector<Node> parts = node.list();
  if (parts.size() != 3) node.fail_need("three numbers, of red, green and blue");
  std::array<double, 3> values{};
  for (std::size_t i = 0; i < 3; ++i) values[i] = parts[i].number(low, high, need);
  return values;
}

double mean_of(const std::array<double, 3>& v) { return (v[0] + v[1] + v[2]) / 3; }

void read_material(const Node& node, const Manifest& manifest, Manifest::Image& image) {
  const char *const above_0 = "a number above 0", *const share = "a number from 0 to 1";
  if (manifest.in_colours) {
    image.colours = {
        three(node["sigma_t"], std::numeric_limits<double>::min(), std::numeric_limits<double>::max(), above_0),
        three(node["albedo"], 0, 1, share)};
    image.sigma_t = mean_of(image.colours->sigma_t);
    image.albedo = mean_of(image.colours->albedo);
  } else {
    image.sigma_t = node["sigma_t"].positive(above_0);
    image.albedo = node["albedo"].number(0, 1, share);
  }
  const double below_one = std::nextafter(1.0, 0.0);
  image.g = node["g"].number(-below_one, below_one, "a number between -1 and 1");
}

Manifest::Image image_of(const Node& node, const Manifest& manifest) {
  Manifest::Image image;
  image.file = node["file"].file();
  image.split = node["split"].one_of(SPLITS);
  image.shape = node["shape"].index(manifest.shapes.size(), "shapes");
  image.light = node["light"].index(manifest.lights.size(), "lights");
  read_material(node, manifest, image);
  image.seed = node["seed"].seed();
  if (manifest.cameras) {
    const Node camera = node["camera"];
    image.camera = {camera["elevation"].number(1, 89, "an angle of 1 to 89 degrees"),
                    camera["azimuth"].number(-180, 180, "an angle of -180 to 180 degrees")};
  }
  if (node.has("boundary")) image.boundary = boundary_of(node["boundary"]);
  const Manifest::Shape& shape = manifest.shapes[static_cast<std::size_t>(image.shape)];
  const bool unseen = image.split == Manifest::Split::unseen_shape || image.split == Manifest::Split::unseen_both;
  if (unseen != (shape.role == Manifest::Role::test))
    node["split"].fail(fmt::format("is \"{}\", and the shape \"{}\" has the role \"{}\"", split_name(image.split),
                                   shape.name, name_of(ROLES, shape.role)));
  return image;
}

void require_new(std::set<std::string>& names, const std::string& name, const Node& node) {
  if (!names.insert(name).second) node.fail("\"" + name + "\" is there twice");
}

Manifest manifest_of(const Node& root) {
  const Node schema = root["schema"];
  if (schema.json() != SCHEMA) schema.fail_need(std::string("\"") + SCHEMA + "\"; render the set again");
  Manifest manifest;
  manifest.version = root["version"].text();
  manifest.hash = root["hash"].text();
  if (manifest.hash.size() < 16 || manifest.hash.find_first_not_of("0123456789abcdef") != std::string::npos)
    root["hash"].fail_need("16 or more of the digits 0 to 9 and a to f");
  manifest.complete = root["complete"].boolean();
  if (!root["config"].json().is_object()) root["config"].fail_need("an object");
  manifest.config = root["config"].json().dump();
  manifest.size = root["size"].whole(1, MOST_PIXELS);
  manifest.spp = root["spp"].whole(1, std::numeric_limits<int>::max());
  manifest.mm_per_unit = root["mm_per_unit"].positive("a number above 0");
  manifest.boundary = boundary_of(root["boundary"]);
  if (root.has("in_colours")) manifest.in_colours = root["in_colours"].boolean();
  if (root.has("cameras")) manifest.cameras = root["cameras"].boolean();
  if (root.has("flash")) manifest.flash = root["flash"].positive("an irradiance above 0");
  if (root.has("linear_sigma_t")) manifest.linear_sigma_t = root["linear_sigma_t"].boolean();
  std::set<std::string> names, files;
  for (const Node& node : root["shapes"].list()) {
    manifest.shapes.push_back(shape_of(node, manifest.cameras));
    require_new(names, manifest.shapes.back().name, node["name"]);
    if (!manifest.cameras) require_new(files, manifest.shapes.back().buffers, node["buffers"]);
  }
  for (const Node& node : root["lights"].list()) manifest.lights.push_back(light_of(node));
  for (const Node& node : root["images"].list()) {
    manifest.images.push_back(image_of(node, manifest));
    require_new(files, manifest.images.back().file, node["file"]);
  }
  return manifest;
}

Json json_of(const Manifest::Boundary& boundary) {
  if (!boundary.rough) return {{"type", "matched"}};
  return {{"type", "rough"}, {"alpha", boundary.alpha}, {"int_ior", boundary.int_ior}};
}

Json json_of(const Manifest::Shape& shape) {
  Json mesh;
  if (const auto* named = std::get_if<Manifest::NamedMesh>(&shape.mesh)) mesh = {{"named", named->name}};
  if (const auto* random = std::get_if<Manifest::RandomMesh>(&shape.mesh))
    mesh = {{"random", random->seed}, {"triangles", random->triangles}};
  if (const auto* file = std::get_if<Manifest::FileMesh>(&shape.mesh)) mesh = {{"file", file->file}};
  Json json{{"name", shape.name}, {"role", name_of(ROLES, shape.role)}};
  if (!shape.buffers.empty()) json["buffers"] = shape.buffers;
  json["mesh"] = mesh;
  return json;
}

Json json_of(const Manifest::Light& light) {
  Json json = Json::object();
  if (light.environment) json = {{"environment", light.environment->file}, {"scale", light.environment->scale}};
  if (light.lamps) json = {{"lamps", *light.lamps}};
  json["azimuth"] = light.azimuth;
  if (!light.environment && !light.lamps) json["zenith"] = light.zenith;
  json["direction"] = light.direction;
  return json;
}

Json json_of(const Manifest::Image& image) {
  Json json{{"file", image.file}, {"split", split_name(image.split)}, {"shape", image.shape}, {"light", image.light}};
  json["sigma_t"] = image.colours ? Json(image.colours->sigma_t) : Json(image.sigma_t);
  json["albedo"] = image.colours ? Json(image.colours->albedo) : Json(image.albedo);
  json["g"] = image.g;
  json["seed"] = image.seed;
  if (image.camera) json["camera"] = {{"elevation", image.camera->elevation}, {"azimuth", image.camera->azimuth}};
  if (image.boundary) json["boundary"] = json_of(*image.boundary);
  return json;
}

Json json_of(const Manifest& manifest) {
  Json shapes = Json::array(), lights = Json::array(), images = Json::array();
  for (const Manifest::Shape& shape : manifest.shapes) shapes.push_back(json_of(shape));
  for (const Manifest::Light& light : manifest.lights) lights.push_back(json_of(light));
  for (const Manifest::Image& image : manifest.images) images.push_back(json_of(image));
  Json json{{"schema", SCHEMA},
            {"version", manifest.version},
            {"hash", manifest.hash},
            {"complete", manifest.complete},
            {"config", Json::parse(manifest.config, nullptr, false)},
            {"size", manifest.size},
            {"spp", manifest.spp},
            {"mm_per_unit", manifest.mm_per_unit},
            {"boundary", json_of(manifest.boundary)}};
  if (manifest.in_colours) json["in_colours"] = true;
  if (manifest.cameras) json["cameras"] = true;
  if (manifest.flash > 0) json["flash"] = manifest.flash;
  if (manifest.linear_sigma_t) json["linear_sigma_t"] = true;
  json["shapes"] = shapes;
  json["lights"] = lights;
  json["images"] = images;
  return json;
}

}  // namespace

std::span<const Manifest::Image> of_same_paths(const Manifest& set, const Manifest::Image& image) {
  const Manifest::Image *first = &image, *last = &image;
  while (first != set.images.data() && (first - 1)->seed == image.seed) --first;
  while (last != &set.images.back() && (last + 1)->seed == image.seed) ++last;
  return {first, last + 1};
}

bool is_laboratory(const Manifest& set) {
  return !set.in_colours && !set.cameras && std::none_of(set.images.begin(), set.images.end(), [](const auto& image) {
    return image.boundary.has_value();
  });
}

std::string split_name(Manifest::Split split) { return name_of(SPLITS, split); }

std::string manifest_file(const std::string& folder) {
  return (std::filesystem::path(folder) / "manifest.json").string();
}

void write_manifest(const std::string& folder, const Manifest& manifest) {
  const std::string file = manifest_file(folder);
  const Json json = json_of(manifest);
  manifest_of({json, file});
  write_file(file, json.dump(1) + "\n");
}

Manifest read_manifest(const std::string& folder) {
  const std::string file = manifest_file(folder);
  if (!is_there(file))
    throw InputError(fmt::format("{}: is not there; make the data set first: itn dataset CONFIG -o {}", file, folder));
  return parse_manifest(read_file(file), file);
}

Manifest parse_manifest(std::string_view text, const std::string& file) {
  const auto json = parse_json<Json>(text, file);
  return manifest_of({json, file});
}

Manifest read_complete_manifest(const std::string& folder) {
  Manifest manifest = read_manifest(folder);
  if (!manifest.complete)
    throw InputError(manifest_file(folder) + ": the data set is not complete; the itn dataset that began it goes on");
  return manifest;
}

}  // namespace itn
