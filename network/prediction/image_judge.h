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

  // What it sees is as the network's, but for how many pixels that is, and for the share of the picture that an object
  // takes which both cut out: these are of the data set that each learnt from.
  const NetworkDescription& description() const { return judge_.description(); }
  Verdict verdict(const Seen& seen);
  // What a user is told who asks the network about such an image; empty where it is not doubted.
  std::string warning(const std::string& file, const Verdict& verdict) const;

 private:
  explicit ImageJudge(Network judge) : judge_(std::move(judge)), input_(judge_.image_values()) {}

  Network judge_;
  std::vector<float> input_;
};

}  // namespace itn
