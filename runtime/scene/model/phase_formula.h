// A phase function's formulas over any scalar, also of a table or a mixture, whose functions
// kernels/scattering/mixture.h makes on the device. For derivatives, and for tests in double precision.
#pragma once
#include <stdexcept>
#include <vector>

#include "kernels/model/models.h"
#include "runtime/scene/model/mixture.h"

namespace itn {

// function(part, n): the sum over the parts of a mixture, by their shares; of another model, its own.
template <class Real, class Function>
Real mean_of_parts(const Model& model, const Real* n, Function function) {
  if (!model.mixture) return function(model, n);
  const std::vector<Mixture::Part>& parts = model.mixture->parts;
  Real mean(0);
  for (std::size_t k = 0; k < parts.size(); ++k)
    mean = mean + mixture_share(n, static_cast<int>(parts.size()), static_cast<int>(k)) *
                      function(*parts[k].model, n + parts[k].first);
  return mean;
}

template <class Real>
Real phase_value(const Model& model, const Real* n, const Real& cosine) {
  return mean_of_parts(model, n, [&](const Model& part, const Real* own) -> Real {
    if (part.table) return tabulated_value(part.table, own, cosine);
#define ITN_PHASE_VALUE(name, PREFIX, type) \
  if (part.id == MODEL_##name) return name##_value(own, cosine);
    PHASE_LIST(ITN_PHASE_VALUE)
    throw std::logic_error("no phase function " + part.name);
  });
}

template <class Real>
Real phase_mean_cosine(const Model& model, const Real* n) {
  return mean_of_parts(model, n, [&](const Model& part, const Real* own) -> Real {
    if (part.table) return tabulated_mean_cosine(part.table, own);
#define ITN_PHASE_MEAN_COSINE(name, PREFIX, type) \
  if (part.id == MODEL_##name) return name##_mean_cosine(own);
    PHASE_LIST(ITN_PHASE_MEAN_COSINE)
    throw std::logic_error("no phase function " + part.name);
  });
}

// The mean cosine with the parameters of these values, and its derivative by each of their slots.
std::vector<double> mean_cosine(const Model& model, const std::vector<double>& parameters);

}  // namespace itn
