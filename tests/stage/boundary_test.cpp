// Stages ray, null, dielectric and rough dielectric: every path against the same formulas in double precision.
#include <catch2/catch.hpp>

#include "host_model.h"
#include "kernels/model/bsdf/dielectric.h"
#include "kernels/model/bsdf/rough_dielectric.h"
#include "kernels/model/shading_frame.h"
#include "path_bench.h"
#include "scenes.h"
#include "stage_test.h"

using namespace itn;
using namespace itn::test;

namespace {

// Paths that have arrived at the unit sphere, half of them from inside; throughput and the rest arbitrary.
std::vector<Path> arrivals(const PathBench& bench, Queue queue, std::size_t n) {
  Rays rays(7);
  std::vector<Path> paths(n);
  int sphere = 0;
  while (bench.data().geometry.primitives[static_cast<std::size_t>(sphere)].shape != 0) ++sphere;
  for (std::size_t i = 0; i < n; ++i) {
    Path& p = paths[i];
    const bool inside = i % 2;
    p.position = rays.direction();
    do p.direction = rays.direction();
    while ((dot(p.direction, p.position) > 0) != inside || std::abs(dot(p.direction, p.position)) < 1e-3);
    p.medium = inside ? 0 : -1;
    p.hit = sphere;
    p.pixel = static_cast<int>(i);
    p.event = 3 + static_cast<int>(i % 4);
    p.depth = static_cast<int>(i % 12);
    p.throughput = {rays.number(0.1, 1), rays.number(0.1, 1), rays.number(0.1, 1)};
    if (i % 5 == 4) p.depth += 600;  // where roulette also ends what loses nothing
    if (i % 10 == 9)
      for (double& t : p.throughput) t *= 100;  // but what is heavy
    p.radiance = {0.25, 0.5, 0.75};
    p.refraction_scale = rays.number(0.5, 2);
    p.last_pdf = 0.125;
    p.skip = -1;
    p.queue = queue;
  }
  return paths;
}

Vec3 to_array(const Vector3<double>& v) { return {v.x, v.y, v.z}; }

// The device's frame about n: any rotation of it about n would be as good, but the random numbers refer to this one.
struct HostFrame {
  Vector3<double> s, t, n;
  explicit HostFrame(const Vec3& normal) : n{normal[0], normal[1], normal[2]} { shading_frame(n, &s, &t); }
  Vec3 to_world(const Vector3<double>& v) const { return to_array(::to_world(s, t, n, v)); }
  Vector3<double> to_local(const Vec3& v) const { return ::to_local(s, t, n, {v[0], v[1], v[2]}); }
};

struct Expected {
  bool reflects;
  Vec3 direction;
  double weight;  // f cos / p without the radiance's 1 / eta^2
  double eta;     // far side over near side
};

// Outcome of boundaries for a path once the direction is known: counts of paths that do otherwise, and the largest
// errors.
struct BoundaryCheck {
  std::size_t wrong = 0, died = 0, reflected = 0;
  double direction = 0, throughput = 0, scale = 0, position = 0;

  void add(const PathBench& bench, const Path& before, const Path& after, const Expected& e, const Rgb& reflectance,
           const Rgb& transmittance, int max_depth, int rr_depth) {
    const int depth = before.depth + 1;
    reflected += e.reflects;
    Rgb expected{};
    double largest = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      expected[c] = before.throughput[c] * e.weight * (e.reflects ? reflectance : transmittance)[c];
      largest = std::max(largest, expected[c]);
    }
    const double survival = test::survival(depth, largest, 0.999), u = bench.random(before, 0)[3];
    if (depth > rr_depth && std::abs(u - survival) < 1e-4) return;  // rounding decides
    const bool dies = largest <= 0 || depth >= max_depth || (depth > rr_depth && u >= survival);
    died += dies;
    if (dies) {
      wrong += after.queue != Queue::free || after.sample_radiance != before.radiance;
      return;
    }
    if (depth > rr_depth)
      for (double& t : expected) t /= survival;
    const bool inside_before = before.medium >= 0, inside = inside_before == e.reflects;
    wrong += after.queue != (inside ? Queue::medium : Queue::ray) || after.medium != (inside ? 0 : -1) ||
             after.skip != before.hit || after.depth != depth || after.event != before.event + 1 ||
             after.radiance != before.radiance || after.pixel != before.pixel || after.last_pdf != 0;
    direction = std::max(direction, test::distance(after.direction, e.direction));
    for (std::size_t c = 0; c < 3; ++c)
      throughput = std::max(throughput, std::abs(after.throughput[c] / expected[c] - 1));
    scale = std::max(scale,
                     std::abs(after.refraction_scale / before.refraction_scale * (e.reflects ? 1 : e.eta * e.eta) - 1));
    // beside the surface, on the side where the path goes on
    const double height = length(after.position) - 1, offset = bench.offset(before.hit);
    position = std::max(position, std::abs(height - (inside ? -offset : offset)));
  }
};

}  // namespace

TEST_CASE("stage ray finds the closest surface and the queue of its boundary") {
  Scene scene = sphere_scene(bsdf_of("null"), medium_of(1, 0.5, 0));
  const Bsdf kinds[] = {bsdf_of("diffuse"), bsdf_of("dielectric"), bsdf_of("roughdielectric", 1.5, 0.2, "beckmann"),
                        bsdf_of("roughdielectric", 1.5, 0.2, "ggx")};
  for (int k = 0; k < 4; ++k) {
    Shape shape = scene.shapes[0];
    shape.center = {3.0 * std::cos(k * 1.5), 3.0 * std::sin(k * 1.5), 0.5};
    shape.radius = 0.8;
    shape.bsdf = static_cast<int>(scene.bsdfs.size());
    scene.bsdfs.push_back(kinds[k]);
    scene.shapes.push_back(shape);
  }
  add_floor(scene, bsdf_of("diffuse"), 5, -2);
  for (const int width : widths()) {
    PathBench bench(device(), scene, {.width = width});
    Rays rays(1);
    std::vector<Path> paths(4001);  // the last group is not full
    for (std::size_t i = 0; i < paths.size(); ++i) {
      Path& p = paths[i];
      p.pixel = static_cast<int>(i);
      p.position = {rays.number(-6, 6), rays.number(-6, 6), rays.number(1.5, 6)};
      p.direction = rays.direction();
      if (i % 2) p.direction[2] = -std::abs(p.direction[2]);
      p.throughput = {0.5, 0.5, 0.5};
      p.queue = Queue::ray;
    }
    std::vector<Path> after = paths;
    bench.run(Queue::ray, after);
    std::size_t wrong = 0, close = 0, hits = 0;
    double error = 0;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      const HostHit hit = closest(scene, paths[i].position, paths[i].direction, 1e-4);
      const Path& p = after[i];
      const Queue expected =
          hit.shape < 0
              ? Queue::escape
              : bench.queue_of(
                    scene.bsdfs[static_cast<std::size_t>(scene.shapes[static_cast<std::size_t>(hit.shape)].bsdf)]);
      if (p.queue != expected) {
        ++close;  // only rays that graze a surface or start on one may be seen differently
        continue;
      }
      wrong += test::distance(p.direction, paths[i].direction) > 1e-7 || p.throughput != paths[i].throughput ||
               p.event != 1 || p.medium != -1;
      if (hit.shape < 0) continue;
      ++hits;
      wrong += bench.data().geometry.primitives[static_cast<std::size_t>(p.hit)].shape != hit.shape;
      error = std::max(error, test::distance(p.position, along(paths[i].position, hit.t, paths[i].direction)) *
                                  std::abs(dot(hit.normal, paths[i].direction)));
    }
    CAPTURE(width);
    CHECK(hits > 500);
    CHECK(wrong == 0);
    CHECK(close <= 2);
    CHECK(error < 1e-5);
  }
}

TEST_CASE("stage null goes straight on in the medium of the other side") {
  const Scene scene = sphere_scene(bsdf_of("null"), medium_of(1, 0.5, 0));
  for (const int width : widths()) {
    PathBench bench(device(), scene, {.width = width});
    std::vector<Path> paths = arrivals(bench, Queue::null, 501), after;
    for (std::size_t i = 0; i < paths.size(); i += 10)
      paths[i].medium = paths[i].medium < 0 ? 0 : -1;  // rounding put it there
    after = paths;
    bench.run(Queue::null, after);
    CHECK(bench.misplaced() == 51);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      const bool inside = i % 2 == 0;
      const Path &p = paths[i], &q = after[i];
      const double height = length(q.position) - 1;
      wrong += q.queue != (inside ? Queue::medium : Queue::ray) || q.medium != (inside ? 0 : -1) || q.skip != p.hit ||
               q.depth != p.depth || q.event != p.event || distance(q.direction, p.direction) > 1e-7 ||
               std::abs(q.throughput[0] / p.throughput[0] - 1) > 1e-7 || q.last_pdf != p.last_pdf ||
               std::abs(height - (inside ? -1 : 1) * bench.offset(p.hit)) > 3e-7;
    }
    CAPTURE(width);
    CHECK(wrong == 0);
  }
}

TEST_CASE("stage dielectric reflects and refracts as Fresnel and Snell say") {
  for (const double eta : {1.5, 0.7}) {
    Bsdf bsdf = bsdf_of("dielectric", eta);
    bsdf.value("specular_reflectance").value = {1, 0.75, 0.5};
    bsdf.value("specular_transmittance").value = {0.25, 0.5, 1};
    Scene scene = sphere_scene(bsdf, medium_of(1, 0.5, 0));
    scene.integrator.max_depth = 611;
    scene.integrator.rr_depth = 5;
    for (const int width : widths()) {
      PathBench bench(device(), scene, {.width = width});
      const std::vector<Path> paths = arrivals(bench, Queue::dielectric, 4001);
      std::vector<Path> after = paths;
      bench.run(Queue::dielectric, after);
      BoundaryCheck check;
      for (std::size_t i = 0; i < paths.size(); ++i) {
        const Vec3 normal = unit(paths[i].position);
        const HostFrame frame(normal);
        const Vector3<double> wi = frame.to_local(along({0, 0, 0}, -1, paths[i].direction));
        const double far = wi.z > 0 ? eta : 1 / eta, u = bench.random(paths[i], 0)[0];
        if (std::abs(u - fresnel_dielectric(std::abs(wi.z), far)) < 1e-5) continue;
        Vector3<double> wo;
        double weight;
        bool reflects;
        dielectric_sample(far, wi, u, &wo, &weight, &reflects);
        // near the critical angle float sees another square root
        if (!reflects && std::abs(wo.z) < 0.03) continue;
        check.add(bench, paths[i], after[i], {reflects, frame.to_world(wo), 1, far},
                  bsdf.value("specular_reflectance").value, bsdf.value("specular_transmittance").value, 611, 5);
      }
      CAPTURE(eta, width);
      CHECK(check.wrong == 0);
      CHECK(check.died > 100);
      CHECK(check.reflected > 100);
      CHECK(check.direction < 2e-5);
      CHECK(check.throughput < 1e-6);
      CHECK(check.scale < 1e-6);
      CHECK(check.position < 3e-7);
    }
  }
}

TEST_CASE("stage rough dielectric follows the microfacet model") {
  for (const std::string distribution : {"beckmann", "ggx"}) {
    Bsdf bsdf = bsdf_of("roughdielectric", 1.33, 0.3, distribution);
    bsdf.value("specular_reflectance").value = {1, 0.75, 0.5};
    Scene scene = sphere_scene(bsdf, medium_of(1, 0.5, 0));
    scene.integrator.max_depth = 611;
    scene.integrator.rr_depth = 5;
    const int kind = distribution == "ggx" ? MICROFACET_GGX : MICROFACET_BECKMANN;
    const Queue queue = distribution == "ggx" ? Queue::rough_ggx : Queue::rough_beckmann;
    for (const int width : widths()) {
      PathBench bench(device(), scene, {.width = width});
      const std::vector<Path> paths = arrivals(bench, queue, 4001);
      std::vector<Path> after = paths;
      bench.run(queue, after);
      BoundaryCheck check;
      std::size_t undecided = 0;
      for (std::size_t i = 0; i < paths.size(); ++i) {
        const HostFrame frame(unit(paths[i].position));
        const Vector3<double> wi = frame.to_local(along({0, 0, 0}, -1, paths[i].direction));
        const double far = wi.z > 0 ? 1.33 : 1 / 1.33;
        const auto u = bench.random(paths[i], 0);
        Vector3<double> wo, other;
        double weight, pdf, other_weight, other_pdf;
        bool reflects, above, below;
        rough_dielectric_sample(kind, 0.3, far, wi, u[0], u[1], u[2], &wo, &weight, &pdf, &reflects);
        rough_dielectric_sample(kind, 0.3, far, wi, u[0] + 1e-4, u[1], u[2], &other, &other_weight, &other_pdf, &above);
        rough_dielectric_sample(kind, 0.3, far, wi, u[0] - 1e-4, u[1], u[2], &other, &other_weight, &other_pdf, &below);
        // near the threshold, the critical angle and the horizon rounding decides or is magnified
        if (above != below || std::abs(wo.z) < 0.03 || std::abs(wi.z) < 0.03 || (!reflects && pdf > 20)) {
          ++undecided;
          continue;
        }
        check.add(bench, paths[i], after[i],
                  {reflects, frame.to_world(wo), reflects ? weight : weight * far * far, far},
                  bsdf.value("specular_reflectance").value, {1, 1, 1}, 611, 5);
      }
      CAPTURE(kind, width);
      CHECK(undecided < 800);
      CHECK(check.wrong == 0);
      CHECK(check.died > 100);
      CHECK(check.reflected > 100);
      CHECK(check.direction < 1e-4);
      CHECK(check.throughput < 1e-4);
      CHECK(check.scale < 1e-6);
      CHECK(check.position < 3e-7);
    }
  }
}
