#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/model/sensor/opencv.h"
#include "runtime/scene/box.h"
#include "runtime/scene/transform.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"
#include "runtime/scene/xml/plugins.h"
#include "runtime/scene/xml/values.h"

namespace itn {
namespace {

double radians(double degrees) { return degrees * M_PI / 180; }
double degrees(double radians) { return radians * 180 / M_PI; }

bool is_among(const std::string& type, const std::vector<std::string>& types) {
  return std::find(types.begin(), types.end(), type) != types.end();
}

// Field of view given along `axis` -> along x.
double fov_along_x(double fov, const std::string& axis, double aspect) {
  const double half = std::tan(radians(fov) / 2);
  if (axis == "x" || (axis == "smaller" && aspect <= 1) || (axis == "larger" && aspect > 1)) return fov;
  if (axis == "diagonal") return 2 * degrees(std::atan(half * aspect / std::sqrt(1 + aspect * aspect)));
  return 2 * degrees(std::atan(half * aspect));
}

}  // namespace

std::vector<std::string> sensor_types() {
  return {"perspective", "opencv", "thinlens", "orthographic", "radiancemeter", "irradiancemeter", "distant"};
}
std::vector<std::string> film_types() { return {"hdrfilm"}; }
std::vector<std::string> filter_types() { return {"box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"}; }
std::vector<std::string> sampler_types() {
  return {"independent", "stratified", "multijitter", "orthogonal", "ldsampler"};
}

double parse_fov(Properties& properties, double aspect) {
  const std::string axis = properties.choice("fov_axis", {"x", "y", "diagonal", "smaller", "larger"});
  if (properties.has("fov")) {
    if (properties.has("focal_length")) properties.fail_at("focal_length", "both fov and focal_length given; need one");
    const double fov = properties.number("fov");
    if (!(fov > 0 && fov < 180)) properties.fail_at("fov", "fov = " + to_text(fov) + "; need degrees in (0, 180)");
    return fov_along_x(fov, axis, aspect);
  }
  std::string text = properties.text("focal_length", "50mm");
  if (text.size() > 2 && text.substr(text.size() - 2) == "mm") text.resize(text.size() - 2);
  double focal_length = 0;
  for (const auto& child : properties.element().children)
    if (child->attribute("name") == "focal_length")
      focal_length = parse_number(text, child->where, "sensor \"perspective\": \"focal_length\"");
  if (!properties.has("focal_length")) focal_length = 50;
  if (!(focal_length > 0)) properties.fail_at("focal_length", "focal_length = " + text + "; need millimetres above 0");
  // Film of 36 x 24 mm: the focal length tells the diagonal field of view.
  const double diagonal = std::sqrt(36.0 * 36.0 + 24.0 * 24.0);
  return fov_along_x(2 * degrees(std::atan(diagonal / (2 * focal_length))), "diagonal", aspect);
}

namespace {

int dimension(Properties& properties, const std::string& name, long fallback, long lowest, long highest) {
  const long value = properties.integer(name, fallback);
  if (value < lowest || value > highest)
    properties.fail_at(name, name + " = " + std::to_string(value) + "; need " + std::to_string(lowest) + " to " +
                                 std::to_string(highest));
  return static_cast<int>(value);
}

}  // namespace

void read_filter(Builder& builder, const Element& element, Sensor& sensor) {
  Properties properties = builder.properties(element);
  if (properties.type() == "box") {
    sensor.filter = FilterKind::box;
  } else if (properties.type() == "tent") {
    sensor.filter = FilterKind::tent;
    sensor.filter_radius = properties.number("radius", 1);
    if (!(sensor.filter_radius > 0 && sensor.filter_radius <= 16))
      properties.fail_at("radius", "radius = " + to_text(sensor.filter_radius) + "; need pixels in (0, 16]");
  } else if (properties.type() == "gaussian") {
    sensor.filter = FilterKind::gaussian;
    sensor.filter_stddev = properties.number("stddev", 0.5);
    if (!(sensor.filter_stddev > 0 && sensor.filter_stddev <= 4))
      properties.fail_at("stddev", "stddev = " + to_text(sensor.filter_stddev) + "; need pixels in (0, 4]");
  } else if (properties.type() == "mitchell" || properties.type() == "catmullrom" || properties.type() == "lanczos") {
    // These have negative lobes, and positions cannot be drawn from a negative density.
    if (properties.type() == "mitchell")
      for (const char* name : {"B", "C"}) properties.number(name, 1.0 / 3);
    if (properties.type() == "lanczos") properties.integer("lobes", 3);
    builder.warn(element.where, properties.title() + " is rendered as gaussian (stddev 0.5), which does not sharpen");
  } else {
    fail_type(element, filter_types());
  }
  properties.finish();
}

namespace {

// The crop keeps its fraction of the film.
void resize(Sensor& sensor, const FilmSize& size) {
  const auto scaled = [](int value, int to, int from) {
    return static_cast<int>(std::lround(static_cast<double>(value) * to / from));
  };
  const int right = scaled(sensor.crop_x + sensor.crop_width, size.width, sensor.width);
  const int bottom = scaled(sensor.crop_y + sensor.crop_height, size.height, sensor.height);
  sensor.crop_x = std::min(scaled(sensor.crop_x, size.width, sensor.width), size.width - 1);
  sensor.crop_y = std::min(scaled(sensor.crop_y, size.height, sensor.height), size.height - 1);
  sensor.crop_width = std::max(right - sensor.crop_x, 1);
  sensor.crop_height = std::max(bottom - sensor.crop_y, 1);
  sensor.width = size.width;
  sensor.height = size.height;
}

void parse_pixel_format(Builder& builder, Properties& properties, Sensor& sensor) {
  const std::string format =
      properties.choice("pixel_format", {"rgb", "luminance", "rgba", "luminance_alpha", "xyz", "xyza"});
  sensor.luminance = format.rfind("luminance", 0) == 0;
  if (format != "rgb" && format != "luminance")
    builder.warn(properties.element().where, properties.title() + ": " + quote(format) + " is written as " +
                                                 (sensor.luminance ? "luminance" : "linear sRGB without alpha"));
}

}  // namespace

void read_film(Builder& builder, const Element& element, Sensor& sensor) {
  if (element.attribute("type") != "hdrfilm") fail_type(element, film_types());
  Properties properties = builder.properties(element);
  sensor.width = dimension(properties, "width", 768, 1, largest_film);
  sensor.height = dimension(properties, "height", 576, 1, largest_film);
  sensor.crop_x = dimension(properties, "crop_offset_x", 0, 0, sensor.width - 1);
  sensor.crop_y = dimension(properties, "crop_offset_y", 0, 0, sensor.height - 1);
  sensor.crop_width =
      dimension(properties, "crop_width", sensor.width - sensor.crop_x, 1, sensor.width - sensor.crop_x);
  sensor.crop_height =
      dimension(properties, "crop_height", sensor.height - sensor.crop_y, 1, sensor.height - sensor.crop_y);
  parse_pixel_format(builder, properties, sensor);
  // The output is always float32 OpenEXR.
  properties.choice("component_format", {"float16", "float32", "uint32"});
  properties.choice("file_format", {"openexr", "exr", "rgbe", "pfm"});
  sensor.sample_border = properties.boolean("sample_border", false);
  properties.boolean("compensate", false);
  properties.boolean("banner", false);  // of Mitsuba 0.6
  if (const Element* filter = properties.object("rfilter")) build_filter(builder, *filter, sensor);
  properties.finish();
}

void read_sampler(Builder& builder, const Element& element, Sensor& sensor) {
  Properties properties = builder.properties(element);
  if (!is_among(properties.type(), sampler_types())) fail_type(element, sampler_types());
  sensor.spp = dimension(properties, "sample_count", 4, 0, 1'000'000'000);
  if (sensor.spp == 0) {
    builder.warn(element.where, properties.title() + ": sample_count = 0 is taken as 1; spp gives another one");
    sensor.spp = 1;
  }
  properties.integer("seed", 0);  // the renderer's seed chooses the random numbers
  if (properties.type() == "multijitter" || properties.type() == "stratified" || properties.type() == "orthogonal")
    properties.boolean("jitter", true);
  if (properties.type() == "orthogonal") properties.integer("strength", 2);
  properties.finish();
}

namespace {

constexpr double usual_far_clip = 1e4;  // Mitsuba's

void parse_perspective(Properties& properties, Sensor& sensor) {
  sensor.fov_x = parse_fov(properties, static_cast<double>(sensor.width) / sensor.height);
  if (properties.type() == "perspective") {  // Mitsuba's thinlens has none
    sensor.principal_x = properties.number("principal_point_offset_x", 0);
    sensor.principal_y = properties.number("principal_point_offset_y", 0);
  }
  if (!is_rigid(sensor.to_world))
    properties.fail_at("to_world", "to_world scales or shears; a perspective sensor can only be moved and turned");
}

// Newton's method must find each place of the film again, and the distortion must not fold on the way there from the
// axis.
void check_distortion(const Properties& properties, const Sensor& sensor) {
  constexpr int cells = 64;
  const double tan_x = std::tan(radians(sensor.fov_x) / 2);
  const double tan_y = tan_x * sensor.height / sensor.width * sensor.pixel_aspect;
  for (int i = 0; i <= cells; ++i)
    for (int j = 0; j <= cells; ++j) {
      const double film_x = 1.0 * i / cells, film_y = 1.0 * j / cells;
      const double x = (2 * (film_x + sensor.principal_x) - 1) * tan_x,
                   y = (2 * (film_y + sensor.principal_y) - 1) * tan_y;
      double u = 0, v = 0, again_x = 0, again_y = 0;
      opencv_undistort(sensor.distortion.data(), x, y, &u, &v);
      opencv_distort(sensor.distortion.data(), u, v, &again_x, &again_y);
      bool is_right = std::hypot(again_x - x, again_y - y) < 1e-6 * (1 + std::hypot(x, y));
      double last = -1;  // distance from the axis on the film, which grows with that in space
      for (int k = 0; k <= cells && is_right && std::hypot(u, v) > 1e-9; ++k) {
        const double share = 1.0 * k / cells;
        opencv_distort(sensor.distortion.data(), share * u, share * v, &again_x, &again_y);
        is_right = std::hypot(again_x, again_y) > last;
        last = std::hypot(again_x, again_y);
      }
      if (!is_right)
        properties.fail_at("k1", "the distortion by k1 to k6, p1 and p2 folds before pixel (" +
                                     to_text(film_x * sensor.width) + ", " + to_text(film_y * sensor.height) +
                                     "); need one under which places on the film move outwards all over the film");
    }
}

// OpenCV's camera. fx, fy, cx, cy are of the film that the scene asks for [pixel], and the middle of the first pixel is
// (0, 0).
void parse_opencv(Properties& properties, const FilmSize& film, Sensor& sensor) {
  const double fx = properties.number("fx"), fy = properties.number("fy", fx);
  for (const auto& [name, value] : {std::pair("fx", fx), std::pair("fy", fy)})
    if (!(value > 0)) properties.fail_at(name, std::string(name) + " = " + to_text(value) + "; need pixels above 0");
  const double cx = properties.number("cx", (film.width - 1) / 2.0),
               cy = properties.number("cy", (film.height - 1) / 2.0);
  // --size may stretch the film: what is seen stays.
  const double stretch = 1.0 * sensor.width / film.width * film.height / sensor.height;
  sensor.fov_x = 2 * degrees(std::atan(film.width / (2 * fx)));
  sensor.pixel_aspect = fx / fy * stretch;
  sensor.principal_x = 0.5 - (cx + 0.5) / film.width;
  sensor.principal_y = 0.5 - (cy + 0.5) / film.height;
  const std::array<const char*, 8> names{"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"};
  for (std::size_t i = 0; i < names.size(); ++i) sensor.distortion[i] = properties.number(names[i], 0);
  if (!is_rigid(sensor.to_world))
    properties.fail_at("to_world", "to_world scales or shears; an opencv sensor can only be moved and turned");
  check_distortion(properties, sensor);
}

void parse_clips(Properties& properties, Sensor& sensor) {
  sensor.near_clip = properties.number("near_clip", 1e-2);
  // Mitsuba's own far plane would cut scenes off that are larger than its unit, so that only one that is asked for
  // counts.
  const double far_plane = properties.number("far_clip", usual_far_clip);
  sensor.far_clip = properties.has("far_clip") ? far_plane : std::numeric_limits<double>::infinity();
  sensor.focus_distance = properties.number("focus_distance", far_plane);
  if (!(sensor.near_clip > 0))
    properties.fail_at("near_clip", "near_clip = " + to_text(sensor.near_clip) + "; need more than 0");
  if (!(sensor.far_clip > sensor.near_clip))
    properties.fail_at("far_clip", "far_clip = " + to_text(sensor.far_clip) +
                                       "; need more than near_clip = " + to_text(sensor.near_clip));
}

void parse_lens(Properties& properties, Sensor& sensor) {
  sensor.aperture_radius = properties.number("aperture_radius");
  if (!(sensor.aperture_radius > 0))
    properties.fail_at("aperture_radius", "aperture_radius = " + to_text(sensor.aperture_radius) +
                                              "; need more than 0: without a lens use perspective");
  if (!(sensor.focus_distance > 0))
    properties.fail_at("focus_distance", "focus_distance = " + to_text(sensor.focus_distance) + "; need more than 0");
}

void require_one_pixel(const Properties& properties, const Sensor& sensor) {
  if (sensor.width != 1 || sensor.height != 1)
    fail(sensor.where, properties.title() + ": a film of " + std::to_string(sensor.width) + " x " +
                           std::to_string(sensor.height) + " pixels; need 1 x 1");
}

// Along one direction: what reaches the target, a point or the points of a shape, or anything of the scene.
void parse_distant(Builder& builder, Properties& properties, Sensor& sensor) {
  if (properties.has("direction") && properties.has("to_world"))
    properties.fail_at("direction", "both direction and to_world given; need one or the other");
  const Vec3 d = properties.has("direction") ? properties.vector("direction", {0, 0, 1})
                                             : transform_vector(sensor.to_world, {0, 0, 1});
  if (!(length(d) > 0)) properties.fail_at("direction", "it is (0, 0, 0); need a direction");
  sensor.direction = normalize(d);
  require_one_pixel(properties, sensor);
  if (const Element* shape = properties.object("shape", "target")) {
    const std::size_t bsdfs = builder.scene.bsdfs.size();
    Shape zone = make_shape(builder, *shape);
    if (shape->children.empty() || zone.bsdf == static_cast<int>(bsdfs)) builder.scene.bsdfs.resize(bsdfs);
    zone.bsdf = zone.light = -1;
    sensor.zone = std::make_shared<const Shape>(std::move(zone));
  } else if (properties.has("target")) {
    sensor.target = properties.vector("target", {0, 0, 0});
  }
}

// One ray: an orthographic camera whose film has no extent.
void parse_radiancemeter(Properties& properties, Sensor& sensor) {
  const Vec3 origin = properties.vector("origin", {0, 0, 0}), direction = properties.vector("direction", {0, 0, 1});
  if (properties.has("origin") != properties.has("direction"))
    properties.fail_at("", "only one of origin and direction given; need both, or to_world");
  if (properties.has("origin") && !properties.has("to_world")) {
    if (!(length(direction) > 0)) properties.fail_at("direction", "direction is (0, 0, 0); need a direction");
    const Vec3 d = normalize(direction);
    sensor.to_world.m = {0, 0, d[0], origin[0], 0, 0, d[1], origin[1], 0, 0, d[2], origin[2], 0, 0, 0, 1};
  }
  require_one_pixel(properties, sensor);
  for (std::size_t row = 0; row < 3; ++row) sensor.to_world.m[4 * row] = sensor.to_world.m[4 * row + 1] = 0;
  sensor.near_clip = 0;
}

}  // namespace

void read_sensor(Builder& builder, const Element& element, const Shape* on) {
  Properties properties = builder.properties(element);
  if (!is_among(properties.type(), sensor_types())) fail_type(element, sensor_types());
  Sensor sensor;
  sensor.id = element.id;
  sensor.where = element.where;
  const std::string& type = properties.type();
  if ((type == "irradiancemeter") != (on != nullptr))
    fail(element.where, on ? properties.title() + " in a <shape>; need irradiancemeter there"
                           : properties.title() + " belongs into the <shape> on which it lies");

  if (const Element* film = properties.object("film")) build_film(builder, *film, sensor);
  const FilmSize own_film{sensor.width, sensor.height};
  if (builder.film_size) resize(sensor, *builder.film_size);
  if (const Element* sampler = properties.object("sampler")) build_sampler(builder, *sampler, sensor);
  if (const Element* medium = properties.object("medium")) sensor.medium = build_medium(builder, *medium);
  properties.number("shutter_open", 0);  // nothing moves
  properties.number("shutter_close", 0);
  if (on) {
    sensor.kind = Sensor::Kind::irradiance;
    if (sensor.width != 1 || sensor.height != 1)  // in Mitsuba, of the part to which its sampler maps the pixel
      builder.warn(element.where, properties.title() + ": every pixel measures the irradiance of the whole shape");
    sensor.zone = std::make_shared<const Shape>(*on);
    if (sensor.medium < 0) sensor.medium = on->exterior;
  } else {
    sensor.to_world = properties.transform("to_world");
  }
  if (type == "perspective" || type == "opencv" || type == "thinlens" || type == "orthographic")
    parse_clips(properties, sensor);
  if (type == "perspective" || type == "thinlens") parse_perspective(properties, sensor);
  if (type == "opencv") parse_opencv(properties, own_film, sensor);
  if (type == "thinlens") parse_lens(properties, sensor);
  if (type == "orthographic" || type == "radiancemeter") sensor.kind = Sensor::Kind::orthographic;
  if (type == "radiancemeter") parse_radiancemeter(properties, sensor);
  if (type == "distant") {
    sensor.kind = Sensor::Kind::distant;
    parse_distant(builder, properties, sensor);
  }
  properties.finish();
  builder.scene.sensors.push_back(sensor);
}

void warn_of_far_scenes(Builder& builder) {
  Box box;
  for (const Shape& shape : builder.scene.shapes) box.add(box_of(shape));
  if (box.longest_side() < 0) return;
  for (const Sensor& sensor : builder.scene.sensors) {
    const bool is_camera =
        (sensor.kind == Sensor::Kind::perspective || sensor.kind == Sensor::Kind::orthographic) && sensor.near_clip > 0;
    if (!is_camera || std::isfinite(sensor.far_clip)) continue;
    const Vec3 along = normalize(transform_vector(sensor.to_world, {0, 0, 1}));
    double furthest = 0;
    for (std::size_t corner = 0; corner < 8; ++corner) {
      Vec3 place{};
      for (std::size_t k = 0; k < 3; ++k)
        place[k] =
            static_cast<double>((corner >> k & 1) != 0 ? box.high[k] : box.low[k]) - sensor.to_world.m[4 * k + 3];
      furthest = std::max(furthest, dot(place, along));
    }
    if (furthest > usual_far_clip)
      builder.warn(sensor.where, "the scene reaches " + to_text(furthest) + " from sensor " + quote(sensor.id) +
                                     ", and Mitsuba shows only what is nearer than its far_clip of " +
                                     to_text(usual_far_clip) + ": here all is seen; give far_clip to say how far");
  }
}

Sensor sensor_of_all(const Builder& builder) {
  Sensor sensor;
  sensor.id = "sensor";
  sensor.where = builder.document.root->where;
  sensor.fov_x = 45;
  if (builder.film_size) resize(sensor, *builder.film_size);
  Box box;
  for (const Shape& shape : builder.scene.shapes) box.add(box_of(shape));
  const auto longest = static_cast<double>(box.longest_side());
  if (!(longest > 0)) return sensor;
  const double distance = longest / (2 * std::tan(radians(sensor.fov_x) / 2));
  const auto middle = [&](std::size_t k) {
    return (static_cast<double>(box.low[k]) + static_cast<double>(box.high[k])) / 2;
  };
  sensor.to_world = translate({middle(0), middle(1), static_cast<double>(box.low[2]) - distance});
  sensor.near_clip = distance / 100;
  sensor.far_clip = 5 * longest + distance;
  return sensor;
}

}  // namespace itn
