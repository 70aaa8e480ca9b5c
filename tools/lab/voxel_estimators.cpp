// g++ -O2 -std=c++20 tools/lab/voxel_estimators.cpp -lfmt -o voxel_estimators && ./voxel_estimators
//
// Three ways to estimate the gradient of a path tracer by all voxels of an extinction grid, in double precision and
// nothing but what they need, side by side: ours (kernels/derivative/voxel_gradient.h, kernels/scattering/probe.h),
// differential ratio tracking (Nimier-David et al. 2022, doi:10.1145/3528223.3530073) and sample matching (Yu et al.
// 2026, doi:10.1145/3811329). Each is written here from what the papers say of it, and all share one path tracer, so
// that what differs is the estimator.
//
// A path's flight from x along w brings the integral of T(s) sigma(s) a J(s) over s, T: transmittance, J: what is
// scattered at s towards x, and T(D) L(D) from the end D of the medium. By the extinction at a place t that is
//   - T(t) L(t)     of what comes from behind   ("extinction")
//   + T(t) a J(t)   of what is scattered there  ("scattering")
// all: s by a free flight; extinction at places up to s, times what the path gathers from there on.
//   ours               extinction at one place in each coarse cell up to s; scattering at s by 1 / max(sigma, knee),
//   and, for what that lacks, at the
//                      place of a probe up to s, which is drawn without regard to sigma from cells that are thin
//                      somewhere
//   ratio tracking     extinction at a uniform place up to s; scattering at a probe that is drawn in proportion to T,
//   by ratio tracking and a reservoir;
//                      "with MIS" scattering at s too, by 1 / (sigma + knee)
//   sample matching    extinction and scattering at one probe, uniform up to s, as T(t) is the chance of s > t
// A probe is a path of its own. Either each flight has one, as published, or each path has one, at a flight that is
// drawn in proportion to what it is expected to tell.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <functional>
#include <numeric>
#include <random>
#include <string>
#include <vector>

namespace {

using Vec = std::array<double, 3>;
using Random = std::mt19937_64;

double uniform(Random& random) { return (static_cast<double>(random() >> 11) + 0.5) * 0x1p-53; }

Vec along(const Vec& x, const Vec& w, double t) { return {x[0] + t * w[0], x[1] + t * w[1], x[2] + t * w[2]}; }

// The unit cube in voxels, each of one value; coarse cells of two voxels along an axis, as the renderer's of a
// grid of 64^3, know their greatest and least value.
struct World {
  std::array<int, 3> size{1, 1, 1};
  std::vector<double> sigma, albedo;
  bool rod = false;  // light goes along x alone, and turns round at every other scattering

  std::array<int, 3> cells{};
  std::vector<double> greatest, least;
  double knee = 0;

  static constexpr int voxels_a_cell = 2;

  std::size_t voxel(const Vec& p) const {
    std::size_t index = 0;
    for (std::size_t a = 3; a-- > 0;)
      index = index * static_cast<std::size_t>(size[a]) +
              static_cast<std::size_t>(std::clamp(static_cast<int>(p[a] * size[a]), 0, size[a] - 1));
    return index;
  }

  void finish() {
    for (std::size_t a = 0; a < 3; ++a) cells[a] = (size[a] + voxels_a_cell - 1) / voxels_a_cell;
    const auto count = static_cast<std::size_t>(cells[0] * cells[1] * cells[2]);
    greatest.assign(count, 0);
    least.assign(count, 1e300);
    for (int z = 0; z < size[2]; ++z)
      for (int y = 0; y < size[1]; ++y)
        for (int x = 0; x < size[0]; ++x) {
          const double v = sigma[static_cast<std::size_t>((z * size[1] + y) * size[0] + x)];
          const auto c = static_cast<std::size_t>(((z / voxels_a_cell) * cells[1] + y / voxels_a_cell) * cells[0] +
                                                  x / voxels_a_cell);
          greatest[c] = std::max(greatest[c], v);
          least[c] = std::min(least[c], v);
        }
    // kernels/derivative/voxel_gradient.h
    knee = std::max(4.0, 0.25 * std::accumulate(sigma.begin(), sigma.end(), 0.0) / static_cast<double>(sigma.size()));
  }

  double light(const Vec& w) const { return rod ? (w[0] > 0 ? 1 : 0.2) : 0.2 + 1.5 * std::max(0.0, w[2]); }

  Vec scattered(Random& random) const {
    if (rod) return {uniform(random) < 0.5 ? 1.0 : -1.0, 0, 0};
    const double z = 2 * uniform(random) - 1, r = std::sqrt(1 - z * z), phi = 2 * M_PI * uniform(random);
    return {r * std::cos(phi), r * std::sin(phi), z};
  }
};

// A way through the coarse cells.
class Way {
 public:
  Way(const World& world, const Vec& x, const Vec& w) : world_(world) {
    for (std::size_t a = 0; a < 3; ++a) {
      const double n = world.cells[a], edge = World::voxels_a_cell / static_cast<double>(world.size[a]);
      cell_[a] = std::clamp(static_cast<int>(x[a] / edge), 0, static_cast<int>(n) - 1);
      step_[a] = w[a] > 0 ? 1 : -1;
      next_[a] = w[a] == 0 ? 1e300 : ((cell_[a] + (w[a] > 0 ? 1 : 0)) * edge - x[a]) / w[a];
      wide_[a] = w[a] == 0 ? 0 : edge / std::abs(w[a]);
      if (w[a] != 0) end_ = std::min(end_, ((w[a] > 0 ? 1.0 : 0.0) - x[a]) / w[a]);
    }
  }
  double at() const { return at_; }
  double wall() const { return std::min(end_, *std::min_element(next_.begin(), next_.end())); }
  double end() const { return end_; }
  std::size_t cell() const {
    return static_cast<std::size_t>((cell_[2] * world_.cells[1] + cell_[1]) * world_.cells[0] + cell_[0]);
  }
  bool inside() const { return at_ < end_; }
  void step() {
    const auto a = static_cast<std::size_t>(std::min_element(next_.begin(), next_.end()) - next_.begin());
    at_ = wall();
    cell_[a] += step_[a];
    next_[a] += wide_[a];
    if (cell_[a] < 0 || cell_[a] >= world_.cells[a]) at_ = end_;
  }

 private:
  const World& world_;
  std::array<int, 3> cell_{}, step_{};
  std::array<double, 3> next_{}, wide_{};
  double at_ = 0, end_ = 1e300;
};

// Calls f(t, rate) at tentative collisions at the greatest values' rate until it returns true. Returns t; else the end
// of the medium.
template <class Function>
double track(const World& world, const Vec& x, const Vec& w, Random& random, const Function& f) {
  Way way(world, x, w);
  while (way.inside()) {
    const double rate = world.greatest[way.cell()], wall = way.wall();
    for (double t = way.at() - std::log(uniform(random)) / rate; t < wall; t -= std::log(uniform(random)) / rate)
      if (f(t, rate)) return t;
    way.step();
  }
  return way.end();
}

struct Flight {
  double s;
  bool scatters;
};

Flight fly(const World& world, const Vec& x, const Vec& w, Random& random) {
  Flight flight{0, false};
  flight.s = track(world, x, w, random, [&](double t, double rate) {
    return flight.scatters = uniform(random) * rate < world.sigma[world.voxel(along(x, w, t))];
  });
  return flight;
}

constexpr int most_flights = 64;

// The radiance of a path that goes on from x along w.
double radiance(const World& world, Vec x, Vec w, Random& random) {
  double throughput = 1;
  for (int k = 0; k < most_flights; ++k) {
    const Flight flight = fly(world, x, w, random);
    if (!flight.scatters) return throughput * world.light(w);
    x = along(x, w, flight.s);
    const double a = world.albedo[world.voxel(x)];
    if (uniform(random) >= a) return 0;
    w = world.scattered(random);
  }
  return 0;
}

// The radiance that is scattered at x towards a path.
double scattered(const World& world, const Vec& x, Random& random) {
  return world.albedo[world.voxel(x)] * radiance(world, x, world.scattered(random), random);
}

struct Estimator {
  enum Kind { ours, ratio_tracking, ratio_tracking_mis, matching } kind = ours;
  int probes = 0;         // of a path, each at a flight from a part of its own; 0: one at each flight
  bool baseline = false;  // what a path brings on average is taken off what it brings; of the renderer's a simple case
};

// A probe that a flight may have: where, times which weight; `room`: what the flight is expected to tell.
struct Probe {
  Vec place{};
  double weight = 0, room = 0;
};

// Ours: the length of cells up to s that are thin somewhere, and a place in proportion to it.
Probe our_probe(const World& world, const Vec& x, const Vec& w, double s, Random& random) {
  const auto walk = [&](double target, double* at) {
    double room = 0;
    for (Way way(world, x, w); way.inside() && way.at() < s; way.step()) {
      if (world.least[way.cell()] >= world.knee) continue;
      const double length = std::min(way.wall(), s) - way.at();
      if (target >= room && target < room + length) *at = way.at() + target - room;
      room += length;
    }
    return room;
  };
  double at = 0;
  Probe probe;
  probe.room = walk(-1, &at);
  if (probe.room == 0) return probe;
  walk(uniform(random) * probe.room, &at);
  probe.place = along(x, w, at);
  probe.weight = probe.room * std::max(0.0, 1 - world.sigma[world.voxel(probe.place)] / world.knee);
  return probe;
}

// In proportion to the transmittance: one of the tentative collisions by their ratio weights. rate: at least this, so
// that empty cells have some.
Probe ratio_probe(const World& world, const Vec& x, const Vec& w, double least_rate, bool mis, Random& random) {
  Probe probe;
  double ratio = 1, sum = 0;
  for (Way way(world, x, w); way.inside(); way.step()) {
    const double rate = std::max(world.greatest[way.cell()], least_rate), wall = way.wall();
    for (double t = way.at() - std::log(uniform(random)) / rate; t < wall; t -= std::log(uniform(random)) / rate) {
      const Vec place = along(x, w, t);
      sum += ratio / rate;
      if (uniform(random) * sum < ratio / rate) probe.place = place;
      ratio *= 1 - world.sigma[world.voxel(place)] / rate;
    }
  }
  probe.weight = probe.room = sum;
  if (mis && sum > 0) probe.weight *= world.knee / (world.sigma[world.voxel(probe.place)] + world.knee);
  return probe;
}

// s: where the flight ends
Probe draw_probe(const World& world, Estimator::Kind kind, const Vec& x, const Vec& w, double s, Random& random) {
  if (kind == Estimator::ours) return our_probe(world, x, w, s, random);
  if (kind == Estimator::matching) return {along(x, w, uniform(random) * s), s, s};
  return ratio_probe(world, x, w, 1, kind == Estimator::ratio_tracking_mis, random);
}

// One path, whose gradient is added to `gradient`. expected: of scores of mean 0, with those of the probes, times this
// nothing changes but the noise. Returns what the path brings.
double differentiate(const World& world, const Estimator& by, double expected, Random& random,
                     std::vector<double>& gradient) {
  struct Event {
    Vec x, w;
    double s;
    bool scatters;
    Probe probe;
  };
  std::vector<Event> events;
  Vec x{0, 0.5, 0.5}, w{1, 0, 0};
  if (!world.rod) {
    x = {1e-9, uniform(random), uniform(random)};
    const double r = std::sqrt(uniform(random)), phi = 2 * M_PI * uniform(random);
    w = {std::sqrt(1 - r * r), r * std::cos(phi), r * std::sin(phi)};
  }
  // Albedos decide who goes on, so that the throughput of who does is 1.
  double brings = 0;
  for (int k = 0; k < most_flights; ++k) {
    const Flight flight = fly(world, x, w, random);
    Event e{x, w, flight.s, flight.scatters, {}};
    e.probe = draw_probe(world, by.kind, x, w, flight.s, random);
    events.push_back(e);
    if (!flight.scatters) {
      brings = world.light(w);
      break;
    }
    x = along(x, w, flight.s);
    if (uniform(random) >= world.albedo[world.voxel(x)]) break;
    w = world.scattered(random);
  }
  const auto add = [&](const Vec& place, double value) { gradient[world.voxel(place)] += value; };
  const double rest = brings - expected;
  for (const Event& e : events) {
    if (by.kind == Estimator::ours) {
      const double u = uniform(random);
      for (Way way(world, e.x, e.w); way.inside() && way.at() < e.s && rest != 0; way.step()) {
        const double to = std::min(way.wall(), e.s);
        add(along(e.x, e.w, way.at() + u * (to - way.at())), -(to - way.at()) * rest);
      }
    } else if (by.kind != Estimator::matching) {
      add(along(e.x, e.w, uniform(random) * e.s), -e.s * rest);
    }
    if (!e.scatters || by.kind == Estimator::matching || by.kind == Estimator::ratio_tracking) continue;
    const Vec end = along(e.x, e.w, e.s);
    const double sigma = world.sigma[world.voxel(end)];
    add(end, rest / (by.kind == Estimator::ours ? std::max(sigma, world.knee) : sigma + world.knee));
  }
  const auto tell = [&](const Probe& probe, double share) {
    if (probe.weight == 0) return;
    const double lost = by.kind == Estimator::matching ? brings : expected;
    add(probe.place, share * probe.weight * (scattered(world, probe.place, random) - lost));
  };
  double sum = 0;
  for (const Event& e : events) {
    sum += e.probe.room;
    if (by.probes == 0) tell(e.probe, 1);
  }
  for (int k = 0; k < by.probes; ++k) {
    double target = (uniform(random) + k) / by.probes * sum;
    for (const Event& e : events) {
      if (target < e.probe.room) {
        const Probe probe = k == 0 ? e.probe : draw_probe(world, by.kind, e.x, e.w, e.s, random);
        tell(probe, sum / by.probes / e.probe.room);
        break;
      }
      target -= e.probe.room;
    }
  }
  return brings;
}

struct Statistics {
  std::vector<double> mean, stderr_;
  double variance = 0, seconds = 0;  // of a path: summed over the voxels; of a processor
};

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

Statistics measure(const World& world, const Estimator& by, int paths, std::uint64_t seed) {
  Random random(seed);
  const std::size_t n = world.sigma.size();
  std::vector<double> sum(n), square(n), own(n);
  const double begin = cpu_seconds();
  double expected = 0;
  constexpr int pilot = 2000;
  for (int k = 0; k < pilot && by.baseline; ++k) expected += differentiate(world, by, 0, random, own) / pilot;
  for (int k = 0; k < paths; ++k) {
    std::fill(own.begin(), own.end(), 0);
    differentiate(world, by, expected, random, own);
    for (std::size_t v = 0; v < n; ++v) {
      sum[v] += own[v];
      square[v] += own[v] * own[v];
    }
  }
  Statistics result;
  result.seconds = (cpu_seconds() - begin) / paths;
  for (std::size_t v = 0; v < n; ++v) {
    const double mean = sum[v] / paths, variance = square[v] / paths - mean * mean;
    result.mean.push_back(mean);
    result.stderr_.push_back(std::sqrt(variance / paths));
    result.variance += variance;
  }
  return result;
}

const std::vector<std::pair<std::string, Estimator>> estimators = {
    {"ours, one probe a path", {Estimator::ours, 1}},
    {"ours, a probe a flight", {Estimator::ours, 0}},
    {"ours with a baseline, one probe a path", {Estimator::ours, 1, true}},
    {"ours with a baseline, four a path", {Estimator::ours, 4, true}},
    {"ratio tracking, one a path", {Estimator::ratio_tracking, 1}},
    {"ratio tracking, one a flight", {Estimator::ratio_tracking, 0}},
    {"ratio tracking with MIS, one a path", {Estimator::ratio_tracking_mis, 1}},
    {"ratio tracking with MIS, one a flight", {Estimator::ratio_tracking_mis, 0}},
    {"sample matching, one a path", {Estimator::matching, 1}},
    {"sample matching, four a path", {Estimator::matching, 4}},
    {"sample matching, one a flight", {Estimator::matching, 0}},
};

// The rod's radiance at x = 0 against x, from the two streams' equation: in each voxel a matrix exponential.
double rod_radiance(const World& world) {
  using Matrix = std::array<double, 4>;
  const auto product = [](const Matrix& a, const Matrix& b) {
    return Matrix{a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2],
                  a[2] * b[1] + a[3] * b[3]};
  };
  Matrix all{1, 0, 0, 1};
  for (std::size_t v = 0; v < world.sigma.size(); ++v) {
    const double a = world.albedo[v], depth = world.sigma[v] / world.size[0];
    const Matrix m{depth * (a / 2 - 1), depth * a / 2, -depth * a / 2, depth * (1 - a / 2)};
    Matrix term{1, 0, 0, 1}, sum = term;
    for (int k = 1; k < 60; ++k) {
      term = product(term, m);
      for (std::size_t i = 0; i < 4; ++i) term[i] /= k;
      for (std::size_t i = 0; i < 4; ++i) sum[i] += term[i];
    }
    all = product(sum, all);
  }
  return (1 - all[2] * 0.2) / all[3];  // (I, J) at 1 = all (0.2, J at 0), and J at 1 is 1
}

World rod() {
  World world;
  world.rod = true;
  world.size = {10, 1, 1};
  world.sigma = {0, 3, 1, 0.2, 3,
                 0, 0, 0, 0,   2};  // coarse cells begin with their least value or their greatest; one is empty
  world.albedo = {0.9, 0.5, 1, 0.8, 0.7, 0.9, 0.6, 1, 0.9, 0.4};
  world.finish();
  return world;
}

World cube(const std::string& kind, double scale, double albedo) {
  World world;
  world.size = {8, 8, 8};
  for (int z = 0; z < 8; ++z)
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x) {
        const double dx = (x - 3.5) / 4, dy = (y - 3.5 - 0.4 * z + 1.4) / 3,
                     wave = 0.6 + 0.4 * std::sin(1.3 * x + 2.1 * z);
        world.sigma.push_back(scale * (kind == "constant" ? 0.3 : std::max(0.0, (1 - dx * dx - dy * dy) * wave)));
      }
  world.albedo.assign(world.sigma.size(), albedo);
  world.finish();
  return world;
}

// Compares the estimators' means with the exact derivatives of a rod, where it is empty or densest too. Returns how
// many are five standard errors off.
int compare_with_rod() {
  const World world = rod();
  int wrong = 0;
  for (const auto& [name, by] : estimators) {
    const Statistics found = measure(world, by, 200000, 7);
    for (std::size_t v = 0; v < world.sigma.size(); ++v) {
      World more = world, less = world;
      more.sigma[v] += 1e-4;
      less.sigma[v] -= 1e-4;
      const double exact = (rod_radiance(more) - rod_radiance(less)) / 2e-4;
      if (std::abs(found.mean[v] - exact) < 5 * found.stderr_[v]) continue;
      fmt::print("{}, voxel {}: {} +- {}, exact {}\n", name, v, found.mean[v], found.stderr_[v], exact);
      ++wrong;
    }
  }
  return wrong;
}

// Prints variance times time of gradients by voxels over that of ours.
void compare_with_each_other() {
  fmt::print("{:24} {:>38} {:>12} {:>10} {:>12} {:>12}\n", "scene", "estimator", "variance", "us a path", "times ours",
             "largest z");
  for (const std::string kind : {"plume", "constant"})
    for (const double scale : {3.0, 30.0})
      for (const double albedo : {0.6, 0.95}) {
        const World world = cube(kind, scale, albedo);
        Statistics ours;
        for (const auto& [name, by] : estimators) {
          const Statistics s = measure(world, by, 50000, 3);
          if (ours.mean.empty()) ours = s;
          double z = 0;
          for (std::size_t v = 0; v < s.mean.size(); ++v)
            if (s.stderr_[v] > 0 && ours.stderr_[v] > 0)
              z = std::max(z, std::abs(s.mean[v] - ours.mean[v]) / std::hypot(s.stderr_[v], ours.stderr_[v]));
          fmt::print("{:24} {:>38} {:12.4g} {:10.2f} {:12.2f} {:12.1f}\n",
                     fmt::format("{} {:g}, {:g}", kind, scale, albedo), name, s.variance, 1e6 * s.seconds,
                     s.variance * s.seconds / (ours.variance * ours.seconds), z);
        }
      }
}

}  // namespace

int main() {
  if (compare_with_rod() > 0) return 1;
  compare_with_each_other();
  return 0;
}
