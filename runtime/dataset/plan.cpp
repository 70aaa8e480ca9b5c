#include "runtime/dataset/plan.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/base/fingerprint.h"
#include "runtime/base/random.h"
#include "runtime/dataset/dataset_scene.h"
#include "runtime/shapes/named_shapes.h"

namespace itn {
namespace {

enum Stream : std::uint64_t { STREAM_SHAPE, STREAM_SEED, STREAM_AZIMUTH, STREAM_MATERIAL };

constexpr int validation_share = 10;  // one in so many

// Their names have six digits. Each shape has images: there are no more of those either.
constexpr std::size_t most_images = 1'000'000;

void require_room(std::size_t images) {
  if (images > most_images)
    throw InputError(fmt::format("the data set would have more than {} images; need fewer shapes, lights or materials",
                                 most_images));
}

// Where an environment is in the set's folder.
std::string environment_file(const std::string& from) {
  return "environments/" + std::filesystem::path(from).stem().string() + ".exr";
}

class Planner {
 public:
  Planner(const DatasetConfig& config, Manifest& set) : config_(config), set_(set) {}

  // The side's suns, then its environments; none: each image's is drawn.
  std::vector<int> lights(const DatasetConfig::Side& side) {
    std::vector<int> result;
    for (const double azimuth : side.azimuths) result.push_back(add(sun(azimuth)));
    for (const std::string& file : side.environments) {
      const Manifest::Environment environment{environment_file(file), config_.environment_scale};
      const std::shared_ptr<const Bitmap> picture = read_environment(file);
      for (const double azimuth : side.environment_azimuths) {
        const Vec3 direction = mean_direction(environment_light(picture, azimuth, environment.scale));
        result.push_back(add({azimuth, 0, direction, environment}));
      }
    }
    return result;
  }
  // One of its own, from the range.
  int drawn_light(const std::array<double, 2>& range) {
    const double u = random_uniform(config_.seed, STREAM_AZIMUTH, set_.images.size());
    return add(sun(range[0] + u * (range[1] - range[0])));
  }

  // The next material, point i of the additive sequence of Roberts (2018) in three dimensions: 1/phi, 1/phi^2, 1/phi^3
  // with phi^4 = phi + 1, shifted by the seed.
  void add_image(Manifest::Split split, int shape, int light) {
    const std::size_t i = set_.images.size();
    require_room(i + 1);
    const double phi = 1.22074408460575947536;
    std::array<double, 3> u{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double shift = random_uniform(config_.seed, STREAM_MATERIAL, k);
      u[k] = std::fmod(shift + static_cast<double>(i) * std::pow(phi, -static_cast<double>(k + 1)), 1.0);
    }
    Manifest::Image image;
    image.file = fmt::format("images/{:06}.exr", i);
    image.split = split;
    image.shape = shape;
    image.light = light;
    image.sigma_t = config_.sigma_t[0] * std::pow(config_.sigma_t[1] / config_.sigma_t[0], u[0]);
    image.albedo = config_.albedo[0] + u[1] * (config_.albedo[1] - config_.albedo[0]);
    image.g = config_.g[0] + u[2] * (config_.g[1] - config_.g[0]);
    image.seed = random_bits(config_.seed, STREAM_SEED, i);
    set_.images.push_back(image);
  }

 private:
  Manifest::Light sun(double azimuth) const {
    return {azimuth, config_.zenith, sun_direction(azimuth, config_.zenith), {}};
  }
  int add(const Manifest::Light& light) {
    set_.lights.push_back(light);
    return static_cast<int>(set_.lights.size()) - 1;
  }

  const DatasetConfig& config_;
  Manifest& set_;
};

void add_environments(const DatasetConfig::Side& side, DatasetPlan& plan) {
  for (const std::string& from : side.environments) {
    const auto [known, is_new] = plan.environment_files.try_emplace(environment_file(from), from);
    if (!is_new && known->second != from)
      throw InputError(fmt::format("{} and {}: two environments of one name; rename one", known->second, from));
  }
}

void add_shapes(const DatasetConfig& config, const DatasetConfig::Side& side, Manifest::Role role, DatasetPlan& plan) {
  const auto add = [&](const std::string& name, auto mesh, const std::string& from) {
    plan.manifest.shapes.push_back({name, role, "shapes/" + name + ".exr", mesh});
    plan.mesh_files.push_back(from);
  };
  for (const std::string& shape : side.shapes) {
    const std::filesystem::path path(shape);
    if (!path.has_extension()) {
      add(shape, Manifest::NamedMesh{shape}, "");
      continue;
    }
    const std::string name = path.stem().string();
    add(name, Manifest::FileMesh{"shapes/" + name + ".ply"}, shape);
  }
  require_room(plan.manifest.shapes.size() + static_cast<std::size_t>(side.random_shapes));
  for (int i = 0; i < side.random_shapes; ++i) {
    // Test shapes are never training shapes: even and odd seeds.
    const std::uint64_t index = 2 * static_cast<std::uint64_t>(i) + (role == Manifest::Role::test ? 1 : 0);
    const std::uint64_t seed = (random_bits(config.seed, STREAM_SHAPE, 0) & ~std::uint64_t{0xffffffff}) + index;
    add(fmt::format("random_{}", seed), Manifest::RandomMesh{seed, side.triangles}, "");
  }
}

std::string hash_of(const DatasetConfig& config, const DatasetPlan& plan, const std::string& version,
                    const std::string& device) {
  std::uint64_t hash = fingerprint(to_json(config));
  hash = fingerprint(version, hash);
  hash = fingerprint(device, hash);
  for (const std::string& file : plan.mesh_files)
    if (!file.empty()) hash = fingerprint(read_file(file), hash);
  for (const auto& [name, file] : plan.environment_files) hash = fingerprint(read_file(file), hash);
  return fmt::format("{:016x}", hash);
}

}  // namespace

DatasetPlan plan_dataset(const DatasetConfig& config, const std::string& version, const std::string& device) {
  DatasetPlan plan;
  Manifest& set = plan.manifest;
  set.version = version;
  set.config = to_json(config);
  set.size = config.size;
  set.spp = config.spp;
  set.mm_per_unit = config.longest_side_mm;
  set.boundary = config.boundary;
  add_shapes(config, config.train, Manifest::Role::train, plan);
  const int train_shapes = static_cast<int>(set.shapes.size());
  add_shapes(config, config.test, Manifest::Role::test, plan);
  add_environments(config.train, plan);
  add_environments(config.test, plan);
  set.hash = hash_of(config, plan, version, device);

  Planner planner(config, set);
  const std::vector<int> train_lights = planner.lights(config.train), test_lights = planner.lights(config.test);
  const bool any_train_light = train_lights.empty(), random = config.train.random_shapes > 0;
  using Split = Manifest::Split;
  const auto add = [&](Split split, int shape, const std::vector<int>& lights, const DatasetConfig::Side& drawn,
                       int materials) {
    for (std::size_t l = 0; l < std::max<std::size_t>(1, lights.size()); ++l)
      for (int m = 0; m < materials; ++m) {
        const bool held_out = (random ? shape : m) % validation_share == validation_share - 1;
        planner.add_image(split == Split::train && held_out ? Split::validation : split, shape,
                          lights.empty() ? planner.drawn_light(drawn.azimuth_range) : lights[l]);
      }
  };
  // Where the training has suns from anywhere, only environments are unseen.
  std::vector<int> seen_lights, unseen_lights;
  for (const int light : test_lights)
    (any_train_light && !set.lights[static_cast<std::size_t>(light)].environment ? seen_lights : unseen_lights)
        .push_back(light);
  const bool any_unseen = !any_train_light || !unseen_lights.empty();
  for (int shape = 0; shape < static_cast<int>(set.shapes.size()); ++shape) {
    if (shape < train_shapes) {
      add(Split::train, shape, train_lights, config.train, config.train.materials);
      if (!random && any_unseen) add(Split::unseen_light, shape, unseen_lights, config.test, config.test.materials);
    } else {
      if (!any_train_light)
        add(Split::unseen_shape, shape, train_lights, config.train, config.test.materials);
      else if (!seen_lights.empty() || test_lights.empty())
        add(Split::unseen_shape, shape, seen_lights, config.test, config.test.materials);
      if (any_unseen) add(Split::unseen_both, shape, unseen_lights, config.test, config.test.materials);
    }
  }
  return plan;
}

}  // namespace itn
