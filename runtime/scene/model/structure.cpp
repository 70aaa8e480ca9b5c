#include "runtime/scene/model/structure.h"

#include <fmt/format.h>

#include <map>
#include <mutex>

#include "kernels/model/nest/list.h"
#include "runtime/base/fingerprint.h"

namespace itn {
namespace {

const Model& twosided() { return *find_model(nest_models(), "twosided"); }

// A BSDF as the start of a structure: itself, or what it is made of already.
Structure parts_of(const Bsdf& bsdf) {
  if (bsdf.model && bsdf.model->structure) return *bsdf.model->structure;
  Structure parts;
  Structure::Leaf leaf;
  if (bsdf.model) {
    parts.pieces.push_back({bsdf.model, bsdf.variant});
    leaf.piece = 0;
    if (bsdf.twosided) leaf.nests.push_back({&twosided(), 0, -1});
  }
  parts.leaves.push_back(leaf);
  return parts;
}

// Behind the pieces that `all` has; each leaf behind one more nest.
void append(const Structure& parts, const Structure::Enter& enter, Structure& all) {
  const int shift = static_cast<int>(all.pieces.size());
  all.pieces.insert(all.pieces.end(), parts.pieces.begin(), parts.pieces.end());
  for (Structure::Leaf leaf : parts.leaves) {
    for (Structure::Enter& nest : leaf.nests)
      if (nest.piece >= 0) nest.piece += shift;
    if (leaf.piece >= 0) leaf.piece += shift;
    leaf.nests.insert(leaf.nests.begin(), enter);
    all.leaves.push_back(leaf);
  }
}

// The same for two structures that are alike in all but the values of their numbers.
std::string description(const Structure& s) {
  std::string text;
  for (const Piece& piece : s.pieces) text += fmt::format("{} {};", piece.model->name, piece.variant);
  for (const Structure::Leaf& leaf : s.leaves) {
    text += "leaf";
    for (const Structure::Enter& nest : leaf.nests)
      text += fmt::format(" {} {} {}", nest.nest->name, nest.branch, nest.piece);
    text += fmt::format(" {};", leaf.piece);
  }
  return text;
}

int traits_of_all(const Structure& s) {
  int any = 0, smooth = BSDF_SMOOTH;
  bool reflects_broadly = false;
  for (const Structure::Leaf& leaf : s.leaves) {
    const int traits = s.traits_of(leaf);
    any |= leaf.piece < 0 ? BSDF_PASSES | BSDF_SMOOTH : traits;
    if (leaf.piece >= 0) smooth &= traits;
    reflects_broadly |= leaf.piece >= 0 && !(traits & (BSDF_TRANSMITS | BSDF_SMOOTH));
    for (const Structure::Enter& nest : leaf.nests) any |= nest.nest->traits;
  }
  // A painted part of a boundary is lit as an opaque surface is, by all light.
  if ((any & BSDF_TRANSMITS) && reflects_broadly) any |= BSDF_BROAD;
  const int kept =
      any & (BSDF_TRANSMITS | BSDF_THIN | BSDF_ANISOTROPIC | BSDF_PASSES | BSDF_BUMPED | BSDF_BROAD | BSDF_MEASURED);
  const bool some = (any & (BSDF_SMOOTH | BSDF_PARTLY_SMOOTH)) != 0;
  return BSDF_STRUCTURE | kept | (smooth ? BSDF_SMOOTH : some ? BSDF_PARTLY_SMOOTH : 0);
}

void declare(Structure& s) {
  Model& m = s.model;
  declare_pieces(s.pieces, m);
  for (std::size_t k = 0; k < s.pieces.size(); ++k)
    for (DeclaredNumber n : s.pieces[k].model->numbers) {
      n.name = piece_name(k, n.name);
      n.slot += s.pieces[k].first_number;
      if (n.role == ROLE_DENSITY || n.role == ROLE_INDEX) n.role = ROLE_FACTOR;  // no score of a density is asked for
      m.numbers.push_back(n);
    }
  s.picked = slots_of_pieces(s.pieces);
  m.number_slots = s.picked + 1;
  m.numbers.push_back({"picked", s.picked, 1, ROLE_FIXED, COORDINATE_ITSELF});
}

const char* const mirrored_inside =
    "what is inside mirrors light in a direction that would move with it, and paths are held fixed; need a rough one "
    "inside, such as roughconductor or roughplastic";

// True for each piece that bends the normals of leaves that choose directions.
std::vector<bool> pieces_that_turn_mirrors(const Structure& s) {
  std::vector<bool> result(s.pieces.size());
  for (const Structure::Leaf& leaf : s.leaves)
    for (const Structure::Enter& nest : leaf.nests)
      if (nest.piece >= 0 && (nest.nest->traits & BSDF_ANISOTROPIC) && leaf.piece >= 0 &&
          (s.traits_of(leaf) & (BSDF_SMOOTH | BSDF_PARTLY_SMOOTH)))
        result[static_cast<std::size_t>(nest.piece)] = true;
  return result;
}

void convert(Structure& s) {
  Model& m = s.model;
  const std::vector<Piece> pieces = s.pieces;
  m.to_numbers = [pieces](int, const std::vector<double>& parameters) {
    std::vector<double> n = numbers_of_pieces(pieces, parameters);
    n.push_back(0);  // picked
    return n;
  };
  m.jacobian = [pieces](int, const std::vector<double>& parameters) {
    auto by = jacobian_of_pieces(pieces, parameters);
    by.emplace_back(parameters.size());
    return by;
  };
  const std::vector<bool> turns_mirrors = pieces_that_turn_mirrors(s);
  m.obstacle = [pieces, turns_mirrors](const double* parameters, int slot) {
    for (std::size_t k = 0; k < pieces.size(); ++k)
      if (turns_mirrors[k] && slot == pieces[k].first_parameter + pieces[k].model->parameters.front().slot)
        return mirrored_inside;
    return obstacle_of_pieces(pieces, parameters, slot);
  };
}

// The one of its kind, which stays.
const Structure& interned(Structure&& s, const std::string& type) {
  static std::mutex mutex;
  static std::map<std::string, Structure> all;
  const std::string key = description(s);
  const std::lock_guard<std::mutex> lock(mutex);
  if (const auto known = all.find(key); known != all.end()) return known->second;
  Structure& made = all.emplace(key, std::move(s)).first->second;
  Model& m = made.model;
  m = {};
  name_made_model(m, fmt::format("structure_{:016x}", fingerprint(key)), fingerprint(key));
  m.type = type;
  m.variants = {""};
  m.traits = traits_of_all(made);
  m.structure = &made;
  declare(made);
  convert(made);
  return made;
}

void append_values(const Instance& instance, std::vector<Texture>& values, std::vector<std::string>& owners) {
  values.insert(values.end(), instance.values.begin(), instance.values.end());
  for (std::size_t i = 0; i < instance.values.size(); ++i) owners.push_back(instance.owner(i));
}

bool has(const Bsdf& bsdf, int traits) { return bsdf.model && (bsdf.model->traits & traits); }

}  // namespace

int Structure::traits_of(const Leaf& leaf) const {
  return leaf.piece < 0 ? PASSAGE_TRAITS & ~BSDF_TRANSMITS & ~BSDF_THIN : model_of(leaf)->traits;
}

Bsdf make_nest(const Instance& nest, const std::vector<Bsdf>& inside) {
  Structure s;
  int piece = -1;
  if (!nest.values.empty()) {
    piece = 0;
    s.pieces.push_back({nest.model, 0});
  }
  const bool two_sides = nest.model == &twosided() && inside.size() == 2;
  Bsdf bsdf;
  append_values(nest, bsdf.values, bsdf.owners);
  for (std::size_t branch = 0; branch < inside.size(); ++branch) {
    append(parts_of(inside[branch]), {nest.model, static_cast<int>(branch) + two_sides, piece}, s);
    append_values(inside[branch], bsdf.values, bsdf.owners);
  }
  if (nest.type() == "mask") {
    Structure passage;
    passage.leaves.emplace_back();
    append(passage, {nest.model, 1, piece}, s);
  }
  bsdf.id = nest.id;
  bsdf.where = nest.where;
  bsdf.model = &interned(std::move(s), nest.type()).model;
  return bsdf;
}

std::string refusal_of_nest(const Model& nest, const std::vector<Bsdf>& inside) {
  std::size_t leaves = 0;
  for (const Bsdf& bsdf : inside) {
    leaves += parts_of(bsdf).leaves.size();
    const bool passes = !bsdf.model || has(bsdf, BSDF_PASSES);
    if (nest.type == "twosided" && (passes || has(bsdf, BSDF_TRANSMITS)))
      return "what is inside lets light pass; need what reflects it: put a mask around twosided";
    if ((nest.traits & BSDF_ANISOTROPIC) && passes)
      return fmt::format("what is inside lets light pass straight on, which has no normal; put {} inside of the mask",
                         nest.type);
    if ((nest.traits & BSDF_ANISOTROPIC) && has(bsdf, BSDF_BUMPED))
      return fmt::format(
          "a bumpmap is inside, whose heights are of the surface itself; put {} inside of the bumpmap, "
          "or make one map of the two",
          nest.type);
  }
  if (leaves > most_leaves)
    return fmt::format("{} surfaces are nested in it, each as often as it is met; the most is {}", leaves, most_leaves);
  return "";
}

}  // namespace itn
