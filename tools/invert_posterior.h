// itn invert --method posterior.
#pragma once
#include <string>
#include <vector>

#include "runtime/inversion/inversion_outcome.h"
#include "runtime/inversion/posterior/posterior.h"
#include "tools/target_options.h"

namespace itn::tools {

struct PosteriorQuestion {
  const CommonOptions& common;
  InversionQuestion asked;                      // noise_known included
  std::vector<std::string> parameters, ranges;  // ranges: NAME=LOW,HIGH
  const TargetOptions& images;
  Prior prior;
  PosteriorOptions posterior;
  std::string renderings;  // the folder where they are kept
};

// Runs it to its end. scene_request: all that renderings depend on but for the parameters' values; request: all that
// the numbers depend on.
void invert_posterior(const PosteriorQuestion& question, const Scene& scene, const std::vector<TargetImage>& targets,
                      ForwardModel& model, const StoredRun::Json& scene_request, const StoredRun::Json& request);

}  // namespace itn::tools
