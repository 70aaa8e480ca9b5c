// A scene whose medium is any that a network's outputs can say, rendered with derivatives.
#pragma once
#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "network/model/network.h"
#include "network/prediction/known_scene.h"
#include "runtime/inverse/posterior/exemplar.h"
#include "runtime/render/renderer.h"
#include "runtime/scene/parameters.h"

namespace itn {

struct SceneToShow {
  const Scene& scene;
  int sensor = 0, medium = 0;
  const Body& body;
  const SceneView* view = nullptr;  // null: for networks of one channel
  std::string who;                  // as of body_of()
};

struct MaterialImages {
  Rendering image;      // luminance
  ImageRows by_shares;  // its derivatives: a row a share, a column a pixel
};

class MaterialRenderer {
 public:
  // On a film of the network's size. options: sensor and derivatives are not looked at. Throws UsageError: as
  // film_for_network(), a medium without one number of each of the network's names; what Renderer throws.
  MaterialRenderer(const NetworkDescription& network, const SceneToShow& shown, const Device& device,
                   RenderOptions options);

  // shares: of the outputs' ranges (output_range.h). Samples as of Renderer.
  MaterialImages render(const Eigen::VectorXd& shares, int first_sample, int samples);

 private:
  double value(std::size_t output, double share) const;
  const Scene& at(const Eigen::VectorXd& shares);

  std::vector<OutputRange> outputs_;
  Scene scene_;
  std::vector<std::vector<Parameter>> numbers_;  // of each output
  double sigma_t_unit_ = 1;
  std::unique_ptr<Renderer> renderer_;
};

}  // namespace itn
