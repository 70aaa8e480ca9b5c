// The judge of a network (network/training/judge.h), asked about the images that the network is asked about.
#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "itn/network.h"
#include "network/model/input.h"
#include "network/training/judge.h"

namespace itn {

class ImageJudge {
 public:
  // judge: a RUN; empty: the judge that ships with `shipped-photos`, for other networks none. Throws as
  // network_of(), and UsageError: it does not see what the network sees.
  static std::optional<ImageJudge> of(const std::string& run, const NetworkDescription& network,
                                      const std::string& judge = "");

  // The judge sees what the network sees, at its own resolution and, where both cut out the object, with the object at
  // its own share of the picture: those of the data set that each learnt from.
  const NetworkDescription& description() const { return judge_.description(); }
  Verdict verdict(const Seen& seen);
  // The warning for whoever asks the network about such an image; empty where the image is not doubted.
  std::string warning(const std::string& file, const Verdict& verdict) const;

 private:
  explicit ImageJudge(Network judge) : judge_(std::move(judge)), input_(judge_.image_values()) {}

  Network judge_;
  std::vector<float> input_;
};

}  // namespace itn
