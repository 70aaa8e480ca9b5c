// Tables of the Commission Internationale de l'Eclairage.
#pragma once
#include <array>

namespace itn {

constexpr double cie_shortest = 360, cie_longest = 830, cie_step = 5;  // [nm]
constexpr int cie_rows = 95;

struct CieRow {
  std::array<double, 3> xyz;  // colour-matching functions
  double d65;                 // relative power of daylight
};

extern const std::array<CieRow, cie_rows> cie_table;

}  // namespace itn
