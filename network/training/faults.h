// Corruptions of photographs, applied to sound ones: a judge (judge.h) learns to tell the two apart.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "itn/network.h"
#include "network/model/input.h"

namespace itn {

class Draws;                                  // random numbers
using Others = std::function<Photographs()>;  // of another shape

struct Fault {
  // The data that must be there for it, and that the network has to see or to know.
  enum class Needs { photo, exposure, flash, mask, shape, light };
  const char* name;
  Needs needs;
  // To 1 of others while a judge begins to learn, of one that knows the shape and of one that does not; above 1: it is
  // hard to see.
  int often_of_known, often_of_unknown;
  void (*happens)(Photographs& photographs, Draws& draws, const Others& others);
};

extern const std::array<Fault, 12> faults;

// The corruptions that a network with these inputs can recognize.
std::vector<Fault> faults_of(const NetworkDescription& network);

// Applies a corruption: the same numbers for the same seed and stream. Throws UsageError: it needs data that are not
// there.
void spoil(Photographs& photographs, const Fault& fault, const Others& others, std::uint64_t seed,
           std::uint64_t stream);

}  // namespace itn
