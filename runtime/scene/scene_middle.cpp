#include "runtime/scene/scene_middle.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "runtime/scene/mesh/placed_mesh.h"
#include "runtime/scene/transform.h"
#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

constexpr double much_nearer = 1.25;
// Relative rounding error of a coordinate: in single precision where rays meet surfaces (compile/geometry.cpp), and in
// double precision where the scene is read.
constexpr double rounding = 0x1p-21, rounding_of_double = 0x1p-52;

struct Placed {
  const Shape* shape;
  Extent box;
  double size;

  double ratio(const Vec3& origin) const { return box.farthest_from(origin) / size; }
};

Extent extent_of(const Shape& shape, const MeshOrigins& origins) {
  Extent box = Extent::empty();
  if (shape.mesh) {
    for (const auto& p : shape.mesh->position) box.add({p[0], p[1], p[2]});
    const auto own = origins.find(shape.mesh.get());
    return own == origins.end() ? box : Extent{box.low + own->second, box.high + own->second};
  }
  Vec3 half{shape.radius, shape.radius, shape.radius};
  if (shape.kind != Shape::Kind::sphere)
    for (std::size_t k = 0; k < 3; ++k) half[k] = std::hypot(shape.edge_u[k], shape.edge_v[k]);
  box.add(shape.center - half);
  box.add(shape.center + half);
  if (shape.kind == Shape::Kind::cylinder) {
    box.add(shape.center + shape.axis - half);
    box.add(shape.center + shape.axis + half);
  }
  return box;
}

std::vector<Placed> placed_shapes(const Scene& scene, const MeshOrigins& origins) {
  std::vector<Placed> shapes;
  for (const Shape& shape : scene.shapes) {
    const Extent box = extent_of(shape, origins);
    if (box.longest_side() > 0) shapes.push_back({&shape, box, box.longest_side()});
  }
  return shapes;
}

double greatest_ratio(const std::vector<Placed>& shapes, const Vec3& origin) {
  double ratio = 0;
  for (const Placed& s : shapes) ratio = std::max(ratio, s.ratio(origin));
  return ratio;
}

// The coordinate from which the farthest shape is the least of its sizes away.
double best_middle(const std::vector<Placed>& shapes, std::size_t axis) {
  double least = 0, most = 0;  // of the ratio
  for (const Placed& s : shapes) most = std::max(most, s.ratio(shapes[0].box.low));
  const auto range = [&](double ratio) {
    double low = -std::numeric_limits<double>::infinity(), high = -low;
    for (const Placed& s : shapes) {
      low = std::max(low, s.box.high[axis] - ratio * s.size);
      high = std::min(high, s.box.low[axis] + ratio * s.size);
    }
    return std::pair(low, high);
  };
  constexpr int halvings = 60;
  for (int i = 0; i < halvings; ++i) {
    const double ratio = (least + most) / 2;
    const auto [low, high] = range(ratio);
    (low <= high ? most : least) = ratio;
  }
  const auto [low, high] = range(most);
  return (low + high) / 2;
}

Vec3 best_origin(const std::vector<Placed>& shapes) {
  const double ratio = greatest_ratio(shapes, {});
  if (!(ratio > far_away)) return {};
  double smallest = std::numeric_limits<double>::infinity();
  for (const Placed& s : shapes) smallest = std::min(smallest, s.size);
  const Vec3 best = rounded_middle({best_middle(shapes, 0), best_middle(shapes, 1), best_middle(shapes, 2)}, smallest);
  return much_nearer * greatest_ratio(shapes, best) < ratio ? best : Vec3{};
}

// Gives shared things one copy that is moved.
template <class Thing>
class Moved {
 public:
  template <class Move>
  std::shared_ptr<const Thing> operator()(const std::shared_ptr<const Thing>& thing, const Move& move) {
    if (!thing) return thing;
    auto& [before, moved] = known_[thing.get()];
    if (!moved) {
      before = thing;  // so that no other one takes its address
      auto copy = std::make_shared<Thing>(*thing);
      move(*copy);
      moved = std::move(copy);
    }
    return moved;
  }

 private:
  std::map<const Thing*, std::pair<std::shared_ptr<const Thing>, std::shared_ptr<const Thing>>> known_;
};

class Mover {
 public:
  // by: what is subtracted
  Mover(const Vec3& by, const MeshOrigins& origins) : by_(by), origins_(origins) {}

  void move(Shape& shape) {
    shape.center = shape.center - by_;
    if (!shape.mesh) return;
    const auto own = origins_.find(shape.mesh.get());
    const Vec3 shift = own == origins_.end() ? Vec3{} - by_ : own->second - by_;
    if (shift == Vec3{}) return;
    shape.mesh = meshes_(shape.mesh, [&](Mesh& mesh) {
      for (auto& p : mesh.position)
        for (std::size_t k = 0; k < 3; ++k) p[k] = static_cast<float>(static_cast<double>(p[k]) + shift[k]);
    });
  }

  void move(Sensor& sensor) {
    move(sensor.to_world);
    if (sensor.target) sensor.target = *sensor.target - by_;
    sensor.zone = zones_(sensor.zone, [&](Shape& zone) { move(zone); });
  }

  void move(Instance& instance) {
    for (Texture& value : instance.values)
      value.volume = volumes_(value.volume, [&](Volume& volume) { move(volume.to_world); });
  }

  void move_light(Light& light) {
    using Reader = ParameterKind::Reader;
    for (std::size_t i = 0; i < light.values.size(); ++i) {
      const DeclaredParameter& p = light.model->parameters[i];
      const bool of_beam = p.kind.reader == Reader::of_shape && p.name == "center";
      if (p.kind.reader == Reader::position || p.kind.reader == Reader::origin || of_beam)
        light.values[i].value = light.values[i].value - by_;
    }
  }

 private:
  void move(Transform& transform) {
    for (std::size_t k = 0; k < 3; ++k) transform.m[4 * k + 3] -= by_[k];
  }

  Vec3 by_;
  const MeshOrigins& origins_;
  Moved<Mesh> meshes_;
  Moved<Shape> zones_;
  Moved<Volume> volumes_;
};

std::string name_of(const Shape& shape) { return shape.id.empty() ? "" : " " + quote(shape.id); }

// Uncertainty of a shape's places, over its size.
double loss_of(const Placed& s, const Vec3& origin) {
  return std::max(rounding * s.ratio(origin), rounding_of_double * s.ratio({}));
}

void tell_far_shapes(const std::vector<Placed>& shapes, const Vec3& origin, std::vector<std::string>& warnings) {
  const Placed* worst = nullptr;
  double loss = 0;
  std::size_t told = 0;
  for (const Placed& s : shapes) {
    const double own = loss_of(s, origin);
    told += own >= loss_said_from ? 1 : 0;
    if (own <= loss) continue;
    loss = own;
    worst = &s;
  }
  if (told == 0) return;
  const std::string what = fmt::format(
      "shape{} has a size of {:.3g} and is {:.3g} from the middle of the scene, so that single precision tells its "
      "places to {:.2g} % of its size{}: bring the shapes nearer to each other, or render them apart",
      name_of(*worst->shape), worst->size, worst->box.farthest_from(origin), 100 * loss,
      told > 1 ? fmt::format(" ({} shapes are known to less than {} %)", told, 100 * loss_said_from) : "");
  if (loss >= loss_refused_from) fail(worst->shape->where, what + "; need 25 % or less");
  warnings.push_back(to_string(worst->shape->where) + ": " + what);
}

bool touch(const Extent& a, const Extent& b) {
  for (std::size_t k = 0; k < 3; ++k)
    if (a.low[k] > b.high[k] || b.low[k] > a.high[k]) return false;
  return true;
}

// Surfaces are met to a rounding of their own coordinates: a huge one, such as a floor, blurs what is small beside it.
void tell_huge_shapes(const std::vector<Placed>& shapes, const Vec3& origin, std::vector<std::string>& warnings) {
  const auto by_size = [](const Placed& a, const Placed& b) { return a.size < b.size; };
  if (shapes.empty()) return;
  const Placed &huge = *std::max_element(shapes.begin(), shapes.end(), by_size), *smallest = nullptr;
  for (const Placed& s : shapes)
    if (&s != &huge && touch(s.box, huge.box) && (!smallest || s.size < smallest->size)) smallest = &s;
  if (!smallest) return;
  const double known = rounding * huge.box.farthest_from(origin), loss = known / smallest->size;
  if (loss < loss_said_from) return;
  warnings.push_back(fmt::format(
      "{}: shape{} has a size of {:.3g}, so that single precision tells its places to {:.2g}, which is {:.2g} "
      "% of the size of shape{} beside it: make it smaller, as large as can be seen",
      to_string(huge.shape->where), name_of(*huge.shape), huge.size, known, 100 * loss, name_of(*smallest->shape)));
}

}  // namespace

void move_to_middle(Scene& scene, const MeshOrigins& origins, std::vector<std::string>& warnings) {
  const std::vector<Placed> shapes = placed_shapes(scene, origins);
  const Vec3 origin = best_origin(shapes);
  tell_far_shapes(shapes, origin, warnings);
  tell_huge_shapes(shapes, origin, warnings);
  Mover mover(origin, origins);
  for (Shape& shape : scene.shapes) mover.move(shape);
  for (Sensor& sensor : scene.sensors) mover.move(sensor);
  if (origin == Vec3{}) return;
  for (Medium& medium : scene.media) {
    mover.move(medium);
    mover.move(medium.phase);
  }
  for (Bsdf& bsdf : scene.bsdfs) mover.move(bsdf);
  for (Light& light : scene.lights) mover.move_light(light);
}

}  // namespace itn
