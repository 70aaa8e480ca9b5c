// What the network sees: the same function makes it for training and for predictions.
//
//   channel 0     luminance: log((L + 0.01 m) / (1.01 m)) of the radiance L, m = description.luminance: 0 where L is m,
//                 -4.6 in the dark. Radiance below 0, which sky models have in places, counts as 0.
//   and with six channels, of known shape and light:
//   channel 1..3  the normal of the surface seen, in the world: object and floor; 0 where there is none
//   channel 4     how much nearer than the object's mean depth the object is [scene units]; 0 off the object
//   channel 5     light: cosine between that normal and that of the light (manifest); below 0 where it is turned
//                 away
#pragma once
#include <array>
#include <span>
#include <string>
#include <vector>

#include "network/network.h"
#include "runtime/image/exr.h"
#include "runtime/image/photo.h"

namespace itn {

// What counts as dark, over m: noise below it is not seen.
constexpr double darkest_radiance = 0.01;

// Radiance as luminance, (size, size), from channel Y, or of R, G, B as the renderer weighs them. hash: what the file's
// attribute `hash` must be; empty: anything. Throws InputError: another size, no such channels, pixels that are not
// finite, another hash. errors: become the pixels' standard errors, channel stderr.Y, or 0 where the file has none.
std::vector<float> read_luminance(const std::string& file, int size, const std::string& hash = "",
                                  std::vector<float>* errors = nullptr);
std::vector<float> luminance_of(const ExrImage& image, const std::string& file, std::vector<float>* errors = nullptr);

// As read_luminance(), of any square image, photos too (runtime/image/photo.h): averaged over the squares of size x
// size pixels, or between pixels where it has fewer. Throws InputError: not square, black or with much below 0, and
// what read_luminance() throws beside the size.
std::vector<float> read_resampled_luminance(const std::string& file, int size, const PhotoOptions& photo = {});

// A shape as the camera sees it (runtime/dataset/README.md).
struct SeenShape {
  std::vector<float> normal;    // (3, size, size)
  std::vector<float> nearness;  // (size, size): channel 4
  std::vector<float> mask;      // (size, size): 1 on the object, 0 elsewhere
};

// nearness from depth [scene units, along the ray]: over unit, where the object's longest side is not 1. normal:
// (3, size, size). Throws InputError: a mask of other numbers than 0 and 1 or of zeros alone, normals of another length
// than 1 on the object, numbers there that are not finite; `name` is for the message.
SeenShape seen_shape(std::vector<float> normal, const std::vector<float>& depth, std::vector<float> mask, int size,
                     const std::string& name, double unit = 1);

// From a file. Throws InputError: another size, channels missing, a mask of other numbers than 0 and 1 or of zeros
// alone, normals of another length than 1 on the object, numbers there that are not finite, another hash.
SeenShape read_seen_shape(const std::string& file, int size, const std::string& hash = "");
SeenShape seen_shape_of(const ExrImage& image, const std::string& file);

// The same of any square buffers; a pixel has what is seen at its middle. Throws InputError, too, where no pixel has
// the object.
SeenShape read_resampled_seen_shape(const std::string& file, int size, const std::string& hash = "");

struct KnownScene {
  const SeenShape& shape;
  std::array<double, 3> light;  // towards the sun, length 1
};

// luminance: (size, size); known: null for networks of one channel; input: (channels, size, size). Throws UsageError:
// sizes that do not fit, nothing known where six channels need it.
void network_input(const NetworkDescription& network, std::span<const float> luminance, const KnownScene* known,
                   std::span<float> input);

// What the network would see of the scene's mirror image, left for right: cameras of data sets look along the yz plane.
void mirror_input(const NetworkDescription& network, std::span<float> input);

}  // namespace itn
