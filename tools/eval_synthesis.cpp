// Table 3 of `itn eval`: analysis by synthesis from different starts.
#include <fmt/format.h>

#include <filesystem>

#include "runtime/error.h"
#include "runtime/image/file.h"
#include "tools/eval.h"
#include "tools/evaluation/selection.h"
#include "tools/interrupt.h"
#include "tools/progress.h"

namespace itn::tools {
namespace {

using Json = nlohmann::ordered_json;

// One kind of start, and its state in the report's folder.
class StoredSynthesis {
 public:
  // request: all that the numbers depend on.
  StoredSynthesis(const std::string& file, Json request, Synthesis& synthesis)
      : file_(file), request_(std::move(request)), synthesis_(synthesis) {
    if (!std::filesystem::exists(file_)) return;
    try {
      const nlohmann::json stored = nlohmann::json::parse(read_file(file_));
      if (stored.at("request") == nlohmann::json(request_)) synthesis_.restore(stored.at("state"));
    } catch (const nlohmann::json::exception&) {
      throw InputError(file_ + ": damaged; remove it to begin anew");
    } catch (const std::out_of_range&) {
      throw InputError(file_ + ": damaged; remove it to begin anew");
    }
  }

  void finish(const std::string& label, int iterations, std::size_t images, bool shown) {
    const auto fraction = [&] { return static_cast<double>(synthesis_.iteration()) / iterations; };
    Progress progress(label, static_cast<double>(images) * iterations, "renderings", shown, fraction());
    std::size_t records = synthesis_.records().size();
    const OrderlyEnd orderly_end;
    try {
      while (!synthesis_.finished()) {
        synthesis_.advance();
        progress.update(fraction());
        if (synthesis_.records().size() > records) store();
        records = synthesis_.records().size();
      }
    } catch (const Interrupted&) {
      progress.clear();
      store();
      throw;
    }
  }

 private:
  void store() const { write_file(file_, Json{{"request", request_}, {"state", synthesis_.state()}}.dump() + "\n"); }

  std::string file_;
  Json request_;
  Synthesis& synthesis_;
};

// Images of test shapes, and where the runs start for each.
struct Problem {
  std::vector<SynthesisTarget> targets;
  std::map<std::string, std::vector<DatasetMaterial>> predicted;  // by file, by run
};

Problem choose_problem(const EvalOptions& options, const Evaluation& e) {
  Problem problem;
  std::vector<Manifest::Image> images;
  for (const SplitPredictions& split : e.splits) {
    if (split.split != Manifest::Split::unseen_shape && split.split != Manifest::Split::unseen_both) continue;
    for (std::size_t i = 0; i < split.images.size(); ++i) {
      images.push_back(split.images[i]);
      for (const auto& run : split.predicted) problem.predicted[split.images[i].file].push_back(run[i]);
    }
  }
  for (const Manifest::Image& image :
       choose_of_each_shape(images, static_cast<std::size_t>(options.inversions), options.common.seed))
    problem.targets.push_back({image, read_noisy_image(options.data, e.set, image)});
  if (problem.targets.empty())
    throw InputError(manifest_file(options.data) +
                     ": has no images of test shapes; leave table 3 out with --inversions 0");
  return problem;
}

}  // namespace

void run_syntheses(const EvalOptions& options, const Device& device, RenderedLoss& renderer, Evaluation& e) {
  SynthesisOptions& how = e.synthesis_options;
  how.iterations = options.iterations;
  how.learning_rate = options.learning_rate;
  how.seed = options.common.seed;
  const Problem problem = choose_problem(options, e);
  e.synthesis_targets = problem.targets;
  std::vector<std::string> starts;
  for (const char* name : {"rn", "itn"})
    if (e.kind(name)) starts.emplace_back(name);
  starts.emplace_back("truth");
  Json images = Json::array();
  for (const SynthesisTarget& t : problem.targets) images.push_back(t.image.file);

  for (const std::string& start : starts) {
    const std::size_t run = start == "truth" ? 0 : e.kind(start)->runs.front();
    std::vector<DatasetMaterial> from;
    for (const SynthesisTarget& t : problem.targets)
      from.push_back(start == "truth" ? DatasetMaterial{t.image.sigma_t, t.image.albedo, t.image.g}
                                      : problem.predicted.at(t.image.file)[run]);
    const Json request{{"version", ITN_VERSION},
                       {"data", e.set.hash},
                       {"network", start == "truth" ? "" : e.runs[run].fingerprint},
                       {"images", images},
                       {"iterations", how.iterations},
                       {"learning_rate", how.learning_rate},
                       {"spp", how.spp},
                       {"record_every", how.record_every},
                       {"recorded_spp", how.recorded_spp},
                       {"seed", how.seed},
                       {"device", device.info().name + ", " + device.info().platform}};
    Synthesis synthesis(renderer, e.set, options.data, e.synthesis_targets, from, how);
    StoredSynthesis stored(options.report + "/inversions_" + start + ".json", request, synthesis);
    stored.finish("inversions from " + start, how.iterations, problem.targets.size(), !options.common.quiet);
    e.syntheses.push_back({start, synthesis.records()});
  }
  std::vector<const Manifest::Image*> records;
  for (const SynthesisTarget& t : e.synthesis_targets) records.push_back(&t.image);
  e.synthesis_bounds = find_bounds(options, renderer, e, records);
}

}  // namespace itn::tools
