// Predicted parameters: each raw output, any real number, becomes a parameter strictly inside its range, smoothly.
//
//   share = logistic(output) in (0, 1)      the space of the supervised loss
//   parameter = low + (high - low) share,   or where logarithmic, low (high / low)^share
#pragma once
#include <cmath>
#include <string>
#include <vector>

namespace itn {

struct OutputRange {
  std::string name;  // "sigma_t"
  double low = 0, high = 1;
  bool logarithmic = false;  // low > 0; equal ratios get equal shares

  double parameter(double output) const;
  double parameter_derivative(double output) const;  // d parameter / d output
  double share(double parameter) const;              // of a parameter in [low, high]; outside it goes on beyond [0, 1]
  template <class Real>
  Real parameter_of_share(const Real& share) const {  // the inverse
    using std::exp;
    return logarithmic ? low * exp(std::log(high / low) * share) : low + (high - low) * share;
  }

  friend bool operator==(const OutputRange&, const OutputRange&) = default;
};

double share_of_output(double output);
double share_derivative(double output);  // d share / d output

// sigma_t [1/mm], albedo, g: what the paper's authors clamp to.
std::vector<OutputRange> default_outputs();

// Throws UsageError: none, a range without a name, empty, not finite, logarithmic and not above 0, two of one name.
void check_outputs(const std::vector<OutputRange>& outputs);

}  // namespace itn
