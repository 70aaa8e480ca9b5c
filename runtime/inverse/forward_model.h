// Images of a scene as a function of some of its parameters: what an inversion asks again and again.
#pragma once
#include <memory>
#include <vector>

#include "itn/renderer.h"
#include "runtime/inverse/coordinate.h"

namespace itn {

class ForwardModel {
 public:
  // parameters: names as list_parameters gives them; each image is seen by one of the sensors, with random numbers of
  // its own. options: seed, operator, cancel and so on, for all. Throws as Renderer.
  ForwardModel(const Device& device, const Scene& scene, const std::vector<std::string>& parameters,
               const std::vector<int>& sensors, const RenderOptions& options);

  const std::vector<Coordinate>& coordinates() const { return coordinates_; }
  std::size_t images() const { return renderers_.size(); }
  std::vector<double> start() const;  // the coordinates of the scene's own values

  // Samples [first, first + spp) of every image at these coordinates (one a parameter; what follows is not looked at),
  // with derivatives by the parameters themselves.
  std::vector<Rendering> render(const std::vector<double>& x, int first, int spp);
  // The same at these values of the parameters.
  std::vector<Rendering> render_values(const std::vector<double>& values, int first, int spp);
  // As render(), in the groups of split_samples(); spp >= 2.
  std::vector<std::vector<Rendering>> render_groups(const std::vector<double>& x, int first, int spp);

 private:
  void set(const std::vector<double>& x);
  void set_values(const std::vector<double>& values);

  Scene scene_;
  std::vector<double> values_;  // that the renderers have
  std::vector<Coordinate> coordinates_;
  std::vector<std::unique_ptr<Renderer>> renderers_;
};

}  // namespace itn
