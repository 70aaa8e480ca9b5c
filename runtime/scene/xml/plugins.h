// The plugins that scene files may name, by families: each list stands where its family is read.
#pragma once
#include <string>
#include <vector>

namespace itn {

struct PluginFamily {
  std::string tag;                 // of their elements: "bsdf"
  std::vector<std::string> types;  // "diffuse"
};

// A type may stand in two families.
std::vector<PluginFamily> plugin_families();

std::vector<std::string> bsdf_types();
std::vector<std::string> emitter_types();  // without those that belong into a shape
std::vector<std::string> film_types();
std::vector<std::string> filter_types();
std::vector<std::string> integrator_types();
std::vector<std::string> phase_types();
std::vector<std::string> sampler_types();
std::vector<std::string> sensor_types();
std::vector<std::string> shape_types();
std::vector<std::string> spectrum_types();
std::vector<std::string> texture_types();
std::vector<std::string> volume_types();

}  // namespace itn
