#include "runtime/scene/model/pieces.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <stdexcept>

namespace itn {
namespace {

std::vector<double> of_piece(const Piece& piece, const std::vector<double>& parameters) {
  const auto from = parameters.begin() + piece.first_parameter;
  return {from, from + piece.model->parameter_slots};
}

}  // namespace

std::string piece_name(std::size_t k, const std::string& name) { return fmt::format("p{}_{}", k, name); }

void declare_pieces(std::vector<Piece>& pieces, Model& made) {
  int numbers = 0;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    Piece& piece = pieces[k];
    piece.first_number = numbers;
    piece.first_parameter = made.parameter_slots;
    for (DeclaredParameter p : piece.model->parameters) {
      p.called = p.shown();
      p.name = piece_name(k, p.name);
      p.slot += piece.first_parameter;
      made.parameters.push_back(p);
    }
    numbers += piece.model->number_slots;
    made.parameter_slots += piece.model->parameter_slots;
  }
}

int slots_of_pieces(const std::vector<Piece>& pieces) {
  return pieces.empty() ? 0 : pieces.back().first_number + pieces.back().model->number_slots;
}

std::vector<double> numbers_of_pieces(const std::vector<Piece>& pieces, const std::vector<double>& parameters) {
  std::vector<double> n;
  for (const Piece& piece : pieces) {
    const std::vector<double> own = piece.model->to_numbers(piece.variant, of_piece(piece, parameters));
    n.insert(n.end(), own.begin(), own.end());
  }
  return n;
}

std::vector<std::vector<double>> jacobian_of_pieces(const std::vector<Piece>& pieces,
                                                    const std::vector<double>& parameters) {
  std::vector<std::vector<double>> by;
  for (const Piece& piece : pieces)
    for (const std::vector<double>& own : piece.model->jacobian(piece.variant, of_piece(piece, parameters))) {
      by.emplace_back(parameters.size());
      std::copy(own.begin(), own.end(), by.back().begin() + piece.first_parameter);
    }
  return by;
}

const char* obstacle_of_pieces(const std::vector<Piece>& pieces, const double* parameters, int slot) {
  for (const Piece& piece : pieces)
    if (slot >= piece.first_parameter && slot < piece.first_parameter + piece.model->parameter_slots)
      return piece.model->obstacle(parameters + piece.first_parameter, slot - piece.first_parameter);
  throw std::logic_error("no parameter of any piece");
}

void name_made_model(Model& model, const std::string& name, std::uint64_t key) {
  constexpr std::uint64_t first_id = 1U << 20U, ids = 1U << 30U;
  static std::mutex mutex;
  static std::map<int, std::string> names;
  model.id = static_cast<int>(first_id + key % ids);
  model.name = name;
  const std::lock_guard<std::mutex> lock(mutex);
  if (names.try_emplace(model.id, name).first->second != name) throw std::logic_error("two models with one number");
}

}  // namespace itn
