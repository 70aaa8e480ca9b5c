// A judge: a network that says whether photographs are like those that another network learnt from. It sees what that
// one sees, and learns from the same data set: half of what it is shown is spoilt (faults.h). Its outputs are the
// probability that something is wrong, "doubt", and those of each fault.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "itn/network.h"
#include "network/training/dataset_examples.h"
#include "network/training/faults.h"
#include "network/training/prediction.h"

namespace itn {

// "doubt", and the faults that photographs can have of which the network sees this much: all from 0 to 1.
std::vector<OutputRange> outputs_of_judge(const NetworkDescription& network);

// A data set's images as they are, and after them the same spoilt, at every look by another fault.
class JudgedExamples : public Examples {
 public:
  // As DatasetExamples, and UsageError: a judge of other outputs than outputs_of_judge(). times: so often each image is
  // there spoilt, 1 or more. hard_looks: for a network that knows nothing yet; so many looks, from the first on, are at
  // hard faults alone (Fault::often_of_known above 1), which come more often later, too. A small network that is shown
  // all alike learns what is easy to see, and hardly anything moves it to the rest any more. Without it all come alike.
  JudgedExamples(const DatasetImages& images, const NetworkDescription& judge,
                 const DatasetExamples::Variation& variation = {}, std::size_t times = 1,
                 std::optional<std::uint64_t> hard_looks = {});

  std::size_t count() const override { return (1 + times_) * right_.count(); }
  void read(std::size_t index, std::uint64_t look, std::span<float> image, std::span<double> truth) const override;

 private:
  NetworkDescription judge_;
  std::vector<Fault> faults_;
  std::vector<std::size_t> first_, later_;  // of faults_, each so often as it is drawn in the first looks, and later
  std::uint64_t seed_, first_looks_;
  std::size_t times_;
  DatasetExamples right_;
};

// The doubt that 5 % of the examples that are right exceed; 1 of fewer than 20, which cannot tell. examples: of
// JudgedExamples, none of them learnt from.
double judge_limit(const Predictions& examples);

// Which shares exceed a limit: of the examples that are right, and of those with each fault (outputs_of_judge()).
struct JudgeErrors {
  double limit = 1;
  double false_alarms = 0;
  std::vector<double> found;
};
JudgeErrors judge_errors(const Predictions& examples, double limit);

struct Verdict {
  double doubt = 0;
  bool doubted = false;  // above the judge's limit
};
// raw: of one image.
Verdict verdict_of(std::span<const float> raw, const NetworkDescription& judge);

// Throws UsageError: a judge that does not see what the network sees, or is none. name: of its file.
void require_judge_of(const NetworkDescription& network, const NetworkDescription& judge, const std::string& name);

}  // namespace itn
