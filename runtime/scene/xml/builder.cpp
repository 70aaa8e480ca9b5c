#include "runtime/scene/xml/builder.h"

#include <utility>

#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

void examine(Builder& builder, const Element& element);

// Also examines the children of an element that cannot be built, so that one run tells all errors.
template <class Make>
bool build_or_examine(Builder& builder, const Element& element, Make make) {
  if (builder.report.attempt(make)) return true;
  for (const auto& child : element.children) examine(builder, *child);
  return false;
}

template <class Entry, class Make>
int build_once(Builder& builder, const Element& element, std::map<const Element*, int>& built,
               std::vector<Entry>& entries, Make make) {
  if (const auto found = built.find(&element); found != built.end()) return found->second;
  int index = -1;
  if (!build_or_examine(builder, element, [&] { index = make(builder, element); })) {
    index = static_cast<int>(entries.size());
    entries.emplace_back();
  }
  return built[&element] = index;
}

void examine(Builder& builder, const Element& element) {
  Sensor sensor;
  if (element.tag == "bsdf") build_bsdf(builder, element);
  if (element.tag == "medium") build_medium(builder, element);
  if (element.tag == "phase") build_phase(builder, element);
  if (element.tag == "texture" || element.tag == "volume") check_texture(builder, element);
  if (element.tag == "emitter") build_emitter(builder, element);
  if (element.tag == "shape") build_shape(builder, element);
  if (element.tag == "film") build_film(builder, element, sensor);
  if (element.tag == "rfilter") build_filter(builder, element, sensor);
  if (element.tag == "sampler") build_sampler(builder, element, sensor);
  if (element.tag == "integrator") build_integrator(builder, element);
}

}  // namespace

std::shared_ptr<const Mesh> Builder::keep(PlacedMesh&& mesh) {
  const Vec3 origin = mesh.origin;
  auto kept = std::make_shared<const Mesh>(std::move(mesh));
  mesh_origins.erase(kept.get());  // of one that is gone
  if (origin != Vec3{}) mesh_origins[kept.get()] = origin;
  return kept;
}

void fail_type(const Element& element, const std::vector<std::string>& allowed) {
  const std::string& type = element.attribute("type");
  fail(element.where, "unknown type " + quote(type) + " of <" + element.tag + ">" + need_one_of(type, allowed));
}

int build_bsdf(Builder& builder, const Element& element) {
  return build_once(builder, element, builder.bsdf_of, builder.scene.bsdfs, read_bsdf);
}

int build_medium(Builder& builder, const Element& element) {
  return build_once(builder, element, builder.medium_of, builder.scene.media, read_medium);
}

int build_shape_light(Builder& builder, const Element& element) {
  return build_once(builder, element, builder.light_of, builder.scene.lights, read_shape_light);
}

void build_emitter(Builder& builder, const Element& element) {
  build_or_examine(builder, element, [&] { read_emitter(builder, element); });
}

void build_shape(Builder& builder, const Element& element) {
  build_or_examine(builder, element, [&] { read_shape(builder, element); });
}

void build_sensor(Builder& builder, const Element& element, const Shape* on) {
  build_or_examine(builder, element, [&] { read_sensor(builder, element, on); });
}

void build_integrator(Builder& builder, const Element& element) {
  build_or_examine(builder, element, [&] { read_integrator(builder, element); });
}

Texture build_texture(Builder& builder, const Element& element) {
  Texture texture;
  build_or_examine(builder, element, [&] { texture = read_texture(builder, element); });
  return texture;
}

void check_texture(Builder& builder, const Element& element) {
  if (is_spectrum_type(element.attribute("type")))
    builder.report.attempt([&] { spectrum_plugin(builder.document, element, Quantity::unbounded, builder.report); });
  else if (element.tag == "volume")
    build_volume(builder, element, VoxelValues::of_any_sign);
  else
    build_texture(builder, element);
}

Volume build_volume(Builder& builder, const Element& element, VoxelValues allowed) {
  Volume volume;
  build_or_examine(builder, element, [&] { volume = read_volume(builder, element, allowed); });
  return volume;
}

PhaseFunction build_phase(Builder& builder, const Element& element) {
  PhaseFunction phase = Medium().phase;
  build_or_examine(builder, element, [&] { phase = read_phase(builder, element); });
  return phase;
}

void build_film(Builder& builder, const Element& element, Sensor& sensor) {
  build_or_examine(builder, element, [&] { read_film(builder, element, sensor); });
}

void build_filter(Builder& builder, const Element& element, Sensor& sensor) {
  build_or_examine(builder, element, [&] { read_filter(builder, element, sensor); });
}

void build_sampler(Builder& builder, const Element& element, Sensor& sensor) {
  build_or_examine(builder, element, [&] { read_sampler(builder, element, sensor); });
}

}  // namespace itn
