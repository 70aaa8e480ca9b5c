// A scene that is looked at shows the same images as render(), whatever was moved, shown and interrupted before.
#include "runtime/view/session.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <thread>

#include "itn/error.h"
#include "runtime/image/accumulation.h"
#include "tests/inversion/small_scene.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double sigma_t = 2, albedo = 0.8;

ViewOptions options(int spp = 64) {
  ViewOptions result;
  result.spp = spp;
  return result;
}

// Until there is nothing left to do.
std::shared_ptr<const ViewFrame> settle(ViewSession& session) {
  for (int idle = 0; idle < 600;) {
    if (session.advance()) continue;
    ++idle;  // a program may be compiled in another thread
    session.wait_for_work(std::chrono::milliseconds(50));
    const auto frame = session.frame();
    const bool step_comes =
        session.options().target && !session.fitted().empty() && !(frame->step && frame->step->settled);
    const bool waits = step_comes || frame->derivative_note.find("compiled") != std::string::npos;
    if (!waits) break;
  }
  return session.frame();
}

void check_same(const std::vector<float>& a, const std::vector<float>& b, double relative) {
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    REQUIRE(static_cast<double>(a[i]) == Approx(static_cast<double>(b[i])).epsilon(relative).margin(1e-6));
}

Rendering rendered(const Scene& scene, int spp, const std::vector<std::string>& derivatives = {}) {
  RenderOptions how;
  how.spp = spp;
  how.derivatives = derivatives;
  return render(device(), scene, how);
}

}  // namespace

TEST_CASE("renderings of different samples become the rendering of all") {
  const Scene scene = fog_ball(sigma_t, albedo, 0.3);
  RenderOptions how;
  how.derivatives = {"fog.sigma_t"};
  Renderer renderer(device(), scene, how);
  Accumulation parts;
  int first = 0;
  for (const int samples : {1, 1, 2, 4, 24}) {
    parts.add(renderer.render(first, samples));
    first += samples;
  }
  const Rendering& sum = parts.rendering();
  const Rendering whole = rendered(scene, 32, how.derivatives);
  CHECK(sum.spp == 32);
  CHECK(sum.paths == whole.paths);
  check_same(sum.mean, whole.mean, 1e-5);
  check_same(sum.stderr_, whole.stderr_, 1e-3);
  check_same(sum.derivatives[0].mean, whole.derivatives[0].mean, 1e-4);
  CHECK(sum.mean_of_image[0] == Approx(whole.mean_of_image[0]));
  CHECK(sum.stderr_of_mean[0] == Approx(whole.stderr_of_mean[0]).epsilon(1e-3));
}

TEST_CASE("an image of 2^30 samples still moves by parts of eight") {
  Rendering part;
  part.width = part.height = part.channels = 1;
  part.mean = {0.5F};
  part.stderr_ = {0};
  part.mean_of_image = {0.5};
  part.stderr_of_mean = {0};
  part.spp = 1 << 30;
  Accumulation all;
  all.add(part);
  part.mean = {1.5F};
  part.mean_of_image = {1.5};
  part.spp = 8;
  constexpr int parts = 1 << 16;
  for (int i = 0; i < parts; ++i) all.add(part);
  const double n = 0x1p30, m = 8.0 * parts, mean = 0.5 + m / (n + m);
  CHECK(all.rendering().mean[0] == static_cast<float>(mean));
  CHECK(all.rendering().mean_of_image[0] == Approx(mean).epsilon(1e-9));
  CHECK(all.rendering().stderr_[0] == Approx(std::sqrt(n * m / (n + m)) / (n + m)).epsilon(1e-5));
}

TEST_CASE("the image refines from one sample to as many as are asked for, and is that of render()") {
  ViewSession session(fog_ball(sigma_t, albedo, 0.3), options(50));
  CHECK(session.frame()->number == 0);
  REQUIRE(session.advance());
  CHECK(session.frame()->image.spp == 1);
  CHECK_FALSE(session.frame()->done);
  const auto frame = settle(session);
  CHECK(frame->done);
  CHECK(frame->image.spp == 50);
  check_same(frame->image.mean, rendered(fog_ball(sigma_t, albedo, 0.3), 50).mean, 1e-5);
}

TEST_CASE("a parameter that is set begins the image anew; the first picture has one sample") {
  ViewSession session(fog_ball(sigma_t, albedo, 0.3), options());
  settle(session);
  const std::uint64_t revision = session.set({{"fog.sigma_t", 5}, {"phase.g", 0.1}});
  CHECK(revision == 2);
  CHECK(session.set({{"fog.sigma_t", 5}}) == 2);  // is so already
  REQUIRE(session.advance());
  CHECK(session.frame()->revision == 2);
  CHECK(session.frame()->image.spp == 1);
  const auto frame = settle(session);
  check_same(frame->image.mean, rendered(fog_ball(5, albedo, 0.1), frame->image.spp).mean, 1e-5);
  CHECK(list_parameters(session.scene_of(*frame))[0].value == 5);
}

TEST_CASE("what is no value of a parameter is refused, and then none is set") {
  ViewSession session(fog_ball(sigma_t, albedo, 0.3), options());
  CHECK_THROWS_AS(session.set({{"fog.albedo", 0.5}, {"fog.sigma_t", -1}}), UsageError);
  CHECK_THROWS_AS(session.set({{"fog.sigma_t", std::nan("")}}), UsageError);
  CHECK_THROWS_AS(session.set({{"fog.colour", 1}}), UsageError);
  CHECK_THROWS_AS(session.differentiate("fog.colour"), UsageError);
  CHECK_THROWS_AS(session.fit({"fog.sigma_t"}), UsageError);  // no target
  CHECK(session.values() == ViewSession(fog_ball(sigma_t, albedo, 0.3), options()).values());
}

TEST_CASE("values that cannot be rendered are told, and others are rendered again") {
  Scene scene = fog_ball(sigma_t, albedo, 0.3);
  scene.environment = make_environment("envmap");
  scene.environment->bitmap = std::make_shared<const Bitmap>(Bitmap{4, 4, 3, std::vector<float>(48, 1e15F)});
  scene.environment->id = "sky";
  ViewSession session(scene, options(8));
  settle(session);
  CHECK_THROWS_AS(session.set({{"sky.scale", 1e39}}), UsageError);  // beyond single precision
  session.set({{"sky.scale", 1e29}});                               // as is this, times the picture
  auto frame = settle(session);
  CHECK_THAT(frame->problem, Catch::Contains("scale"));
  CHECK(frame->image.spp == 8);
  session.set({{"sky.scale", 2e-15}});
  frame = settle(session);
  CHECK(frame->problem.empty());
  check_same(frame->image.mean, rendered(session.scene_of(*frame), 8).mean, 1e-5);
}

TEST_CASE("the derivative by a parameter comes with the image, and goes again") {
  ViewSession session(fog_ball(sigma_t, albedo, 0.3), options(32));
  settle(session);
  session.differentiate("fog.sigma_t");
  auto frame = settle(session);
  REQUIRE(frame->image.derivatives.size() == 1);
  CHECK(frame->derivative == "fog.sigma_t");
  const Rendering whole = rendered(fog_ball(sigma_t, albedo, 0.3), 32, {"fog.sigma_t"});
  check_same(frame->image.derivatives[0].mean, whole.derivatives[0].mean, 1e-4);
  session.differentiate("");
  frame = settle(session);
  CHECK(frame->derivative.empty());
  CHECK(frame->image.derivatives.empty());
}

TEST_CASE("components of a colour that become equal stay parameters, with derivatives") {
  Scene scene = fog_ball(sigma_t, albedo, 0.3);
  scene.sensors[0].luminance = false;
  scene.media[0].set("albedo", Rgb{0.9, 0.8, 0.7});
  ViewSession session(scene, options(8));
  session.set({{"fog.albedo.R", 1}, {"fog.albedo.G", 1}, {"fog.albedo.B", 1}});
  session.differentiate("fog.albedo.G");
  const auto frame = settle(session);
  INFO(frame->derivative_note);
  CHECK(frame->derivative == "fog.albedo.G");
}

TEST_CASE("interruptions at any moment change no picture") {
  ViewSession session(fog_ball(sigma_t, albedo, 0.3), options(256));
  std::atomic<bool> end{false};
  std::thread painter([&] {
    while (!end) session.advance();
  });
  for (int i = 1; i <= 60; ++i) {
    session.set({{"fog.sigma_t", 2 + 0.1 * i}});
    if (i % 7 == 0) session.differentiate(i % 2 == 0 ? "fog.sigma_t" : "");
    std::this_thread::sleep_for(std::chrono::milliseconds(i % 9));
  }
  session.differentiate("");
  const std::uint64_t last = session.set({{"fog.sigma_t", 3}});
  auto frame = session.frame();
  for (int i = 0; i < 400 && !(frame->revision == last && frame->done && frame->derivative.empty()); ++i)
    frame = session.wait(frame->number, std::chrono::milliseconds(50));
  end = true;
  session.stop();
  painter.join();
  REQUIRE(frame->done);
  check_same(frame->image.mean, rendered(fog_ball(3, albedo, 0.3), 256).mean, 1e-5);
}

TEST_CASE("a slider that never rests shows pictures all the same") {
  ViewSession session(fog_ball(sigma_t, albedo, 0.3), options(4096));
  std::atomic<bool> end{false};
  std::thread painter([&] {
    while (!end) session.advance();
  });
  session.wait(0, std::chrono::seconds(60));  // its program is compiled
  const std::uint64_t before = session.frame()->number;
  for (int i = 0; i < 200; ++i) {
    session.set({{"fog.sigma_t", 2 + 0.01 * i}});
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  CHECK(session.frame()->number > before + 3);
  end = true;
  session.stop();
  painter.join();
}

TEST_CASE("with a target there are the loss, its gradient and the step of Gauss-Newton, which leads to the truth") {
  ViewOptions how = options(256);
  how.target = rendered_target(device(), fog_ball(3, 0.7, 0.3), 1024, 99);
  ViewSession session(fog_ball(2, 0.8, 0.3), how);
  CHECK(session.fitted() == std::vector<std::string>{"fog.sigma_t", "fog.albedo", "phase.g"});
  session.fit({"fog.sigma_t", "fog.albedo"});
  session.differentiate("fog.sigma_t");
  auto frame = settle(session);
  REQUIRE(frame->loss);
  const double begin = frame->loss->loss;
  CHECK(begin > 3 * frame->loss->loss_stderr);
  REQUIRE(frame->loss->gradient.size() == 1);
  CHECK(frame->loss->gradient[0] < 0);  // more sigma_t is better
  for (int i = 0; i < 4; ++i) {
    REQUIRE(frame->step);
    CHECK(frame->step->from[0] == Approx(session.values()[0]));
    REQUIRE(session.take_step());
    frame = settle(session);
  }
  CHECK(session.values()[0] == Approx(3).epsilon(0.1));
  CHECK(session.values()[1] == Approx(0.7).epsilon(0.05));
  CHECK(std::abs(frame->loss->loss) < 0.05 * begin);
  CHECK((frame->step && frame->step->misfit.empty()));
}

TEST_CASE("where no step is left and the photo is that of another scene, that is said") {
  ViewOptions how = options(256);
  how.target = rendered_target(device(), fog_ball(3, 0.8, 0.3), 256, 99);
  std::rotate(how.target->value.begin(), how.target->value.begin() + 1, how.target->value.end());  // by a pixel
  ViewSession session(fog_ball(2.5, 0.8, 0.3), how);
  session.fit({"fog.sigma_t"});
  auto frame = settle(session);
  for (int i = 0; i < 10 && frame->step && frame->step->distance >= 0.4; ++i) {
    CHECK(frame->step->misfit.empty());
    REQUIRE(session.take_step());
    frame = settle(session);
  }
  REQUIRE(frame->step);
  CHECK_THAT(frame->step->misfit, Catch::Contains("not the noise") && Catch::Contains("check"));
}

TEST_CASE("a step of values that are no longer those seen is not taken") {
  ViewOptions how = options(64);
  how.target = rendered_target(device(), fog_ball(3, 0.7, 0.3), 256, 99);
  ViewSession session(fog_ball(2, 0.8, 0.3), how);
  CHECK_FALSE(session.take_step());
  session.fit({"fog.sigma_t"});
  REQUIRE(settle(session)->step);
  session.set({{"fog.sigma_t", 2.5}});
  CHECK_FALSE(session.take_step());
  CHECK(session.values()[0] == 2.5);
}
