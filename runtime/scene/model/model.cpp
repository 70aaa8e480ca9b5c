#include "itn/model.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "kernels/model/models.h"
#include "kernels/model/nest/list.h"
#include "kernels/model/obstacle.h"
#include "runtime/base/dual.h"

namespace itn {
namespace {

std::vector<std::string> words(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> result{std::istream_iterator<std::string>(in), {}};
  return result.empty() ? std::vector<std::string>{""} : result;
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
#define ITN_INPUT_CONVERSIONS(name, PREFIX, medium, type) ITN_CONVERSIONS(name, PREFIX, )
MEDIUM_INPUT_LIST(ITN_INPUT_CONVERSIONS)
NEST_LIST(ITN_MODEL_CONVERSIONS)

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

#define ITN_PARAMETER(name, kind, fallback, unit) model.declare(#name, parameter_kind::kind, fallback, unit);
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
#define ITN_LIGHT_MODEL(name, PREFIX, type) \
  {                                         \
    ITN_MODEL(name, PREFIX, type)           \
    model.traits = PREFIX##_TRAITS;         \
    model.arrives = name##_arrival;         \
    models.push_back(model);                \
  }
#define ITN_PLAIN_MODEL(name, PREFIX, type) \
  {                                         \
    ITN_MODEL(name, PREFIX, type)           \
    models.push_back(model);                \
  }
#define ITN_INPUT_MODEL(input, PREFIX, medium, type_) \
  {                                                   \
    Model model;                                      \
    ITN_DECLARATIONS(input, PREFIX, type_)            \
    model.id = MODEL_##medium;                        \
    model.name = #medium;                             \
    models.push_back(model);                          \
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

void Model::declare(const std::string& parameter_name, const ParameterKind& kind, double fallback,
                    const std::string& unit) {
  parameters.push_back({parameter_name, kind, fallback, unit, parameter_slots});
  parameter_slots += kind.channels;
}

const DeclaredParameter& Model::parameter(const std::string& wanted) const {
  for (const DeclaredParameter& p : parameters)
    if (p.name == wanted) return p;
  throw std::logic_error("model " + name + " has no parameter " + wanted);
}

int Model::mean_cosine_slot() const {
  for (const DeclaredParameter& p : parameters)
    if (p.kind.reader == ParameterKind::Reader::of_phase) return p.slot;
  return -1;
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
ITN_FAMILY(phase, PHASE_LIST, ITN_PLAIN_MODEL)
ITN_FAMILY(medium, MEDIUM_LIST, ITN_PLAIN_MODEL)
ITN_FAMILY(light, LIGHT_LIST, ITN_LIGHT_MODEL)
ITN_FAMILY(nest, NEST_LIST, ITN_NEST_MODEL)
ITN_FAMILY(environment, ENVIRONMENT_LIST, ITN_ENVIRONMENT_MODEL)

const std::vector<Model>& medium_inputs() {
  static const std::vector<Model> all = [] {
    std::vector<Model> models;
    MEDIUM_INPUT_LIST(ITN_INPUT_MODEL)
    return models;
  }();
  return all;
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
