#include "network/dataset/plan.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "itn/error.h"
#include "itn/file.h"
#include "network/dataset/dataset_scene.h"
#include "runtime/base/fingerprint.h"
#include "runtime/base/random.h"
#include "runtime/scene/shapes/named_shapes.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

enum Stream : std::uint64_t {
  STREAM_SHAPE,
  STREAM_SEED,
  STREAM_AZIMUTH,
  STREAM_MATERIAL,
  STREAM_LAMPS,
  STREAM_ZENITH,
  STREAM_ELEVATION,
  STREAM_CAMERA_AZIMUTH,
  STREAM_MATCHED,
  STREAM_ALPHA,
  STREAM_INT_IOR,
  STREAM_ROOM,
  STREAM_PICTURE,
};

double between(const std::array<double, 2>& range, double u) { return range[0] + u * (range[1] - range[0]); }

constexpr int validation_share = 10;  // one in so many

// Their names have six digits. Each shape has images: there are no more of those either.
constexpr std::size_t most_images = 1'000'000;

void require_room(std::size_t images) {
  if (images > most_images)
    throw InputError(fmt::format("the data set would have more than {} images; need fewer shapes, lights or materials",
                                 most_images));
}

// File of an environment in the set's folder.
std::string environment_file(const std::string& from) {
  return "environments/" + std::filesystem::path(from).stem().string() + ".exr";
}

class Planner {
 public:
  Planner(const DatasetConfig& config, Manifest& set) : config_(config), set_(set) {}

  // The side's suns, then its environments where they are not drawn from; none: each image's is drawn.
  std::vector<int> lights(const DatasetConfig::Side& side) {
    std::vector<int> result;
    for (const double azimuth : side.azimuths) result.push_back(add(sun(azimuth, config_.zenith)));
    if (side.pictures > 0) return result;
    for (const std::string& file : side.environments) {
      const Manifest::Environment environment{environment_file(file), config_.environment_scale};
      const std::shared_ptr<const Bitmap> picture = read_environment(file);
      for (const double azimuth : side.environment_azimuths) {
        const Vec3 direction = mean_direction(environment_light(picture, azimuth, environment.scale));
        result.push_back(add({azimuth, 0, direction, environment, {}}));
      }
    }
    return result;
  }
  // The next images' own, from the side's ranges.
  int drawn_light(const DatasetConfig::Side& side) {
    const double azimuth = draw(STREAM_AZIMUTH, side.azimuth_range);
    const double kind = draw(STREAM_LAMPS, {0, 1});
    if (kind < side.lamps) {
      const std::uint64_t room = random_bits(config_.seed, STREAM_ROOM, material_);
      const Vec3 direction = mean_direction(environment_light(lamp_room(room), azimuth, 1));
      return add({azimuth, 0, direction, {}, room});
    }
    if (kind < side.lamps + side.pictures) {
      const auto which = static_cast<std::size_t>(draw(STREAM_PICTURE, {0, double(side.environments.size())}));
      const std::string& file = side.environments[which];
      const auto [known, is_new] = unturned_.try_emplace(file);
      if (is_new) known->second = mean_direction(environment_light(read_environment(file), 0, 1));
      const Vec3 direction = transform_vector(rotate({0, 0, -1}, azimuth), known->second);
      return add({azimuth, 0, direction, Manifest::Environment{environment_file(file), config_.environment_scale}, {}});
    }
    const double zenith = side.zenith_range ? draw(STREAM_ZENITH, *side.zenith_range) : config_.zenith;
    return add(sun(azimuth, zenith));
  }

  // Adds the images of a material, with so many albedos.
  void add_images(Manifest::Split split, int shape, int light, int albedos) {
    require_room(set_.images.size() + static_cast<std::size_t>(albedos));
    Manifest::Image image;
    image.split = split;
    image.shape = shape;
    image.light = light;
    image.seed = random_bits(config_.seed, STREAM_SEED, material_);
    if (config_.cameras)
      image.camera = {draw(STREAM_ELEVATION, config_.cameras->elevation),
                      draw(STREAM_CAMERA_AZIMUTH, config_.cameras->azimuth)};
    if (const auto& drawn = config_.boundaries) {
      image.boundary.emplace();
      image.boundary->rough = draw(STREAM_MATCHED, {0, 1}) >= drawn->matched;
      if (image.boundary->rough) {
        image.boundary->alpha = draw(STREAM_ALPHA, drawn->alpha);
        image.boundary->int_ior = draw(STREAM_INT_IOR, drawn->int_ior);
      }
    }
    for (int k = 0; k < albedos; ++k) {
      image.file = fmt::format("images/{:06}.exr", set_.images.size());
      set_material(image, static_cast<double>(k) / albedos);
      set_.images.push_back(image);
    }
    ++material_;
  }

 private:
  // Draws a number for the next material.
  double draw(Stream stream, const std::array<double, 2>& range) const {
    return between(range, random_uniform(config_.seed, stream, material_));
  }

  // The next material, point i of the additive sequence of Roberts (2018) in D dimensions: 1/phi, 1/phi^2, ... with
  // phi^(D + 1) = phi + 1, shifted by the seed.
  template <std::size_t D>
  std::array<double, D> material_point() const {
    constexpr double phi = D == 3 ? 1.22074408460575947536 : 1.09698155779855981790;
    static_assert(D == 3 || D == 7);
    std::array<double, D> u{};
    for (std::size_t k = 0; k < D; ++k) {
      const double shift = random_uniform(config_.seed, STREAM_MATERIAL, k);
      u[k] = std::fmod(shift + static_cast<double>(material_) * std::pow(phi, -static_cast<double>(k + 1)), 1.0);
    }
    return u;
  }

  double sigma_t_at(double u) const {
    const auto& [low, high] = config_.sigma_t;
    return config_.linear_sigma_t ? low + u * (high - low) : low * std::pow(high / low, u);
  }

  // farther: of the albedo in its range, in shares of it, and from its end on from its beginning
  void set_material(Manifest::Image& image, double farther) const {
    const auto albedo_at = [&](double u) { return between(config_.albedo, std::fmod(u + farther, 1.0)); };
    if (!config_.in_colours) {
      const std::array<double, 3> u = material_point<3>();
      image.sigma_t = sigma_t_at(u[0]);
      image.albedo = albedo_at(u[1]);
      image.g = between(config_.g, u[2]);
      return;
    }
    const std::array<double, 7> u = material_point<7>();
    Manifest::Colours& colours = image.colours.emplace();
    for (std::size_t c = 0; c < 3; ++c) {
      colours.sigma_t[c] = sigma_t_at(u[c]);
      colours.albedo[c] = albedo_at(u[3 + c]);
    }
    image.sigma_t = (colours.sigma_t[0] + colours.sigma_t[1] + colours.sigma_t[2]) / 3;
    image.albedo = (colours.albedo[0] + colours.albedo[1] + colours.albedo[2]) / 3;
    image.g = between(config_.g, u[6]);
  }

  Manifest::Light sun(double azimuth, double zenith) const {
    return {azimuth, zenith, sun_direction(azimuth, zenith), {}, {}};
  }
  int add(const Manifest::Light& light) {
    set_.lights.push_back(light);
    return static_cast<int>(set_.lights.size()) - 1;
  }

  const DatasetConfig& config_;
  Manifest& set_;
  std::size_t material_ = 0;              // of the next images
  std::map<std::string, Vec3> unturned_;  // mean directions of pictures that are drawn, at azimuth 0
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
    plan.manifest.shapes.push_back({name, role, config.cameras ? "" : "shapes/" + name + ".exr", mesh});
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
  if (config.spp < 2)
    throw UsageError(fmt::format(
        "spp {}: images without standard errors, which nothing can be learnt from; need 2 or more", config.spp));
  DatasetPlan plan;
  Manifest& set = plan.manifest;
  set.version = version;
  set.config = to_json(config);
  set.size = config.size;
  set.spp = config.spp;
  set.mm_per_unit = config.longest_side_mm;
  set.boundary = config.boundary;
  set.in_colours = config.in_colours;
  set.cameras = config.cameras.has_value();
  set.flash = config.flash;
  set.linear_sigma_t = config.linear_sigma_t;
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
  // drawn: the side whose lights are drawn; side: that whose materials
  const auto add = [&](Split split, int shape, const std::vector<int>& lights, const DatasetConfig::Side& drawn,
                       const DatasetConfig::Side& side) {
    for (std::size_t l = 0; l < std::max<std::size_t>(1, lights.size()); ++l)
      for (int m = 0; m < side.materials; ++m) {
        const bool held_out = (random ? shape : m) % validation_share == validation_share - 1;
        planner.add_images(split == Split::train && held_out ? Split::validation : split, shape,
                           lights.empty() ? planner.drawn_light(drawn) : lights[l], side.albedos);
      }
  };
  // Only environments count as unseen where training has suns from anywhere.
  std::vector<int> seen_lights, unseen_lights;
  for (const int light : test_lights)
    (any_train_light && !set.lights[static_cast<std::size_t>(light)].environment ? seen_lights : unseen_lights)
        .push_back(light);
  const bool any_unseen = !any_train_light || !unseen_lights.empty();
  for (int shape = 0; shape < static_cast<int>(set.shapes.size()); ++shape) {
    if (shape < train_shapes) {
      add(Split::train, shape, train_lights, config.train, config.train);
      if (!random && any_unseen) add(Split::unseen_light, shape, unseen_lights, config.test, config.test);
    } else {
      if (!any_train_light)
        add(Split::unseen_shape, shape, train_lights, config.train, config.test);
      else if (!seen_lights.empty() || test_lights.empty())
        add(Split::unseen_shape, shape, seen_lights, config.test, config.test);
      if (any_unseen) add(Split::unseen_both, shape, unseen_lights, config.test, config.test);
    }
  }
  return plan;
}

}  // namespace itn
