#include "runtime/inverse/gauss_newton/uncertainty.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "itn/colour.h"
#include "runtime/base/parameter_chain.h"
#include "runtime/base/statistics.h"
#include "runtime/scene/model/phase_formula.h"

namespace itn {
namespace {

const double z95 = normal_quantile(0.975);

bool may_be_negative(const Parameter& p) { return p.low < 0; }

// Position of the parameter that sets this number of the medium's channel; -1: it is fixed.
int unknown(const std::vector<Coordinate>& coordinates, Owner owner, const std::string& member, int medium,
            int channel) {
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    const Parameter& p = coordinates[i].parameter();
    if (p.is(owner, member) && p.belongs_to(medium) && (p.component < 0 || p.component == channel))
      return static_cast<int>(i);
  }
  return -1;
}

// Reduced scattering and absorption are those of its numbers of these names; a medium without them, or with a grid in
// their place, has none.
constexpr const char *const extinction = "sigma_t", *const single_scattering_albedo = "albedo";

bool has_coefficients(const Medium& medium) {
  const auto has = [&](const char* name) {
    const auto& numbers = medium.model->numbers;
    return std::any_of(numbers.begin(), numbers.end(), [&](const DeclaredNumber& n) { return n.name == name; });
  };
  return !medium.has_grid() && has(extinction) && has(single_scattering_albedo);
}

// The numbers of that name, a channel each.
Rgb number_of(const Medium& medium, const char* name) {
  const DeclaredNumber& number = medium.model->number_called(name);
  const std::vector<double> n = medium.model->to_numbers(medium.variant, medium.slots());
  const auto at = [&](int c) { return n[static_cast<std::size_t>(number.slot + (number.channels == 3 ? c : 0))]; };
  return {at(0), at(1), at(2)};
}

// A parameter of a medium that reduced scattering and absorption depend on, and their derivatives by it.
struct Influence {
  Owner owner;
  std::string member;
  std::array<double, 2> by;
};

// The two coefficients in one channel, and what they depend on.
std::pair<std::array<double, 2>, std::vector<Influence>> coefficients(const Medium& medium, std::size_t channel) {
  const PhaseFunction& phase = medium.phase;
  const std::vector<double> mean = mean_cosine(*phase.model, phase.slots());  // and its derivatives
  const auto chain = jacobian(reduced_scattering_and_absorption,
                              std::array{number_of(medium, extinction)[channel],
                                         number_of(medium, single_scattering_albedo)[channel], mean[0]});
  std::vector<Influence> influences;
  // Moves the chain's arguments that fast.
  const auto influence = [&](Owner owner, const std::string& parameter, const std::array<double, 3>& speed) {
    std::array<double, 2> by{};
    for (std::size_t quantity = 0; quantity < 2; ++quantity)
      for (std::size_t k = 0; k < 3; ++k) by[quantity] += chain.by[quantity][k] * speed[k];
    influences.push_back({owner, parameter, by});
  };
  const auto by_parameters = medium.model->jacobian(medium.variant, medium.slots());
  const auto row = [&](const char* name) {
    const DeclaredNumber& number = medium.model->number_called(name);
    return by_parameters[static_cast<std::size_t>(number.slot) + (number.channels == 3 ? channel : 0)];
  };
  for (const DeclaredParameter& p : medium.model->parameters) {
    const std::size_t slot = static_cast<std::size_t>(p.slot) + (p.kind.channels == 3 ? channel : 0);
    influence(Owner::medium, p.name, {row(extinction)[slot], row(single_scattering_albedo)[slot], 0});
  }
  // The numbers of a medium given by reduced scattering move with the mean cosine, too.
  const int slot = medium.model->mean_cosine_slot();
  const auto with_cosine = [&](const char* name) { return slot < 0 ? 0 : row(name)[static_cast<std::size_t>(slot)]; };
  for (const DeclaredParameter& p : phase.model->parameters) {
    const double speed = mean[static_cast<std::size_t>(p.slot) + 1];
    influence(Owner::phase, p.name,
              {speed * with_cosine(extinction), speed * with_cosine(single_scattering_albedo), speed});
  }
  return {chain.value, influences};
}

// The interval of a number > 0 whose logarithm has the standard error sd.
Interval log_interval(const std::string& name, double value, double sd) {
  return {name, value, value * std::exp(-z95 * sd), value * std::exp(z95 * sd), value * sd};
}

}  // namespace

std::vector<Interval> intervals(const std::vector<Coordinate>& coordinates, const std::vector<double>& x,
                                const Eigen::MatrixXd& covariance) {
  std::vector<Interval> result;
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    const Coordinate& c = coordinates[i];
    const auto k = static_cast<Eigen::Index>(i);
    const double sd = std::sqrt(covariance(k, k));
    result.push_back(
        {c.parameter().name, c.value(x[i]), c.value(x[i] - z95 * sd), c.value(x[i] + z95 * sd), c.slope(x[i]) * sd});
  }
  return result;
}

std::vector<Interval> exposures(const std::vector<Coordinate>& coordinates, const std::vector<double>& x,
                                const Eigen::MatrixXd& covariance, const std::vector<std::string>& names) {
  std::vector<Interval> result;
  for (std::size_t i = coordinates.size(); i < x.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    result.push_back(log_interval(names[i], std::exp(x[i]), std::sqrt(covariance(k, k))));
  }
  return result;
}

std::vector<Interval> transport_coefficients(const Scene& scene, const std::vector<Coordinate>& coordinates,
                                             const std::vector<double>& x, const Eigen::MatrixXd& covariance) {
  std::vector<Interval> result;
  for (std::size_t m = 0; m < scene.media.size(); ++m) {
    const Medium& medium = scene.media[m];
    if (!has_coefficients(medium)) continue;
    const bool one = grey(number_of(medium, extinction)) && grey(number_of(medium, single_scattering_albedo));
    const int channels = one ? 1 : 3;
    for (int c = 0; c < channels; ++c) {
      const auto [values, influences] = coefficients(medium, static_cast<std::size_t>(c));
      for (std::size_t quantity = 0; quantity < 2; ++quantity) {
        Eigen::VectorXd by = Eigen::VectorXd::Zero(covariance.rows());
        bool depends = false;
        for (const Influence& influence : influences) {
          const int i = unknown(coordinates, influence.owner, influence.member, static_cast<int>(m), c);
          if (i < 0) continue;
          const auto k = static_cast<std::size_t>(i);
          by[i] = influence.by[quantity] * coordinates[k].slope(x[k]);
          depends |= by[i] != 0;
        }
        if (!depends) continue;
        const double value = values[quantity], sd = std::sqrt(by.dot(covariance * by));
        result.push_back(
            log_interval(fmt::format("{}.{}{}", medium.id, quantity == 0 ? "reduced_scattering" : "absorption",
                                     channels == 1 ? "" : std::string(".") + "RGB"[c]),
                         value, sd / value));
      }
    }
  }
  return result;
}

std::vector<Direction> ambiguity(const std::vector<Coordinate>& coordinates, const std::vector<double>& x,
                                 const Eigen::MatrixXd& covariance) {
  const auto n = static_cast<Eigen::Index>(coordinates.size());
  Eigen::VectorXd slope(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Coordinate& c = coordinates[static_cast<std::size_t>(i)];
    const double at = x[static_cast<std::size_t>(i)];
    slope[i] = c.slope(at) / (may_be_negative(c.parameter()) ? 1 : c.value(at));
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(slope.asDiagonal() * covariance.topLeftCorner(n, n) *
                                                             slope.asDiagonal());
  std::vector<Direction> result;
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::VectorXd v = eigen.eigenvectors().col(k);
    Eigen::Index largest = 0;
    v.cwiseAbs().maxCoeff(&largest);
    if (v[largest] < 0) v = -v;
    result.push_back({{v.begin(), v.end()}, std::sqrt(std::max(0.0, eigen.eigenvalues()[k]))});
  }
  return result;
}

std::string words(const Direction& direction, const std::vector<Coordinate>& coordinates) {
  std::vector<std::size_t> order(coordinates.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return std::fabs(direction.part[a]) > std::fabs(direction.part[b]); });
  std::string text;
  for (const std::size_t i : order) {
    const double change = direction.part[i] * direction.uncertainty;
    if (std::fabs(direction.part[i]) < 0.05) continue;
    const Parameter& p = coordinates[i].parameter();
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", p.name,
                        may_be_negative(p) ? fmt::format("{:+.2g}", change) : fmt::format("{:+.2g} %", 100 * change));
  }
  return text;
}

}  // namespace itn
