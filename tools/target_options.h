// --target, --mask, --sensor and --size: the images that a scene is compared with.
#pragma once
#include "runtime/inversion/image_loss.h"
#include "tools/common.h"

namespace itn::tools {

struct TargetOptions {
  std::vector<std::string> targets, masks;  // masks: none, or one a target
  std::vector<int> sensors;                 // after read_targets(): one a target
  std::optional<FilmSize> size;             // of the films, instead of the scene's
};

void add_target_options(CLI::App& command, TargetOptions& options);

// Without --sensor the targets were seen by the scene's sensors in their order. Throws UsageError where sensors or
// masks do not come one a target or not at all, or a sensor is none of the scene's, and as read_target().
std::vector<TargetImage> read_targets(TargetOptions& options, const Scene& scene);

// Do the files of all of them say it?
bool errors_known(const std::vector<TargetImage>& targets);

// Of the targets' noise over their radiance, beside what their files say: as given, or where that is below 0 and they
// say nothing, 1 %.
double relative_noise(double given, const std::vector<TargetImage>& targets);

}  // namespace itn::tools
