// Kinds of parameters that models declare (kernels/shared/declaration.h): how they are read, and their valid range.
#pragma once
#include <limits>

namespace itn {

// Distance that the voxels of a grid keep from a bound that is not included.
constexpr double least_distance_from_bound = 1e-6;
constexpr double least_ior = 1e-3, greatest_ior = 1e3;  // indices of refraction that scenes may have

// The quantity that a spectrum describes. Reflectances and indices of refraction are seen under daylight (D65), so that
// 1 at all wavelengths is white; light is seen as it is, so that the same amount at all wavelengths is pinkish.
enum class Quantity { reflectance, unbounded, emission };

struct ParameterKind {
  enum class Reader {
    number,
    number_volume,
    flag,
    colour,
    texture,
    index,
    metal,
    roughness,
    roughness_texture,
    number_texture,
    index_or_specular,
    position,
    origin,
    axis_x,
    axis_y,
    axis_z,
    light_texture,
    aspect,
    field_of_view,
    direction,
    beam,
    share,
    normals,
    bumps,
    any_number,
    measured_table,
    measured_roughness,
    measured_gloss,
    volume,
    of_phase,
    of_shape
  };
  int channels = 1;  // 3: a colour
  double low = 0, high = 0;
  bool low_included = true, high_included = true;
  Reader reader = Reader::number;
  bool listed = true;        // is it a parameter of the scene's image, or fixed?
  const char* meaning = "";  // for messages
  Quantity quantity = Quantity::reflectance;
  bool by_component = false;  // given as <rgb>, it has the parameters .R .G .B even where the three are equal
  const char* field = "";     // of volumes: the number that their grid is a factor of
};

// Named in the declarations of kernels/model.
namespace parameter_kind {
constexpr double unbounded = std::numeric_limits<double>::infinity();
using Reader = ParameterKind::Reader;
constexpr ParameterKind REFLECTANCE{3, 0, 1, true, true, Reader::texture};
constexpr ParameterKind TEXTURE_COLOUR{3, 0, unbounded, true, false};  // its parameter has a range of its own
constexpr ParameterKind TINT{3, 0, 1, true, true, Reader::colour, false};
constexpr ParameterKind EXTINCTION{
    3, 0, unbounded, true, false, Reader::colour, true, "per scene unit", Quantity::unbounded, true};
constexpr ParameterKind ALBEDO_VOLUME{
    3, 0, 1, true, true, Reader::volume, true, "sigma_s / sigma_t", Quantity::reflectance, true, "albedo"};
constexpr ParameterKind EXTINCTION_VOLUME{
    3, 0, unbounded, true, false, Reader::volume, true, "per scene unit", Quantity::unbounded, true, "sigma_t"};
constexpr ParameterKind DENSITY_VOLUME{3,    0,          unbounded,           true, false,    Reader::volume,
                                       true, "a factor", Quantity::unbounded, true, "sigma_t"};
constexpr ParameterKind MEAN_COSINE{1, -1, 1, false, false, Reader::of_phase, false};  // of a medium's phase function
constexpr ParameterKind OF_SHAPE{3, -unbounded, unbounded, false, false, Reader::of_shape, false};  // of a light's
constexpr ParameterKind OF_SHAPE_NUMBER{1, 0, 1, true, true, Reader::of_shape, false};
constexpr ParameterKind EMISSION{3, 0, unbounded, true, false, Reader::colour, true, "", Quantity::emission};
constexpr ParameterKind POSITION{3, -unbounded, unbounded, false, false, Reader::position, false};
constexpr ParameterKind ORIGIN{3, -unbounded, unbounded, false, false, Reader::origin, false};
constexpr ParameterKind AXIS_X{3, -1, 1, true, true, Reader::axis_x, false};
constexpr ParameterKind AXIS_Y{3, -1, 1, true, true, Reader::axis_y, false};
constexpr ParameterKind AXIS_Z{3, -1, 1, true, true, Reader::axis_z, false};
constexpr ParameterKind LIGHT_TINT{3, 0, unbounded, true, false, Reader::light_texture, false};
constexpr ParameterKind FIELD_OF_VIEW{1, 0, 180, false, false, Reader::field_of_view, false, "an angle in degrees"};
constexpr ParameterKind PICTURE_ASPECT{1, 0, unbounded, false, false, Reader::aspect, false};
constexpr ParameterKind DIRECTION{3, -1, 1, true, true, Reader::direction, false};
constexpr ParameterKind HALF_ANGLE{1, 0, 180, false, true, Reader::number, false, "an angle in degrees"};
constexpr ParameterKind BEAM{1, 0, 180, true, true, Reader::beam, false, "an angle in degrees"};
constexpr ParameterKind METAL_INDEX{3, 0, 1e3, true, true, Reader::metal, true, "a part of an index of refraction"};
constexpr ParameterKind COSINE{1, -1, 1, false, false, Reader::number_volume, true, "a mean cosine"};
constexpr ParameterKind CONCENTRATION{1, 0, unbounded, false, false, Reader::number_volume, true, "a concentration"};
constexpr ParameterKind NON_NEGATIVE{1, 0, unbounded, true, false};
constexpr ParameterKind ROUGHNESS{1, 0, 1, false, true, Reader::roughness};
constexpr ParameterKind ROUGHNESS_TEXTURE{1, 0, 1, false, true, Reader::roughness_texture};
constexpr ParameterKind WEIGHT{1, 0, 1, true, true, Reader::number_texture};
constexpr ParameterKind DOUBLE_WEIGHT{1, 0, 2, true, true, Reader::number_texture};
constexpr ParameterKind SLOPE_ANGLE{1, 0, 1.5, true, true, Reader::number_texture, true, "an angle in radian"};
constexpr ParameterKind EXPONENT{1, 0, 1e5, true, true, Reader::number_texture};
constexpr ParameterKind INDEX_TEXTURE{1, least_ior, greatest_ior, true, true, Reader::number_texture};
constexpr ParameterKind INDEX_OR_SPECULAR{1, least_ior, greatest_ior, true, true, Reader::index_or_specular};
constexpr ParameterKind SAMPLING_RATE{1, 0, unbounded, true, false, Reader::number, false};
constexpr ParameterKind INDEX{1, least_ior, greatest_ior, true, true, Reader::index};
constexpr ParameterKind MIXING_WEIGHT{1, 0, 1, true, true, Reader::number_volume, true, "a share"};
constexpr ParameterKind SHARE{1, 0, 1, true, true, Reader::share, true, "a share"};
constexpr ParameterKind NORMAL_TEXTURE{3, 0, 1, true, true, Reader::normals, false};
constexpr ParameterKind BUMP_TEXTURE{3, -unbounded, unbounded, false, false, Reader::bumps, false};
constexpr ParameterKind BUMP_SCALE{1,     -unbounded,         unbounded, false,
                                   false, Reader::any_number, true,      "a factor of heights"};
constexpr ParameterKind COEFFICIENT{3,    -unbounded, unbounded,         false, false, Reader::colour,
                                    true, "",         Quantity::emission};
constexpr ParameterKind ANGLE{3, -unbounded, unbounded, false, false, Reader::colour, false, "", Quantity::unbounded};
constexpr ParameterKind TURBIDITY{1, 1, 10};
constexpr ParameterKind GROUND_ALBEDO{3, 0, 1, true, true, Reader::colour};
// Kinds of numbers that a measured file gives, by the parameter `filename`.
constexpr ParameterKind MEASURED_TABLE{1, 0, unbounded, true, false, Reader::measured_table, false};
constexpr ParameterKind MEASURED_ROUGHNESS{1, 0, 1, false, true, Reader::measured_roughness, false};
constexpr ParameterKind MEASURED_GLOSS{1, 0, 1, true, true, Reader::measured_gloss, false};
constexpr ParameterKind FLAG{1, 0, 1, true, true, Reader::flag, false};
}  // namespace parameter_kind

}  // namespace itn
