#include "runtime/render/compile/bvh.h"

#include <algorithm>

#include "runtime/base/parallel.h"

namespace itn {

namespace {

constexpr int bin_count = 32;
constexpr std::uint32_t parallel_size = 8192;  // smaller subtrees are not worth a thread

struct BinaryNode {
  Box box;
  std::uint32_t first, count;
  std::uint32_t left = 0, right = 0;  // 0: leaf
};

float middle(const Box& box, std::size_t axis) { return 0.5f * (box.low[axis] + box.high[axis]); }

struct Split {
  std::size_t axis = 3;  // 3: none
  int bin = 0;           // the last one on the left
  float cost = 1e30f;    // area times blocks, summed over both sides
};

class BinaryTree {
 public:
  BinaryTree(std::vector<BoxedPrimitive>& primitives, int width, int heuristic_depth)
      : primitives_(primitives),
        width_(static_cast<std::uint32_t>(width)),
        heuristic_depth_(heuristic_depth),
        nodes_(2 * primitives.size()) {
    build(0, 0, static_cast<std::uint32_t>(primitives.size()), 0);
  }
  const std::vector<BinaryNode>& nodes() const { return nodes_; }

 private:
  // Cost of testing n primitives, in node visits; the small term prefers fewer primitives in the same number of blocks.
  float test_cost(std::uint32_t n) const {
    const std::uint32_t blocks = (n + width_ - 1) / width_;
    return static_cast<float>(blocks) + 1e-3f * static_cast<float>(n);
  }

  static int bin_of(const BoxedPrimitive& p, std::size_t axis, float low, float scale) {
    return std::clamp(static_cast<int>(scale * (middle(p.box, axis) - low)), 0, bin_count - 1);
  }

  Split best_split(std::uint32_t first, std::uint32_t count, const Box& centers) const {
    Split best;
    std::array<std::array<Box, bin_count>, 3> boxes;
    std::array<std::array<std::uint32_t, bin_count>, 3> sizes{};
    std::array<float, 3> scale{};
    for (std::size_t a = 0; a < 3; ++a) {
      const float extent = centers.high[a] - centers.low[a];
      scale[a] = extent > 0 ? bin_count / extent : 0;
      if (scale[a] > 1e30f) scale[a] = 0;
    }
    for (std::uint32_t i = first; i < first + count; ++i)
      for (std::size_t a = 0; a < 3; ++a) {
        const auto b = static_cast<std::size_t>(bin_of(primitives_[i], a, centers.low[a], scale[a]));
        ++sizes[a][b];
        boxes[a][b].add(primitives_[i].box);
      }
    for (std::size_t a = 0; a < 3; ++a) {
      if (scale[a] == 0) continue;
      std::array<float, bin_count> right_cost{};
      Box right;
      std::uint32_t right_count = 0;
      for (int b = bin_count - 1; b > 0; --b) {
        const auto k = static_cast<std::size_t>(b);
        right.add(boxes[a][k]);
        right_count += sizes[a][k];
        right_cost[k - 1] = right_count ? right.half_area() * test_cost(right_count) : 1e30f;
      }
      Box left;
      std::uint32_t left_count = 0;
      for (int b = 0; b + 1 < bin_count; ++b) {
        const auto k = static_cast<std::size_t>(b);
        left.add(boxes[a][k]);
        left_count += sizes[a][k];
        if (left_count == 0 || left_count == count) continue;
        const float cost = left.half_area() * test_cost(left_count) + right_cost[k];
        if (cost < best.cost) best = {a, b, cost};
      }
    }
    return best;
  }

  // A subtree of n primitives owns the 2 n - 1 nodes from `node` on: threads need no agreement about places.
  void build(std::uint32_t node, std::uint32_t first, std::uint32_t count, int depth) {
    Box box, centers;
    for (std::uint32_t i = first; i < first + count; ++i) {
      const Box& b = primitives_[i].box;
      box.add(b);
      centers.add(std::array{middle(b, 0), middle(b, 1), middle(b, 2)});
    }
    nodes_[node] = {.box = box, .first = first, .count = count};
    if (count == 1) return;
    Split split;
    if (depth < heuristic_depth_) split = best_split(first, count, centers);
    if (count <= width_) {
      const float area = box.half_area();
      if (split.axis == 3 || area + split.cost >= area * test_cost(count)) return;
    }
    std::uint32_t left_count = count / 2;
    const auto begin = primitives_.begin() + first;
    if (split.axis < 3) {
      const float low = centers.low[split.axis], scale = bin_count / (centers.high[split.axis] - low);
      const auto end = std::partition(begin, begin + count, [&](const BoxedPrimitive& p) {
        return bin_of(p, split.axis, low, scale) <= split.bin;
      });
      left_count = static_cast<std::uint32_t>(end - begin);
    } else if (depth >= heuristic_depth_) {
      std::size_t axis = 0;
      for (std::size_t a = 1; a < 3; ++a)
        if (centers.high[a] - centers.low[a] > centers.high[axis] - centers.low[axis]) axis = a;
      std::nth_element(begin, begin + left_count, begin + count, [&](const auto& p, const auto& q) {
        const float a = middle(p.box, axis), b = middle(q.box, axis);
        return a != b ? a < b : p.index < q.index;
      });
    }
    const std::uint32_t left = node + 1, right = node + 2 * left_count;
    nodes_[node].left = left;
    nodes_[node].right = right;
    const auto build_left = [=, this] { build(left, first, left_count, depth + 1); };
    const auto build_right = [=, this] { build(right, first + left_count, count - left_count, depth + 1); };
    call_both(core_count() > 1 && depth < 6 && count > parallel_size, build_left, build_right);
  }

  std::vector<BoxedPrimitive>& primitives_;
  std::uint32_t width_;
  int heuristic_depth_;
  std::vector<BinaryNode> nodes_;
};

// Merges the binary tree's subtrees with the largest area into their parent until a node has `width` children.
class Collapse {
 public:
  Collapse(const std::vector<BinaryNode>& binary, int width, WideTree& tree)
      : binary_(binary), width_(static_cast<std::size_t>(width)), tree_(tree) {
    tree_.stack_depth = node(0);
  }

 private:
  // Returns the stack entries that a walk below this node may need.
  int node(std::uint32_t root) {
    const std::size_t me = tree_.nodes.size();
    tree_.nodes.emplace_back();
    std::vector<std::uint32_t> cut{root};
    for (;;) {
      std::size_t widest = cut.size();
      float area = -1;
      for (std::size_t i = 0; i < cut.size(); ++i) {
        const BinaryNode& n = binary_[cut[i]];
        if (n.left && n.box.half_area() > area) {
          area = n.box.half_area();
          widest = i;
        }
      }
      if (widest == cut.size() || cut.size() == width_) break;
      const BinaryNode& n = binary_[cut[widest]];
      cut[widest] = n.left;
      cut.insert(cut.begin() + static_cast<std::ptrdiff_t>(widest) + 1, n.right);
    }
    int below = 0;
    for (const std::uint32_t child : cut) {
      const BinaryNode& n = binary_[child];
      std::uint32_t index;
      if (n.left) {
        index = static_cast<std::uint32_t>(tree_.nodes.size());
        below = std::max(below, node(child));
      } else {
        index = static_cast<std::uint32_t>(tree_.blocks.size());
        tree_.blocks.push_back({n.first, n.count});
      }
      tree_.nodes[me].children.push_back({n.box, n.left == 0, index});
    }
    return below + static_cast<int>(cut.size()) - 1;
  }

  const std::vector<BinaryNode>& binary_;
  std::size_t width_;
  WideTree& tree_;
};

}  // namespace

WideTree build_tree(std::vector<BoxedPrimitive> primitives, int width, int heuristic_depth) {
  WideTree tree;
  if (primitives.empty()) return tree;
  tree.primitives = std::move(primitives);
  const BinaryTree binary(tree.primitives, width, heuristic_depth);
  Collapse(binary.nodes(), width, tree);
  return tree;
}

}  // namespace itn
