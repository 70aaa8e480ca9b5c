#include "network/evaluation/stored_synthesis.h"

#include <stdexcept>

#include "itn/error.h"
#include "itn/version.h"
#include "network/evaluation/selection.h"

namespace itn {
namespace {

using Json = StoredRun::Json;
using Split = Manifest::Split;

bool is_of_test_shape(const SplitPredictions& split) {
  return split.split == Split::unseen_shape || split.split == Split::unseen_both;
}

// Start of each target's synthesis: the prediction of the kind's first run, or the truth.
std::vector<DatasetMaterial> materials_at(const Evaluation& e, const std::string& start) {
  std::vector<DatasetMaterial> materials;
  std::map<std::string, DatasetMaterial> predicted;  // by file
  if (start != "truth")
    for (const SplitPredictions& split : e.splits)
      if (is_of_test_shape(split))
        for (std::size_t i = 0; i < split.images.size(); ++i)
          predicted[split.images[i].file] = split.predicted[e.kind(start)->runs.front()][i];
  for (const SynthesisTarget& t : e.synthesis_targets)
    materials.push_back(start == "truth" ? DatasetMaterial{t.image.sigma_t, t.image.albedo, t.image.g}
                                         : predicted.at(t.image.file));
  return materials;
}

Json request_of(const Evaluation& e, const Device& device, const std::string& start) {
  Json images = Json::array();
  for (const SynthesisTarget& t : e.synthesis_targets) images.push_back(t.image.file);
  const SynthesisOptions& how = e.synthesis_options;
  return {{"version", version()},
          {"data", e.set.hash},
          {"network", start == "truth" ? "" : e.runs[e.kind(start)->runs.front()].fingerprint},
          {"images", images},
          {"iterations", how.iterations},
          {"learning_rate", how.learning_rate},
          {"spp", how.spp},
          {"record_every", how.record_every},
          {"recorded_spp", how.recorded_spp},
          {"seed", how.seed},
          {"device", device.info().name + ", " + device.info().platform}};
}

StoredRun file_of(const EvaluationOptions& options, const std::string& start) {
  return {options.report + "/inversions_" + start + ".json", "itn.eval.inversions/1", "inversions of itn eval"};
}

}  // namespace

std::vector<std::string> choose_synthesis_targets(const EvaluationOptions& options, Evaluation& e) {
  e.synthesis_options.iterations = options.iterations;
  e.synthesis_options.learning_rate = options.learning_rate;
  e.synthesis_options.seed = options.seed;
  std::vector<Manifest::Image> images;
  for (const SplitPredictions& split : e.splits)
    if (is_of_test_shape(split)) images.insert(images.end(), split.images.begin(), split.images.end());
  for (const Manifest::Image& image :
       choose_of_each_shape(images, static_cast<std::size_t>(options.inversions), options.seed))
    e.synthesis_targets.push_back({image, read_noisy_image(options.data, e.set, image)});
  if (e.synthesis_targets.empty())
    throw InputError(manifest_file(options.data) +
                     ": has no images of test shapes; leave table 3 out with inversions 0");
  std::vector<std::string> starts;
  for (const char* name : {"rn", "itn"})
    if (e.kind(name)) starts.emplace_back(name);
  starts.emplace_back("truth");
  return starts;
}

void require_same_syntheses(const EvaluationOptions& options, const Device& device, const Evaluation& e,
                            const std::vector<std::string>& starts) {
  for (const std::string& start : starts) file_of(options, start).require_same(request_of(e, device, start));
}

StoredSynthesis::StoredSynthesis(const EvaluationOptions& options, const Device& device, RenderedLoss& renderer,
                                 const Evaluation& e, const std::string& start)
    : start_(start),
      iterations_(options.iterations),
      request_(request_of(e, device, start)),
      synthesis_(renderer, e.set, options.data, e.synthesis_targets, materials_at(e, start), e.synthesis_options),
      stored_(file_of(options, start)) {
  stored_.require_same(request_);
  const Json state = stored_.before("state");
  if (state.is_null()) return;
  try {
    synthesis_.restore(state);
  } catch (const nlohmann::json::exception&) {
    stored_.refuse();
  } catch (const std::out_of_range&) {
    stored_.refuse();
  }
}

void StoredSynthesis::advance() {
  const std::size_t records = synthesis_.records().size();
  synthesis_.advance();
  if (synthesis_.records().size() > records) store();
}

void StoredSynthesis::store() const { stored_.write(request_, {{"state", synthesis_.state()}}); }

}  // namespace itn
