#include "network/evaluation/evaluation.h"

#include <cmath>

#include "runtime/base/statistics.h"

namespace itn {
namespace {

constexpr double rounding = 1e-12;  // of a parameter that becomes a coordinate and is taken back

}  // namespace

std::size_t cell_of(const Manifest& set, const Manifest::Image& image) {
  return static_cast<std::size_t>(image.shape) * set.lights.size() + static_cast<std::size_t>(image.light);
}

const Kind* Evaluation::kind(const std::string& name) const {
  for (const Kind& k : kinds)
    if (k.name == name) return &k;
  return nullptr;
}

const ParameterErrors* Evaluation::errors_of(const std::string& subset) const {
  for (const ParameterErrors& e : errors)
    if (e.name == subset) return &e;
  return nullptr;
}

const SynthesisResult* Evaluation::synthesis(const std::string& start) const {
  for (const SynthesisResult& s : syntheses)
    if (s.start == start) return &s;
  return nullptr;
}

Runs Evaluation::appearance(const std::string& who, bool training, bool structure) const {
  std::vector<std::size_t> cells;
  for (const RerenderedResult& r : rerendered)
    if (r.training == training) cells.push_back(cell_of(set, r.target.image));
  const auto one = [&](auto&& of) {
    std::vector<double> values;
    for (const RerenderedResult& r : rerendered)
      if (r.training == training) values.push_back(structure ? of(r).structure : of(r).mean_square);
    return clustered(values, cells);
  };
  if (who == "truth") return {one([](const RerenderedResult& r) { return r.truth; })};
  Runs result;
  for (const std::size_t run : kind(who)->runs)
    result.push_back(one([run](const RerenderedResult& r) { return r.difference[run]; }));
  return result;
}

std::vector<double> Evaluation::synthesis_errors(const Synthesis::Record& record, std::size_t what) const {
  if (what == 3) return record.loss;
  std::vector<double> result;
  for (std::size_t i = 0; i < record.material.size(); ++i) {
    const Manifest::Image& truth = synthesis_targets[i].image;
    const DatasetMaterial& m = record.material[i];
    const double error = what == 0   ? std::log(m.sigma_t / truth.sigma_t)
                         : what == 1 ? m.albedo - truth.albedo
                                     : m.g - truth.g;
    result.push_back(std::abs(error) < rounding ? 0 : error * error);
  }
  return result;
}

double Evaluation::synthesis_limit(std::size_t what) const {
  constexpr double median_square = 0.4549;  // of a standard normal number
  std::vector<double> variances;
  for (std::size_t i = 0; i < synthesis_bounds.size(); ++i) {
    const double unit = what == 0 ? synthesis_targets[i].image.sigma_t : 1;
    variances.push_back(synthesis_bounds[i].image[static_cast<Eigen::Index>(what)] / (unit * unit));
  }
  return median_square * median(variances);
}

}  // namespace itn
