// What an error of the material is worth in an image: the image loss to second order, around the image's own material.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "runtime/image/rendering.h"

namespace itn {

// The matrix C whose u^T C u is the mean squared difference, over the object's pixels, of the image and that of a
// material which is u = (log sigma_t, albedo, g) off: C_ij is the mean over them of d_i d_j, the image's derivatives
// by u. [radiance^2]; the upper triangle, by rows. It is the image's Fisher information where noise is even.
using ImageCurvature = std::array<double, 6>;

// Unbiased, and so with small negative values along directions that the image does not show: products are of different
// halves. a, b: renderings of luminance from different samples, as many of each, with derivatives by sigma_t, albedo
// and g. sigma_t: in the unit of that derivative. mask: above 0 where the object is seen, somewhere.
ImageCurvature image_curvature(const Rendering& a, const Rendering& b, double sigma_t, const std::vector<double>& mask);

// As an image's file has it, its attribute `curvature`: a JSON list.
extern const char* const curvature_attribute;
std::string to_text(const ImageCurvature& curvature);
// Throws InputError that names the file.
ImageCurvature read_curvature(const std::string& text, const std::string& file);

}  // namespace itn
