#include "runtime/scene/model/sized_model.h"

#include <cmath>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "kernels/model/nest/dictionary.h"
#include "kernels/model/phase/mixture.h"
#include "kernels/model/phase/tabulated.h"
#include "runtime/base/dual.h"
#include "runtime/base/fingerprint.h"
#include "runtime/scene/model/pieces.h"
#include "runtime/scene/model/structure.h"

namespace itn {
namespace {

// numbers(parameters, n), over any scalar; for models whose parameters have a slot each.
template <class Numbers>
void convert_by(Model& model, Numbers numbers) {
  const auto slots = static_cast<std::size_t>(model.number_slots);
  model.to_numbers = [numbers, slots](int, const std::vector<double>& parameters) {
    std::vector<double> n(slots);
    numbers(parameters.data(), n.data());
    return n;
  };
  model.jacobian = [numbers, slots](int, const std::vector<double>& at) {
    std::vector<std::vector<double>> by(slots, std::vector<double>(at.size()));
    for (std::size_t k = 0; k < at.size(); ++k) {
      std::vector<Dual<1>> parameters(at.begin(), at.end()), n(slots);
      parameters[k] = Dual<1>::variable(at[k], 0);
      numbers(parameters.data(), n.data());
      for (std::size_t i = 0; i < slots; ++i) by[i][k] = n[i].derivative[0];
    }
    return by;
  };
}

void declare_number(Model& model, const std::string& name, int role, int coordinate) {
  model.numbers.push_back({name, model.number_slots++, 1, role, coordinate});
}

Model make_harmonics(std::size_t order) {
  Model model = *find_model(environment_models(), "sphericalharmonics");
  for (int l = 1; l <= static_cast<int>(order); ++l)
    for (int m = -l; m <= l; ++m)
      model.declare("c_" + std::to_string(l) + "_" + std::to_string(m), parameter_kind::COEFFICIENT, 0, "");
  return model;
}

Model make_table(std::size_t values) {
  Model model;
  const std::string name = "tabulated_" + std::to_string(values);
  name_made_model(model, name, fingerprint(name));
  model.type = "tabphase";
  model.variants = {""};
  model.table = static_cast<int>(values);
  for (std::size_t k = 0; k < values; ++k) {
    const std::string value = "value_" + std::to_string(k);
    model.declare(value, parameter_kind::NON_NEGATIVE, 1, "");
    declare_number(model, value, ROLE_DENSITY, COORDINATE_LOG);
  }
  convert_by(model,
             [table = model.table](const auto* parameters, auto* n) { tabulated_numbers(table, parameters, n); });
  model.obstacle = tabulated_obstacle;
  return model;
}

Model make_dictionary(std::size_t entries) {
  Model model = *find_model(nest_models(), "dictionary");
  for (std::size_t k = 0; k < entries; ++k) {
    model.declare("weight_" + std::to_string(k), parameter_kind::NON_NEGATIVE, 1, "");
    declare_number(model, "share_" + std::to_string(k), ROLE_FACTOR, COORDINATE_ITSELF);
  }
  convert_by(model, [entries](const auto* weights, auto* shares) { dictionary_shares(entries, weights, shares); });
  model.obstacle = [](const double* weights, int slot) { return dictionary_weight_obstacle(weights[slot]); };
  return model;
}

Model make_blend_phase(std::size_t) {
  Model model;
  model.name = "blend_phase";
  model.type = "blendphase";
  model.variants = {""};
  model.declare("weight", parameter_kind::MIXING_WEIGHT, 0.5, "");
  for (const char* share : {"share_0", "share_1"}) declare_number(model, share, ROLE_FACTOR, COORDINATE_ITSELF);
  convert_by(model, [](const auto* weight, auto* shares) { blend_phase_shares(weight, shares); });
  model.obstacle = blend_phase_obstacle;
  return model;
}

const Model& made_once(Model (*make)(std::size_t), std::size_t size) {
  static std::mutex access;
  static std::map<std::pair<Model (*)(std::size_t), std::size_t>, Model> made;
  const std::lock_guard lock(access);
  const auto found = made.find({make, size});
  return found != made.end() ? found->second : made.emplace(std::pair{make, size}, make(size)).first->second;
}

}  // namespace

const Model& spherical_harmonics_model(int order) { return made_once(make_harmonics, static_cast<std::size_t>(order)); }
int spherical_harmonics_order(const Model& model) {
  return static_cast<int>(std::lround(std::sqrt(static_cast<double>(model.parameters.size())))) - 1;
}
const Model& tabulated_model(std::size_t values) { return made_once(make_table, values); }
const Model& dictionary_model(std::size_t entries) { return made_once(make_dictionary, entries); }
const Model& blend_phase_model() { return made_once(make_blend_phase, 2); }

}  // namespace itn
