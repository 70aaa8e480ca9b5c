// Turning elements into the host model, one function a kind of element. Elements may be referenced from several places:
// each becomes one entry of the scene's tables.
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "itn/load_scene.h"
#include "itn/scene.h"
#include "runtime/scene/mesh/placed_mesh.h"
#include "runtime/scene/scene_middle.h"
#include "runtime/scene/volume/volume_file.h"
#include "runtime/scene/xml/document.h"
#include "runtime/scene/xml/properties.h"

namespace itn {

class Builder {
 public:
  Builder(const Document& file, Report& findings) : document(file), report(findings) {}

  const Document& document;
  Report& report;
  Scene scene;
  std::optional<FilmSize> film_size;                                    // instead of the scene's
  bool open = false;                                                    // LoadOptions
  std::map<const Element*, int> bsdf_of, medium_of, light_of;           // indices of what is built already
  std::set<int> nested;                                                 // BSDFs that are inside of structures
  std::vector<Location> put_out;                                        // emitters that do not shine
  bool samples_emitters = true;                                         // the integrator does
  std::map<int, const Element*> twosided_of;                            // those inside of a twosided alone
  std::map<const Element*, std::vector<Shape>> shapes_of_group;         // of each <shape type="shapegroup">
  std::size_t copied_triangles = 0;                                     // of instances
  MeshOrigins mesh_origins;                                             // of the scene's meshes
  std::map<std::string, std::shared_ptr<const Bitmap>> bitmap_of_file;  // key: path, and "raw" or "srgb"
  std::map<std::pair<std::string, int>, std::shared_ptr<const VoxelGrid>> grid_of_file;  // and the bits asked for
  std::map<std::string, std::shared_ptr<const MeasuredBrdf>> measured_of_file;

  Properties properties(const Element& element) { return Properties(document, element, report); }
  void warn(const Location& where, const std::string& what) { report.warn(where, what); }
  std::shared_ptr<const Mesh> keep(PlacedMesh&& mesh);
};

// Every build_ reports what is wrong with its element and with what the element contains, and returns a stand-in then,
// so that the rest of the scene is looked at, too.
int build_bsdf(Builder& builder, const Element& element);    // index into scene.bsdfs
int build_medium(Builder& builder, const Element& element);  // index into scene.media
void build_emitter(Builder& builder, const Element& element);
int build_shape_light(Builder& builder, const Element& element);  // <emitter> of a shape: index into scene.lights
void build_shape(Builder& builder, const Element& element);
Shape make_shape(Builder& builder, const Element& element);  // no group, no instance; not yet in the scene
const std::vector<Shape>& shapes_of_group(Builder& builder, const Element& element);
void build_instance(Builder& builder, const Element& element);
// A sphere or a cylinder that to_world makes something else of, as a mesh; which it tells.
PlacedMesh bent_round_mesh(Builder& builder, const Shape& shape, const Transform& to_world, const std::string& title);
// Refuses a shape whose to_world leads beyond single precision.
void check_single_precision(const Builder& builder, const Properties& properties, const Shape& shape);
void build_sensor(Builder& builder, const Element& element, const Shape* on = nullptr);  // on: the shape that has it
void build_integrator(Builder& builder, const Element& element);
Texture build_texture(Builder& builder, const Element& element);  // <texture>
void check_texture(Builder& builder, const Element& element);     // any <texture> or <volume>, also a spectrum
// <volume type="gridvolume">
Volume build_volume(Builder& builder, const Element& element, VoxelValues allowed);
PhaseFunction build_phase(Builder& builder, const Element& element);
void build_film(Builder& builder, const Element& element, Sensor& sensor);
void build_filter(Builder& builder, const Element& element, Sensor& sensor);
void build_sampler(Builder& builder, const Element& element, Sensor& sensor);

// Functions that the above call: each turns one element into one entry, or throws InputError.
int read_bsdf(Builder& builder, const Element& element);
int read_medium(Builder& builder, const Element& element);
void read_emitter(Builder& builder, const Element& element);
int read_shape_light(Builder& builder, const Element& element);
void read_shape(Builder& builder, const Element& element);
void read_sensor(Builder& builder, const Element& element, const Shape* on);
void read_integrator(Builder& builder, const Element& element);
Texture read_texture(Builder& builder, const Element& element);
Volume read_volume(Builder& builder, const Element& element, VoxelValues allowed);
// The mesh of a shape that is nothing else: inside of a volume. It has texture coordinates.
PlacedMesh read_surface(Builder& builder, const Element& element);
PhaseFunction read_phase(Builder& builder, const Element& element);
void read_film(Builder& builder, const Element& element, Sensor& sensor);
void read_filter(Builder& builder, const Element& element, Sensor& sensor);
void read_sampler(Builder& builder, const Element& element, Sensor& sensor);

// Reads the parameters that the model of the instance declares, each as its kind says.
void read_parameters(Builder& builder, Properties& properties, Instance& instance);
// The parameter `name` of a medium: a number, a colour or a grid of voxels.
Texture read_medium_parameter(Builder& builder, Properties& properties, const DeclaredParameter& parameter);
// The parameter `name` of a phase function: a number or a grid of them.
Texture read_number_volume(Builder& builder, Properties& properties, const DeclaredParameter& parameter);
// Refuses a value outside of the parameter's range.
void check_in_range(Properties& properties, const DeclaredParameter& parameter, double value);
// "weights" of a dictionary: one for each of so many elements of a tag.
void read_weights(Properties& properties, const std::string& tag, std::size_t entries, Instance& nest);
// The types of the models, for messages.
std::vector<std::string> types_of(const std::vector<Model>& models);
// The parameter `name`: a colour in [0, 1], or a texture of values up to `most`.
Texture build_texture(Builder& builder, Properties& owner, const std::string& name, double fallback, double most = 1);

// The sensor that earlier versions of Mitsuba 3 gave a scene without one: from below its least z, along z, it sees all
// of the scene.
Sensor sensor_of_all(const Builder& builder);

// Cameras without far_clip of scenes that go beyond Mitsuba's.
void warn_of_far_scenes(Builder& builder);

// Horizontal field of view [degree] from fov, fov_axis and focal_length, as of Mitsuba's cameras; aspect: width over
// height.
double parse_fov(Properties& properties, double aspect);

// The image that the parameter `name` names; files are read once. `raw`: 8-bit values are linear, not sRGB.
std::shared_ptr<const Bitmap> load_bitmap(Builder& builder, Properties& owner, const std::string& name, bool raw);

// Ends with the message that a type is not known.
[[noreturn]] void fail_type(const Element& element, const std::vector<std::string>& allowed);

}  // namespace itn
