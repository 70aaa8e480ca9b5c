// BSDFs that XML nests, flattened when they are read (kernels/model/nest): leaves, which are BSDFs, each with the nests
// that lead to it. All of it is one model to the rest of the program, with the numbers of nests and leaves one after
// the other; scenes that nest the same things in the same way share it.
#pragma once
#include <string>
#include <vector>

#include "itn/scene.h"
#include "runtime/scene/model/pieces.h"

namespace itn {

struct Structure {
  // From outside in one of the nest's branches (kernels/model/nest/list.h).
  struct Enter {
    const Model* nest = nullptr;
    int branch = 0, piece = -1;  // -1: it has no numbers
  };
  struct Leaf {
    int piece = -1;  // -1: light passes straight on
    std::vector<Enter> nests;
  };

  std::vector<Piece> pieces;  // nests and leaves
  std::vector<Leaf> leaves;
  Model model;
  int picked = 0;  // the slot that holds the leaf of a sample

  const Model* model_of(const Leaf& leaf) const {
    return leaf.piece < 0 ? nullptr : pieces[static_cast<std::size_t>(leaf.piece)].model;
  }
  // Its traits; of a leaf that is a passage: those of one.
  int traits_of(const Leaf& leaf) const;
  // Index of a piece's first number; 0 for none.
  int first_of(int piece) const { return piece < 0 ? 0 : pieces[static_cast<std::size_t>(piece)].first_number; }
};

// Limit for one structure: each leaf is code of the scene's program.
inline constexpr std::size_t most_leaves = 64;

// The nests that scene files know, in the order of their list.
const std::vector<Model>& nest_models();

// A nest with its values around others: one, or a branch each. They keep their ids as owners of their values.
Bsdf make_nest(const Instance& nest, const std::vector<Bsdf>& inside);

// Why the nest cannot stand around these; empty: it can.
std::string refusal_of_nest(const Model& nest, const std::vector<Bsdf>& inside);

}  // namespace itn
