// The C++ interface: renders a scene with derivatives, and finds its material again in the image.
#include <itn/invert.h>
#include <itn/load_scene.h>
#include <itn/parameters.h>
#include <itn/renderer.h>

#include <cstdio>
#include <exception>
#include <vector>

int main(int argc, char** argv) try {
  if (argc != 3) return std::fprintf(stderr, "renders SCENE.xml FOLDER\n"), 2;
  const itn::Device device;  // the first that OpenCL has; Device(1), or ITN_DEVICE, takes another
  itn::Scene scene = itn::load_scene(argv[1], {{"size", "16"}});
  for (const itn::Parameter& parameter : itn::list_parameters(scene))
    std::printf("%s = %g\n", parameter.name.c_str(), parameter.value);

  itn::RenderOptions options;
  options.spp = 256;
  options.derivatives = {"medium.sigma_t"};
  const itn::Rendering image = itn::render(device, scene, options);
  double mean = 0, change = 0;
  for (std::size_t i = 0; i < image.mean.size(); ++i) {
    mean += image.mean[i] / static_cast<double>(image.mean.size());
    change += image.derivatives[0].mean[i] / static_cast<double>(image.mean.size());
  }
  std::printf("mean %g, its derivative by sigma_t %g\n", mean, change);

  itn::InvertRequest request;
  request.parameters = {"medium.albedo"};
  request.folder = argv[2];
  request.method = "gauss-newton";
  const auto pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  request.targets = {
      {image.width, image.height, image.channels, image.mean, std::vector<float>(pixels, 1), image.stderr_}};
  itn::set_parameter(scene, itn::find_parameter(itn::list_parameters(scene), "medium.albedo"), 0.5);
  const itn::InvertResult found = itn::invert(device, scene, request);
  for (const auto& [name, interval] : found.parameters)
    std::printf("%s = %g, 95 %%: %g to %g\n", name.c_str(), interval.value, interval.low, interval.high);
  return found.converged ? 0 : 1;
} catch (const std::exception& error) {  // itn/error.h: one type for each exit code
  std::fprintf(stderr, "renders: %s\n", error.what());
  return 1;
}
