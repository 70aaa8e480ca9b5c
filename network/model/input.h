// Inputs of a network: the same function makes them for training and for predictions. A network's description names
// those that it has (network.h):
//
//   luminance        log((L + 0.01 m) / (1.01 m)) of the radiance L, m = description.luminance: 0 where L is m, -4.6
//                    in the dark. Radiance below 0, which sky models have in places, counts as 0. Where the network
//                    does not know exposures, m is the image's mean over pixels and colours, and of the light that a
//                    flash adds its own: nobody knows either how strong a flash is. Where the network sees the object
//                    alone, L is 0 elsewhere, and the mean is the object's.
//   rgb              the same of red, green and blue
//   flash_luminance, the same of the light that a flash at the camera adds
//   flash_rgb
//   mask             1 where the object is seen, else 0
//   normal           of the surface seen, in the world: object and floor; 0 where there is none. In sets with cameras
//                    all around it is rotated about the vertical, so that the camera looks along +y
//   nearness         how much nearer than the object's mean depth the object is [scene units]; 0 off the object
//   light            cosine between that normal and that of the light (manifest); below 0 where it is turned away
#pragma once
#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "itn/exr.h"
#include "itn/network.h"
#include "itn/photo.h"

namespace itn {

// Radiance that counts as dark, over m: noise below it is not seen.
constexpr double darkest_radiance = 0.01;

// Least m where it is an image's own mean: an object, or what a flash adds to it, may be black.
constexpr double least_mean = 1e-30;

// Radiance as luminance, (size, size), from channel Y, or of R, G, B as the renderer weighs them. hash: what the file's
// attribute `hash` must be; empty: anything. Throws InputError: another size, no such channels, pixels that are not
// finite, another hash. errors: become the pixels' standard errors, channel stderr.Y, or 0 where the file has none.
std::vector<float> read_luminance(const std::string& file, int size, const std::string& hash = "",
                                  std::vector<float>* errors = nullptr);
std::vector<float> luminance_of(const ExrImage& image, const std::string& file, std::vector<float>* errors = nullptr);

// Radiance as planes, one of luminance or three of red, green and blue: (colours, size, size). prefix: of the channels'
// names, "flash." of the flash's. Throws InputError as luminance_of(), and where colours are asked for and there is
// luminance alone.
std::vector<float> radiance_of(const ExrImage& image, const std::string& file, int colours,
                               const std::string& prefix = "", std::vector<float>* errors = nullptr);

// A shape as the camera sees it (network/dataset/README.md).
struct SeenShape {
  std::vector<float> normal;    // (3, size, size); empty where only the mask is known
  std::vector<float> nearness;  // (size, size); likewise
  std::vector<float> mask;      // (size, size): 1 on the object, 0 elsewhere
};

// An object in a picture, by its mask.
struct CutOut {
  SeenShape mask;  // as the network sees it
  int width, height;
  std::vector<float> white;    // of the picture's pixels: 1 on the object, 0 elsewhere
  int left, top, side;         // of the square around it, which may reach beyond the picture
  std::vector<float> covered;  // (size, size), of what the network sees: the share of each pixel that the object has
};

// An image in as many pixels as a network sees.
struct ResampledImage {
  std::vector<float> value;     // (colours, size, size)
  double saturated = 0;         // share of a photo's pixels, of the object's where there is one
  std::vector<float> errors{};  // standard errors, where they are read
};

// As radiance_of(), of any square image, photos too (include/itn/photo.h): averaged over the squares of size x size
// pixels, or between pixels where it has fewer. object: of the square around it, where each pixel has what is seen of
// the object in it, or 0. Throws InputError: not square, or of another width or height than the object's mask; black or
// with much below 0; and what radiance_of() throws.
ResampledImage read_resampled_radiance(const std::string& file, int size, int colours, const PhotoOptions& photo = {},
                                       const std::string& prefix = "", const CutOut* object = nullptr);
// Luminance with its errors, as if those of the image's pixels were independent; 0 where an EXR file does not say, and
// between pixels, where what is read is not independent.
ResampledImage read_resampled_luminance(const std::string& file, int size, const PhotoOptions& photo = {});

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

// From a file of any size, as photos' masks are: more than half of white is the object. Throws InputError: not square,
// not readable, white nowhere.
SeenShape read_mask(const std::string& file, int size);

// The same of a picture that need not be square: of the square around the object in which the longer side of the box
// around it is this share of the side.
CutOut cut_out(const std::string& mask_file, int size, double share);
// The same of a mask (height, width) of 0 and 1; name: for messages.
CutOut cut_out(std::vector<float> white, int width, int height, int size, double share, const std::string& name);

// Cuts planes (count, height, width) of the mask's picture, as read_resampled_radiance() does with an object.
std::vector<float> cut_planes(std::vector<float> planes, const CutOut& object);

// The box around what is white: first and last column, first and last row; the first behind the last where nothing is.
struct WhiteBox {
  int left, right = -1, top, bottom = -1;
  int longer_side() const { return std::max(right - left, bottom - top) + 1; }
};
WhiteBox box_around_white(std::span<const float> mask, int width, int height);

// That longer side over the image's, of a mask (size, size) that is not 0 everywhere.
double share_of_object(std::span<const float> mask);

// Views of the data from which a network's input is made.
struct Seen {
  std::span<const float> image;       // luminance (size, size), or red, green and blue (3, size, size)
  std::span<const float> flash = {};  // likewise
  const SeenShape* shape = nullptr;
  const std::array<double, 3>* light = nullptr;  // towards it, length 1
};

// Inputs beside the image that a network needs.
struct Needs {
  explicit Needs(const NetworkDescription& network)
      : shape(sees(network, "normal") || sees(network, "nearness") || sees(network, "light")),
        mask(sees(network, "mask")),
        flash(sees(network, "flash_rgb") || sees(network, "flash_luminance")) {}

  bool shape, mask, flash;
  bool any() const { return shape || mask || flash; }
};

// Photographs of an object, and what is known of it: square, row-major planes, linear.
struct Photographs {
  int size = 0;                   // [pixels]
  std::vector<float> image;       // of one colour or three
  std::vector<float> flash{};     // the light that a flash adds, likewise; empty: there is none
  SeenShape shape{};              // without a mask: it is not known
  std::array<double, 3> light{};  // towards it, length 1; 0: it is not known

  Seen seen() const { return {image, flash, &shape, &light}; }
};

// For networks that see the object alone: photos and flash are cut out, and what is known of the shape is its mask.
void keep_object(Photographs& photographs, const CutOut& object);

// input: (channels, size, size). Throws UsageError: sizes that do not fit, something missing that the network sees.
void network_input(const NetworkDescription& network, const Seen& seen, std::span<float> input);

// Mirrors the input as if the scene were mirrored, left for right: cameras of data sets look along the yz plane, or are
// rotated there.
void mirror_input(const NetworkDescription& network, std::span<float> input);

}  // namespace itn
