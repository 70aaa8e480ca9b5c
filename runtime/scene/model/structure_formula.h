// A structure's formulas over any scalar: what kernels/scattering/structure.h makes of its text on the device. For
// derivatives, and for tests in double precision.
#pragma once
#include <cstddef>
#include <stdexcept>
#include <vector>

#include "kernels/model/models.h"
#include "kernels/model/nest/list.h"
#include "runtime/scene/model/structure.h"

namespace itn {

template <class Real>
class StructureFormula {
 public:
  using Direction = Vector3<Real>;
  StructureFormula(const Structure& structure, const Real* n) : structure_(structure), n_(n) {}

  // f |cos wo| in three channels.
  std::vector<Real> value(const Direction& wi, const Direction& wo) const {
    return sum_of_leaves(
        [&](const Structure::Leaf& leaf, const Nest<Real>& x, Real* f) {
          const Direction in = nest_local(&x, wi), out = nest_local(&x, wo);
          of_leaf(leaf, [&]<class Functions>(Functions functions, int variant, const Real* n) {
            functions.value(variant, n, in, out, f);
          });
          return x.share * x.lit;
        },
        wi, wo, {});
  }

  // Pdf of the sampled direction.
  Real density(const Direction& wi, const Direction& wo) const {
    return sum_of_leaves(
        [&](const Structure::Leaf& leaf, const Nest<Real>& x, Real* f) {
          const Direction in = nest_local(&x, wi), out = nest_local(&x, wo);
          of_leaf(leaf, [&]<class Functions>(Functions functions, int variant, const Real* n) {
            f[0] = f[1] = f[2] = functions.density(variant, n, in, out);
          });
          return x.share;
        },
        wi, wo, {})[0];
  }

  // Value of a direction that the picked leaf chose.
  std::vector<Real> chosen(const Direction& wi, const Direction& wo) const {
    return sum_of_leaves(
        [&](const Structure::Leaf& leaf, const Nest<Real>& x, Real* f) {
          const Direction in = nest_local(&x, wi), out = nest_local(&x, wo);
          of_leaf(leaf, [&]<class Functions>(Functions functions, int variant, const Real* n) {
            functions.chosen(variant, n, in, out, f);
          });
          return x.share * x.lit;
        },
        wi, wo, {n_ + structure_.picked});
  }

  Nest<Real> at(const Structure::Leaf& leaf, const Direction& wi, const Direction& wo) const {
    Nest<Real> x = nest_begin(wi);
    for (const Structure::Enter& nest : leaf.nests) enter(nest, wi, wo, &x);
    if (leaf.piece >= 0 && !(structure_.traits_of(leaf) & BSDF_TRANSMITS)) nest_opaque(wi, &x);
    return x;
  }

 private:
  // f: of one leaf; returns its weight. picked: if there, where the leaf stands that alone counts.
  template <class Function>
  std::vector<Real> sum_of_leaves(Function of, const Direction& wi, const Direction& wo,
                                  const std::vector<const Real*>& picked) const {
    std::vector<Real> sum(3, Real(0));
    for (std::size_t k = 0; k < structure_.leaves.size(); ++k) {
      const Structure::Leaf& leaf = structure_.leaves[k];
      const Nest<Real> x = at(leaf, wi, wo);
      std::vector<Real> f(3, Real(0));
      const Real weight = of(leaf, x, f.data());
      for (std::size_t c = 0; c < 3; ++c) {
        Real part = choose(x.seen > Real(0), weight * f[c], Real(0));
        const auto index = static_cast<double>(leaf.piece < 0 ? PASSAGE_LEAF : static_cast<int>(k));
        if (!picked.empty()) part = choose(*picked[0] == Real(index), part, Real(0));
        sum[c] = sum[c] + part;
      }
    }
    return sum;
  }

#define ITN_LEAF_FUNCTIONS(name)                                                                               \
  struct name##_functions {                                                                                    \
    void value(int v, const Real* n, Direction wi, Direction wo, Real* f) { name##_value(v, n, wi, wo, f); }   \
    Real density(int v, const Real* n, Direction wi, Direction wo) { return name##_density(v, n, wi, wo); }    \
    void chosen(int v, const Real* n, Direction wi, Direction wo, Real* f) { name##_chosen(v, n, wi, wo, f); } \
  };
#define ITN_LEAF(name, PREFIX, type, variants) ITN_LEAF_FUNCTIONS(name)
  BSDF_LIST(ITN_LEAF)
  ITN_LEAF_FUNCTIONS(passage)
#undef ITN_LEAF
#undef ITN_LEAF_FUNCTIONS

  template <class Call>
  void of_leaf(const Structure::Leaf& leaf, Call call) const {
    if (leaf.piece < 0) return call(passage_functions{}, 0, n_);
    const Piece& piece = structure_.pieces[static_cast<std::size_t>(leaf.piece)];
    const Real* n = n_ + piece.first_number;
    switch (piece.model->id) {
#define ITN_LEAF(name, PREFIX, type, variants) \
  case MODEL_##name:                           \
    return call(name##_functions{}, piece.variant, n);
      BSDF_LIST(ITN_LEAF)
#undef ITN_LEAF
      default:
        throw std::logic_error("a structure's leaf is no BSDF");
    }
  }

  void enter(const Structure::Enter& nest, const Direction& wi, const Direction& wo, Nest<Real>* x) const {
    const Real* n = n_ + structure_.first_of(nest.piece);
#define ITN_ENTER(model, PREFIX, type) \
  if (nest.nest->name == #model) return model##_enter(nest.branch, n, wi, wo, x);
    NEST_LIST(ITN_ENTER)
#undef ITN_ENTER
    throw std::logic_error("no nest " + nest.nest->name);
  }

  const Structure& structure_;
  const Real* n_;
};

}  // namespace itn
