#include "runtime/scene/model/phase_formula.h"

#include "runtime/base/dual.h"

namespace itn {

std::vector<double> mean_cosine(const Model& model, const std::vector<double>& parameters) {
  std::vector<double> n = model.to_numbers(0, parameters);
  n.resize(n.size() + 1);  // a model may have none
  const auto by = model.jacobian(0, parameters);
  std::vector<double> result{phase_mean_cosine(model, n.data())};
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    std::vector<Dual<1>> moving(n.begin(), n.end());
    for (std::size_t i = 0; i < by.size(); ++i) moving[i].derivative[0] = by[i][k];
    result.push_back(phase_mean_cosine(model, moving.data()).derivative[0]);
  }
  return result;
}

}  // namespace itn
