// A misfit and its likely cause. The residual of a target is compared with the residuals that a shift, another size,
// another brightness and so on would leave there, as a least-squares fit beside the parameters' own derivatives, so
// that the advice is about what is likeliest wrong: a better start does not help where the camera stood elsewhere.
#pragma once
#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "itn/rendering.h"
#include "itn/target_image.h"
#include "runtime/inverse/image_fit.h"

namespace itn {

struct Misfit {
  // shift, size, rotation, brightness, colour, offset, curve, blur, saturation, noise_too_large, noise_too_small;
  // edges, areas: none of these, but where most of it lies. Empty: the targets fit.
  std::string kind;
  double share = 0;        // of the residual beyond the noise that the cause explains or that lies there
  std::size_t target = 0;  // the one that fits worst, which is examined
  double x = 0, y = 0;     // shift of the target's content [pixels], to the right and down
  double change = 0;       // relative: of size, of brightness; of noise: what it is over what was said of it
  std::string words;       // a sentence
};

// A target beside the image found.
struct ComparedImage {
  const Rendering& image;         // with derivatives by the parameters, or with none
  std::array<double, 3> factors;  // camera_factors(): what it is multiplied by
  const TargetImage& target;
  const WhiteResidual& white;
};

// exposure, white_balance: were found, too.
Misfit misfit_of(const std::vector<ComparedImage>& images, const ImageFit& fit, bool exposure, bool white_balance);

struct ImageComparison {
  ImageFit fit;
  Misfit misfit;
};
// groups: of each target two or more renderings of different samples; the first half of them tells the noise.
// exposures: what each is multiplied by; found: they were not known. many_unknowns: as of ImageFit.
ImageComparison compare_images(const std::vector<std::vector<Rendering>>& groups,
                               const std::vector<TargetImage>& targets, const std::vector<double>& exposures,
                               bool found, double relative_noise, bool noise_known, bool many_unknowns = false);

// The sentence says that the images do not fit, and the likely cause.
std::string misfit_words(const ImageComparison& comparison);

// null where all fits.
nlohmann::ordered_json to_json(const Misfit& misfit);

}  // namespace itn
