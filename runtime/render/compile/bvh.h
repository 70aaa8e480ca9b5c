// Bounding volume hierarchies with many children a node, as geometry/trace.h walks them.
#pragma once
#include <cstdint>
#include <vector>

#include "runtime/scene/box.h"

namespace itn {

struct BoxedPrimitive {
  Box box;
  std::uint32_t index;
};

struct WideNode {
  struct Child {
    Box box;
    bool is_block;
    std::uint32_t index;  // in WideTree::nodes or WideTree::blocks
  };
  std::vector<Child> children;
};

struct WideTree {
  struct Block {
    std::uint32_t first, count;  // in WideTree::primitives
  };
  std::vector<WideNode> nodes;  // the root first, a parent before its children
  std::vector<Block> blocks;    // 1 to width primitives each
  std::vector<BoxedPrimitive> primitives;
  int stack_depth = 0;  // entries that a depth-first walk may have to keep
};

// Surface area heuristic over bins down to a depth of the binary tree, below it halves by count, so that no input makes
// a tree of any depth. The result does not depend on the number of threads. No primitives: no nodes.
WideTree build_tree(std::vector<BoxedPrimitive> primitives, int width, int heuristic_depth);

}  // namespace itn
