// What goes wrong with photographs, done to ones that are right: a judge (judge.h) learns to tell the two apart.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "network/network.h"

namespace itn {

// Of an object: square, row-major planes, linear.
struct Photographs {
  int size = 0;              // [pixels]
  std::vector<float> image;  // of one colour or three
  std::vector<float> flash;  // the light that a flash adds, likewise; empty: there is none
  std::vector<float> mask;   // 1 where the object is seen, else 0; empty: there is none
};

class Draws;                                              // random numbers
using OthersFlash = std::function<std::vector<float>()>;  // of other photographs

struct Fault {
  const char* name;
  bool needs_flash, needs_mask;
  void (*happens)(Photographs& photographs, Draws& draws, const OthersFlash& others_flash);
};

extern const std::array<Fault, 8> faults;

// Those that photographs can have of which a network sees this much.
std::vector<Fault> faults_of(const NetworkDescription& network);

// The same numbers for the same seed and stream. Throws UsageError: a fault that needs what is not there.
void spoil(Photographs& photographs, const Fault& fault, const OthersFlash& others_flash, std::uint64_t seed,
           std::uint64_t stream);

}  // namespace itn
