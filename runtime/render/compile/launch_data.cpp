#include "runtime/render/compile/launch_data.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "itn/colour.h"
#include "itn/error.h"
#include "kernels/model/models.h"
#include "kernels/model/texture/list.h"
#include "kernels/shared/baseline_layout.h"
#include "kernels/shared/path_state.h"
#include "runtime/render/compile/camera.h"
#include "runtime/render/compile/environment.h"
#include "runtime/render/compile/field.h"
#include "runtime/render/compile/light.h"
#include "runtime/render/compile/light_reach.h"
#include "runtime/render/compile/surfaces.h"
#include "runtime/scene/model/mixture.h"

namespace itn {
namespace {

// A number whose channels are no colour.
bool is_direction(const DeclaredNumber& number) { return number.role == ROLE_NORMAL || number.role == ROLE_BUMP; }

void append_bitmap(const Texture& texture, TextureRecord& r, LaunchData& data) {
  const Bitmap& bitmap = *texture.bitmap;
  const auto [known, is_new] = data.texels_of.try_emplace(&bitmap, static_cast<int>(data.texels.size()));
  r.offset = known->second;
  r.width = bitmap.width;
  r.height = bitmap.height;
  r.wrap = texture.wrap == Texture::Wrap::repeat   ? TEXTURE_REPEAT
           : texture.wrap == Texture::Wrap::mirror ? TEXTURE_MIRROR
                                                   : TEXTURE_CLAMP;
  r.nearest = texture.nearest;
  const std::size_t pixels = static_cast<std::size_t>(bitmap.width) * static_cast<std::size_t>(bitmap.height);
  const std::size_t channels = static_cast<std::size_t>(bitmap.channels);
  for (std::size_t i = 0; is_new && i < pixels; ++i)
    for (std::size_t c = 0; c < 3; ++c) data.texels.push_back(bitmap.data[i * channels + std::min(c, channels - 1)]);
}

// Returns its index. model: that of the number for which it stands
int append_texture(const Texture& texture, const Model& model, const DeclaredNumber& number, LaunchData& data) {
  TextureRecord r{};
  r.kind = texture.model->id;
  for (std::size_t k = 0; k < 6; ++k) r.to_uv[k] = static_cast<float>(texture.to_uv[k]);
  r.numbers = model.number_slots;
  r.gradient = -1;
  if (!texture.attribute.empty()) data.attributes.emplace_back(data.textures.size(), &texture);
  if (texture.bitmap) {
    append_bitmap(texture, r, data);
    data.coloured |= texture.bitmap->channels > 1 && !is_direction(number);
  }
  if (texture.volume) {
    append_shown_volume(*texture.volume, r, data);
    data.coloured |= texture.volume->grid->channels > 1;
  }
  for (const Rgb& colour : texture.colours) data.coloured |= !grey(colour);
  data.textures.push_back(r);
  return static_cast<int>(data.textures.size()) - 1;
}

// Room in the array of numbers for those of a model; returns where it begins.
int append_numbers(const Model& model, int variant, const std::vector<double>& slots, LaunchData& data) {
  const std::vector<double> n = model.to_numbers(variant, slots);
  const int first = static_cast<int>(data.numbers.size());
  for (const double number : n) data.numbers.push_back(static_cast<float>(number));
  if (n.empty()) data.numbers.push_back(0);  // each has a place of its own
  data.number_textures.resize(data.numbers.size(), -1);
  return first;
}

// A texture takes the place of the number that its parameter is called after; behind the numbers come sets of them with
// the textures' colours (TextureRecord).
void append_textures(const Instance& instance, int first, LaunchData& data) {
  const Model& model = *instance.model;
  std::size_t sets = 0;
  for (const Texture& texture : instance.values) sets = std::max(sets, texture.colours.size());
  const auto room = sets * static_cast<std::size_t>(model.number_slots);
  data.numbers.resize(data.numbers.size() + room);
  data.number_textures.resize(data.numbers.size(), -1);
  for (std::size_t i = 0; i < instance.values.size(); ++i) {
    const Texture& texture = instance.values[i];
    if (texture.is_constant()) continue;
    const DeclaredNumber& number = model.number_called(model.parameters[i].name);
    const int index = append_texture(texture, model, number, data);
    if (number.slot + number.channels > TEXTURED_SLOTS && !model.structure)
      throw std::logic_error("model " + model.name + ": " + number.name + " must be declared earlier to be textured");
    data.number_textures[static_cast<std::size_t>(first + number.slot)] = index;
    data.textured.insert({model.id, number.slot});
    for (std::size_t k = 0; k < texture.colours.size(); ++k) {
      const std::vector<double> n = model.to_numbers(instance.variant, instance.showing(i, k).slots());
      for (int slot = number.slot; slot < number.slot + number.channels; ++slot)
        data.numbers[static_cast<std::size_t>(first + model.place_of_colour(slot, static_cast<int>(k) + 1))] =
            static_cast<float>(n[static_cast<std::size_t>(slot)]);
    }
  }
}

// Numbers that name a measured table become its index among those of the launch.
void append_measured(const Bsdf& bsdf, int first, LaunchData& data) {
  for (std::size_t i = 0; i < bsdf.values.size(); ++i) {
    if (bsdf.model->parameters[i].kind.reader != ParameterKind::Reader::measured_table) continue;
    const MeasuredBrdf* table = bsdf.values[i].measured.get();
    if (!table) throw std::logic_error("a measured BSDF without its table");
    const auto [known, is_new] = data.measured_of.try_emplace(table, static_cast<int>(data.measured_of.size()));
    if (is_new) data.measured.insert(data.measured.end(), table->values.begin(), table->values.end());
    const DeclaredNumber& number = bsdf.model->number_called(bsdf.model->parameters[i].name);
    data.numbers[static_cast<std::size_t>(first + number.slot)] = static_cast<float>(known->second);
    data.coloured = true;
  }
}

BsdfRecord bsdf_record(const Bsdf& bsdf, LaunchData& data) {
  BsdfRecord r{};
  r.first_cell = data.cells;
  if (!bsdf.model) return r;
  for (std::size_t i = 0; i < bsdf.values.size(); ++i)
    data.coloured |= bsdf.model->parameters[i].kind.channels == 3 &&
                     bsdf.model->parameters[i].kind.reader != ParameterKind::Reader::normals &&
                     bsdf.values[i].is_constant() && !grey(bsdf.values[i].value);
  r.surface = surface_number(*bsdf.model, bsdf.variant);
  if (bsdf.model->structure) data.structures[r.surface] = bsdf.model;
  r.twosided = bsdf.twosided ? -1 : 0;
  r.first_number = append_numbers(*bsdf.model, bsdf.variant, bsdf.slots(), data);
  append_textures(bsdf, r.first_number, data);
  append_measured(bsdf, r.first_number, data);
  if (bsdf.model->traits & BSDF_BASELINE) data.cells += BASELINE_BOUNDARY_CELLS;
  return r;
}

// The boundary that light connections out of a medium assume: a rough one around it, of facets with `alpha` and `eta`.
bool is_rough_boundary(const Bsdf& bsdf) {
  constexpr int others = BSDF_SMOOTH | BSDF_PARTLY_SMOOTH | BSDF_THIN | BSDF_BROAD | BSDF_STRUCTURE;
  return bsdf.model && (bsdf.model->traits & (BSDF_TRANSMITS | others)) == BSDF_TRANSMITS;
}

// Appends the values of an attribute that a texture refers to: those at the corners of each triangle.
void append_attribute(const Mesh& mesh, const MeshAttribute& attribute, double scale, LaunchData& data) {
  for (std::size_t i = 0; i < mesh.triangle.size(); ++i)
    for (const std::uint32_t corner : mesh.triangle[i]) {
      const std::size_t row = attribute.is_of_faces() ? i : corner;
      for (std::size_t c = 0; c < 3; ++c)
        data.texels.push_back(static_cast<float>(
            scale *
            static_cast<double>(attribute.values[row * attribute.channels + std::min(c, attribute.channels - 1)])));
    }
  data.coloured |= attribute.channels > 1;
}

// Appends a table of places for each texture that refers to an attribute (model/texture/mesh_attribute.h). Loaded
// meshes have no triangle without an area, so that each has a primitive.
void append_attributes(const Scene& scene, const JobRecord& job, LaunchData& data) {
  const auto& primitives = data.geometry.primitives;
  for (const auto& [index, texture] : data.attributes) {
    const std::size_t table = data.texels.size();
    data.textures[index].offset = static_cast<int>(table);
    data.textures[index].width = static_cast<int>(scene.shapes.size());
    data.texels.resize(table + scene.shapes.size());
    std::size_t first = data.geometry.records[static_cast<std::size_t>(job.geometry)].first_primitive;
    for (std::size_t k = 0; k < scene.shapes.size(); ++k) {
      const Mesh* mesh = scene.shapes[k].mesh.get();
      const MeshAttribute* attribute = mesh ? mesh->attribute(texture->attribute) : nullptr;
      if (attribute) {
        const auto place = static_cast<std::int64_t>(data.texels.size()) - 9 * static_cast<std::int64_t>(first);
        if (data.texels.size() + 9 * mesh->triangle.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
          throw InputError("the attributes of the scene's meshes need more than 2^31 numbers; need smaller meshes");
        data.texels[table + k] = std::bit_cast<float>(static_cast<std::int32_t>(place));
        append_attribute(*mesh, *attribute, texture->scale, data);
      }
      while (first < primitives.size() && primitives[first].shape == static_cast<int>(k)) ++first;
    }
  }
  data.attributes.clear();
}

// Greatest sigma_t of all channels; with a grid: the factor of its values.
double greatest_extinction(const Medium& medium) {
  const std::vector<double> n = medium.model->to_numbers(medium.variant, medium.slots());
  const DeclaredNumber& sigma_t = medium.model->number_called("sigma_t");
  const auto first = n.begin() + sigma_t.slot;
  return *std::max_element(first, first + sigma_t.channels);
}

MediumRecord medium_record(const Scene& scene, int index, LaunchData& data) {
  const Medium& medium = scene.media[static_cast<std::size_t>(index)];
  MediumRecord r{};
  r.model = medium.model->id;
  r.first_number = append_numbers(*medium.model, medium.variant, medium.slots(), data);
  r.phase = medium.phase.model->id;
  r.sample_emitters = medium.sample_emitters;
  data.phases[r.phase] = medium.phase.model;
  r.first_phase_number = append_numbers(*medium.phase.model, medium.phase.variant, medium.phase.slots(), data);
  for (const Shape& shape : scene.shapes) {
    const Bsdf& bsdf = scene.bsdfs[static_cast<std::size_t>(shape.bsdf)];
    const bool passes = !bsdf.model || (bsdf.model->traits & BSDF_PASSES);
    if (passes && (shape.interior == index || shape.exterior == index)) r.connection = CONNECTION_STRAIGHT;
    if (is_rough_boundary(bsdf) && shape.interior == index && r.connection == CONNECTION_NONE) {
      const std::vector<double> n = bsdf.model->to_numbers(bsdf.variant, bsdf.slots());
      r.connection = CONNECTION_REFRACTED;
      r.distribution = bsdf.variant;
      const auto number = [&](const char* name) {
        return n[static_cast<std::size_t>(bsdf.model->number_called(name).slot)];
      };
      const bool anisotropic = (bsdf.model->traits & BSDF_ANISOTROPIC) != 0;
      r.alpha = static_cast<float>(anisotropic ? std::sqrt(number("alpha_u") * number("alpha_v")) : number("alpha"));
      r.eta = static_cast<float>(number("eta"));
    }
  }
  r.first_cell = data.cells;
  data.cells += BASELINE_MEDIUM_CELLS;
  r.field = r.albedo_field = -1;
  const double density = greatest_extinction(medium);
  for (std::size_t i = 0; i < medium.values.size(); ++i) {
    const Texture& value = medium.values[i];
    const bool coloured_grid = value.is_grid() && value.volume->grid->channels == 3;
    const ParameterKind& kind = medium.model->parameters[i].kind;
    const bool extinction = kind.field == std::string("sigma_t");
    if (value.is_grid() || (value.volume && extinction))
      (extinction ? r.field : r.albedo_field) = append_field(*value.volume, extinction ? density : 0, data);
    if (extinction) data.coloured_field |= coloured_grid;
    if (grey(value.value) && !coloured_grid) continue;
    data.coloured = true;
    data.spectral |= kind.quantity == Quantity::unbounded;  // a coefficient, not an albedo
  }
  r.first_phase_field = static_cast<int>(data.fields.size());
  for (std::size_t i = 0; i < medium.phase.values.size(); ++i) {
    if (!medium.phase.values[i].is_grid()) continue;
    const int field = append_field(*medium.phase.values[i].volume, 0, data);
    data.fields[static_cast<std::size_t>(field)].slot = number_of_grid(medium.phase, i).slot;
    ++r.phase_fields;
  }
  return r;
}

int append_record(const EnvironmentRecord& record, LaunchData& data) {
  data.environments.push_back(record);
  return static_cast<int>(data.environments.size()) - 1;
}

int append_light(const Environment& light, LaunchData& data) {
  const bool shared = light.bitmap && !light.sampled_as;
  const auto key = std::tuple(light.bitmap.get(), light.slots(), light.to_world.m);
  if (shared && data.environment_of.count(key)) return data.environment_of[key];
  EnvironmentRecord record;
  append_environment(light, record, data.light_tables);
  data.coloured_light |= is_uneven(record) || !std::all_of(light.values.begin(), light.values.end(),
                                                           [](const Texture& of) { return grey(of.value); });
  const int index = append_record(record, data);
  if (shared) data.environment_of[key] = index;
  return index;
}

// Distance in front of a shape that shines at which connections with it end: beyond the tolerance in which rays meet
// surfaces, and beyond the offset with which they begin beside other surfaces.
double distance_in_front(const Geometry& geometry, const GeometryRecord& record) {
  float offset = 0;
  for (std::size_t i = record.first_primitive; i < geometry.primitives.size(); ++i)
    offset = std::max(offset, geometry.primitives[i].offset);
  return 4 * static_cast<double>(offset);
}

// A light of the scene, as it is sampled. surfaces: of one that is a shape.
struct SampledLight {
  const Light* light;
  std::optional<LightSurfaces> surfaces;

  double brings(const Vec3& low, const Vec3& high, int steps) const {
    return expected_irradiance(*light, surfaces ? &*surfaces : nullptr, low, high, steps);
  }
};

// The grid in which chances of lights stand: about the box, so that its planes go through none of the places that
// people build from, and coarse where the lights are many. One light needs none.
void lay_light_grid(const Vec3& low, const Vec3& high, std::size_t lights, JobRecord& job) {
  const std::size_t most = lights < 2 ? 1 : std::clamp<std::size_t>((1 << 16) / lights, 1, 512);
  const double longest = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  Vec3 size{};
  for (std::size_t k = 0; k < 3; ++k) {
    size[k] = 1.0837 * std::max(high[k] - low[k], 1e-3 * longest);
    job.light_low[k] = static_cast<float>((low[k] + high[k]) / 2 - 0.5137 * size[k]);
    job.light_cells[k] = 1;
  }
  if (most == 1) return;
  const auto cells = [&](double edge) {
    std::size_t product = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      job.light_cells[k] = std::max(1, static_cast<int>(size[k] / edge));
      job.light_cells_a_unit[k] = static_cast<float>(job.light_cells[k] / size[k]);
      product *= static_cast<std::size_t>(job.light_cells[k]);
    }
    return product;
  };
  double edge = std::cbrt(size[0] * size[1] * size[2] / static_cast<double>(most));
  while (cells(edge) > most) edge *= 1.05;
}

// Appends the probability of each light, by place (light_layout.h): by its expected irradiance there with weight .8,
// else uniform, since the expectation is only a guess.
void append_light_chances(const std::vector<SampledLight>& lights, JobRecord& job, LaunchData& data) {
  constexpr double by_guess = 0.8;
  job.light_chances = static_cast<int>(data.light_tables.size());
  std::vector<double> expected(lights.size(), 1.0);
  if (lights.size() == 1) return append_cumulative(expected.data(), 1, data.light_tables);
  Vec3 low{}, high{};
  const auto side = [&](std::size_t k, int at) {
    const double cell = job.light_cells[k] > 1 ? 1 / static_cast<double>(job.light_cells_a_unit[k]) : 0;
    low[k] = static_cast<double>(job.light_low[k]) + at * cell;
    high[k] = low[k] + cell;
  };
  for (int x = 0; x < job.light_cells[0]; ++x)
    for (int y = 0; y < job.light_cells[1]; ++y)
      for (int z = 0; z < job.light_cells[2]; ++z) {
        side(0, x);
        side(1, y);
        side(2, z);
        for (std::size_t i = 0; i < lights.size(); ++i) expected[i] = lights[i].brings(low, high, 2);
        const double sum = std::accumulate(expected.begin(), expected.end(), 0.0);
        for (double& e : expected)
          e = (1 - by_guess) / static_cast<double>(lights.size()) + (sum > 0 ? by_guess * e / sum : 0);
        append_cumulative(expected.data(), expected.size(), data.light_tables);
      }
}

// Lights by themselves, then each shape that shines.
void append_lights(const Scene& scene, JobRecord& job, LaunchData& data) {
  std::vector<int>& numbers = data.scenes.back().light_numbers;
  const GeometryRecord& geometry = data.geometry.records[static_cast<std::size_t>(job.geometry)];
  const double in_front = scene.lights.empty() ? 0 : distance_in_front(data.geometry, geometry);
  for (const Light& light : scene.lights) {
    numbers.push_back(append_numbers(*light.model, light.variant, light.slots(), data));
    append_textures(light, numbers.back(), data);
    if (light.model->traits & LIGHT_BEAM)  // ends its connections in front of its shape, as one that shines itself
      data.numbers[static_cast<std::size_t>(numbers.back() + light.model->number_called("in_front").slot)] =
          static_cast<float>(in_front);
    const std::vector<double> n = light.model->to_numbers(light.variant, light.slots());
    for (std::size_t c = 0; c < (light.model->traits & LIGHT_TINTED ? 6U : 3U); c += 3)
      data.coloured_light |= !grey({n[c], n[c + 1], n[c + 2]});
  }
  job.first_light = static_cast<int>(data.lights.size());
  if (scene.lights.empty()) return;
  const auto vector = [](const float v[3]) { return Vec3{v[0], v[1], v[2]}; };
  std::vector<SampledLight> sampled;
  const RefractingBodies bodies(scene);
  data.inner_lights |= bodies.has_panes();
  // shape: of a light that is one
  const auto append = [&](int index, const Shape* shape, std::optional<LightSurfaces> surfaces) {
    const auto i = static_cast<std::size_t>(index);
    const Light& light = scene.lights[i];
    LightRecord r{};
    r.reach = bodies.reach(light, shape, surfaces ? &*surfaces : nullptr);
    data.inner_lights |= r.reach == LIGHT_INSIDE;
    r.model = light.model->id;
    r.first_number = numbers[i];
    if (surfaces) {
      r.table = static_cast<int>(data.light_tables.size());
      r.surfaces = surfaces->count;
      r.inverse_area = static_cast<float>(1 / surfaces->area);
      data.light_tables.insert(data.light_tables.end(), surfaces->table.begin(), surfaces->table.end());
    }
    data.lights.push_back(r);
    const Light& like = scene.lights_sampled_as.empty() ? light : scene.lights_sampled_as[i];
    sampled.push_back({&like, std::move(surfaces)});
  };
  for (std::size_t i = 0; i < scene.lights.size(); ++i)
    if (!(scene.lights[i].model->traits & LIGHT_ON_SHAPE)) append(static_cast<int>(i), nullptr, std::nullopt);
  std::size_t primitive = geometry.first_primitive;  // of the shape, within the launch. As of attributes, each has one.
  for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
    if (scene.shapes[i].light < 0) continue;
    const auto& primitives = data.geometry.primitives;
    while (primitive < primitives.size() && primitives[primitive].shape < static_cast<int>(i)) ++primitive;
    data.shapes[static_cast<std::size_t>(job.first_shape) + i].light = static_cast<int>(data.lights.size());
    append(scene.shapes[i].light, &scene.shapes[i],
           light_surfaces(scene.shapes[i], in_front, static_cast<int>(primitive)));
  }
  job.lights = static_cast<int>(sampled.size());
  const Vec3 low = vector(geometry.low), high = vector(geometry.high);
  lay_light_grid(low, high, sampled.size(), job);
  append_light_chances(sampled, job, data);
  job.light_share = 1;
  const EnvironmentRecord& around = data.environments[static_cast<std::size_t>(job.environment)];
  const double rest = is_uneven(around) ? static_cast<double>(around.sun_weight + around.sky_weight) : 0;
  if (!(rest > 0)) return;
  double sum = 0;
  for (const SampledLight& light : sampled) sum += light.brings(low, high, 3);
  job.light_share = static_cast<float>(std::clamp(sum / (sum + rest), 0.1, 0.9));
}

// Do flights change positions of single precision? Paths in media too dense for it stay where they are.
bool flights_move(const Scene& scene, const GeometryRecord& geometry) {
  double extent = 0, densest = 0;
  for (int k = 0; k < 3; ++k)
    extent = std::max({extent, std::abs(double(geometry.low[k])), std::abs(double(geometry.high[k]))});
  for (const Medium& medium : scene.media) densest = std::max(densest, greatest_extinction(medium));
  return densest * extent * std::numeric_limits<float>::epsilon() < 1;
}

}  // namespace

JobRecord append_scene(const Scene& scene, int sensor, int geometry, LaunchData& data) {
  JobRecord job{};
  job.pixel_step = 1;
  job.geometry = geometry;
  const int first_medium = static_cast<int>(data.media.size()), first_bsdf = static_cast<int>(data.bsdfs.size());
  job.first_shape = static_cast<int>(data.shapes.size());
  job.first_number = static_cast<int>(data.numbers.size());
  data.scenes.push_back({job.first_number, first_medium, first_bsdf, {}});
  const auto medium_index = [&](int medium) { return medium < 0 ? -1 : first_medium + medium; };
  for (int m = 0; m < static_cast<int>(scene.media.size()); ++m) data.media.push_back(medium_record(scene, m, data));
  for (const Bsdf& bsdf : scene.bsdfs) data.bsdfs.push_back(bsdf_record(bsdf, data));
  for (const Shape& shape : scene.shapes)
    data.shapes.push_back({first_bsdf + shape.bsdf, medium_index(shape.interior), medium_index(shape.exterior),
                           shape.sends_beam ? -2 : -1});

  job.camera = static_cast<int>(data.cameras.size());
  const Sensor& camera = scene.sensors[static_cast<std::size_t>(sensor)];
  const GeometryRecord& shapes = data.geometry.records[static_cast<std::size_t>(job.geometry)];
  // Only such a sensor asks, and it goes through all surfaces.
  const double in_front = camera.zone ? distance_in_front(data.geometry, shapes) : 0;
  data.cameras.push_back(camera_record(scene, camera, shapes, in_front, first_medium, data));
  see_to_the_end(shapes, data.cameras.back());
  data.pixels.push_back(camera.crop_width * camera.crop_height);

  job.environment = scene.environment ? append_light(*scene.environment, data) : append_record({}, data);

  append_lights(scene, job, data);
  append_attributes(scene, job, data);

  job.max_depth = scene.integrator.max_depth;
  job.is_endless = job.max_depth < 0;
  job.is_stuck = job.is_endless && !flights_move(scene, data.geometry.records[static_cast<std::size_t>(job.geometry)]);
  if (job.is_endless) job.max_depth = job.is_stuck ? STUCK_DEPTH : MOST_DEPTH;
  job.rr_depth = scene.integrator.rr_depth;
  job.hide_emitters = scene.integrator.hide_emitters;
  data.hidden_lights |=
      scene.integrator.hide_emitters && std::any_of(scene.shapes.begin(), scene.shapes.end(),
                                                    [](const Shape& s) { return s.light >= 0 || s.sends_beam; });
  std::fill_n(job.future_tint, 3, 1.0F);
  return job;
}

JobRecord append_scene(const Scene& scene, int sensor, LaunchData& data) {
  append_geometry(scene, data.geometry);
  return append_scene(scene, sensor, static_cast<int>(data.geometry.records.size()) - 1, data);
}

void clear_scenes(LaunchData& data) {
  LaunchData cleared;
  cleared.geometry = std::move(data.geometry);
  data = std::move(cleared);
}

namespace {

constexpr float least_concentration = 4;  // of a picture whose bright regions are sampled through rough boundaries

// Slots for the numbers of any model that the data has, and one behind them.
int most_slots(const LaunchData& data) {
  int most = 0;
  const ModelsOfLaunch models = models_of(data);
  for (const auto& family : {models.bsdfs, models.structures, models.media, models.phases, models.lights})
    for (const Model* model : family) most = std::max(most, model->number_slots);
  return most + origin_words(data);
}

}  // namespace

std::map<std::string, std::string> feature_definitions(const LaunchData& data) {
  std::map<std::string, std::string> d = environment_definitions(data.environments);
  const auto set = [&](const char* name, bool value) { d[name] = std::to_string(value); };
  const std::vector<SurfaceKind> surfaces = surfaces_of(data);
  // Is there a BSDF that has of the traits in `mask` just these?
  const auto has = [&](int mask, int traits) {
    return std::any_of(surfaces.begin(), surfaces.end(),
                       [&](const SurfaceKind& s) { return (s.model->traits & mask) == traits; });
  };
  const bool null = std::any_of(data.bsdfs.begin(), data.bsdfs.end(),
                                [](const BsdfRecord& bsdf) { return bsdf.surface == SURFACE_NULL; });
  const bool rough = has(BSDF_TRANSMITS | BSDF_SMOOTH, BSDF_TRANSMITS);
  const bool reflecting = has(BSDF_TRANSMITS | BSDF_SMOOTH, 0);
  bool matched = false, refracted = false;
  for (const MediumRecord& medium : data.media) {
    matched |= medium.connection == CONNECTION_STRAIGHT;
    refracted |= medium.connection == CONNECTION_REFRACTED;
  }
  bool smooth = false, round = false;
  for (const PrimitiveRecord& primitive : data.geometry.primitives) {
    smooth |= (primitive.flags & PRIMITIVE_SMOOTH) != 0;
    round |= (primitive.flags & PRIMITIVE_ROUND) != 0;
  }
  const bool uneven_light = std::any_of(data.environments.begin(), data.environments.end(), is_uneven);
  set("HAS_NULL", null || data.hidden_lights);  // through hidden ones paths go straight on
  set("HAS_HIDDEN_LIGHTS", data.hidden_lights);
  set("HAS_UNLIT_MEDIA", std::any_of(data.media.begin(), data.media.end(),
                                     [](const MediumRecord& medium) { return medium.sample_emitters == 0; }));
  set("HAS_FAR_CLIP", std::any_of(data.cameras.begin(), data.cameras.end(), [](const CameraRecord& c) {
        return std::any_of(c.clip, c.clip + 3, [](float x) { return x != 0; });
      }));
  set("HAS_FILM_EDGES",
      std::any_of(data.cameras.begin(), data.cameras.end(), [](const CameraRecord& c) { return c.filter_reach > 0; }));
  set("HAS_PASSAGES", has(BSDF_PASSES, BSDF_PASSES));
  set("HAS_MEDIUM", !data.media.empty());
  set("HAS_FIELDS", !data.fields.empty());
  set("PACKED_FIELDS", std::any_of(data.fields.begin(), data.fields.end(),
                                   [](const FieldRecord& field) { return field.first_brick >= 0; }));
  int phase_fields = 0;
  for (const MediumRecord& medium : data.media) phase_fields = std::max(phase_fields, medium.phase_fields);
  d["PHASE_FIELDS"] = std::to_string(phase_fields);
  set("VOXEL_SUMS", false);
  d["FIELD_CHANNELS"] = data.coloured_field ? "3" : "1";
  set("HAS_TEXTURE", !data.textures.empty());
  set("HAS_ATTRIBUTES", std::any_of(data.textures.begin(), data.textures.end(),
                                    [](const TextureRecord& t) { return texture_has(t.kind, TEXTURE_ON_MESH); }));
  set("HAS_VOLUME_TEXTURES", std::any_of(data.textures.begin(), data.textures.end(),
                                         [](const TextureRecord& t) { return texture_has(t.kind, TEXTURE_IN_SPACE); }));
  set("HAS_SMOOTH", smooth);
  set("HAS_ROUND", round || data.round_zone);
  set("HAS_LENS", std::any_of(data.cameras.begin(), data.cameras.end(), [](const CameraRecord& c) {
        return std::any_of(c.lens_a, c.lens_a + 3, [](float x) { return x != 0; });
      }));
  set("HAS_DISTORTION",
      std::any_of(data.cameras.begin(), data.cameras.end(), [](const CameraRecord& c) { return c.slope_a != 0; }));
  set("HAS_ZONE",
      std::any_of(data.cameras.begin(), data.cameras.end(), [](const CameraRecord& c) { return c.surfaces > 0; }));
  set("SPECTRAL", data.spectral);
  const bool sun = std::any_of(data.environments.begin(), data.environments.end(),
                               [](const EnvironmentRecord& e) { return e.sun_pdf > 0; });
  // Bright regions of a picture, through rough boundaries: without a sun, beside which only the sun is sampled.
  const bool peaks =
      !sun && std::any_of(data.environments.begin(), data.environments.end(),
                          [](const EnvironmentRecord& e) { return e.concentration > least_concentration; });
  const bool lights = !data.lights.empty();
  const bool rough_light = ((sun || peaks || lights) && rough) || (uneven_light && has(BSDF_BROAD, BSDF_BROAD));
  const auto lights_of_launch = models_of(data).lights;
  const auto aimed_at = [&](bool shapes) {
    return rough && refracted && std::any_of(data.lights.begin(), data.lights.end(), [&](const LightRecord& light) {
             return light.reach == LIGHT_AIMED_AT && (!shapes || light.surfaces > 0);
           });
  };
  const bool aimed = aimed_at(false);
  const bool metered =
      std::any_of(data.cameras.begin(), data.cameras.end(), [](const CameraRecord& c) { return c.measures != 0; }) &&
      std::any_of(data.lights.begin(), data.lights.end(), [](const LightRecord& light) { return light.surfaces == 0; });
  const bool medium_light = ((uneven_light || lights) && matched) || ((sun || peaks || aimed) && refracted) ||
                            (data.inner_lights && !data.media.empty());
  set("HAS_LIGHTS", lights);
  set("HAS_AREA_LIGHTS",
      std::any_of(data.shapes.begin(), data.shapes.end(), [](const ShapeRecord& s) { return s.light >= 0; }));
  set("HAS_AIMED_LIGHTS", aimed);
  set("HAS_AIMED_SHAPES", aimed_at(true));
  set("HAS_INNER_LIGHTS", data.inner_lights);
  set("HAS_PEAKS", peaks);
  set("HAS_SCREENS", std::any_of(lights_of_launch.begin(), lights_of_launch.end(), [](const Model* m) {
        return (m->traits & LIGHT_ON_SHAPE) != 0 && (m->traits & LIGHT_TINTED) != 0;
      }));
  set("ROUGH_LIGHT_SAMPLING", rough_light);
  set("MEDIUM_LIGHT_SAMPLING", medium_light);
  set("LIGHT_SAMPLING", medium_light || rough_light || metered || ((uneven_light || lights) && reflecting));
  set("HAS_METERED_LIGHTS", metered);
  d["MOST_SLOTS"] = std::to_string(most_slots(data));
  d["THROUGHPUT_CHANNELS"] = std::to_string(data.coloured ? 3 : 1);
  d["RADIANCE_CHANNELS"] = std::to_string(data.coloured || data.coloured_light ? 3 : 1);
  return d;
}

}  // namespace itn
