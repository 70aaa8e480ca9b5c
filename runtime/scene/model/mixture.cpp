#include "runtime/scene/model/mixture.h"

#include <fmt/format.h>

#include <map>
#include <mutex>
#include <stdexcept>
#include <string>

#include "kernels/model/phase/mixture.h"
#include "runtime/base/dual.h"
#include "runtime/base/fingerprint.h"

namespace itn {
namespace {

// The numbers of a mixture from those of its pieces.
template <class Real>
std::vector<Real> flattened(const std::vector<Piece>& pieces, const std::vector<Real>& n) {
  std::vector<Real> shares, others;
  for (std::size_t k = 1; k < pieces.size(); ++k) {
    const Model& inside = *pieces[k].model;
    const auto parts = static_cast<int>(parts_of(inside));
    const Real* own = n.data() + pieces[k].first_number;
    for (int part = 0; part < parts; ++part)
      shares.push_back(inside.mixture ? n[k - 1] * mixture_share(own, parts, part) : n[k - 1]);
    others.insert(others.end(), own + parts - 1, own + inside.number_slots);
  }
  others.insert(others.begin(), shares.begin() + 1, shares.end());
  return others;
}

void add_number(Model& model, std::string name, const DeclaredNumber& like) {
  model.numbers.push_back({std::move(name), model.number_slots, like.channels, like.role, like.coordinate});
  model.number_slots += like.channels;
}

void declare(Mixture& mixture) {
  declare_pieces(mixture.pieces, mixture.model);
  std::vector<const Model*> models;
  for (std::size_t k = 1; k < mixture.pieces.size(); ++k) {
    const Model* inside = mixture.pieces[k].model;
    if (!inside->mixture) models.push_back(inside);
    if (inside->mixture)
      for (const Mixture::Part& part : inside->mixture->parts) models.push_back(part.model);
  }
  for (std::size_t k = 1; k < models.size(); ++k)
    add_number(mixture.model, fmt::format("share_{}", k), {"", 0, 1, ROLE_DENSITY, COORDINATE_ITSELF});
  for (std::size_t k = 0; k < models.size(); ++k) {
    mixture.parts.push_back({models[k], mixture.model.number_slots});
    for (const DeclaredNumber& n : models[k]->numbers) add_number(mixture.model, piece_name(k, n.name), n);
  }
}

void convert(Mixture& mixture) {
  Model& m = mixture.model;
  const std::vector<Piece> pieces = mixture.pieces;
  m.to_numbers = [pieces](int, const std::vector<double>& parameters) {
    return flattened(pieces, numbers_of_pieces(pieces, parameters));
  };
  m.jacobian = [pieces, slots = static_cast<std::size_t>(m.number_slots)](int, const std::vector<double>& at) {
    const std::vector<double> n = numbers_of_pieces(pieces, at);
    const auto by_pieces = jacobian_of_pieces(pieces, at);
    std::vector<std::vector<double>> by(slots, std::vector<double>(at.size()));
    for (std::size_t k = 0; k < at.size(); ++k) {
      std::vector<Dual<1>> moving(n.begin(), n.end());
      for (std::size_t i = 0; i < n.size(); ++i) moving[i].derivative[0] = by_pieces[i][k];
      const std::vector<Dual<1>> flat = flattened(pieces, moving);
      for (std::size_t i = 0; i < slots; ++i) by[i][k] = flat[i].derivative[0];
    }
    return by;
  };
  m.obstacle = [pieces](const double* parameters, int slot) { return obstacle_of_pieces(pieces, parameters, slot); };
}

// The same for two mixtures that are alike in all but the values of their parameters.
std::string description(const std::vector<Piece>& pieces) {
  std::string text = pieces[0].model->name;
  for (std::size_t k = 1; k < pieces.size(); ++k) text += " " + pieces[k].model->name;
  return text;
}

// The one of its kind, which stays.
const Mixture& interned(std::vector<Piece> pieces) {
  static std::mutex mutex;
  static std::map<std::string, Mixture> all;
  const std::string key = description(pieces);
  const std::lock_guard<std::mutex> lock(mutex);
  if (const auto known = all.find(key); known != all.end()) return known->second;
  Mixture& made = all[key];
  made.pieces = std::move(pieces);
  made.model.type = made.pieces[0].model->type;
  made.model.variants = {""};
  made.model.mixture = &made;
  name_made_model(made.model, fmt::format("mixture_{:016x}", fingerprint(key)), fingerprint(key));
  declare(made);
  convert(made);
  return made;
}

}  // namespace

std::size_t parts_of(const Model& phase) { return phase.mixture ? phase.mixture->parts.size() : 1; }

const DeclaredNumber& number_of_grid(const PhaseFunction& phase, std::size_t parameter) {
  const auto by = phase.model->jacobian(phase.variant, phase.slots());
  const auto slot = static_cast<std::size_t>(phase.model->parameters[parameter].slot);
  const DeclaredNumber* found = nullptr;
  for (const DeclaredNumber& number : phase.model->numbers) {
    const double speed = by[static_cast<std::size_t>(number.slot)][slot];
    if (speed == 0) continue;
    if (found || speed != 1) throw std::logic_error("a grid of " + phase.model->parameters[parameter].name);
    found = &number;
  }
  if (!found) throw std::logic_error("a grid of " + phase.model->parameters[parameter].name + ", which moves nothing");
  return *found;
}

PhaseFunction make_mixture(const Instance& nest, const std::vector<PhaseFunction>& inside) {
  PhaseFunction mixture;
  mixture.id = nest.id;
  mixture.where = nest.where;
  std::vector<Piece> pieces;
  const auto append = [&](const Instance& piece) {
    pieces.push_back({piece.model});
    mixture.values.insert(mixture.values.end(), piece.values.begin(), piece.values.end());
    for (std::size_t i = 0; i < piece.values.size(); ++i) mixture.owners.push_back(piece.owner(i));
  };
  append(nest);
  for (const PhaseFunction& phase : inside) append(phase);
  mixture.model = &interned(std::move(pieces)).model;
  return mixture;
}

}  // namespace itn
