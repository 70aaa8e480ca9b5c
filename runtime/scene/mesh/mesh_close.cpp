#include "runtime/scene/mesh/mesh_close.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numeric>
#include <unordered_map>

#include "runtime/scene/box.h"
#include "runtime/scene/mesh/hole_filling.h"
#include "runtime/scene/mesh/mesh_repair.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

// Dropped triangles keep their number until the end.
void drop(std::array<std::uint32_t, 3>& triangle) { triangle[1] = triangle[2] = triangle[0]; }
bool is_dropped(const std::array<std::uint32_t, 3>& triangle) {
  return triangle[0] == triangle[1] && triangle[1] == triangle[2];
}

double area_of(const Mesh& mesh, std::size_t triangle) {
  return length(area_normal(mesh, mesh.triangle[triangle])) / 2;
}

std::size_t drop_duplicates(Mesh& mesh) {
  const std::vector<std::uint32_t> number = number_positions(mesh);
  struct Place {
    std::array<std::uint32_t, 3> corner;  // position numbers in rising order
    std::uint32_t triangle;
    bool even;  // was the order an even permutation?
  };
  std::vector<Place> places;
  for (std::uint32_t i = 0; i < mesh.triangle.size(); ++i) {
    const auto& t = mesh.triangle[i];
    std::array<std::uint32_t, 3> c{number[t[0]], number[t[1]], number[t[2]]};
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
    const bool even = c[1] < c[2];
    if (!even) std::swap(c[1], c[2]);
    places.push_back({c, i, even});
  }
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return a.corner != b.corner ? a.corner < b.corner : a.triangle < b.triangle;
  });
  std::size_t dropped = 0;
  for (auto first = places.begin(); first != places.end();) {
    const auto last = std::find_if(first, places.end(), [&](const Place& p) { return p.corner != first->corner; });
    const auto even = std::count_if(first, last, [](const Place& p) { return p.even; });
    const auto odd = (last - first) - even;
    bool keeps_one = even != odd;
    for (; first != last; ++first) {
      if (keeps_one && first->even == (even > odd)) {
        keeps_one = false;
        continue;
      }
      drop(mesh.triangle[first->triangle]);
      ++dropped;
    }
  }
  return dropped;
}

std::size_t count_unbalanced(const Mesh& mesh) {
  const Topology t = topology(mesh);
  return t.open_edges + t.turned_edges + t.non_manifold_edges;
}

// The vertices at ends of open edges, in order of their numbers.
std::vector<std::uint32_t> vertices_on_open_edges(const Mesh& mesh) {
  const std::vector<std::uint32_t> number = number_positions(mesh);
  std::vector<bool> is_open(mesh.position.size());  // by position number
  for_each_edge(half_edges(mesh, number), [&](const HalfEdge* first, const HalfEdge* last) {
    if (last - first == 1) is_open[first->low] = is_open[first->high] = true;
  });
  std::vector<std::uint32_t> vertices;
  for (std::uint32_t i = 0; i < mesh.position.size(); ++i)
    if (is_open[number[i]]) vertices.push_back(i);
  return vertices;
}

// Places that have been taken so far, in cells as wide as the distance at which they attract.
class Places {
 public:
  explicit Places(double distance) : distance_(distance) {}

  // The first place taken within the distance, or p itself, which is taken then.
  std::array<float, 3> near_or_new(const std::array<float, 3>& p) {
    const std::array<std::int64_t, 3> at = cell(p);
    for (std::int64_t i = 0; i < 27; ++i)
      for (const auto& other : cells_[key({at[0] + i % 3 - 1, at[1] + i / 3 % 3 - 1, at[2] + i / 9 - 1})]) {
        const Vec3 apart{double{p[0]} - other[0], double{p[1]} - other[1], double{p[2]} - other[2]};
        if (length(apart) <= distance_) return other;
      }
    cells_[key(at)].push_back(p);
    return p;
  }

 private:
  std::array<std::int64_t, 3> cell(const std::array<float, 3>& p) const {
    return {std::llround(p[0] / distance_), std::llround(p[1] / distance_), std::llround(p[2] / distance_)};
  }
  // Cells may share a key: it only decides which bucket to search.
  static std::uint64_t key(const std::array<std::int64_t, 3>& c) {
    std::uint64_t k = 0;
    for (const std::int64_t x : c) k = (k ^ static_cast<std::uint64_t>(x)) * 0x9e3779b97f4a7c15u;
    return k;
  }

  double distance_;
  std::unordered_map<std::uint64_t, std::vector<std::array<float, 3>>> cells_;
};

// Returns how many vertices moved. What brings no edges together is left as it was.
std::size_t weld_seams(Mesh& mesh) {
  const double distance = weld_distance * box_of(mesh).longest_side();
  if (!(distance > 0)) return 0;
  Places places(distance);
  const std::vector<std::array<float, 3>> before = mesh.position;
  std::size_t moved = 0;
  for (const std::uint32_t i : vertices_on_open_edges(mesh)) {
    mesh.position[i] = places.near_or_new(before[i]);
    moved += mesh.position[i] != before[i];
  }
  if (moved == 0) return 0;
  Mesh unwelded{before, {}, {}, mesh.triangle};
  if (count_unbalanced(mesh) < count_unbalanced(unwelded)) return moved;
  mesh.position = before;
  return 0;
}

// Numbers triangles by the part they belong to: those joined across edges of two triangles.
std::vector<std::uint32_t> number_parts(const Mesh& mesh, const std::vector<HalfEdge>& edges) {
  std::vector<std::uint32_t> parent(mesh.triangle.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for_each_edge(edges, [&](const HalfEdge* first, const HalfEdge* last) {
    if (last - first == 2) parent[root(first[0].triangle)] = root(first[1].triangle);
  });
  for (std::uint32_t i = 0; i < parent.size(); ++i) parent[i] = root(i);
  return parent;
}

std::vector<double> areas_of_parts(const Mesh& mesh, const std::vector<std::uint32_t>& part) {
  std::vector<double> area(part.size());
  for (std::size_t i = 0; i < part.size(); ++i) area[part[i]] += area_of(mesh, i);
  return area;
}

constexpr std::ptrdiff_t crowded = 64;  // triangles at an edge: beyond, nothing there is taken for a wall

// For each part: is it a small one that meets others, and are its edges in order without it? Of parts that meet at an
// edge the smallest.
std::vector<bool> find_walls(const Mesh& mesh, const std::vector<std::uint32_t>& part,
                             const std::vector<HalfEdge>& edges) {
  const std::vector<double> area = areas_of_parts(mesh, part);
  const double limit = small_area * std::accumulate(area.begin(), area.end(), 0.0);
  std::vector<bool> is_wall(part.size(), false), is_needed(part.size(), false);
  for_each_edge(edges, [&](const HalfEdge* first, const HalfEdge* last) {
    if (last - first == 2) return;
    for (const HalfEdge* e = first; e != last; ++e) {
      const std::uint32_t me = part[e->triangle];
      int without = last - first > crowded;
      for (const HalfEdge* other = first; other != last && last - first <= crowded; ++other)
        if (part[other->triangle] != me) without += other->forward ? 1 : -1;
      if (last - first > 2) is_wall[me] = true;
      if (without != 0 || net_winding(first, last) == 0 || area[me] > limit) is_needed[me] = true;
    }
  });
  const auto before = [&](std::uint32_t a, std::uint32_t b) { return area[a] != area[b] ? area[a] < area[b] : a < b; };
  std::vector<bool> loses(part.size(), false);
  for_each_edge(edges, [&](const HalfEdge* first, const HalfEdge* last) {
    if (last - first > crowded) return;
    for (const HalfEdge* e = first; e != last; ++e)
      for (const HalfEdge* other = first; other != last; ++other) {
        const std::uint32_t me = part[e->triangle], you = part[other->triangle];
        if (is_wall[you] && !is_needed[you] && before(you, me)) loses[me] = true;
      }
  });
  for (std::size_t i = 0; i < part.size(); ++i) is_wall[i] = is_wall[i] && !is_needed[i] && !loses[i];
  return is_wall;
}

std::size_t drop_walls(Mesh& mesh) {
  const std::vector<std::uint32_t> number = number_positions(mesh);
  std::size_t dropped = 0;
  for (std::size_t before = dropped;; before = dropped) {
    const std::vector<HalfEdge> edges = half_edges(mesh, number);
    const std::vector<std::uint32_t> part = number_parts(mesh, edges);
    const std::vector<bool> is_wall = find_walls(mesh, part, edges);
    for (std::size_t i = 0; i < part.size(); ++i)
      if (is_wall[part[i]] && !is_dropped(mesh.triangle[i])) {
        drop(mesh.triangle[i]);
        ++dropped;
      }
    if (dropped == before) return dropped;
  }
}

// The side that a missing triangle would have: against the open edge.
struct Gap {
  std::uint32_t from, to;              // vertices
  std::uint32_t from_place, to_place;  // position numbers
  std::uint32_t triangle;              // that has the open edge
  bool used = false;
};

std::vector<Gap> find_gaps(const std::vector<HalfEdge>& edges, const std::vector<std::uint32_t>& number) {
  std::vector<Gap> gaps;
  for_each_edge(edges, [&](const HalfEdge* first, const HalfEdge* last) {
    const int net = net_winding(first, last);
    if (std::abs(net) != 1) return;
    const HalfEdge* e = std::find_if(first, last, [&](const HalfEdge& h) { return h.forward == (net > 0); });
    gaps.push_back({e->to, e->from, number[e->to], number[e->from], e->triangle});
  });
  return gaps;
}

// Rings of gaps that visit no place twice.
class Rings {
 public:
  explicit Rings(std::vector<Gap>& gaps) {
    for (Gap& gap : gaps) leaving_.emplace(gap.from_place, &gap);
    for (Gap& start : gaps) {
      for (Gap* gap = start.used ? nullptr : &start; gap; gap = next_from(gap->to_place)) follow(*gap);
      path_.clear();
      step_at_.clear();
    }
  }
  std::vector<std::vector<const Gap*>> found;

 private:
  void follow(Gap& gap) {
    gap.used = true;
    step_at_[gap.from_place] = path_.size();
    path_.push_back(&gap);
    const auto met = step_at_.find(gap.to_place);
    if (met == step_at_.end()) return;
    const auto first = path_.begin() + static_cast<std::ptrdiff_t>(met->second);
    found.emplace_back(first, path_.end());
    for (const Gap* g : found.back()) step_at_.erase(g->from_place);
    path_.erase(first, path_.end());
  }

  Gap* next_from(std::uint32_t place) {
    for (;;) {
      const auto next = leaving_.find(place);
      if (next == leaving_.end()) return nullptr;
      Gap* gap = next->second;
      leaving_.erase(next);
      if (!gap->used) return gap;
    }
  }

  std::multimap<std::uint32_t, Gap*> leaving_;
  std::vector<const Gap*> path_;
  std::map<std::uint32_t, std::size_t> step_at_;  // where on the path a place was left
};

void fill_holes(Mesh& mesh, Closing& closing) {
  const std::vector<std::uint32_t> number = number_positions(mesh);
  const std::vector<HalfEdge> edges = half_edges(mesh, number);
  const std::vector<std::uint32_t> part = number_parts(mesh, edges);
  const std::vector<double> area = areas_of_parts(mesh, part);
  const double total = std::accumulate(area.begin(), area.end(), 0.0);
  // Parts that are nearly flat have no inside to close: a lid would lie upon them.
  constexpr double flat = 0.9;
  std::vector<Gap> gaps = find_gaps(edges, number);
  for (const std::vector<const Gap*>& ring : Rings(gaps).found) {
    if (ring.size() < 3 || ring.size() > largest_loop) continue;
    std::vector<Vec3> corners;
    corners.reserve(ring.size());
    for (const Gap* gap : ring) corners.push_back(position_of(mesh, gap->from));
    const auto triangles = triangulate_loop(corners);
    double lid = 0;
    for (const auto& t : triangles)
      lid += length(cross(corners[t[1]] - corners[t[0]], corners[t[2]] - corners[t[0]])) / 2;
    if (lid > small_area * total || lid > flat * area[part[ring[0]->triangle]]) continue;
    for (const auto& t : triangles)
      add_triangle(mesh, {ring[t[0]]->from, ring[t[1]]->from, ring[t[2]]->from}, ring[0]->triangle);
    ++closing.holes;
    closing.hole_triangles += triangles.size();
  }
}

std::string counted(std::size_t count, const char* one, const char* many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

}  // namespace

std::string Closing::summary() const {
  std::vector<std::string> parts;
  if (holes > 0)
    parts.push_back(fmt::format("closed {} with {}", counted(holes, "hole", "holes"),
                                counted(hole_triangles, "triangle", "triangles")));
  if (welded > 0) parts.push_back("welded " + counted(welded, "vertex", "vertices") + " along seams");
  if (duplicates > 0)
    parts.push_back("dropped " + counted(duplicates, "triangle", "triangles") + " that others cover or cancel");
  if (wall_triangles > 0)
    parts.push_back("took out " + counted(wall_triangles, "triangle", "triangles") + " of walls inside");
  return fmt::format("{}", fmt::join(parts, ", "));
}

Closing close_mesh(Mesh& mesh) {
  Closing closing;
  closing.left = topology(mesh);
  if (closing.left.closed() && closing.left.shared_edges == 0) return closing;
  Mesh mended = mesh;
  const auto is_done = [&] { return (closing.left = topology(mended)).closed(); };
  closing.duplicates = drop_duplicates(mended);
  if (!is_done()) closing.welded = weld_seams(mended);
  if (closing.welded > 0) closing.duplicates += drop_duplicates(mended);
  if (!is_done()) closing.wall_triangles = drop_walls(mended);
  if (!is_done()) fill_holes(mended, closing);
  if (!is_done()) return closing;
  std::vector<bool> dropped;
  dropped.reserve(mended.triangle.size());
  for (const auto& t : mended.triangle) dropped.push_back(is_dropped(t));
  erase_triangles(mended, dropped);
  if (mended.triangle.empty()) return Closing{topology(mesh)};  // sheets of paper: nothing but pairs that cancel
  mesh = std::move(mended);
  return closing;
}

}  // namespace itn
