// A user of training and evaluation: the shipped network by its name, and what is said where there is no data set.
#include <network/evaluation/evaluate.h>
#include <network/evaluation/report.h>
#include <network/model/trained_network.h>
#include <network/training/training_run.h>
#include <runtime/base/error.h>

namespace {

template <class Call>
bool says_how_to_make_the_data(const Call& call) {
  try {
    call();
  } catch (const itn::InputError& error) {
    return std::string(error.what()).find("itn dataset") != std::string::npos;
  }
  return false;
}

}  // namespace

int main() {
  if (itn::network_of(itn::shipped_run).description().channels != 6) return 1;
  const std::atomic<bool> cancel{false};
  itn::TrainingRequest request;
  request.data = {"nowhere"};
  request.folder = "run";
  itn::EvaluationOptions options;
  options.data = "nowhere";
  options.runs = {itn::shipped_run};
  const bool training = says_how_to_make_the_data([&] { itn::TrainingRun(request, cancel); });
  const bool evaluation = says_how_to_make_the_data([&] {
    itn::Evaluation e = itn::begin_evaluation(options);
    itn::predict_splits(options, e, cancel, {});
    itn::write_evaluation("report", e);
  });
  return training && evaluation ? 0 : 1;
}
