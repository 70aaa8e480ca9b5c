#include <catch2/catch.hpp>
#include <cstdio>
#include "tests/inversion/small_scene.h"
using namespace itn;
using namespace itn::test;
TEST_CASE("debug", "[.debug]") {
  const Device& device = test::device();
  for (int k = 0; k < 3; ++k) {
    const double truth[3] = {2.0 + k, 0.9 - .2 * k, 0.1 + .2 * k};
    const std::vector<TargetImage> targets{rendered_target(device, fog_ball(truth[0], truth[1], truth[2]), 256, 7)};
    RenderOptions options;
    options.seed = 5;
    ForwardModel model(device, fog_ball(3, 0.7, 0.3), {"fog.sigma_t", "fog.albedo", "phase.g"}, {0}, options);
    InversionOptions how;
    how.spp = 4096;
    how.iterations = 14;
    Inversion inversion(model, targets, how);
    InversionState state = inversion.start(model.start());
    while (!state.done) {
      auto s = inversion.advance(state);
      std::printf("%d spp %d loss %.3g x", s.iteration, s.spp, s.loss);
      for (int p = 0; p < 3; ++p) std::printf(" %.4f", model.coordinates()[p].value(s.x[p]));
      std::printf(" %s dist %.3f cost %.4g +- %.2g\n", s.accepted ? "" : "rejected", s.distance, state.accepted_cost, state.accepted_cost_stderr);
    }
    auto e = inversion.conclude(state);
    for (int p = 0; p < 3; ++p) std::printf(" %.4f+-%.4f (%.4f)", model.coordinates()[p].value(e.x[p]), model.coordinates()[p].slope(e.x[p])*std::sqrt(e.covariance(p,p)), truth[p]);
    std::printf("conv %d det %d res %.3f\n", e.converged, e.determined, e.residual);
  }
}
