#include "itn/load_scene.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "kernels/shared/declaration.h"
#include "runtime/scene/box.h"
#include "runtime/scene/scene_middle.h"
#include "runtime/scene/transform.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"
#include "runtime/scene/xml/transform.h"

namespace itn {
namespace {

// Objects that belong to what refers to them; here only what they contain is checked.
void check_loose_objects(Builder& builder, Properties& root) {
  for (const Element* element : root.objects("texture")) check_texture(builder, *element);
  for (const Element* element : root.objects("volume")) check_texture(builder, *element);
  for (const Element* element : root.objects("phase")) build_phase(builder, *element);
  Sensor sensor;
  for (const Element* element : root.objects("film")) build_film(builder, *element, sensor);
  for (const Element* element : root.objects("rfilter")) build_filter(builder, *element, sensor);
  for (const Element* element : root.objects("sampler")) build_sampler(builder, *element, sensor);
}

void build_scene(Builder& builder) {
  Properties root = builder.properties(*builder.document.root);
  if (const Element* integrator = root.object("integrator")) build_integrator(builder, *integrator);
  for (const Element* element : root.objects("bsdf")) build_bsdf(builder, *element);
  for (const Element* element : root.objects("medium")) build_medium(builder, *element);
  check_loose_objects(builder, root);
  for (const Element* element : root.objects("emitter")) build_emitter(builder, *element);
  for (const Element* element : root.objects("shape")) build_shape(builder, *element);
  for (const Element* element : root.objects("sensor")) build_sensor(builder, *element);
  root.finish();
}

// A light that is a shape may stand by itself, but for a shape to refer to it.
void check_lights(const Scene& scene) {
  std::set<int> of_shapes;
  for (const Shape& shape : scene.shapes) of_shapes.insert(shape.light);
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    const Light& light = scene.lights[i];
    const bool used = of_shapes.count(static_cast<int>(i)) > 0;
    const bool placed = (light.model->traits & LIGHT_BEAM) != 0 && length(light.value("normal").value) > 0;
    if ((light.model->traits & (LIGHT_ON_SHAPE | LIGHT_BEAM)) != 0 && !used && !placed)
      fail(light.where, "emitter " + quote(light.type()) +
                            " belongs into a <shape>, which is what shines, or needs one that refers to it by its id");
  }
}

// Is it the very same surface?
bool coincide(const Shape& a, const Shape& b) {
  if (a.kind != b.kind) return false;
  if (a.kind != Shape::Kind::mesh)
    return a.center == b.center && a.radius == b.radius && a.axis == b.axis && a.edge_u == b.edge_u &&
           a.edge_v == b.edge_v;
  return a.mesh == b.mesh || (a.mesh->position == b.mesh->position && a.mesh->triangle == b.mesh->triangle);
}

bool same(const Volume& a, const Volume& b) {
  return a.grid == b.grid && a.to_world.m == b.to_world.m && a.nearest == b.nearest && a.wrap == b.wrap;
}

bool same(const Texture& a, const Texture& b) {
  const bool volumes = a.volume == b.volume || (a.volume && b.volume && same(*a.volume, *b.volume));
  return volumes && a.value == b.value && a.model == b.model && a.to_uv == b.to_uv && a.colours == b.colours &&
         a.bitmap == b.bitmap && a.nearest == b.nearest && a.wrap == b.wrap && a.attribute == b.attribute &&
         a.scale == b.scale && a.measured == b.measured;
}

// Do they differ in nothing but their names?
bool same(const Instance& a, const Instance& b) {
  return a.model == b.model && a.variant == b.variant &&
         std::equal(a.values.begin(), a.values.end(), b.values.begin(), b.values.end(),
                    [](const Texture& s, const Texture& t) { return same(s, t); });
}

bool same_media(const Scene& scene, int a, int b) {
  if (a == b) return true;
  if (a < 0 || b < 0) return false;
  const Medium &s = scene.media[static_cast<std::size_t>(a)], &t = scene.media[static_cast<std::size_t>(b)];
  return same(s, t) && same(s.phase, t.phase);
}

bool look_alike(const Mesh& a, const Mesh& b) {
  return a.normal == b.normal && a.texcoord == b.texcoord &&
         std::equal(a.attributes.begin(), a.attributes.end(), b.attributes.begin(), b.attributes.end(),
                    [](const MeshAttribute& s, const MeshAttribute& t) {
                      return s.name == t.name && s.channels == t.channels && s.values == t.values;
                    });
}

// Drops shapes that repeat others in every respect that a path meets. A few coincident copies stay: more change
// nothing, and make the render time grow with the square of their number. Of boundaries that refract only one stays,
// since each would refract the light. Shapes that emit all stay.
void drop_repeated(Builder& builder) {
  Scene& scene = builder.scene;
  const auto same_in_all = [&](const Shape& a, const Shape& b) {
    const Bsdf &s = scene.bsdfs[static_cast<std::size_t>(a.bsdf)], &t = scene.bsdfs[static_cast<std::size_t>(b.bsdf)];
    return a.flip_normals == b.flip_normals && same_media(scene, a.interior, b.interior) &&
           same_media(scene, a.exterior, b.exterior) && (&s == &t || (s.twosided == t.twosided && same(s, t))) &&
           coincide(a, b) && (a.mesh == b.mesh || look_alike(*a.mesh, *b.mesh));
  };
  const auto place = [](const Shape& s) { return std::pair(box_of(s).low, box_of(s).high); };
  constexpr std::ptrdiff_t few = 16;
  std::map<decltype(place(Shape())), std::vector<std::size_t>> at;  // of those that stay
  std::vector<Shape> kept;
  std::size_t dropped = 0;
  Location first_where;
  std::string first;
  for (Shape& shape : scene.shapes) {
    std::vector<std::size_t>& others = at[place(shape)];
    const auto like = std::count_if(others.begin(), others.end(), [&](std::size_t i) {
      return shape.light < 0 && kept[i].light < 0 && same_in_all(kept[i], shape);
    });
    const Model* bsdf = scene.bsdfs[static_cast<std::size_t>(shape.bsdf)].model;
    if (like >= (bsdf && (bsdf->traits & BSDF_TRANSMITS) ? 1 : few)) {
      if (dropped++ == 0) {
        first_where = shape.where;
        first = "shape " + quote(shape.id) + " is the same surface of the same material as " +
                (like > 1 ? std::to_string(like) + " others, such as " : "") + quote(kept[others.front()].id) + " at " +
                to_string(kept[others.front()].where) + ", and is left out";
      }
      continue;
    }
    if (others.size() < static_cast<std::size_t>(few)) others.push_back(kept.size());
    kept.push_back(shape);
  }
  if (dropped == 0) return;
  builder.warn(first_where, first + (dropped > 1 ? "; so are " + std::to_string(dropped - 1) + " others" : ""));
  scene.shapes = std::move(kept);
}

// Chance decides which of two coincident surfaces a path meets first: where their media differ, so does the image.
void warn_of_coinciding(Builder& builder) {
  const auto place = [](const Shape& s) { return std::pair(box_of(s).low, box_of(s).high); };
  std::map<decltype(place(Shape())), std::vector<const Shape*>> at;
  for (const Shape& shape : builder.scene.shapes) {
    if (shape.interior == shape.exterior) continue;
    std::vector<const Shape*>& others = at[place(shape)];
    for (const Shape* other : others)
      if ((other->interior != shape.interior || other->exterior != shape.exterior) && coincide(*other, shape)) {
        builder.warn(shape.where, "shape " + quote(shape.id) + " is the same surface as " + quote(other->id) + " at " +
                                      to_string(other->where) +
                                      ", with other media: which one a path meets is chance, and the image wrong; "
                                      "make one of them smaller, or remove it");
        break;
      }
    constexpr std::size_t most_compared = 16;
    if (others.size() < most_compared) others.push_back(&shape);
  }
}

// A sensor that lies on a surface is connected with lights without extent by a straight line: a mirror or smooth glass
// between them deflects it, and no path from the sensor meets such a light.
void warn_of_unseen_lights(Builder& builder) {
  const Scene& scene = builder.scene;
  const auto smooth = std::find_if(scene.shapes.begin(), scene.shapes.end(), [&](const Shape& shape) {
    const Model* bsdf = scene.bsdfs[static_cast<std::size_t>(shape.bsdf)].model;
    return bsdf && (bsdf->traits & (BSDF_SMOOTH | BSDF_PARTLY_SMOOTH)) != 0;
  });
  const auto light = std::find_if(scene.lights.begin(), scene.lights.end(),
                                  [](const Light& l) { return !(l.model->traits & LIGHT_ON_SHAPE); });
  if (smooth == scene.shapes.end() || light == scene.lights.end()) return;
  for (const Sensor& sensor : scene.sensors)
    if (sensor.kind == Sensor::Kind::irradiance)
      builder.warn(
          sensor.where,
          "sensor \"irradiancemeter\": light of " + quote(light->type()) + " at " + to_string(light->where) +
              " that smooth surfaces refract or mirror, as that of shape " + quote(smooth->id) + " at " +
              to_string(smooth->where) +
              ", is missing: no path finds a light without extent behind them; give them a roughness "
              "(roughdielectric, roughconductor with a small alpha), or the light an extent (a small area lamp, or "
              "an envmap or sunsky instead of parallel light)");
}

// BSDFs that only stand inside of structures, which have copies of them, are no surfaces.
void drop_nested(Builder& builder) {
  Scene& scene = builder.scene;
  std::set<int> gone = builder.nested;
  const auto keep_used = [&] {
    for (const Shape& shape : scene.shapes) gone.erase(shape.bsdf);
  };
  keep_used();
  for (const auto& [inner, element] : builder.twosided_of)
    if (const auto twosided = builder.bsdf_of.find(element);
        twosided != builder.bsdf_of.end() && gone.count(twosided->second))
      gone.insert(inner);
  keep_used();
  std::vector<Bsdf> kept;
  std::vector<int> place;
  for (std::size_t i = 0; i < scene.bsdfs.size(); ++i) {
    place.push_back(static_cast<int>(kept.size()));
    if (!gone.count(static_cast<int>(i))) kept.push_back(scene.bsdfs[i]);
  }
  for (Shape& shape : scene.shapes) shape.bsdf = place[static_cast<std::size_t>(shape.bsdf)];
  scene.bsdfs = std::move(kept);
}

// Emitters that are put out are no lights of the scene.
void drop_put_out(const Builder& builder, Scene& scene) {
  const auto same = [](const Location& a, const Location& b) {
    return a.line == b.line && a.column == b.column && a.file == b.file;
  };
  std::vector<Light> kept;
  std::vector<int> place;
  for (const Light& light : scene.lights) {
    place.push_back(static_cast<int>(kept.size()));
    if (std::none_of(builder.put_out.begin(), builder.put_out.end(),
                     [&](const Location& out) { return same(out, light.where); }))
      kept.push_back(light);
  }
  for (Shape& shape : scene.shapes)
    if (shape.light >= 0) shape.light = place[static_cast<std::size_t>(shape.light)];
  scene.lights = std::move(kept);
}

Scene scene_of(const std::string& file, const Document& document, const LoadOptions& options, Report& report) {
  Builder builder(document, report);
  builder.scene.file = file;
  builder.film_size = options.size;
  builder.open = options.open;
  report.attempt([&] { warn_of_transforms(*document.root, builder.scene.warnings); });
  report.attempt([&] { build_scene(builder); });
  report.raise();
  check_lights(builder.scene);
  move_to_middle(builder.scene, builder.mesh_origins, builder.scene.warnings);
  drop_repeated(builder);
  warn_of_coinciding(builder);
  drop_nested(builder);
  if (!builder.put_out.empty()) drop_put_out(builder, builder.scene);
  warn_of_unseen_lights(builder);
  warn_of_far_scenes(builder);

  if (builder.scene.sensors.empty()) {
    builder.scene.sensors.push_back(sensor_of_all(builder));
    builder.warn(
        document.root->where,
        "the scene has no sensor: a perspective one below it looks along z; add <sensor type=\"perspective\">");
  }
  if (!builder.scene.environment && builder.scene.lights.empty())
    builder.warn(document.root->where,
                 "the scene has no emitter: the image will be black; add <emitter type=\"constant\"/>");
  builder.scene.warnings.insert(builder.scene.warnings.end(), report.warnings().begin(), report.warnings().end());
  return builder.scene;
}

}  // namespace

Scene load_scene(const std::string& file, const std::map<std::string, std::string>& definitions,
                 const LoadOptions& options) {
  Report report;
  return scene_of(file, read_document(file, definitions, report), options, report);
}

Scene load_scene_text(const std::string& file, const std::string& text, const LoadOptions& options) {
  Report report;
  return scene_of(file, read_document_text(file, text, report), options, report);
}

}  // namespace itn
