#include "runtime/scene/mesh/mesh_topology.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "runtime/scene/transform.h"

namespace itn {
namespace {

// Equal edges side by side: a counting sort by the low end, then each short bucket by the high end.
void group_by_ends(std::vector<HalfEdge>& edges, std::size_t position_count) {
  std::vector<std::size_t> start(position_count + 1, 0);
  for (const HalfEdge& e : edges) ++start[e.low + 1];
  std::partial_sum(start.begin(), start.end(), start.begin());
  std::vector<HalfEdge> sorted(edges.size());
  std::vector<std::size_t> next(start.begin(), start.end() - 1);
  for (const HalfEdge& e : edges) sorted[next[e.low]++] = e;
  for (std::size_t i = 0; i < position_count; ++i)
    std::sort(sorted.begin() + static_cast<std::ptrdiff_t>(start[i]),
              sorted.begin() + static_cast<std::ptrdiff_t>(start[i + 1]), [](const HalfEdge& a, const HalfEdge& b) {
                return a.high != b.high ? a.high < b.high : a.triangle < b.triangle;
              });
  edges = std::move(sorted);
}

void count(std::size_t& counter, EdgePlace& place, const Mesh& mesh, const HalfEdge& edge) {
  if (counter++ == 0)
    place = {0.5 * (position_of(mesh, edge.from) + position_of(mesh, edge.to)), std::size_t{edge.triangle}};
}

}  // namespace

Vec3 position_of(const Mesh& mesh, std::uint32_t vertex) {
  const std::array<float, 3>& p = mesh.position[vertex];
  return {p[0], p[1], p[2]};
}

Vec3 area_normal(const Mesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  const Vec3 a = position_of(mesh, triangle[0]);
  return cross(position_of(mesh, triangle[1]) - a, position_of(mesh, triangle[2]) - a);
}

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

std::vector<HalfEdge> half_edges(const Mesh& mesh, const std::vector<std::uint32_t>& number) {
  std::vector<HalfEdge> edges;
  edges.reserve(3 * mesh.triangle.size());
  for (std::uint32_t i = 0; i < mesh.triangle.size(); ++i) {
    const auto& t = mesh.triangle[i];
    if (number[t[0]] == number[t[1]] || number[t[1]] == number[t[2]] || number[t[2]] == number[t[0]]) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = t[k], to = t[(k + 1) % 3];
      edges.push_back({std::min(number[from], number[to]), std::max(number[from], number[to]), from, to, i,
                       number[from] < number[to]});
    }
  }
  if (!edges.empty()) group_by_ends(edges, *std::max_element(number.begin(), number.end()) + std::size_t{1});
  return edges;
}

int net_winding(const HalfEdge* first, const HalfEdge* last) {
  int net = 0;
  for (; first != last; ++first) net += first->forward ? 1 : -1;
  return net;
}

Topology topology(const Mesh& mesh) {
  Topology result;
  for (const auto& t : mesh.triangle)
    result.volume += dot(position_of(mesh, t[0]), cross(position_of(mesh, t[1]), position_of(mesh, t[2]))) / 6;
  for_each_edge(half_edges(mesh, number_positions(mesh)), [&](const HalfEdge* first, const HalfEdge* last) {
    if (last - first > 2) ++result.shared_edges;
    if (net_winding(first, last) == 0) return;
    if (last - first == 1)
      count(result.open_edges, result.open_at, mesh, *first);
    else if (last - first == 2)
      count(result.turned_edges, result.turned_at, mesh, *first);
    else
      count(result.non_manifold_edges, result.non_manifold_at, mesh, *first);
  });
  return result;
}

}  // namespace itn
