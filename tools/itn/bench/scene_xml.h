// Mitsuba XML that the bench's scenes share.
#pragma once
#include <string>

namespace itn {

// A scene of 128 x 128 pixels and 64 samples, with `body` for light and objects. fov: in degrees; lookat: the
// attributes origin and target.
std::string bench_scene_xml(const char* integrator, int max_depth, int rr_depth, double fov, const char* lookat,
                            const std::string& body);

// Sun and sky, the sun 30 degrees from the zenith. Widening it (aperture, in degrees) keeps its power.
std::string bench_sunsky_xml(double aperture);

std::string bench_constant_xml();

std::string bench_rough_xml(const char* distribution, double alpha, double ior);

}  // namespace itn
