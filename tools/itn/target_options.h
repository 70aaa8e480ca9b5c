// --target, --mask, --sensor and --size: the images that a scene is compared with.
#pragma once
#include "runtime/inverse/image_loss.h"
#include "tools/itn/common.h"

namespace itn::tools {

struct TargetOptions {
  std::vector<std::string> targets, masks;  // masks: none, or one a target
  std::vector<int> sensors;                 // after read_targets(): one a target
  std::optional<FilmSize> size;             // of the films, instead of the scene's
  PhotoOptions photo;                       // of targets that are no OpenEXR files
};

void add_target_options(CLI::App& command, TargetOptions& options);
// --curve and --saturation: of photos.
void add_photo_options(CLI::App& command, PhotoOptions& options);
void add_curve_option(CLI::App& command, TransferCurve& curve);

// Without --sensor the targets were seen by the scene's sensors in their order. Throws UsageError where sensors or
// masks do not come one a target or not at all, or a sensor is none of the scene's, and as read_target().
std::vector<TargetImage> read_targets(TargetOptions& options, const Scene& scene);

// Says of each photo what was done to it; factor_known: no exposure is looked for.
void print_notes(const CommonOptions& common, const std::vector<TargetImage>& targets, bool factor_known);

// --noise
void add_noise_option(CLI::App& command, std::optional<double>& relative);

// settle_noise() of runtime; says what was measured.
TargetNoise settle_noise(const CommonOptions& common, std::vector<TargetImage>& targets,
                         const std::optional<double>& relative);

}  // namespace itn::tools
