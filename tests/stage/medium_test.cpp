// Stage medium, one event at a time: flights, scatterings, roulette and the end of paths against double precision.
#include <catch2/catch.hpp>

#include "host_model.h"
#include "kernels/model/phase/henyey_greenstein.h"
#include "kernels/model/shading_frame.h"
#include "path_bench.h"
#include "scenes.h"
#include "stage_test.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr int once = 0x40000000;  // SCATTERED_ONCE of path_state.h

// Paths inside the unit sphere.
std::vector<Path> inside_sphere(std::size_t n) {
  std::vector<Path> paths(n);
  for (std::size_t i = 0; i < n; ++i) {
    Path& p = paths[i];
    const double k = static_cast<double>(i);
    p.position = {0.6 * std::sin(k), 0.6 * std::sin(1.7 * k), 0.3 * std::cos(2.3 * k)};
    p.direction = unit({std::cos(3.1 * k), std::sin(5.3 * k), std::sin(0.7 * k) + 0.01});
    p.pixel = static_cast<int>(i);
    p.medium = 0;
    p.depth = static_cast<int>(i % 8);
    p.throughput = {0.9, 0.6, 0.3};
    if (i % 7 < 3)
      for (double& t : p.throughput) t *= 0.4;  // where roulette ends what is faint
    if (i % 5 == 4) p.depth += 600;             // where roulette also ends what loses nothing
    if (i % 10 == 9)
      for (double& t : p.throughput) t *= 100;  // but what is heavy
    p.radiance = {0.5, 0.5, 0.5};
    p.event = 2;
    p.queue = Queue::medium;
  }
  return paths;
}

Scene medium_scene(const std::string& kind, double sigma_t, double g) {
  Scene scene = sphere_scene(bsdf_of(kind), medium_of(sigma_t, 0.5, g));
  scene.media[0].set("albedo", Rgb{0.9, 0.7, 0.5});
  scene.integrator.max_depth = 607;
  scene.integrator.rr_depth = 4;
  return scene;
}

struct MediumCheck {
  std::size_t wrong = 0, arrived = 0, scattered = 0, died = 0, undecided = 0;
  double position = 0, direction = 0, throughput = 0, weight = 0;
};

MediumCheck check_event(const Scene& scene, const PathBench& bench, const std::vector<Path>& paths,
                        const std::vector<Path>& after, bool spectral, bool single) {
  MediumCheck check;
  const Rgb sigma_t = scene.media[0].colour("sigma_t"), albedo = scene.media[0].colour("albedo");
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const Path &p = paths[i], &q = after[i];
    const auto u = bench.random(p, 0);
    const double sigma = sigma_t[static_cast<std::size_t>(spectral ? p.hero : 0)];
    const double flight = -std::log(u[0]) / sigma, surface = closest(scene, p.position, p.direction, 1e-6).t;
    if (std::abs(flight - surface) < 1e-4) {
      ++check.undecided;
      continue;
    }
    const bool meets = surface < flight;
    const double d = std::min(surface, flight);
    Rgb spectral_weight = p.spectral_weight;
    if (spectral) {
      double sum = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        spectral_weight[c] *= std::exp((sigma - sigma_t[c]) * d) * (meets ? 1 : sigma_t[c] / sigma);
        sum += spectral_weight[c];
      }
      for (double& weight : spectral_weight) weight *= 3 / sum;
    }
    Rgb throughput = p.throughput;
    if (!meets)
      for (std::size_t c = 0; c < 3; ++c) throughput[c] *= albedo[c];
    const auto check_state = [&] {
      check.position = std::max(check.position, distance(q.position, along(p.position, d, p.direction)));
      for (std::size_t c = 0; c < 3; ++c) {
        check.throughput = std::max(check.throughput, std::abs(q.throughput[c] / throughput[c] - 1));
        if (spectral) check.weight = std::max(check.weight, std::abs(q.spectral_weight[c] / spectral_weight[c] - 1));
      }
      check.wrong += q.radiance != p.radiance || q.event != p.event + 1 || q.medium != 0 || q.pixel != p.pixel;
    };
    if (meets) {
      ++check.arrived;
      const Queue boundary = scene.bsdfs[0].type() == "null" ? Queue::null : Queue::dielectric;
      check.wrong += q.queue != boundary || q.depth != p.depth || q.hit < 0;
      check.direction = std::max(check.direction, distance(q.direction, p.direction));
      check_state();
      continue;
    }
    const int depth = (p.depth & (once - 1)) + 1;
    double largest = 0, weight = 1;
    for (std::size_t c = 0; c < 3; ++c) {
      if (spectral) weight = spectral_weight[c];
      largest = std::max(largest, throughput[c] * weight);
    }
    const double survival = test::survival(depth, largest, 1);
    if (depth > scene.integrator.rr_depth && std::abs(u[3] - survival) < 1e-4) {
      ++check.undecided;
      continue;
    }
    const bool again = single && p.depth >= once;
    if (again || depth >= scene.integrator.max_depth || (depth > scene.integrator.rr_depth && u[3] >= survival)) {
      ++check.died;
      check.wrong += q.queue != Queue::free || q.sample_radiance != p.radiance;
      continue;
    }
    if (depth > scene.integrator.rr_depth)
      for (double& t : throughput) t /= survival;
    ++check.scattered;
    double cosine, sine;
    henyey_greenstein_sample((scene.media[0].phase.type() == "hg" ? scene.media[0].phase.number("g") : 0.0), u[1],
                             &cosine, &sine);
    Vector3<double> s, t;
    const Vector3<double> n{p.direction[0], p.direction[1], p.direction[2]};
    shading_frame(n, &s, &t);
    const double phi = 2 * pi * u[2];
    const Vector3<double> w = to_world(s, t, n, {sine * std::cos(phi), sine * std::sin(phi), cosine});
    check.direction = std::max(check.direction, distance(q.direction, {w.x, w.y, w.z}));
    check.wrong += q.queue != Queue::medium || q.depth != depth + (single ? once : 0) || q.skip != -1;
    check_state();
  }
  return check;
}

void require_exact(const MediumCheck& check) {
  CHECK(check.wrong == 0);
  CHECK(check.arrived > 100);
  CHECK(check.scattered > 100);
  CHECK(check.died > 50);
  CHECK(check.undecided < 20);
  CHECK(check.position < 3e-6);
  CHECK(check.direction < 3e-6);
  CHECK(check.throughput < 1e-6);
  CHECK(check.weight < 2e-6);
}

}  // namespace

TEST_CASE("stage medium flies, scatters and ends paths as the formulas say") {
  for (const char* kind : {"null", "dielectric"})
    for (const double g : {0.0, 0.8, -0.5})
      for (const int width : widths()) {
        const Scene scene = medium_scene(kind, 1.2, g);
        PathBench bench(device(), scene, {.width = width});
        const std::vector<Path> paths = inside_sphere(2001);
        std::vector<Path> after = paths;
        bench.run(Queue::medium, after);
        CAPTURE(kind, g, width);
        require_exact(check_event(scene, bench, paths, after, false, false));
      }
}

TEST_CASE("sigma_t with colours: flights with the hero's, weights by the densities of all kept") {
  for (const int width : widths()) {
    Scene scene = medium_scene("null", 1, 0.3);
    scene.media[0].set("sigma_t", Rgb{0.5, 1.5, 3});
    PathBench bench(device(), scene, {.width = width});
    std::vector<Path> paths = inside_sphere(2001);
    for (std::size_t i = 0; i < paths.size(); ++i) {
      paths[i].hero = static_cast<int>(i % 3);
      if (i % 5 == 0) paths[i].spectral_weight = {0.4, 1.6, 1};
    }
    std::vector<Path> after = paths;
    bench.run(Queue::medium, after);
    CAPTURE(width);
    require_exact(check_event(scene, bench, paths, after, true, false));
  }
}

TEST_CASE("operator single ends paths at their second scattering in a medium") {
  for (const int width : widths()) {
    const Scene scene = medium_scene("dielectric", 1.2, 0.3);
    PathBench bench(device(), scene, {.op = Operator::single, .width = width});
    std::vector<Path> paths = inside_sphere(2001);
    for (std::size_t i = 0; i < paths.size(); i += 3) paths[i].depth += once;
    std::vector<Path> after = paths;
    bench.run(Queue::medium, after);
    std::vector<Path> first, first_after;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      if (i % 3 == 0) continue;
      first.push_back(paths[i]);
      first_after.push_back(after[i]);
    }
    CAPTURE(width);
    require_exact(check_event(scene, bench, first, first_after, false, true));
    for (std::size_t i = 0; i < paths.size(); i += 3)  // a second scattering ends them, arrivals go on
      REQUIRE(
          (after[i].queue == Queue::free || (after[i].queue == Queue::dielectric && after[i].depth == paths[i].depth)));
  }
}

TEST_CASE("several events in one launch are the same events as one at a time") {
  Scene scene = medium_scene("dielectric", 4, 0.5);
  scene.integrator.max_depth = 7;
  for (const int width : widths()) {
    PathBench one(device(), scene, {.width = width, .medium_events = 1});
    PathBench many(device(), scene, {.width = width, .medium_events = 64});
    std::vector<Path> a = inside_sphere(501), b = a;
    const auto waits = [](const std::vector<Path>& paths) {
      return std::any_of(paths.begin(), paths.end(), [](const Path& p) { return p.queue == Queue::medium; });
    };
    int launches = 0;
    while (waits(a)) one.run(Queue::medium, a);
    for (; waits(b); ++launches) many.run(Queue::medium, b);
    CAPTURE(width);
    CHECK(launches < 10);
    std::size_t different = 0;
    double error = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      different += a[i].queue != b[i].queue || a[i].event != b[i].event || a[i].depth != b[i].depth;
      error = std::max({error, distance(a[i].position, b[i].position), distance(a[i].direction, b[i].direction)});
    }
    CHECK(different == 0);
    CHECK(error == 0);
  }
}

TEST_CASE("free flights are exponential and turns follow the phase function") {
  for (const int width : widths()) {
    Scene scene = medium_scene("null", 2, 0.6);
    scene.shapes[0].radius = 100;
    PathBench bench(device(), scene, {.width = width});
    std::vector<Path> paths = inside_sphere(20000);
    for (Path& p : paths) p.depth = 0;
    std::vector<Path> after = paths;
    bench.run(Queue::medium, after);
    std::vector<double> flights, cosines;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      REQUIRE(after[i].queue == Queue::medium);
      flights.push_back(distance(paths[i].position, after[i].position));
      cosines.push_back(dot(paths[i].direction, after[i].direction));
    }
    CAPTURE(width);
    CHECK(largest_gap(flights, [](double d) { return 1 - std::exp(-2 * d); }) < kolmogorov_bound(paths.size()));
    CHECK(largest_gap(cosines, [](double c) {
            const double g = 0.6;  // integral of Henyey and Greenstein's function from -1
            return (1 - g * g) / (2 * g) * (1 / std::sqrt(1 + g * g - 2 * g * c) - 1 / (1 + g));
          }) < kolmogorov_bound(paths.size()));
  }
}

TEST_CASE("a medium without extinction is crossed, albedo 0 ends paths") {
  for (const int width : widths()) {
    Scene scene = medium_scene("null", 0, 0);
    {
      PathBench bench(device(), scene, {.width = width});
      std::vector<Path> paths = inside_sphere(100);
      bench.run(Queue::medium, paths);
      for (const Path& p : paths) REQUIRE(p.queue == Queue::null);
    }
    scene.media[0].set("sigma_t", 1000);
    scene.media[0].set("albedo", 0);
    PathBench bench(device(), scene, {.width = width});
    std::vector<Path> paths = inside_sphere(100);
    for (Path& p : paths) p.depth = 0;
    bench.run(Queue::medium, paths);
    for (const Path& p : paths) REQUIRE(p.queue == Queue::free);
  }
}
