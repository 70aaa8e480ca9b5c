#include "runtime/scene/mesh/nearest_point.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "runtime/scene/transform.h"

namespace itn {
namespace {

constexpr std::size_t most_in_leaf = 4;

Vec3 corner(const Mesh& mesh, std::uint32_t triangle, std::size_t k) {
  const auto& p = mesh.position[mesh.triangle[triangle][k]];
  return {p[0], p[1], p[2]};
}

double squared_distance_to_box(const Vec3& p, const Vec3& low, const Vec3& high) {
  double sum = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double off = std::max({low[a] - p[a], p[a] - high[a], 0.0});
    sum += off * off;
  }
  return sum;
}

// The t in [0, 1] at which a + t d is nearest to p.
double along_edge(const Vec3& p, const Vec3& a, const Vec3& d) {
  const double square = dot(d, d);
  return square > 0 ? std::clamp(dot(p - a, d) / square, 0.0, 1.0) : 0;
}

// The foot of the perpendicular where it lies inside, else the nearest place of the three edges.
NearestPoint::Place nearest_of_triangle(const Vec3& p, const Vec3& a, const Vec3& ab, const Vec3& ac) {
  const double bb = dot(ab, ab), bc = dot(ab, ac), cc = dot(ac, ac), pb = dot(p - a, ab), pc = dot(p - a, ac);
  const double det = bb * cc - bc * bc;
  NearestPoint::Place best;
  best.distance = std::numeric_limits<double>::infinity();
  const auto offer = [&](double b, double c) {
    const double distance = length(p - (a + b * ab + c * ac));
    if (distance < best.distance) best = {0, b, c, distance};
  };
  if (det > 0) {
    const double b = (cc * pb - bc * pc) / det, c = (bb * pc - bc * pb) / det;
    if (b >= 0 && c >= 0 && b + c <= 1) {
      offer(b, c);
      return best;
    }
  }
  offer(along_edge(p, a, ab), 0);
  offer(0, along_edge(p, a, ac));
  const double t = along_edge(p, a + ab, ac - ab);
  offer(1 - t, t);
  return best;
}

}  // namespace

NearestPoint::NearestPoint(const Mesh& mesh) : mesh_(mesh), order_(mesh.triangle.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  build(0, order_.size());
}

// Halves by the middles of triangles along the longest axis.
std::size_t NearestPoint::build(std::size_t first, std::size_t count) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Node node{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}, first, count, 0};
  for (std::size_t i = first; i < first + count; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p = corner(mesh_, order_[i], k);
      for (std::size_t a = 0; a < 3; ++a) {
        node.low[a] = std::min(node.low[a], p[a]);
        node.high[a] = std::max(node.high[a], p[a]);
      }
    }
  const std::size_t at = nodes_.size();
  nodes_.push_back(node);
  if (count <= most_in_leaf) return at;
  const Vec3 size = node.high - node.low;
  const auto axis = static_cast<std::size_t>(std::max_element(size.begin(), size.end()) - size.begin());
  const auto middle = [&](std::uint32_t t) {
    return corner(mesh_, t, 0)[axis] + corner(mesh_, t, 1)[axis] + corner(mesh_, t, 2)[axis];
  };
  const auto begin = order_.begin() + static_cast<std::ptrdiff_t>(first);
  const auto half = static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(begin, begin + half, begin + static_cast<std::ptrdiff_t>(count),
                   [&](std::uint32_t s, std::uint32_t t) { return std::pair(middle(s), s) < std::pair(middle(t), t); });
  build(first, count / 2);
  nodes_[at].second = build(first + count / 2, count - count / 2);
  nodes_[at].count = 0;
  return at;
}

NearestPoint::Place NearestPoint::operator()(const Vec3& point) const {
  Place best;
  best.distance = std::numeric_limits<double>::infinity();
  std::vector<std::pair<double, std::size_t>> waiting{{0, 0}};
  while (!waiting.empty()) {
    const auto [least, at] = waiting.back();
    waiting.pop_back();
    if (least >= best.distance * best.distance) continue;
    const Node& node = nodes_[at];
    for (std::size_t i = node.first; i < node.first + node.count; ++i) {
      const std::uint32_t t = order_[i];
      const Vec3 a = corner(mesh_, t, 0);
      Place found = nearest_of_triangle(point, a, corner(mesh_, t, 1) - a, corner(mesh_, t, 2) - a);
      found.triangle = t;
      if (found.distance < best.distance) best = found;
    }
    if (node.count > 0) continue;
    std::pair<double, std::size_t> one{0, at + 1}, other{0, node.second};
    for (auto* child : {&one, &other})
      child->first = squared_distance_to_box(point, nodes_[child->second].low, nodes_[child->second].high);
    if (one.first < other.first) std::swap(one, other);
    waiting.push_back(one);  // the farther one waits longer
    waiting.push_back(other);
  }
  return best;
}

}  // namespace itn
