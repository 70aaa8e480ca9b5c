// The lights of a data set's images: sun and sky, a picture of the surroundings (an environment map), or lamps in a
// room.
#pragma once
#include <map>
#include <memory>
#include <string>

#include "itn/scene.h"
#include "network/dataset/manifest.h"

namespace itn {

// Towards the sun, unit; z is up, the camera looks along +y and down. azimuth [degree]: from behind the object (0,
// back-lighting) to its side (90); zenith [degree].
Vec3 sun_direction(double azimuth, double zenith);

// As in the authors' scenes: the sun is widened, at the same power.
Environment sun_and_sky(const Vec3& towards_sun);

// A picture of all directions, latitude by longitude as in Mitsuba: OpenEXR, PNG or JPEG. Values below 0, which
// pictures have from compression and from colours that sRGB lacks, become 0. Throws InputError that names the file and
// the pixel: not readable, below 3 x 3 pixels, not finite, more than a thousandth of its light negative.
std::shared_ptr<const Bitmap> read_environment(const std::string& file);

// Its upper edge is the zenith; its middle stands where a sun of that azimuth stands, and what is right of the middle
// has a greater azimuth.
Environment environment_light(std::shared_ptr<const Bitmap> picture, double azimuth, double scale);

// One to four soft lamps of white to warm light in a dim room, a picture of all directions. A function of the seed; of
// all rooms alike a horizontal surface gets the same irradiance, that of sun and sky, about.
std::shared_ptr<const Bitmap> lamp_room(std::uint64_t seed);

// A warm lamp of ten degrees in radius, and no other light. towards: to the lamp, unit, not upright; irradiance: of a
// surface that faces it, in luminance.
Environment lamp_alone(const Vec3& towards, double irradiance);

// The direction by which networks know an environment: the mean of the directions above the floor, weighted by
// luminance and solid angle, unit. The light that falls on a surface changes with its normal along it, to first order
// (Ramamoorthi and Hanrahan 2001), whereas the brightest pixel may be a small lamp that says little. Without light
// there: the zenith.
Vec3 mean_direction(const Environment& environment);

// The lights of a set. Pictures are read when first asked for, and kept.
class DatasetLights {
 public:
  // set must outlive it.
  DatasetLights(const Manifest& set, std::string folder) : set_(set), folder_(std::move(folder)) {}

  // index: of the manifest's lights. Throws InputError: its picture.
  Environment of(int index);

 private:
  const Manifest& set_;
  std::string folder_;
  std::map<std::string, std::shared_ptr<const Bitmap>> pictures_;  // by file
};

}  // namespace itn
