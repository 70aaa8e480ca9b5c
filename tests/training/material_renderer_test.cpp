// The derivatives by shares that a network is shown, beside differences of renderings.
#include "network/prediction/material_renderer.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "runtime/scene/load.h"

using namespace itn;

TEST_CASE("a material's derivative images by the shares of a network's ranges are differences of its images") {
  const Scene scene = load_scene(ITN_SOURCE_DIR "/scenes/gallery/translucent_blob.xml");
  NetworkDescription network;
  network.size = 16;
  network.mm_per_unit = 0.5;  // sigma_t is twice as large in the scene's unit
  const Body body = body_of(scene, 0, "test");
  const SceneToShow shown{scene, 0, 0, body, nullptr, "test"};
  const Device device("");
  MaterialRenderer renderer(network, shown, device, {});
  const Eigen::Vector3d shares(0.3, 0.6, 0.4);
  constexpr int spp = 1024;
  constexpr double h = 0.1;
  const MaterialImages at = renderer.render(shares, 0, spp);
  REQUIRE(at.by_shares.rows() == 3);
  REQUIRE(at.image.derivatives.size() == 3);
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::VectorXd way = h * Eigen::VectorXd::Unit(3, i);
    const Image more = renderer.render(shares + way, 1 << 20, spp).image,
                less = renderer.render(shares - way, 1 << 21, spp).image;
    const double difference = (more.mean_of_image[0] - less.mean_of_image[0]) / (2 * h);
    const double derivative = static_cast<double>(at.by_shares.row(i).mean());
    const Image& raw = at.image.derivatives[static_cast<std::size_t>(i)];
    const double noise = std::hypot(more.stderr_of_mean[0] / (2 * h), less.stderr_of_mean[0] / (2 * h),
                                    raw.stderr_of_mean[0] * derivative / raw.mean_of_image[0]);
    CAPTURE(i, difference, derivative, noise);
    CHECK(std::fabs(difference) > 10 * noise);  // there is something to compare
    CHECK(std::fabs(derivative - difference) < 4 * noise + 0.02 * std::fabs(difference));  // and what bends over 2 h
  }
}
