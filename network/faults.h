// What goes wrong with photographs, done to ones that are right: a judge (judge.h) learns to tell the two apart.
#pragma once
#include <array>
#include <cstdint>
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

struct Fault {
  const char* name;
  bool needs_flash, needs_mask;
};

// Lengths in pixels of images of 64.
constexpr std::array<Fault, 8> faults{{
    {"noisy", false, false},        // a standard deviation of a tenth to a half of the object's mean is added
    {"blurred", false, false},      // by a normal distribution of 1 to 3 pixels
    {"curve", false, false},        // radiance to the power of e^.4 to e, or one over that
    {"saturated", false, false},    // 5 to 40 % of the object are cut off in the brighter photo, the other alike
    {"mask", false, true},          // grown or shrunk by 2 to 6 pixels, moved by 3 to 9, or the box around it
    {"moved", true, false},         // by 1.5 to 6.5 pixels between the photo and the one with the flash
    {"others_flash", true, false},  // of another object
    {"no_flash", true, false},      // the second photo is the first, brighter, and a little noise
}};

// Those that photographs can have of which a network sees this much.
std::vector<Fault> faults_of(const NetworkDescription& network);

// others_flash: of other photographs, for the fault of this name. The same numbers for the same seed and stream.
// Throws UsageError: a name that faults does not have, a fault that needs what is not there.
void spoil(Photographs& photographs, const std::string& fault, const std::vector<float>& others_flash,
           std::uint64_t seed, std::uint64_t stream);

}  // namespace itn
