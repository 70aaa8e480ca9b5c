// The trained networks that an evaluation compares.
#pragma once
#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "itn/network.h"
#include "network/dataset/dataset_scene.h"

namespace itn {

// The parameters, in the order in which everything here holds them.
constexpr std::array<const char*, 3> parameter_names{"sigma_t", "albedo", "g"};

inline std::array<double, 3> as_array(const DatasetMaterial& m) { return {m.sigma_t, m.albedo, m.g}; }

struct EvaluatedRun {
  std::string path, kind;  // kind: rn, itn, ssn
  Network network;
  std::array<std::size_t, 3> output{};  // where the network says each parameter
  std::string fingerprint;              // of the network's file
  std::vector<nlohmann::json> curve;    // RUN/curve.jsonl; empty: a network without its training
  std::vector<std::string> warnings;
};

// Throws InputError: no network there, one for images of another size or unit of length, or of other parameters than
// sigma_t, albedo and g; a curve that cannot be read.
EvaluatedRun read_run(const std::string& path, const Manifest& set);

// The runs of one kind, as indices; kinds in the order rn, itn, ssn, those without runs left out.
struct Kind {
  std::string name;
  std::vector<std::size_t> runs;
  std::string title() const;  // "RN"
};
std::vector<Kind> kinds_of(const std::vector<EvaluatedRun>& runs);

}  // namespace itn
