// What a network knows of a scene beside the image: the shape as the camera sees it, and where light comes from.
#pragma once
#include <array>
#include <span>
#include <string>

#include "itn/scene.h"
#include "network/model/input.h"

namespace itn {

// The shape that a medium is inside of.
struct Body {
  int shape = 0;
  double longest_side = 1;  // of the box around it, along the axes [scene units]
};

// who: whose network it is, for messages: "--init rn". Throws UsageError: a medium inside of several shapes or none.
Body body_of(const Scene& scene, int medium, const std::string& who);

// The sensor as if it had size x size pixels, as networks see images. who: as of body_of(). Throws UsageError: pixels
// that are no square or only a part of the film.
void film_for_network(Scene& scene, int sensor, int size, const std::string& who);

// For networks that see of the shape, which learnt from bodies whose longest side is one scene unit.
class SceneView {
 public:
  // sensor: as of film_for_network(). Throws as that, and UsageError: shapes that the network cannot know, or light,
  // where it sees light.
  SceneView(const Scene& scene, int sensor, const NetworkDescription& network, const Body& body,
            const std::string& who);
  // Of an image of the scene; holds as long as the image and this.
  Seen seen(std::span<const float> luminance) const { return {luminance, {}, &shape_, &light_}; }

 private:
  SeenShape shape_;
  std::array<double, 3> light_{};
};

// What a network that sees sigma_t [1/mm] means in 1 / scene unit: it learnt from bodies of another size.
double sigma_t_in_scene(double sigma_t, const NetworkDescription& network, const Body& body);
// The same of 1 / mm as the scene's parameter has it, which the medium's `scale` multiplies.
double sigma_t_unit(const Scene& scene, int medium, const NetworkDescription& network, const Body& body);

}  // namespace itn
