#include "itn/output_range.h"

#include <cmath>
#include <set>

#include "itn/error.h"
#include "runtime/base/parameter_chain.h"

namespace itn {
namespace {

Jacobian<1, 1> parameter_chain(const OutputRange& range, double output) {
  if (!range.logarithmic) return jacobian(FromLogit{range.low, range.high}, std::array{output});
  const auto chain = [&]<class Real>(const Numbers<Real, 1>& x) {
    return from_log(FromLogit{std::log(range.low), std::log(range.high)}(x));
  };
  return jacobian(chain, std::array{output});
}

Jacobian<1, 1> share_chain(double output) { return jacobian(FromLogit{0, 1}, std::array{output}); }

}  // namespace

double OutputRange::parameter(double output) const { return parameter_chain(*this, output).value[0]; }

double OutputRange::parameter_derivative(double output) const { return parameter_chain(*this, output).by[0][0]; }

double OutputRange::share(double parameter) const {
  if (logarithmic) return std::log(parameter / low) / std::log(high / low);
  return (parameter - low) / (high - low);
}

double share_of_output(double output) { return share_chain(output).value[0]; }

double share_derivative(double output) { return share_chain(output).by[0][0]; }

std::vector<OutputRange> default_outputs() {
  return {{"sigma_t", 20, 300, true}, {"albedo", 0.35, 0.97, false}, {"g", -0.1, 0.9, false}};
}

void check_outputs(const std::vector<OutputRange>& outputs) {
  if (outputs.empty()) throw UsageError("a network needs at least one output");
  std::set<std::string> names;
  for (const OutputRange& range : outputs) {
    if (range.name.empty() || !names.insert(range.name).second)
      throw UsageError("output '" + range.name + "': every output needs a name of its own");
    if (!std::isfinite(range.low) || !std::isfinite(range.high) || !(range.low < range.high))
      throw UsageError("output '" + range.name + "': low and high must be finite, and low below high");
    if (range.logarithmic && !(range.low > 0))
      throw UsageError("output '" + range.name + "': a logarithmic range lies above 0");
  }
}

}  // namespace itn
