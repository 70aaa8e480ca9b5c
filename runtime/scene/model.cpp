#include "runtime/scene/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <mutex>
#include <sstream>
#include <stdexcept>

#include "kernels/model/models.h"
#include "kernels/model/nest/list.h"
#include "runtime/derivative/dual.h"
#include "runtime/scene/structure.h"

namespace itn {
namespace {

std::vector<std::string> words(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> result{std::istream_iterator<std::string>(in), {}};
  return result.empty() ? std::vector<std::string>{""} : result;
}

void declare(Model& model, const char* name, const ParameterKind& kind, double fallback, const char* unit) {
  model.parameters.push_back({name, kind, fallback, unit, model.parameter_slots});
  model.parameter_slots += kind.channels;
}

// The parameters as dual numbers, each moving along a direction of its own.
template <std::size_t count>
std::vector<Dual<count>> moving(const std::vector<double>& at) {
  std::vector<Dual<count>> parameters;
  parameters.reserve(count);
  for (std::size_t i = 0; i < count; ++i) parameters.push_back(Dual<count>::variable(at[i], i));
  return parameters;
}

template <std::size_t count>
std::vector<std::vector<double>> derivatives(const std::vector<Dual<count>>& numbers) {
  std::vector<std::vector<double>> by;
  by.reserve(numbers.size());
  for (const Dual<count>& number : numbers) by.emplace_back(number.derivative.begin(), number.derivative.end());
  return by;
}

// Expanded once a model: its conversion over doubles, and over dual numbers.
// NOLINTNEXTLINE(bugprone-macro-parentheses): a term of the sum below
#define ITN_COUNT_SLOTS(name, kind, fallback, unit) parameter_kind::kind.channels +
#define ITN_PARAMETER_SLOTS(PREFIX) (PREFIX##_PARAMETERS(ITN_COUNT_SLOTS) 0)
// passed: the arguments of name_numbers before the parameters
#define ITN_CONVERSIONS(name, PREFIX, passed)                                                                     \
  std::vector<double> name##_to_numbers([[maybe_unused]] int variant, const std::vector<double>& parameters) {    \
    std::vector<double> n(PREFIX##_SLOTS);                                                                        \
    name##_numbers(passed parameters.data(), n.data());                                                           \
    return n;                                                                                                     \
  }                                                                                                               \
  std::vector<std::vector<double>> name##_jacobian([[maybe_unused]] int variant, const std::vector<double>& at) { \
    const auto parameters = moving<ITN_PARAMETER_SLOTS(PREFIX)>(at);                                              \
    std::vector<Dual<ITN_PARAMETER_SLOTS(PREFIX)>> n(PREFIX##_SLOTS);                                             \
    name##_numbers(passed parameters.data(), n.data());                                                           \
    return derivatives(n);                                                                                        \
  }
#define ITN_VARIANT variant,
#define ITN_BSDF_CONVERSIONS(name, PREFIX, type, variants) ITN_CONVERSIONS(name, PREFIX, ITN_VARIANT)
#define ITN_MODEL_CONVERSIONS(name, PREFIX, type) ITN_CONVERSIONS(name, PREFIX, )
BSDF_LIST(ITN_BSDF_CONVERSIONS)
MEDIUM_LIST(ITN_MODEL_CONVERSIONS)
PHASE_LIST(ITN_MODEL_CONVERSIONS)
LIGHT_LIST(ITN_MODEL_CONVERSIONS)
NEST_LIST(ITN_MODEL_CONVERSIONS)

#define ITN_MEAN_COSINE(name, PREFIX, type)                                      \
  std::vector<double> name##_mean(const std::vector<double>& at) {               \
    const auto parameters = moving<ITN_PARAMETER_SLOTS(PREFIX)>(at);             \
    std::vector<Dual<ITN_PARAMETER_SLOTS(PREFIX)>> n(PREFIX##_SLOTS);            \
    name##_numbers(parameters.data(), n.data());                                 \
    const auto mean = name##_mean_cosine(n.data());                              \
    std::vector<double> result{mean.value};                                      \
    result.insert(result.end(), mean.derivative.begin(), mean.derivative.end()); \
    return result;                                                               \
  }
PHASE_LIST(ITN_MEAN_COSINE)

Vector3<double> vector3(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

#define ITN_ARRIVES(name, PREFIX, type)                                                                    \
  Arrival name##_arrival(const std::vector<double>& n, const std::array<double, 3>& from,                  \
                         const std::array<double, 3>& on, const std::array<double, 3>& normal) {           \
    Vector3<double> towards{};                                                                             \
    Arrival a;                                                                                             \
    name##_arrives(n.data(), vector3(from), vector3(on), vector3(normal), &towards, &a.distance, &a.share, \
                   a.uv.data());                                                                           \
    a.towards = {towards.x, towards.y, towards.z};                                                         \
    return a;                                                                                              \
  }
LIGHT_LIST(ITN_ARRIVES)

#define ITN_PARAMETER(name, kind, fallback, unit) declare(model, #name, parameter_kind::kind, fallback, unit);
#define ITN_NUMBER(PREFIX, name, channels, role, coordinate) \
  model.numbers.push_back({#name, PREFIX##_##name, channels, role, coordinate});
#define ITN_MODEL(name_, PREFIX, type_) \
  Model model;                          \
  model.id = MODEL_##name_;             \
  ITN_DECLARATIONS(name_, PREFIX, type_)
#define ITN_DECLARATIONS(name_, PREFIX, type_)                                                         \
  model.name = #name_;                                                                                 \
  model.type = type_;                                                                                  \
  model.variants = {""};                                                                               \
  PREFIX##_PARAMETERS(ITN_PARAMETER) PREFIX##_NUMBERS(ITN_NUMBER) model.number_slots = PREFIX##_SLOTS; \
  model.to_numbers = name_##_to_numbers;                                                               \
  model.jacobian = name_##_jacobian;                                                                   \
  model.obstacle = name_##_obstacle;
#define ITN_BSDF_MODEL(name, PREFIX, type, variants_) \
  {                                                   \
    ITN_MODEL(name, PREFIX, type)                     \
    model.variants = words(variants_);                \
    model.traits = PREFIX##_TRAITS;                   \
    model.refusal = name##_refusal;                   \
    models.push_back(model);                          \
  }
#define ITN_PHASE_MODEL(name, PREFIX, type) \
  {                                         \
    ITN_MODEL(name, PREFIX, type)           \
    model.mean_cosine = name##_mean;        \
    models.push_back(model);                \
  }
#define ITN_LIGHT_MODEL(name, PREFIX, type) \
  {                                         \
    ITN_MODEL(name, PREFIX, type)           \
    model.traits = PREFIX##_TRAITS;         \
    model.arrives = name##_arrival;         \
    models.push_back(model);                \
  }
#define ITN_MEDIUM_MODEL(name, PREFIX, type) \
  {                                          \
    ITN_MODEL(name, PREFIX, type)            \
    models.push_back(model);                 \
  }
#define ITN_NEST_MODEL(name, PREFIX, type) \
  {                                        \
    Model model;                           \
    ITN_DECLARATIONS(name, PREFIX, type)   \
    model.traits = PREFIX##_TRAITS;        \
    models.push_back(model);               \
  }

// Radiance is linear in their parameters, or smooth.
const char* no_obstacle(const double*, int) { return differentiable; }
#define ITN_ENVIRONMENT_MODEL(name_, PREFIX, type_)                  \
  {                                                                  \
    Model model;                                                     \
    model.id = MODEL_##name_;                                        \
    model.name = #name_;                                             \
    model.type = type_;                                              \
    model.variants = {""};                                           \
    model.traits = PREFIX##_TRAITS;                                  \
    model.formula = PREFIX##_FORMULA;                                \
    PREFIX##_PARAMETERS(ITN_PARAMETER) model.obstacle = no_obstacle; \
    models.push_back(model);                                         \
  }

}  // namespace

const DeclaredParameter& Model::parameter(const std::string& wanted) const {
  for (const DeclaredParameter& p : parameters)
    if (p.name == wanted) return p;
  throw std::logic_error("model " + name + " has no parameter " + wanted);
}

const DeclaredNumber& Model::number_of(int slot) const {
  for (const DeclaredNumber& n : numbers)
    if (slot >= n.slot && slot < n.slot + n.channels) return n;
  throw std::logic_error("model " + name + " has no number in slot " + std::to_string(slot));
}

const DeclaredNumber& Model::number_called(const std::string& wanted) const {
  for (const DeclaredNumber& n : numbers)
    if (n.name == wanted) return n;
  throw std::logic_error("model " + name + " has no number " + wanted);
}

#define ITN_FAMILY(family, LIST, MODEL)         \
  const std::vector<Model>& family##_models() { \
    static const std::vector<Model> all = [] {  \
      std::vector<Model> models;                \
      LIST(MODEL)                               \
      return models;                            \
    }();                                        \
    return all;                                 \
  }
ITN_FAMILY(bsdf, BSDF_LIST, ITN_BSDF_MODEL)
ITN_FAMILY(phase, PHASE_LIST, ITN_PHASE_MODEL)
ITN_FAMILY(medium, MEDIUM_LIST, ITN_MEDIUM_MODEL)
ITN_FAMILY(light, LIGHT_LIST, ITN_LIGHT_MODEL)
ITN_FAMILY(nest, NEST_LIST, ITN_NEST_MODEL)
ITN_FAMILY(environment, ENVIRONMENT_LIST, ITN_ENVIRONMENT_MODEL)

const Model& spherical_harmonics_model(int order) {
  static std::mutex access;
  static std::map<int, Model> made;
  const std::lock_guard lock(access);
  const auto found = made.find(order);
  if (found != made.end()) return found->second;
  Model model = *find_model(environment_models(), "sphericalharmonics");
  for (int l = 1; l <= order; ++l)
    for (int m = -l; m <= l; ++m)
      declare(model, ("c_" + std::to_string(l) + "_" + std::to_string(m)).c_str(), parameter_kind::COEFFICIENT, 0, "");
  return made.emplace(order, std::move(model)).first->second;
}

int spherical_harmonics_order(const Model& model) {
  return static_cast<int>(std::lround(std::sqrt(static_cast<double>(model.parameters.size())))) - 1;
}

const Model& dictionary_model(std::size_t entries) {
  static std::mutex access;
  static std::map<std::size_t, Model> made;
  const std::lock_guard lock(access);
  const auto found = made.find(entries);
  if (found != made.end()) return found->second;
  Model model = *find_model(nest_models(), "dictionary");
  for (std::size_t k = 0; k < entries; ++k) {
    const std::string index = std::to_string(k);
    declare(model, ("weight_" + index).c_str(), parameter_kind::NON_NEGATIVE, 1, "");
    model.numbers.push_back({"share_" + index, model.number_slots++, 1, ROLE_FACTOR, COORDINATE_ITSELF});
  }
  model.to_numbers = [entries](int, const std::vector<double>& weights) {
    std::vector<double> shares(entries);
    dictionary_shares(entries, weights.data(), shares.data());
    return shares;
  };
  model.jacobian = [entries](int, const std::vector<double>& at) {
    std::vector<std::vector<double>> by(entries, std::vector<double>(entries));
    for (std::size_t k = 0; k < entries; ++k) {
      std::vector<Dual<1>> weights(at.begin(), at.end()), shares(entries);
      weights[k] = Dual<1>::variable(at[k], 0);
      dictionary_shares(entries, weights.data(), shares.data());
      for (std::size_t i = 0; i < entries; ++i) by[i][k] = shares[i].derivative[0];
    }
    return by;
  };
  model.obstacle = [](const double* weights, int slot) { return dictionary_weight_obstacle(weights[slot]); };
  return made.emplace(entries, std::move(model)).first->second;
}

const Model* find_model(const std::vector<Model>& models, const std::string& type) {
  const auto found = std::find_if(models.begin(), models.end(), [&](const Model& m) { return m.type == type; });
  return found == models.end() ? nullptr : &*found;
}

const Model* find_of_type(const Model& model, int trait) {
  for (const Model& other : bsdf_models())
    if (&other != &model && (other.traits & trait) && other.type == model.type) return &other;
  return nullptr;
}

}  // namespace itn
