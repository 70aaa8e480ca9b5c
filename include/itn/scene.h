// The host model of a scene: what a Mitsuba 3 XML file says, checked and in world space, before anything knows OpenCL.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "itn/bitmap.h"
#include "itn/colour.h"
#include "itn/measured_brdf.h"
#include "itn/model.h"
#include "itn/texture_model.h"

namespace itn {

using Vec2 = std::array<double, 2>;
using Vec3 = std::array<double, 3>;

// 4x4, row major: world = matrix * local
struct Transform {
  std::array<double, 16> m{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
};

// Position of an element in a scene file, for messages.
struct Location {
  std::string file;
  int line = 0, column = 0;
};

enum class FilterKind { box, tent, gaussian };

struct Shape;

struct Sensor {
  std::string id;
  Location where;
  // irradiance: what arrives at the front of `zone`; distant: the mean radiance that goes against `direction` from the
  // points of `zone`, or from those that a disk as wide as the scene hides, or from `target`.
  enum class Kind { perspective, orthographic, irradiance, distant } kind = Kind::perspective;
  std::shared_ptr<const Shape> zone;
  std::optional<Vec3> target;
  Vec3 direction{0, 0, 1};
  double aperture_radius = 0, focus_distance = 1;  // perspective: 0: everything is sharp
  double fov_x = 0;  // [degree], horizontal (already converted from fov_axis and focal_length); perspective only
  double principal_x = 0, principal_y = 0;  // principal_point_offset_x, _y
  double pixel_aspect = 1;                  // focal length along x over that along y, both in pixels; perspective only
  std::array<double, 8> distortion{};  // k1 to k6, p1, p2 of OpenCV (kernels/model/sensor/opencv.h); perspective only
  double near_clip = 1e-2, far_clip = 1e4;
  bool sample_border = false;  // may positions of a pixel's filter lie beyond the border of the film?
  Transform to_world;  // Mitsuba: camera looks along local +z, +y up, +x left; orthographic covers [-1,1] in x scaled
                       // by to_world
  int width = 768, height = 576;
  int crop_x = 0, crop_y = 0, crop_width = 768, crop_height = 576;
  bool luminance = false;  // hdrfilm pixel_format "luminance"
  FilterKind filter = FilterKind::gaussian;
  double filter_radius = 1;    // tent: radius [pixel]
  double filter_stddev = 0.5;  // gaussian [pixel]
  int spp = 4;
  int medium = -1;  // index into Scene::media, -1: vacuum
};

struct PackedVoxels;

// Voxels of one channel or three: x fastest, then y, then z; channels interleaved.
struct VoxelGrid {
  int width = 0, height = 0, depth = 0, channels = 1;
  Vec3 low{0, 0, 0}, high{1, 1, 1};  // the box that the file says they fill
  std::vector<float> data;
  std::shared_ptr<const PackedVoxels> packed;  // in place of data (packed_voxels.h)
};

// The volume that a grid's values, or a constant, fill: the image of the unit cube.
struct Volume {
  Transform to_world;                     // of the unit cube; invertible
  std::shared_ptr<const VoxelGrid> grid;  // null: the same everywhere
  bool nearest = false;                   // filter_type; else trilinear
  enum class Wrap { clamp, repeat, mirror } wrap = Wrap::clamp;
};

// A value, which is constant or differs over a surface or within a volume.
struct Texture {
  Rgb value{0.5, 0.5, 0.5};             // when constant; a number: three times
  bool by_component = false;            // a colour whose parameters are always .R .G .B (ParameterKind)
  const TextureModel* model = nullptr;  // null: constant
  std::string id;
  std::array<double, 6> to_uv{1, 0, 0, 0, 1, 0};  // row major 2x3: applied to (u, v, 1) before the lookup
  std::vector<Rgb> colours;                       // one of each that the model declares
  // For the model `bitmap`. v = 0 is row 0
  std::shared_ptr<const Bitmap> bitmap;
  bool nearest = false;  // filter_type
  enum class Wrap { repeat, mirror, clamp } wrap = Wrap::repeat;
  // For the model `mesh_attribute`: the attribute of the shapes' meshes, and a factor on it.
  std::string attribute;
  double scale = 1;

  // For medium parameters that may have one; null: the same in all space. The value beside a grid is 1. In a phase
  // function the grid stands for the number, and the value is its mean.
  std::shared_ptr<const Volume> volume;

  // For measured BSDFs.
  std::shared_ptr<const MeasuredBrdf> measured;

  bool is_constant() const { return !model; }
  bool is_grid() const { return volume && volume->grid; }
  // Takes the model's fallbacks.
  void become(const TextureModel& of);
};

// A `bitmap` with Mitsuba's defaults.
Texture make_bitmap(std::shared_ptr<const Bitmap> bitmap);

// A model (model.h) with its values: one a declared parameter, in their order.
struct Instance {
  std::string id;
  Location where;
  const Model* model = nullptr;
  int variant = 0;  // of the model's variants
  std::vector<Texture> values;
  std::vector<std::string> owners;  // ids of what the values belong to; empty: all its own

  const std::string& owner(std::size_t value) const { return owners.empty() ? id : owners[value]; }
  // The values of the parameter of that name and owner: of a structure (structure.h) several, where it has it twice.
  std::vector<std::size_t> values_called(const std::string& owner_id, const std::string& name) const;
  std::string type() const { return model ? model->type : "null"; }
  bool has_grid() const;  // of any parameter
  // Takes the model's fallbacks.
  void become(const Model& of, int its_variant = 0);
  // The value of a parameter. Throws std::logic_error: the model has none of that name.
  Texture& value(const std::string& name);
  const Texture& value(const std::string& name) const;
  // The value of a parameter that is a number.
  double number(const std::string& name) const { return value(name).value[0]; }
  // The value of a parameter that is a uniform colour.
  const Rgb& colour(const std::string& name) const { return value(name).value; }
  void set(const std::string& name, double number) { set(name, Rgb{number, number, number}); }
  void set(const std::string& name, const Rgb& colour) { value(name).value = colour; }
  // All values, slot after slot of the model's parameters.
  std::vector<double> slots() const;
  // A copy with the texture of values[parameter] replaced by one of its colours.
  Instance showing(std::size_t parameter, std::size_t colour) const;
};

struct Bsdf : Instance {  // without a model: null, an index-matched boundary
  bool twosided = false;  // inside a <bsdf type="twosided">
};

// With the fallbacks of its model. type: as in scene files, "null" too; distribution: its variant, "": the first.
Bsdf make_bsdf(const std::string& type, const std::string& distribution = "");

using PhaseFunction = Instance;

// Its id: "homogeneous0" when the file gives none; that of the phase function likewise.
struct Medium : Instance {
  PhaseFunction phase;
  bool sample_emitters = true;  // false: lights without extent do not shine on its scattering vertices

  bool has_grid() const;  // of any parameter, or of its phase function's
  // As of any instance, with the mean cosine of the phase function where the model asks for it.
  std::vector<double> slots() const;

  Medium();  // homogeneous and isotropic, with Mitsuba's defaults
};

// Values of one or three channels on a mesh: one a vertex, between which they are interpolated, or one a triangle.
struct MeshAttribute {
  std::string name;  // as Mitsuba has it: "vertex_color", "face_weight"
  std::size_t channels = 1;
  std::vector<float> values;

  bool is_of_faces() const { return name.rfind("face_", 0) == 0; }
};

// World space. normal and texcoord are empty or one a vertex.
struct Mesh {
  std::vector<std::array<float, 3>> position, normal;
  std::vector<std::array<float, 2>> texcoord;
  std::vector<std::array<std::uint32_t, 3>> triangle;
  std::vector<MeshAttribute> attributes = {};

  const MeshAttribute* attribute(const std::string& name) const;  // null: there is none
};

struct Shape {
  std::string id;
  Location where;
  enum class Kind { mesh, sphere, disk, cylinder } kind = Kind::mesh;
  std::shared_ptr<const Mesh> mesh;  // of all but the others: world space; triangles wind so that normals point out
  Vec3 center{0, 0, 0};              // sphere, disk; cylinder: of the circle at its beginning
  double radius = 1;                 // sphere, cylinder
  // Disk: center + a * edge_u + b * edge_v with a^2 + b^2 <= 1; cylinder: center + a * edge_u + b * edge_v + c * axis
  // with a^2 + b^2 = 1, 0 <= c <= 1. Sphere: directions of its local axes, for its texture coordinates.
  Vec3 edge_u{1, 0, 0}, edge_v{0, 1, 0}, axis{0, 0, 1};
  bool flip_normals = false;         // sphere, disk, cylinder (meshes are already flipped)
  int bsdf = -1;                     // index into Scene::bsdfs; always valid after loading
  int interior = -1, exterior = -1;  // index into Scene::media, -1: vacuum
  int light = -1;                    // index into Scene::lights, -1: it does not shine
  bool sends_beam = false;           // a light without extent shines from it
};

// With a place in the scene: by itself, or the surface of the shapes that name it.
using Light = Instance;

struct Sun {
  Vec3 direction{0, 0, 1};   // local: z is up (Mitsuba 3's convention), unit, towards the sun
  double aperture = 0.5358;  // [degree], full angle
  bool complex = false;      // with limb darkening: Mitsuba's complex_sun
};

// Around the scene: a model of kernels/model/environment, and what of it is no number.
struct Environment : Instance {
  Environment();                         // constant
  Sun sun;                               // sunsky
  std::shared_ptr<const Bitmap> bitmap;  // envmap, latitude-longitude as in Mitsuba
  Transform to_world;                    // envmap, sunsky: rotation
  // Light of the same model in whose proportions directions are drawn; null: this one's. Changes no mean.
  std::shared_ptr<const Environment> sampled_as;
};

// With the fallbacks of its model. type: as in scene files. Throws std::logic_error: there is none.
Environment make_environment(const std::string& type);

struct Integrator {
  int max_depth = -1;  // -1: unlimited; as in Mitsuba, 1 shows emitters only, 2 adds one scattering
  int rr_depth = 5;
  bool hide_emitters = false;
};

struct Scene {
  std::string file;
  Integrator integrator;
  std::vector<Sensor> sensors;
  std::vector<Shape> shapes;
  std::vector<Bsdf> bsdfs;
  std::vector<Medium> media;
  std::vector<Light> lights;
  std::vector<Light> lights_sampled_as;  // in whose proportions lights are drawn; empty: these. Changes no mean.
  std::optional<Environment> environment;
  std::vector<std::string> warnings;
};

}  // namespace itn
