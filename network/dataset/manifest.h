// A data set's manifest, DIR/manifest.json: which images it has, of what, and with which parameters (README.md here).
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace itn {

struct Manifest {
  struct Boundary {
    bool rough = false;             // else index-matched
    double alpha = 0, int_ior = 1;  // rough only: > 0, >= 1
  };

  // The source of a shape's mesh.
  struct NamedMesh {
    std::string name;  // one of named_shapes()
  };
  struct RandomMesh {
    std::uint64_t seed = 0;
    int triangles = 1;  // about so many
  };
  struct FileMesh {
    std::string file;  // in the data set's folder
  };

  enum class Role { train, test };
  struct Shape {
    std::string name;  // no two alike
    Role role = Role::train;
    std::string
        buffers;  // file in the data set's folder: the shape as the camera sees it; empty: images' files have it
    std::variant<NamedMesh, RandomMesh, FileMesh> mesh;
  };

  // A picture of the surroundings that lights the scene.
  struct Environment {
    std::string file;  // in the data set's folder
    double scale = 1;  // > 0: radiance in the scene over that in the file
  };
  // Sun and sky, an environment, or lamps in a room.
  struct Light {
    double azimuth = 0;                           // of the sun or of the picture's middle [degrees]
    double zenith = 0;                            // of the sun [degrees], in [0, 90]; not looked at of environments
    std::array<double, 3> direction = {0, 0, 1};  // towards the sun, or to where most light comes from; length 1
    std::optional<Environment> environment = {};
    std::optional<std::uint64_t> lamps = {};  // seed of lamp_room(), dataset_light.h
  };

  // Position of a camera around the object [degrees]; without one it is at 45 and 0.
  struct Camera {
    double elevation = 45;  // above the floor, (0, 90)
    double azimuth = 0;     // around the vertical, from above counter-clockwise, [-180, 180]
  };

  // The purpose of an image. Shapes of `train`, `validation` and `unseen_light` have the role train, those of
  // `unseen_shape` and `unseen_both` the role test: no shape is learnt and then called unseen.
  enum class Split { train, validation, unseen_light, unseen_shape, unseen_both };

  // Values for red, green and blue.
  struct Colours {
    std::array<double, 3> sigma_t{1, 1, 1};  // [1/mm], > 0
    std::array<double, 3> albedo{0, 0, 0};   // [0, 1]
  };
  struct Image {
    std::string file;  // in the data set's folder; no two alike
    Split split = Split::train;
    int shape = 0, light = 0;               // indices
    double sigma_t = 1;                     // [1/mm], > 0; of colours their mean
    double albedo = 0;                      // [0, 1]; of colours their mean
    double g = 0;                           // (-1, 1)
    std::uint64_t seed = 0;                 // of its rendering; neighbours who share it are of the same paths
    std::optional<Colours> colours = {};    // of a set in colours
    std::optional<Camera> camera = {};      // of a set with cameras all around
    std::optional<Boundary> boundary = {};  // instead of the set's
  };

  std::string version;        // of the program that made it
  std::string hash;           // 16 hexadecimal digits or more: of all that determines the images' bits
  bool complete = false;      // all files are there; else this is the plan
  std::string config = "{}";  // JSON: what the set was asked for, with every default filled in
  int size = 1;               // side of the square images [pixels]
  int spp = 1;                // samples a pixel
  double mm_per_unit = 1;     // sigma_t [1/mm] times it is per scene unit
  Boundary boundary;
  // Properties of people's pictures, where they are not of luminance from one place:
  bool in_colours = false;      // images have red, green and blue, and every image has `colours`
  bool cameras = false;         // every image has a camera, and its file the shape's buffers
  double flash = 0;             // irradiance of a lamp at the camera, whose light each file has, too; 0: none
  bool linear_sigma_t = false;  // equal differences are equally likely, else equal ratios
  std::vector<Shape> shapes;
  std::vector<Light> lights;
  std::vector<Image> images;
};

// The images, one after another, that differ in albedo alone and are of the same paths as one of the set's; most sets'
// are by themselves.
std::span<const Manifest::Image> of_same_paths(const Manifest& set, const Manifest::Image& image);

// Are the images of luminance, from one camera, of bodies in one boundary? What renders a set's images again needs
// that.
bool is_laboratory(const Manifest& set);

// As in the file: "train", "unseen_light", ...
std::string split_name(Manifest::Split split);

// DIR/manifest.json.
std::string manifest_file(const std::string& folder);

// Written whole or not at all. Throws InputError where read_manifest() would refuse it, ResultError where it cannot be
// written.
void write_manifest(const std::string& folder, const Manifest& manifest);

// Complete or not. Keys that are not known are left out. Throws InputError that names the file, the place in it, what
// is there and what is needed: no such file, no JSON, another schema, keys missing or of another type, numbers outside
// of their ranges, indices beyond the end, splits that contradict roles, files outside of the folder, two of one name.
Manifest read_manifest(const std::string& folder);
// The same of a file's text.
Manifest parse_manifest(std::string_view text, const std::string& file);

// The same for those who need all files. Throws InputError also where it is not complete.
Manifest read_complete_manifest(const std::string& folder);

}  // namespace itn
