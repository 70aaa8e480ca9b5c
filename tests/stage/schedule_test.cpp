// The schedule, the number of paths per launch and the jobs that share it do not change a bit.
#include <catch2/catch.hpp>
#include <map>

#include "itn/renderer.h"
#include "runtime/render/wavefront/wavefront.h"
#include "scenes.h"
#include "stage_test.h"

using namespace itn;
using namespace itn::test;

TEST_CASE("fused and staged schedules give the same bits for launches of any size") {
  Scene scene = sphere_scene(bsdf_of("roughdielectric", 1.4, 0.3), medium_of(2, 0.9, 0.5));
  scene.sensors[0].to_world.m = {1, 0, 0, 0, 0, 0, 1, -4, 0, 1, 0, 0, 0, 0, 0, 1};
  scene.environment = wide_sun(40, {0.6, 0, 0.8}, 1);
  for (const int width : widths()) {
    RenderOptions options;
    options.spp = 64;
    options.width = width;
    options.schedule = Schedule::fused;
    const Rendering fused = render(device(), scene, options);
    for (const int paths : {1000, 7777, 2000000000}) {
      options.schedule = Schedule::staged;
      options.paths_a_launch = paths;
      const Rendering staged = render(device(), scene, options);
      CAPTURE(width, paths);
      CHECK((staged.mean == fused.mean && staged.stderr_ == fused.stderr_));
    }
  }
}

TEST_CASE("timing the stages counts every path and changes no bit") {
  Scene scene = sphere_scene(bsdf_of("roughdielectric", 1.4, 0.3), medium_of(2, 0.9, 0.5));
  scene.sensors[0].to_world.m = {1, 0, 0, 0, 0, 0, 1, -4, 0, 1, 0, 0, 0, 0, 0, 1};
  RenderOptions options;
  options.spp = 64;
  options.schedule = Schedule::staged;
  const Rendering plain = render(device(), scene, options);
  options.time_stages = true;
  const Rendering timed = render(device(), scene, options);
  CHECK(plain.stages.empty());
  CHECK(timed.mean == plain.mean);
  double seconds = 0;
  std::map<std::string, std::uint64_t> paths;
  for (const StageTime& stage : timed.stages) {
    seconds += stage.seconds;
    paths[stage.stage] = stage.paths;
  }
  CHECK((seconds > 0 && seconds < timed.render_s));
  CHECK(paths["generate"] == timed.paths);
  CHECK((paths["escape"] > 0 && paths["escape"] <= timed.paths));  // absorbed ones do not
  CHECK((paths["medium"] > 0 && paths["rough_dielectric ggx"] > 0));
}

TEST_CASE("jobs that share a launch have the bits of each job alone") {
  // three scenes of the same features: materials, light, camera and seed differ
  std::vector<Scene> scenes;
  for (const double sigma_t : {2.0, 8.0, 0.5}) {
    Scene scene =
        sphere_scene(bsdf_of("roughdielectric", 1.3 + 0.02 * sigma_t, 0.3), medium_of(sigma_t, 0.9, 0.1 * sigma_t));
    add_floor(scene, bsdf_of("diffuse"), 3, -1.25f);
    scene.sensors[0].to_world.m = {1, 0, 0, 0, 0, 0, 1, -4 - 0.1 * sigma_t, 0, 1, 0, 0, 0, 0, 0, 1};
    scene.environment = wide_sun(40, {0.6, 0, 0.8}, 0.2 * sigma_t);
    scenes.push_back(scene);
  }
  // scenes in turn, one of them twice, runs of pixels and samples that begin anywhere
  const std::vector<JobSlice> slices{{0, 3, 200, 5, 7}, {1, 0, 256, 0, 9}, {0, 210, 40, 0, 16}, {2, 17, 100, 1, 33}};
  for (const Schedule schedule : {Schedule::fused, Schedule::staged})
    for (const int width : widths()) {
      CAPTURE(schedule == Schedule::fused, width);
      const auto data_of = [](const std::vector<Scene>& of, std::vector<JobRecord>& jobs) {
        LaunchData data;
        data.geometry.box_width = 4;
        for (const Scene& scene : of) jobs.push_back(append_scene(scene, 0, data));
        return data;
      };
      const auto trace = [&](Wavefront& wavefront, const std::vector<JobSlice>& together) {
        wavefront.trace(together);
        int paths = 0;
        for (const JobSlice& s : together) paths += s.pixels * s.samples;
        std::vector<float> samples(static_cast<std::size_t>(paths * wavefront.channels()));
        device().download(wavefront.samples(), samples);
        return samples;
      };
      std::vector<JobRecord> jobs;
      const LaunchData data = data_of(scenes, jobs);
      for (std::size_t j = 0; j < jobs.size(); ++j) jobs[j].seed_low = static_cast<unsigned>(10 + j);
      Wavefront shared(device(), data, jobs, {}, Operator::full, width, schedule);
      std::vector<float> alone;
      for (const JobSlice& slice : slices) {
        const std::size_t k = static_cast<std::size_t>(slice.job);
        std::vector<JobRecord> job;
        const LaunchData own = data_of({scenes[k]}, job);
        job[0].seed_low = jobs[k].seed_low;
        Wavefront wavefront(device(), own, job, {}, Operator::full, width, schedule);
        JobSlice same = slice;
        same.job = 0;
        const std::vector<float> part = trace(wavefront, {same});
        alone.insert(alone.end(), part.begin(), part.end());
      }
      CHECK(std::any_of(alone.begin(), alone.end(), [](float x) { return x > 0; }));
      CHECK(trace(shared, slices) == alone);
    }
}
