// The host model of a scene: what a Mitsuba 3 XML file says, checked and in world space, before anything knows OpenCL.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace itn {

using Vec2 = std::array<double, 2>;
using Vec3 = std::array<double, 3>;
using Rgb = std::array<double, 3>;  // linear sRGB

// 4x4, row major: world = matrix * local
struct Transform {
  std::array<double, 16> m{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
};

// Where an element stands in a scene file: for messages.
struct Location {
  std::string file;
  int line = 0, column = 0;
};

enum class FilterKind { box, tent, gaussian };

struct Sensor {
  std::string id;
  Location where;
  bool orthographic = false;
  double fov_x = 0;  // [degree], horizontal (already converted from fov_axis and focal_length); perspective only
  double principal_x = 0, principal_y = 0;  // principal_point_offset_x, _y
  double near_clip = 1e-2, far_clip = 1e4;
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

// Row 0 on top; channels 1 or 3, linear.
struct Bitmap {
  int width = 0, height = 0, channels = 3;
  std::vector<float> data;
};

struct Texture {
  std::shared_ptr<const Bitmap> bitmap;  // null: constant
  Rgb value{0.5, 0.5, 0.5};              // when constant
  bool nearest = false;                  // filter_type
  enum class Wrap { repeat, mirror, clamp } wrap = Wrap::repeat;
  std::array<double, 6> to_uv{1, 0, 0,
                              0, 1, 0};  // row major 2x3: applied to (u, v, 1) before the lookup; v = 0 is row 0
};

enum class BsdfKind { null, diffuse, dielectric, roughdielectric };
enum class Distribution { beckmann, ggx };

constexpr double least_ior = 1e-3, greatest_ior = 1e3;  // indices of refraction that scenes may have
constexpr double least_alpha = 1e-4;                    // smaller ones are rendered as this one, as in Mitsuba
constexpr double greatest_g = 0.999999;    // of |g|: sharper peaks are rendered as this one, whose width is 1e-6 radian
constexpr double greatest_sigma_t = 1e30;  // times scale [1 / scene unit]: denser media are rendered as this one

struct Bsdf {
  std::string id;
  Location where;
  BsdfKind kind = BsdfKind::null;
  bool twosided = false;  // diffuse inside a <bsdf type="twosided">
  Texture reflectance;
  double int_ior = 1.5046, ext_ior = 1.000277;
  Distribution distribution = Distribution::beckmann;
  double alpha = 0.1;
  Rgb specular_reflectance{1, 1, 1}, specular_transmittance{1, 1, 1};
};

struct Medium {
  std::string id;        // "homogeneous0" when the file gives none
  std::string phase_id;  // "hg0" when the file gives none
  Location where;
  Rgb sigma_t{1, 1, 1};  // without scale [1/scene unit]
  Rgb albedo{0.75, 0.75, 0.75};
  bool sigma_t_is_rgb = false, albedo_is_rgb = false;  // given as <rgb>: parameters are then addressed by component
  double scale = 1;
  bool isotropic = true;
  double g = 0;
};

// World space. normal and texcoord are empty or one a vertex.
struct Mesh {
  std::vector<std::array<float, 3>> position, normal;
  std::vector<std::array<float, 2>> texcoord;
  std::vector<std::array<std::uint32_t, 3>> triangle;
};

struct Shape {
  std::string id;
  Location where;
  enum class Kind { mesh, sphere, disk } kind = Kind::mesh;
  std::shared_ptr<const Mesh>
      mesh;              // obj, ply, mesh, rectangle, cube: world space; triangles wind so that normals point out
  Vec3 center{0, 0, 0};  // sphere, disk
  double radius = 1;     // sphere
  Vec3 edge_u{1, 0, 0}, edge_v{0, 1, 0};  // disk: center + a * edge_u + b * edge_v with a^2 + b^2 <= 1
  bool flip_normals = false;              // sphere, disk (meshes are already turned)
  int bsdf = -1;                          // index into Scene::bsdfs; always valid after loading
  int interior = -1, exterior = -1;       // index into Scene::media, -1: vacuum
};

struct SunSky {
  double turbidity = 3;
  Rgb albedo{0.3, 0.3, 0.3};
  Vec3 sun_direction{0, 0, 1};  // local: z is up (Mitsuba 3's convention), unit, towards the sun
  double sun_scale = 1, sky_scale = 1;
  double sun_aperture = 0.5358;  // [degree], full angle
  bool complex_sun = false;
};

struct Emitter {
  std::string id;
  Location where;
  enum class Kind { constant, envmap, sunsky } kind = Kind::constant;
  Rgb radiance{1, 1, 1};                 // constant
  std::shared_ptr<const Bitmap> bitmap;  // envmap, latitude-longitude as in Mitsuba
  double scale = 1;                      // envmap
  SunSky sunsky;
  Transform to_world;  // envmap, sunsky: rotation
  // Light of the same kind in whose proportions directions are drawn; null: this one's. Changes no mean.
  std::shared_ptr<const Emitter> sampled_as;
};

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
  std::optional<Emitter> environment;
  std::vector<std::string> warnings;
};

}  // namespace itn
