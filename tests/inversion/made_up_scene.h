// A scene whose images are formulas: what takes renderings to learn elsewhere is known here, and a rendering costs
// nothing.
#pragma once
#include <cmath>
#include <functional>
#include <random>

#include "runtime/inverse/posterior/posterior.h"

namespace itn::test {

struct MadeUpScene {
  // The radiance of pixel (x, y) in [-1, 1]^2 at natural coordinates.
  std::function<double(double x, double y, const Eigen::VectorXd& at)> radiance;
  int pixels = 16;
  double sample_noise = 0.5;  // standard deviation of a sample, over the radiance
  std::mt19937_64 random{1};

  double at_pixel(int i, const Eigen::VectorXd& at) const {
    const int x = i % pixels, y = i / pixels;
    return radiance((2 * x + 1.0) / pixels - 1, (2 * y + 1.0) / pixels - 1, at);
  }

  PosteriorRendering render(const Eigen::VectorXd& at, int spp) {
    std::normal_distribution<double> normal;
    PosteriorRendering result{at, {{spp, {}}}};
    const Eigen::Index rows = 1 + at.size(), count = static_cast<Eigen::Index>(pixels) * pixels;
    for (HalfImages& half : result.views[0].half) {
      half.value.resize(rows, count);
      half.error.resize(rows, count);
    }
    for (Eigen::Index r = 0; r < rows; ++r) {
      constexpr double h = 1e-4;
      Eigen::VectorXd up = at, down = at;
      if (r > 0) {
        up[r - 1] += h;
        down[r - 1] -= h;
      }
      for (int i = 0; i < count; ++i) {
        const double value = at_pixel(i, at), of_row = r == 0 ? value : (at_pixel(i, up) - at_pixel(i, down)) / (2 * h);
        // derivatives are noisier than what they are of
        const double error = (r == 0 ? 1 : 2) * sample_noise * value / std::sqrt(static_cast<double>(spp));
        for (HalfImages& half : result.views[0].half) {
          half.value(r, i) = static_cast<float>(of_row + error * normal(random));
          half.error(r, i) = static_cast<float>(error);
        }
      }
    }
    return result;
  }

  TargetImage photo(const Eigen::VectorXd& at, int spp, double exposure = 1) {
    std::normal_distribution<double> normal;
    TargetImage target{pixels, pixels, 1, {}, {}, {}};
    for (int i = 0; i < pixels * pixels; ++i) {
      const double value = exposure * at_pixel(i, at), error = sample_noise * value / std::sqrt(double(spp));
      target.value.push_back(static_cast<float>(value + error * normal(random)));
      target.error.push_back(static_cast<float>(error));
      target.weight.push_back(1);
    }
    return target;
  }

  void run(Posterior& posterior) {
    while (!posterior.done()) {
      std::vector<PosteriorRendering> rendered;
      for (const Posterior::Wanted& wanted : posterior.wanted()) rendered.push_back(render(wanted.at, wanted.spp));
      posterior.advance(std::move(rendered));
    }
  }
};

inline double even(const Eigen::VectorXd&) { return 0; }

}  // namespace itn::test
