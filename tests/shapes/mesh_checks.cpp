#include "tests/shapes/mesh_checks.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <set>

#include "runtime/base/random.h"
#include "runtime/scene/mesh/mesh_topology.h"
#include "runtime/scene/shapes/polygonise.h"
#include "runtime/scene/transform.h"

namespace itn::test {
namespace {

Vec3 at(const Mesh& mesh, std::uint32_t vertex) {
  const auto& p = mesh.position[vertex];
  return {p[0], p[1], p[2]};
}

Vec3 normal_of(const Mesh& mesh, const std::array<std::uint32_t, 3>& t) {
  return cross(at(mesh, t[1]) - at(mesh, t[0]), at(mesh, t[2]) - at(mesh, t[0]));
}

// Does the segment from p to q go through the triangle?
bool goes_through(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto side = [](const Vec3& i, const Vec3& j, const Vec3& k, const Vec3& l) {
    return dot(j - i, cross(k - i, l - i));
  };
  if (side(a, b, c, p) * side(a, b, c, q) >= 0) return false;
  const double x = side(p, q, a, b), y = side(p, q, b, c), z = side(p, q, c, a);
  return (x > 0 && y > 0 && z > 0) || (x < 0 && y < 0 && z < 0);
}

}  // namespace

void check_closed(const Mesh& mesh) {
  // The triangles around each vertex, as a map from a neighbour to the next one around.
  std::vector<std::vector<std::array<std::uint32_t, 2>>> fan(mesh.position.size());
  double shortest = 1, largest_turn = -1;
  std::vector<double> agreement(mesh.position.size(), -1);
  for (const auto& t : mesh.triangle) {
    const Vec3 normal = normal_of(mesh, t);
    const double area = length(normal);
    largest_turn = std::max(largest_turn, area > 0 ? -1.0 : 1.0);
    for (std::size_t i = 0; i < 3; ++i) {
      fan[t[i]].push_back({t[(i + 1) % 3], t[(i + 2) % 3]});
      shortest = std::min(shortest, length(at(mesh, t[i]) - at(mesh, t[(i + 1) % 3])));
      const auto& n = mesh.normal[t[i]];
      agreement[t[i]] = std::max(agreement[t[i]], dot(Vec3{n[0], n[1], n[2]}, (1 / area) * normal));
    }
  }
  CHECK(shortest > 1e-5);
  CHECK(largest_turn < 0);  // no triangle without area
  std::size_t broken_fans = 0, bad_normals = 0;
  for (std::size_t vertex = 0; vertex < fan.size(); ++vertex) {
    const auto& steps = fan[vertex];
    std::size_t walked = 0;
    std::uint32_t now = steps.empty() ? 0 : steps[0][0];
    do {
      const auto next = std::find_if(steps.begin(), steps.end(), [&](const auto& s) { return s[0] == now; });
      if (next == steps.end()) break;
      now = (*next)[1];
      ++walked;
    } while (now != steps[0][0] && walked <= steps.size());
    broken_fans += steps.empty() || walked != steps.size();
    const auto& n = mesh.normal[vertex];
    const double size = length(Vec3{n[0], n[1], n[2]});
    bad_normals += !(std::abs(size - 1) < 1e-5) || !(agreement[vertex] > 0);
  }
  CHECK(broken_fans == 0);
  CHECK(bad_normals == 0);
  const Topology found = topology(mesh);
  CHECK(found.closed());
  CHECK(found.volume > 0);
  CHECK(genus(mesh) >= 0);
}

void check_normalised(const Mesh& mesh) {
  Vec3 low{9, 9, 9}, high{-9, -9, -9};
  for (const auto& p : mesh.position)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min<double>(low[k], p[k]);
      high[k] = std::max<double>(high[k], p[k]);
    }
  CHECK(std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}) == Approx(1).margin(1e-6));
  CHECK(low[2] == 0);
  CHECK(low[0] + high[0] == Approx(0).margin(1e-6));
  CHECK(low[1] + high[1] == Approx(0).margin(1e-6));
}

std::size_t intersections(const Mesh& mesh) {
  // Triangles by the cells of a grid that their boxes touch.
  constexpr double cell = 0.05;
  std::map<std::array<int, 3>, std::vector<std::uint32_t>> grid;
  for (std::uint32_t i = 0; i < mesh.triangle.size(); ++i) {
    std::array<int, 3> low, high;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& t = mesh.triangle[i];
      const auto [least, most] = std::minmax({mesh.position[t[0]][k], mesh.position[t[1]][k], mesh.position[t[2]][k]});
      low[k] = static_cast<int>(std::floor(least / cell));
      high[k] = static_cast<int>(std::floor(most / cell));
    }
    for (int x = low[0]; x <= high[0]; ++x)
      for (int y = low[1]; y <= high[1]; ++y)
        for (int z = low[2]; z <= high[2]; ++z) grid[{x, y, z}].push_back(i);
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> found;
  for (const auto& [key, members] : grid)
    for (const std::uint32_t i : members)
      for (const std::uint32_t j : members) {
        const auto &s = mesh.triangle[i], &t = mesh.triangle[j];
        if (std::find_first_of(s.begin(), s.end(), t.begin(), t.end()) != s.end()) continue;
        for (std::size_t e = 0; e < 3; ++e)
          if (goes_through(at(mesh, s[e]), at(mesh, s[(e + 1) % 3]), at(mesh, t[0]), at(mesh, t[1]), at(mesh, t[2])))
            found.insert(std::minmax(i, j));
      }
  return found.size();
}

double steepest_slope(const std::function<double(const Vec3&)>& f, int pairs) {
  double steepest = 0;
  std::uint64_t drawn = 0;
  for (int i = 0; i < pairs; ++i) {
    Vec3 a, b;
    for (std::size_t k = 0; k < 3; ++k) {
      a[k] = 4 * random_uniform(1, 0, drawn++) - 2;
      b[k] = a[k] + 0.01 * (2 * random_uniform(1, 0, drawn++) - 1);
    }
    steepest = std::max(steepest, std::abs(f(a) - f(b)) / length(a - b));
  }
  return steepest;
}

}  // namespace itn::test
