// A scene as Python holds it.
#pragma once
#include <nanobind/nanobind.h>

#include <memory>
#include <string>
#include <vector>

#include "itn/parameters.h"
#include "itn/scene.h"

namespace itn::python {

// The scene behind it never changes: giving a parameter another value makes a new one, which shares all that is large.
// So what renders in another thread is not disturbed.
class SceneObject {
 public:
  explicit SceneObject(Scene scene);
  SceneObject(const SceneObject& other);  // the same scene, and no renderers
  ~SceneObject();

  const std::shared_ptr<const Scene>& scene() const { return scene_; }
  void set_scene(Scene scene);
  const std::vector<Parameter>& parameters() const { return parameters_; }
  // Throws UsageError: there is none of that name.
  const Parameter& parameter(const std::string& name) const;

  struct Renderers;  // renderers.h
  Renderers& renderers() const { return *renderers_; }

 private:
  std::shared_ptr<const Scene> scene_;
  std::vector<Parameter> parameters_;
  std::unique_ptr<Renderers> renderers_;
};

// A scene with other values of its parameters, to be rendered by the renderers of the one that it was made of.
struct Variant {
  std::shared_ptr<const Scene> scene;
};

// The scene that a call renders: the variant, or the scene as it is.
inline const std::shared_ptr<const Scene>& rendered(const SceneObject& object, const Variant* variant) {
  return variant ? variant->scene : object.scene();
}

void bind_scene(nanobind::module_& module);

}  // namespace itn::python
