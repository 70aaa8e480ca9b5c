#include "runtime/render/compile/derivative_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "itn/colour.h"
#include "itn/error.h"
#include "itn/parameters.h"
#include "kernels/model/models.h"
#include "kernels/shared/knee.h"
#include "runtime/render/compile/environment.h"
#include "runtime/scene/model/mixture.h"
#include "runtime/scene/model/phase_formula.h"

namespace itn {
namespace {

// The functions of kernels/model whose scores an instance of a model adds up, and those of its decisions.
struct Functions {
  std::vector<std::string> factors, decisions;
};

Functions functions_of(const Model& model, Owner owner, int variant) {
  if (owner == Owner::phase) return {{score_function(model).name}, {}};
  if (owner == Owner::medium) return {{"score_" + model.name + "_scattering", "score_" + model.name + "_passage"}, {}};
  if (model.structure)
    return {{score_function(*model.structure, false).name, score_function(*model.structure, true).name}, {}};
  const std::string name = fmt::format("score_{}_{}", model.name, variant);
  return {{name, name + "_chosen"}, {name + "_decision"}};
}

// Do the scores by a colour number not depend on other colours, so that one serves all channels where it is grey?
bool stands_alone(const ScoreFunction& function, const Model& model, const DeclaredNumber& number) {
  for (const std::string& input : function.inputs_of(number.slot, 0))
    for (const DeclaredNumber& other : model.numbers) {
      if (other.channels == 1 || other.slot == number.slot) continue;
      for (int c = 0; c < other.channels; ++c)
        if (input == fmt::format("n[{}]", other.slot + c)) return false;
    }
  return true;
}

class Builder {
 public:
  Builder(const Scene& scene, const JobRecord& job, LaunchData& launch) : scene_(scene), job_(job), launch_(launch) {}

  // image: which derivative this is
  void add(const Parameter& p, int image) {
    if (p.owner == Owner::environment) return add_environment(p, image);
    launch_.coloured_light |= p.component >= 0;  // where all components are equal, the derivatives are not
    for (const int index : p.indices)
      if (p.by_texels && p.owner == Owner::light)
        add_picture(p, index, image);
      else if (p.by_texels)
        add_texels(p, index, image);
      else if (p.by_voxels)
        add_voxels(p, index, image);
      else if (p.owner == Owner::texture)
        add_textures(p, index, image);
      else if (p.owner == Owner::light)
        add_light(p, index, image);
      else
        add_number(p, index, image);
  }

  // The scores that tell what paths gather with so many other albedos of the first medium.
  void add_albedos(int count) {
    data_.albedos = count;
    const Place place = place_of(Owner::medium, 0);
    for (int c = 0; c < 3; ++c)
      data_.albedo_score[static_cast<std::size_t>(c)] =
          score(Owner::medium, place, place.model->number_called("albedo"), c);
  }

  // A sum that is by texels, too, is so for all surfaces of its model.
  DerivativeData take() {
    for (const NumberOfPart& by : data_.numbers)
      for (NumberOfPart& part : data_.numbers)
        if (by.texels >= 0 && part.model == by.model && part.slot == by.slot && part.origin == by.origin)
          part.texels = by.texels;
    return std::move(data_);
  }

 private:
  // A model of the scene, and where its numbers begin.
  struct Place {
    const Model* model;
    int variant, first;
    std::vector<double> slots, numbers;
    int origin = 0;              // as of ScoreRecord
    bool grey = false;           // all of its colours, everywhere on its surfaces
    bool coloured_grid = false;  // what a number is times differs between channels
  };

  // Radiance enters linearly: no path carries a score for it.
  void add_light_part(const DerivativeRecord& record, int image) {
    data_.derivatives.push_back(record);
    data_.parts.push_back({image, {-1, -1, -1}});
    data_.numbers.push_back({});
  }

  void add_light(const Parameter& p, int index, int image) {
    const Light& light = scene_.lights[static_cast<std::size_t>(index)];
    const auto by = light.model->jacobian(light.variant, light.slots());
    const DeclaredParameter& declared = light.model->parameter(p.member);
    DerivativeRecord record{{0, 0, 0}, -1, start().light_numbers[static_cast<std::size_t>(index)], {0, 0, 0}};
    for (std::size_t c = 0; c < 3; ++c)  // the colour is what the first numbers are
      if (p.component < 0 || p.component == static_cast<int>(c))
        record.colour[c] =
            static_cast<float>(by[c][static_cast<std::size_t>(declared.slot) + (declared.kind.channels == 3 ? c : 0)]);
    add_light_part(record, image);
  }

  void add_environment(const Parameter& p, int image) {
    DerivativeRecord record{{0, 0, 0}, static_cast<int>(launch_.environments.size()), -1, {0, 0, 0}};
    const EnvironmentRecord light = launch_.environments[static_cast<std::size_t>(job_.environment)];
    launch_.environments.push_back(environment_derivative(*scene_.environment, p, light, launch_.light_tables));
    if (const std::string formula = scene_.environment->model->formula; !formula.empty())
      data_.functions[formula] = {0};
    add_light_part(record, image);
    if (!p.by_texels) return;
    data_.by_environment = true;
    DifferentiatedTexture pixels;
    pixels.bitmap = scene_.environment->bitmap.get();
    pixels.set_shape(values_of(scene_, p));
    launch_.environments[static_cast<std::size_t>(job_.environment)].gradient = sums_of(std::move(pixels), image);
  }

  void add_number(const Parameter& p, int index, int image) {
    const Instance& own = instance(p.owner, index);
    const int slot = mean_cosine_slot(p.owner, index);
    for (const std::size_t i : own.values_called(p.id, p.member)) {
      add_instance(p, i, place_of(p.owner, index), image);
      if (slot < 0) continue;
      // The medium's numbers, too, depend on the mean cosine of its phase function.
      const auto of_phase = static_cast<std::size_t>(own.model->parameters[i].slot);
      const double speed = mean_cosine(*own.model, own.slots())[of_phase + 1];
      add_parts(p, Owner::medium, place_of(Owner::medium, index), image, {slot, 0, speed});
    }
  }

  // Slot of the mean cosine in the medium of this phase function; -1: none.
  int mean_cosine_slot(Owner owner, int index) const {
    return owner == Owner::phase ? scene_.media[static_cast<std::size_t>(index)].model->mean_cosine_slot() : -1;
  }

  // A colour of a texture, wherever the BSDF has it.
  void add_textures(const Parameter& p, int index, int image) {
    const Bsdf& bsdf = scene_.bsdfs[static_cast<std::size_t>(index)];
    for (std::size_t i = 0; i < bsdf.values.size(); ++i) {
      const Texture& texture = bsdf.values[i];
      for (std::size_t k = 0; texture.id == p.id && k < texture.colours.size(); ++k) {
        if (texture.model->colours[k].name != p.member) continue;
        Place place = place_of(Owner::bsdf, index);
        place.slots = bsdf.showing(i, k).slots();
        place.numbers = bsdf.model->to_numbers(bsdf.variant, place.slots);
        place.origin = static_cast<int>(k) + 1;
        add_instance(p, i, place, image);
      }
    }
  }

  // A texture of texels, wherever the BSDF has it.
  void add_texels(const Parameter& p, int index, int image) {
    const Bsdf& bsdf = scene_.bsdfs[static_cast<std::size_t>(index)];
    for (const std::size_t i : bsdf.values_called(p.id, p.member)) {
      const DeclaredNumber& number = bsdf.model->number_called(bsdf.model->parameters[i].name);
      const Place place = place_of(Owner::bsdf, index);
      PartRecord part{image, {-1, -1, -1}};
      for (int c = 0; c < 3; ++c) part.score[c] = score(p.owner, place, number, c);
      data_.derivatives.push_back({{1, 1, 1}, -1, -1, {0, 0, 0}});  // a texture is the number itself
      data_.parts.push_back(part);
      NumberOfPart by{bsdf.model, place.first, number.slot, number.channels == 3};
      by.texels = number.slot;
      by.heights = number.role == ROLE_BUMP;
      if (number.role == ROLE_BUMP || number.role == ROLE_NORMAL) {
        by.colour = false;
        by.components = by.heights ? 2 : 3;
        data_.by_directions = true;
      }
      if (by.heights) data_.functions["derivative_bumped_normal"] = {0};
      data_.numbers.push_back(by);
      sum_texels(p, bsdf.values[i], job_.first_number + place.first + number.slot, image);
    }
  }

  // The texture that tints a light.
  void add_picture(const Parameter& p, int index, int image) {
    const Light& light = scene_.lights[static_cast<std::size_t>(index)];
    const DeclaredNumber& number = light.model->number_called(p.member);
    const int first = start().light_numbers[static_cast<std::size_t>(index)];
    data_.derivatives.push_back({{1, 1, 1}, -1, -1, {0, 0, 0}});
    data_.parts.push_back({image, {-1, -1, -1}});
    NumberOfPart by{light.model, first - job_.first_number, number.slot, true};
    by.texels = number.slot;
    data_.numbers.push_back(by);
    data_.by_pictures = true;
    sum_texels(p, light.value(p.member), first + number.slot, image);
  }

  // number: in whose place the launch has the texture.
  void sum_texels(const Parameter& p, const Texture& shown, int number, int image) {
    const auto record = static_cast<std::size_t>(launch_.number_textures[static_cast<std::size_t>(number)]);
    DifferentiatedTexture texture;
    texture.bitmap = shown.bitmap.get();
    texture.set_shape(values_of(scene_, p));
    if (!shown.bitmap) texture.corners = corners_of(p, shown.attribute);
    launch_.textures[record].gradient = sums_of(std::move(texture), image);
  }

  // The grids that a medium's sigma_t or albedo is times, or that stand for a number of its phase function.
  void add_voxels(const Parameter& p, int index, int image) {
    const Instance& own = instance(p.owner, index);
    for (const std::size_t i : own.values_called(p.id, p.member)) {
      if (p.owner == Owner::phase)
        for (const std::string& name : functions_of(*own.model, p.owner, own.variant).factors)
          want(score_function(name), number_of_grid(own, i), 1);
      add_grid(p, index, i, image);
    }
  }

  // The grid of one value of a medium or of its phase function.
  void add_grid(const Parameter& p, int index, std::size_t i, int image) {
    const Texture& value = instance(p.owner, index).values[i];
    DifferentiatedTexture grid;
    grid.grid = value.volume->grid.get();
    grid.set_shape(*grid.grid);
    const std::vector<float>& voxels = grid.grid->data;
    const bool is_albedo = instance(p.owner, index).model->parameters[i].kind.field == std::string("albedo");
    grid.has_probes =
        p.owner == Owner::medium && (!is_albedo || *std::min_element(voxels.begin(), voxels.end()) < ALBEDO_KNEE);
    FieldRecord& field = launch_.fields[static_cast<std::size_t>(field_of(p.owner, index, i))];
    field.gradient = sums_of(std::move(grid), image);
    field.sum = data_.grids() - 1;
    if (!data_.parts.empty() && data_.parts.back().image == image) return;  // of another medium with the same grid
    data_.derivatives.push_back({{1, 1, 1}, -1, -1, {0, 0, 0}});
    data_.parts.push_back({image, {-1, -1, -1}});
    data_.numbers.push_back({});
    data_.numbers.back().field = field.sum;
  }

  // Index of the launch's field that holds the grid of values[i].
  int field_of(Owner owner, int index, std::size_t i) const {
    const MediumRecord& record = launch_.media[static_cast<std::size_t>(start().first_medium + index)];
    const Instance& own = instance(owner, index);
    if (owner == Owner::medium)
      return own.model->parameters[i].kind.field == std::string("albedo") ? record.albedo_field : record.field;
    const auto is_grid = [](const Texture& value) { return value.is_grid(); };
    return record.first_phase_field +
           static_cast<int>(
               std::count_if(own.values.begin(), own.values.begin() + static_cast<std::ptrdiff_t>(i), is_grid));
  }

  // Index of the first sum by the texels or voxels of `wanted`. Surfaces or media of the same parameter share them.
  int sums_of(DifferentiatedTexture wanted, int image) {
    for (const DifferentiatedTexture& known : data_.textures)
      if (known.image == image && known.bitmap == wanted.bitmap && known.grid == wanted.grid) return known.first_texel;
    wanted.image = image;
    wanted.first_texel = static_cast<int>(data_.texels());
    if (data_.texels() + wanted.texels() > static_cast<std::size_t>(std::numeric_limits<int>::max() / 3))
      throw InputError("the textures and grids to differentiate by have more than 7e8 texels; need smaller ones");
    data_.textures.push_back(std::move(wanted));
    return data_.textures.back().first_texel;
  }

  // For each corner of the launch's attribute (append_attributes) the index of the parameter's value; -1: none.
  std::vector<int> corners_of(const Parameter& p, const std::string& name) const {
    std::map<const Mesh*, std::size_t> first;
    std::size_t values = 0;
    for (const Mesh* mesh : attribute_meshes(scene_, p.indices, name)) {
      first[mesh] = values;
      const MeshAttribute& attribute = *mesh->attribute(name);
      values += attribute.values.size() / attribute.channels;
    }
    std::vector<int> corners;
    for (const Shape& shape : scene_.shapes) {
      const MeshAttribute* attribute = shape.mesh ? shape.mesh->attribute(name) : nullptr;
      if (!attribute) continue;
      const bool own = p.belongs_to(shape.bsdf);
      for (std::size_t i = 0; i < shape.mesh->triangle.size(); ++i)
        for (const std::uint32_t corner : shape.mesh->triangle[i])
          corners.push_back(own ? static_cast<int>(first[shape.mesh.get()] + (attribute->is_of_faces() ? i : corner))
                                : -1);
    }
    return corners;
  }

  // One part for each number that the model's parameter of that index moves.
  void add_instance(const Parameter& p, std::size_t index, const Place& place, int image) {
    const DeclaredParameter& declared = place.model->parameters[index];
    add_parts(p, p.owner, place, image, {declared.slot, declared.kind.channels == 3 ? 1 : 0, 1},
              place.origin > 0 ? declared.name : "");
  }

  // The motion of a model's parameters: slot + c * step moves with that speed for channel c.
  struct Motion {
    int slot, step;
    double speed;
  };

  // One part for each number, or for the one called `only`, that the motion moves.
  void add_parts(const Parameter& p, Owner owner, const Place& place, int image, const Motion& motion,
                 const std::string& only = "") {
    const auto by = place.model->jacobian(place.variant, place.slots);
    for (const DeclaredNumber& number : place.model->numbers) {
      if (!only.empty() && number.name != only) continue;
      DerivativeRecord record{{0, 0, 0}, -1, -1, {0, 0, 0}};
      PartRecord part{image, {-1, -1, -1}};
      bool moves = false;
      for (int c = 0; c < 3; ++c) {
        if (p.component >= 0 && p.component != c) continue;
        const int slot = number.slot + (number.channels == 3 ? c : 0);
        const auto from = static_cast<std::size_t>(motion.slot + c * motion.step);
        record.factor[c] = static_cast<float>(motion.speed * by[static_cast<std::size_t>(slot)][from]);
        if (record.factor[c] == 0) continue;
        part.score[c] = score(owner, place, number, c);
        moves = true;
      }
      if (!moves) continue;
      data_.derivatives.push_back(record);
      data_.parts.push_back(part);
      data_.numbers.push_back({place.model, place.first, number.slot, number.channels == 3, place.origin});
    }
  }

  // Index of the score that a number needs in a channel.
  int score(Owner owner, const Place& place, const DeclaredNumber& number, int channel) {
    const Functions functions = functions_of(*place.model, owner, place.variant);
    bool one_for_all = !place.coloured_grid;  // channels
    const auto in_all_channels = [&](const ScoreFunction& function) {
      return place.grey || function.same_in_all_channels(number.slot);
    };
    const auto value = [&](int c) { return place.numbers[static_cast<std::size_t>(number.slot + c)]; };
    for (const std::string& name : functions.factors) {
      const ScoreFunction& function = score_function(name);
      one_for_all &= number.channels == 1
                         ? in_all_channels(function)
                         : value(0) == value(1) && value(1) == value(2) && stands_alone(function, *place.model, number);
      want(function, number, number.channels);
    }
    if (number.role == ROLE_DENSITY)
      for (const std::string& name : functions.decisions) want(score_function(name), number, number.channels);
    const int c = one_for_all ? 0 : channel;
    const ScoreRecord r{place.model->id, number.slot + (number.channels == 3 ? c : 0), c, place.first, place.origin};
    const auto same = [&](const ScoreRecord& o) {
      return o.model == r.model && o.slot == r.slot && o.channel == r.channel && o.first == r.first &&
             o.origin == r.origin;
    };
    const auto found = std::find_if(data_.scores.begin(), data_.scores.end(), same);
    if (found != data_.scores.end()) return static_cast<int>(found - data_.scores.begin());
    data_.scores.push_back(r);
    return static_cast<int>(data_.scores.size()) - 1;
  }

  void want(const ScoreFunction& function, const DeclaredNumber& number, int channels) {
    for (int c = 0; c < channels; ++c)
      for (int of = 0; of < 3; ++of)
        if (function.derivatives.count({number.slot + c, of}) > 0)
          data_.functions[function.name].insert(number.slot + c);
  }

  const SceneStart& start() const {
    return *std::find_if(launch_.scenes.begin(), launch_.scenes.end(),
                         [&](const SceneStart& s) { return s.first_number == job_.first_number; });
  }

  const Instance& instance(Owner owner, int index) const {
    const auto i = static_cast<std::size_t>(index);
    if (owner == Owner::medium) return scene_.media[i];
    if (owner == Owner::phase) return scene_.media[i].phase;
    return scene_.bsdfs[i];
  }

  Place place_of(Owner owner, int index) const {
    const auto i = static_cast<std::size_t>(index);
    const auto place = [](const Model& model, int variant, int first, const std::vector<double>& slots) {
      return Place{&model, variant, first, slots, model.to_numbers(variant, slots)};
    };
    const int base = job_.first_number;
    const MediumRecord* media = launch_.media.data() + start().first_medium;
    const BsdfRecord* bsdfs = launch_.bsdfs.data() + start().first_bsdf;
    if (owner == Owner::medium) {
      const Medium& medium = scene_.media[i];
      Place of_medium = place(*medium.model, medium.variant, media[i].first_number - base, medium.slots());
      of_medium.coloured_grid = std::any_of(medium.values.begin(), medium.values.end(), [](const Texture& value) {
        return value.is_grid() && value.volume->grid->channels == 3;
      });
      return of_medium;
    }
    if (owner == Owner::phase) {
      const PhaseFunction& phase = scene_.media[i].phase;
      return place(*phase.model, phase.variant, media[i].first_phase_number - base, phase.slots());
    }
    const Bsdf& bsdf = scene_.bsdfs[i];
    Place of_bsdf = place(*bsdf.model, bsdf.variant, bsdfs[i].first_number - base, bsdf.slots());
    of_bsdf.grey = std::all_of(bsdf.values.begin(), bsdf.values.end(), [](const Texture& value) {
      return value.is_constant() && grey(value.value) && !value.measured;
    });
    return of_bsdf;
  }

  const Scene& scene_;
  const JobRecord& job_;
  LaunchData& launch_;
  DerivativeData data_;
};

}  // namespace

DerivativeData derivative_data(const Scene& scene, const std::vector<std::string>& names, const JobRecord& job,
                               LaunchData& launch, bool with_textures, int albedos) {
  const std::vector<Parameter> parameters = list_parameters(scene);
  Builder builder(scene, job, launch);
  for (auto name = names.begin(); name != names.end(); ++name) {
    const Parameter p = find_parameter(parameters, *name);
    if (!p.not_differentiable.empty() && !((p.by_texels || p.by_voxels) && with_textures))
      throw UsageError(fmt::format("parameter {} cannot be differentiated by: {}", p.name, p.not_differentiable));
    if (std::find(names.begin(), name, *name) != name)
      throw UsageError(fmt::format("parameter {}: named twice", *name));
    builder.add(p, static_cast<int>(name - names.begin()));
  }
  if (albedos > 0) builder.add_albedos(albedos);
  return builder.take();
}

std::vector<float> albedo_exponents(const Scene& scene, const std::vector<Rgb>& others) {
  if (others.empty()) return {};
  if (scene.media.size() != 1)
    throw UsageError(fmt::format("other albedos: the scene has {} media, need one", scene.media.size()));
  const Texture& albedo = scene.media.front().value("albedo");
  if (!albedo.is_constant() || *std::min_element(albedo.value.begin(), albedo.value.end()) <= 0)
    throw UsageError("other albedos: the medium's own must be above 0, and the same everywhere");
  constexpr double black = 1e-30;  // has a logarithm: nothing that scatters is seen
  std::vector<float> exponents;
  for (const Rgb& other : others)
    for (std::size_t c = 0; c < 3; ++c)
      exponents.push_back(static_cast<float>(albedo.value[c] * std::log(std::max(black, other[c]) / albedo.value[c])));
  return exponents;
}

}  // namespace itn
