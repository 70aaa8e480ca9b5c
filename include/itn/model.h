// The models of kernels/model as the host knows them: what each declares of itself, from the lists of their families.
#pragma once
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "itn/parameter_kind.h"

struct Refusal;  // kernels/model/obstacle.h

namespace itn {

// A parameter that users set. slot: index of its first value among those of all parameters.
struct DeclaredParameter {
  std::string name;
  ParameterKind kind;
  double fallback = 0;
  std::string unit;  // empty: a pure number
  int slot = 0;
  std::string called{};  // by people, where that is not the name
  const std::string& shown() const { return called.empty() ? name : called; }
};

// A number that formulas take: n[slot], or n[slot + c] of a colour. role, coordinate: ROLE_* and COORDINATE_*.
struct DeclaredNumber {
  std::string name;
  int slot = 0, channels = 1, role = 0, coordinate = 0;
};

// Light that a light source brings to a point (kernels/model/light/list.h).
struct Arrival {
  std::array<double, 3> towards{0, 0, 0};
  double distance = 0, share = 0;
  std::array<double, 2> uv{0, 0};
};

struct Structure;
struct Mixture;

struct Model {
  int id = 0;                         // MODEL_* of kernels/model/models.h
  std::string name, type;             // of its file and functions; of the element in scene files
  std::vector<std::string> variants;  // values of `distribution`; one that is empty: there is no such parameter
  int traits = 0;                     // of BSDFs: BSDF_*; of lights: LIGHT_*; of environments: ENVIRONMENT_*
  std::vector<DeclaredParameter> parameters;
  std::vector<DeclaredNumber> numbers;
  int parameter_slots = 0, number_slots = 0;
  // Made for a scene: of what XML nests (structure.h, mixture.h), or a table of so many values (sized_model.h).
  const Structure* structure = nullptr;
  const Mixture* mixture = nullptr;
  int table = 0;

  // Numbers of a variant, from the values of all parameters, slot after slot.
  std::function<std::vector<double>(int variant, const std::vector<double>&)> to_numbers;
  // [number slot][parameter slot]
  std::function<std::vector<std::vector<double>>(int variant, const std::vector<double>&)> jacobian;
  Refusal (*refusal)(const double*) = nullptr;  // why such values cannot be rendered
  // Why there is no derivative by a parameter's slot; or empty.
  std::function<const char*(const double*, int)> obstacle;

  const char* formula =
      "";  // of environments: the function of runtime/render/derivative that derivatives call; or empty

  // Lights only; the arguments are the numbers, the point, and a point of the light's surface with its normal.
  Arrival (*arrives)(const std::vector<double>&, const std::array<double, 3>&, const std::array<double, 3>&,
                     const std::array<double, 3>&) = nullptr;

  // One parameter more, in the next slots.
  void declare(const std::string& parameter_name, const ParameterKind& kind, double fallback, const std::string& unit);
  // The parameter of that name. Throws std::logic_error: there is none.
  const DeclaredParameter& parameter(const std::string& wanted) const;
  // Media only: the slot of the parameter that is the mean cosine of the phase function; -1: it has none.
  int mean_cosine_slot() const;
  // The number that n[slot] belongs to.
  const DeclaredNumber& number_of(int slot) const;
  // The number of that name, which a texture of the parameter takes the place of.
  const DeclaredNumber& number_called(const std::string& wanted) const;
  // Index, counted from n, of the copy of n[slot] for the k-th colour of a texture, from 1 on; 0: n[slot] itself.
  int place_of_colour(int slot, int k) const { return k * number_slots + slot; }
};

const std::vector<Model>& bsdf_models();  // without null, which has none
const std::vector<Model>& phase_models();
const std::vector<Model>& medium_models();
const std::vector<Model>& light_models();        // of lights with a place in the scene
const std::vector<Model>& environment_models();  // of light around it: parameters alone

// Media of the same type by other parameters (kernels/model/medium/list.h): id, name and numbers are the medium's own.
const std::vector<Model>& medium_inputs();

// The first model of that type, or null.
const Model* find_model(const std::vector<Model>& models, const std::string& type);
// The first other BSDF of the same type that has the trait, or null.
const Model* find_of_type(const Model& model, int trait);

}  // namespace itn
