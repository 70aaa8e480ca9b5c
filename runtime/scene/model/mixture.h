// Mixtures of phase functions that XML nests, flattened when they are read to parts that are no mixtures
// (kernels/model/phase/mixture.h). To the rest of the program a mixture is one model, with the shares and the parts'
// numbers one after the other; scenes that nest the same things in the same way share it.
#pragma once
#include <cstddef>
#include <vector>

#include "itn/scene.h"
#include "runtime/scene/model/pieces.h"

namespace itn {

struct Mixture {
  struct Part {
    const Model* model;
    int first = 0;  // of its numbers, among those of the mixture
  };

  std::vector<Piece> pieces;  // the nest, then what is inside, where mixtures may be
  std::vector<Part> parts;
  Model model;
};

// Limit for one mixture: each part is code of the scene's program.
inline constexpr std::size_t most_parts = 64;

std::size_t parts_of(const Model& phase);  // of one that is no mixture: 1

// The number that a grid of a phase function's parameter stands for. Throws std::logic_error: there is none that is the
// parameter itself.
const DeclaredNumber& number_of_grid(const PhaseFunction& phase, std::size_t parameter);

// A nest (sized_model.h) with its values around so many phase functions. They keep their ids as owners of their values.
PhaseFunction make_mixture(const Instance& nest, const std::vector<PhaseFunction>& inside);

}  // namespace itn
