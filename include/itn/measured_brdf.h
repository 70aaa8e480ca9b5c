// Measured reflectance of isotropic surfaces, in the binary format of the MERL database.
#pragma once
#include <string>
#include <vector>

namespace itn {

struct MeasuredBrdf {
  std::vector<float> values;  // [bin][channel], bins as of kernels/model/bsdf/merl.h [1/sr]
  // A sampler's guess at the table: the roughness of its gloss, and the share of the light that this reflects.
  double alpha = 1, gloss = 0.5;
};

// Three 32-bit integers (90, 90, 180), then of red, green and blue a double a bin, in units of 1/1500, 1.15/1500 and
// 1.66/1500 per steradian; all little-endian. Bins that nobody has measured are negative there, and 0 here. Throws
// InputError: unreadable, of another size, cut, with values that are no numbers (says where), or without any light.
MeasuredBrdf read_merl_file(const std::string& file);

// The table's value for directions above the surface, interpolated between the centres of bins as on the device: in
// double precision, one for each channel. Angles [radian]: from the half vector to the normal, from it to wi, and wi's
// azimuth about it.
std::vector<double> measured_value(const MeasuredBrdf& brdf, double half, double difference, double azimuth);

}  // namespace itn
