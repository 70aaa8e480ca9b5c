#include "runtime/scene/mesh_repair.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "runtime/scene/box.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

Vec3 to_double(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

// Angle between unit vectors, exact also near 0 and pi.
double angle_between(const Vec3& a, const Vec3& b) {
  return dot(a, b) < 0 ? M_PI - 2 * std::asin(std::min(1.0, length(a + b) / 2))
                       : 2 * std::asin(std::min(1.0, length(b - a) / 2));
}

// For each vertex the number of its position: equal positions, equal numbers.
std::vector<std::uint32_t> number_positions(const Mesh& mesh) {
  std::vector<std::uint32_t> order(mesh.position.size()), number(mesh.position.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto& p = mesh.position;
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return p[a] < p[b]; });
  std::uint32_t current = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i > 0 && p[order[i]] != p[order[i - 1]]) ++current;
    number[order[i]] = current;
  }
  return number;
}

struct Edge {
  std::uint32_t low, high;  // position numbers
  std::uint32_t from, to;   // vertices, in the direction the triangle runs
  bool forward;             // does it run from low to high?
};

// Equal edges side by side: a counting sort by the low end, then each short bucket by the high end.
void group_by_ends(std::vector<Edge>& edges, std::size_t position_count) {
  std::vector<std::size_t> start(position_count + 1, 0);
  for (const Edge& e : edges) ++start[e.low + 1];
  std::partial_sum(start.begin(), start.end(), start.begin());
  std::vector<Edge> sorted(edges.size());
  std::vector<std::size_t> next(start.begin(), start.end() - 1);
  for (const Edge& e : edges) sorted[next[e.low]++] = e;
  for (std::size_t i = 0; i < position_count; ++i)
    std::sort(sorted.begin() + static_cast<std::ptrdiff_t>(start[i]),
              sorted.begin() + static_cast<std::ptrdiff_t>(start[i + 1]),
              [](const Edge& a, const Edge& b) { return a.high < b.high; });
  edges = std::move(sorted);
}

}  // namespace

void compute_normals(Mesh& mesh) {
  std::vector<Vec3> sum(mesh.position.size(), Vec3{0, 0, 0});
  for (const auto& t : mesh.triangle) {
    const Vec3 corner[3] = {to_double(mesh.position[t[0]]), to_double(mesh.position[t[1]]),
                            to_double(mesh.position[t[2]])};
    const Vec3 normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
    if (!(length(normal) > 0)) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 a = normalize(corner[(i + 1) % 3] - corner[i]), b = normalize(corner[(i + 2) % 3] - corner[i]);
      sum[t[i]] = sum[t[i]] + (angle_between(a, b) / length(normal)) * normal;
    }
  }
  mesh.normal.resize(sum.size());
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const double size = length(sum[i]);
    const Vec3 n = size > 0 ? (1 / size) * sum[i] : Vec3{1, 0, 0};
    mesh.normal[i] = {static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])};
  }
}

void flip(Mesh& mesh) {
  for (auto& t : mesh.triangle) std::swap(t[1], t[2]);
  for (auto& n : mesh.normal) n = {-n[0], -n[1], -n[2]};
}

std::size_t drop_degenerate(Mesh& mesh) {
  const std::size_t before = mesh.triangle.size();
  const auto flat = [&](const std::array<std::uint32_t, 3>& t) {
    const Vec3 a = to_double(mesh.position[t[0]]);
    return !(length(cross(to_double(mesh.position[t[1]]) - a, to_double(mesh.position[t[2]]) - a)) > 0);
  };
  mesh.triangle.erase(std::remove_if(mesh.triangle.begin(), mesh.triangle.end(), flat), mesh.triangle.end());
  return before - mesh.triangle.size();
}

void set_on_floor(Mesh& mesh) {
  const Box box = box_of(mesh);
  const Vec3 low = to_double(box.low), high = to_double(box.high);
  const double scale = 1 / std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  const Vec3 foot{(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]};
  for (auto& p : mesh.position)
    for (std::size_t k = 0; k < 3; ++k) p[k] = static_cast<float>((p[k] - foot[k]) * scale);
}

Topology topology(const Mesh& mesh) {
  const std::vector<std::uint32_t> number = number_positions(mesh);
  Topology result;
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangle.size());
  for (const auto& t : mesh.triangle) {
    const Vec3 a = to_double(mesh.position[t[0]]), b = to_double(mesh.position[t[1]]),
               c = to_double(mesh.position[t[2]]);
    result.volume += dot(a, cross(b, c)) / 6;
    if (number[t[0]] == number[t[1]] || number[t[1]] == number[t[2]] || number[t[2]] == number[t[0]]) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t from = t[i], to = t[(i + 1) % 3];
      edges.push_back({std::min(number[from], number[to]), std::max(number[from], number[to]), from, to,
                       number[from] < number[to]});
    }
  }
  group_by_ends(edges, *std::max_element(number.begin(), number.end()) + 1);
  for (std::size_t first = 0, last = 0; first < edges.size(); first = last) {
    while (last < edges.size() && edges[last].low == edges[first].low && edges[last].high == edges[first].high) ++last;
    const Vec3 middle = 0.5 * (to_double(mesh.position[edges[first].from]) + to_double(mesh.position[edges[first].to]));
    if (last - first == 1) {
      if (result.open_edges++ == 0) result.open_at = middle;
    } else if (last - first > 2) {
      if (result.non_manifold_edges++ == 0) result.non_manifold_at = middle;
    } else if (edges[first].forward == edges[first + 1].forward) {
      if (result.turned_edges++ == 0) result.turned_at = middle;
    }
  }
  return result;
}

}  // namespace itn
