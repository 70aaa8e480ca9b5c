// Rays per second beside Embree's, run by hand: test_geometry "[.bench]".
#include <catch2/catch.hpp>
#include <thread>

#include "tests/geometry/geometry_device.h"
#ifdef ITN_EMBREE
#include <embree3/rtcore.h>
#endif

using namespace itn;
using namespace itn::test;

namespace {

#ifdef ITN_EMBREE
class Embree {
 public:
  explicit Embree(const Mesh& mesh) : device_(rtcNewDevice("threads=2")), scene_(rtcNewScene(device_)) {
    const RTCGeometry g = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    std::copy(mesh.position.begin(), mesh.position.end(),
              static_cast<std::array<float, 3>*>(
                  rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.position.size())));
    std::copy(mesh.triangle.begin(), mesh.triangle.end(),
              static_cast<std::array<std::uint32_t, 3>*>(
                  rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangle.size())));
    rtcSetGeometryBuildQuality(g, RTC_BUILD_QUALITY_HIGH);
    rtcCommitGeometry(g);
    rtcAttachGeometry(scene_, g);
    rtcReleaseGeometry(g);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
    rtcCommitScene(scene_);
  }
  ~Embree() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;

  std::vector<int> trace(const std::vector<TestRay>& rays, Seconds* time) const {
    std::vector<int> primitive(rays.size());
    const auto part = [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRayHit r{};
        r.ray.org_x = rays[i].origin[0];
        r.ray.org_y = rays[i].origin[1];
        r.ray.org_z = rays[i].origin[2];
        r.ray.dir_x = rays[i].direction[0];
        r.ray.dir_y = rays[i].direction[1];
        r.ray.dir_z = rays[i].direction[2];
        r.ray.tfar = rays[i].t_max;
        r.ray.mask = ~0u;
        r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene_, &context, &r);
        primitive[i] = r.hit.geomID == RTC_INVALID_GEOMETRY_ID ? -1 : static_cast<int>(r.hit.primID);
      }
    };
    const Stopwatch watch;
    std::thread other(part, 0, rays.size() / 2);
    part(rays.size() / 2, rays.size());
    other.join();
    *time = watch.time();
    return primitive;
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
};
#endif

}  // namespace

TEST_CASE("speed of rays", "[.bench]") {
  const Mesh mesh = torus_knot(512, 64);
  const GeometryOnDevice g(scene_of({shape_of(mesh)}), 16, 16);
#ifdef ITN_EMBREE
  const Embree embree(mesh);
#endif
  for (const double sigma_t : {5.0, 25.0, 100.0}) {
    const auto rays = g.paths({1, 0, 0}, 1 / sigma_t, 0.95, 1'000'000, 11);
    const auto speed = [&](Seconds time) { return static_cast<double>(rays.size()) / time.core * 1e-6; };
    for (int i = 0; i < 3; ++i) {
      Seconds ours, theirs;
      const auto hits = g.trace(rays, &ours);
      std::size_t same = 0;
#ifdef ITN_EMBREE
      const auto found = embree.trace(rays, &theirs);
      for (std::size_t j = 0; j < rays.size(); ++j) same += hits[j].primitive == found[j];
#endif
      WARN("sigma_t " << sigma_t << ": " << speed(ours) << " million rays/s a core; Embree " << speed(theirs)
                      << ", the same primitive for " << same);
    }
  }
}

TEST_CASE("speed of the build", "[.bench]") {
  for (const auto& [segments, sides] : {std::pair{512, 64}, {2048, 256}}) {
    const Scene scene = scene_of({shape_of(torus_knot(segments, sides))});
    const Stopwatch watch;
    Geometry geometry;
    append_geometry(scene, geometry);
    WARN(2 * segments * sides << " triangles, hierarchy and grid: " << watch);
  }
}
