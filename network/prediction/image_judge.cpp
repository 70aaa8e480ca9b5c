#include "network/prediction/image_judge.h"

#include <fmt/format.h>

#include "itn/trained_network.h"

namespace itn {

std::optional<ImageJudge> ImageJudge::of(const std::string& run, const NetworkDescription& network,
                                         const std::string& judge) {
  std::string name = judge;
  if (name.empty() && run == shipped_photos_run) name = shipped_photos_judge;
  if (name.empty()) return {};
  ImageJudge result(network_of(name));
  require_judge_of(network, result.description(), name);
  return result;
}

Verdict ImageJudge::verdict(const Seen& seen) {
  network_input(description(), seen, input_);
  return verdict_of(judge_.forward(input_, 1), description());
}

std::string ImageJudge::warning(const std::string& file, const Verdict& verdict) const {
  if (!verdict.doubted) return {};
  const Needs needs(description());
  std::string questions;
  if (needs.shape) questions += "are shape and light those of the image, ";
  if (needs.mask && !needs.shape) questions += "is the mask the object's, ";
  if (needs.flash) questions += "did the camera move, ";
  if (!description().exposure) questions += "is it exposed as they are, ";
  return fmt::format(
      "{}: is unlike the images that the network learnt from (doubt {:.2f}; 5 % of those are above {:.2f}): {}is the "
      "curve the camera's (--curve), is it sharp, and nowhere cut off? Or is it right, and of another kind than they "
      "are? What is said of it may be far off, and its intervals too narrow",
      file, verdict.doubt, description().limit, questions);
}

}  // namespace itn
