// Models that are made for a scene of others: the numbers and the parameters of several models one after the other.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "itn/model.h"

namespace itn {

// A model with its numbers and parameters among those of all.
struct Piece {
  const Model* model = nullptr;
  int variant = 0;
  int first_number = 0, first_parameter = 0;
};

// The names of piece `k`'s numbers and parameters among all.
std::string piece_name(std::size_t k, const std::string& name);

// Says where each begins, and declares their parameters in the model that is made of them.
void declare_pieces(std::vector<Piece>& pieces, Model& made);

// The slots of their numbers.
int slots_of_pieces(const std::vector<Piece>& pieces);

// From the values of all parameters, slot after slot, as of Model.
std::vector<double> numbers_of_pieces(const std::vector<Piece>& pieces, const std::vector<double>& parameters);
std::vector<std::vector<double>> jacobian_of_pieces(const std::vector<Piece>& pieces,
                                                    const std::vector<double>& parameters);
const char* obstacle_of_pieces(const std::vector<Piece>& pieces, const double* parameters, int slot);

// Gives a made model its name, and the number that goes with the key: beyond those of kernels/model/models.h, and the
// same in every process. Throws std::logic_error: a model of another name has it.
void name_made_model(Model& model, const std::string& name, std::uint64_t key);

}  // namespace itn
