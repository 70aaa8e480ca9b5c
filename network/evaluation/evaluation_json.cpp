#include <cmath>

#include "network/evaluation/claims.h"
#include "network/evaluation/paper.h"
#include "network/evaluation/report.h"
#include "runtime/base/json_text.h"
#include "runtime/base/statistics.h"

namespace itn {
namespace {

using Json = nlohmann::ordered_json;

Json json_number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json to_json(const Estimate& e) {
  return {{"value", json_number(e.value)}, {"low", json_number(e.low)}, {"high", json_number(e.high)}};
}

// Also the single runs.
Json to_json(const Runs& runs, Average how, const Resampling& resampling) {
  Json json = to_json(estimate(runs, how, resampling));
  json["runs"] = Json::array();
  for (const Clustered& run : runs) json["runs"].push_back(json_number(average(run, how)));
  return json;
}

Json table1_json(const Evaluation& e) {
  Json table = Json::object();
  for (const ParameterErrors& errors : e.errors) {
    Json& subset = object_in(table, errors.name);
    subset["images"] = errors.images;
    subset["cells"] = errors.cells;
    for (const auto& [who, squares] : errors.squares)
      for (std::size_t p = 0; p < 3; ++p)
        object_in(subset, who)[parameter_names[p]] = to_json(squares[p], Average::root_of_mean, e.resampling);
    if (e.kind("rn") && e.kind("itn"))
      for (std::size_t p = 0; p < 3; ++p)
        object_in(subset, "itn/rn")[parameter_names[p]] = to_json(
            ratio(errors.squares.at("itn")[p], errors.squares.at("rn")[p], Average::root_of_mean, e.resampling));
  }
  for (const auto& [subset, figures] : {std::pair{"training", &paper_training}, {"testing", &paper_testing}})
    for (const auto& [kind, values] : *figures) object_in(object_in(table, subset), "paper")[kind] = values;
  return table;
}

Json coverage_json(const Evaluation& e) {
  Json table = Json::object();
  for (const ParameterErrors& errors : e.errors)
    for (const auto& [kind, coverage] : errors.coverage) {
      Json& of_kind = object_in(object_in(table, errors.name), kind);
      for (std::size_t p = 0; p < 3; ++p) {
        of_kind[parameter_names[p]] = to_json(coverage.held[p], Average::mean, e.resampling);
        of_kind[parameter_names[p]]["ranks"] = coverage.ranks[p];
      }
      of_kind["jointly"] = to_json(coverage.held[3], Average::mean, e.resampling);
    }
  return table;
}

Json table2_json(const Evaluation& e) {
  Json table{{"spp", e.spp}};
  for (const bool training : {true, false}) {
    Json& subset = object_in(table, training ? "training" : "testing");
    std::vector<std::string> all{"truth"};
    for (const Kind& kind : e.kinds) all.push_back(kind.name);
    for (const std::string& who : all)
      subset[who] = {{"rmse", to_json(e.appearance(who, training, false), Average::root_of_mean, e.resampling)},
                     {"1-ms_ssim", to_json(e.appearance(who, training, true), Average::mean, e.resampling)}};
    for (const auto& [kind, values] : training ? paper_training_images : paper_testing_images)
      object_in(subset, "paper")[kind] = values;
  }
  Json& images = table["images"] = Json::array();
  for (const RerenderedResult& r : e.rerendered) {
    Json image{{"file", r.target.image.file}, {"split", split_name(r.target.image.split)}};
    for (std::size_t p = 0; p < 3; ++p) {
      const auto k = static_cast<Eigen::Index>(p);
      object_in(image, "limit")[parameter_names[p]] = {{"image", json_number(std::sqrt(r.bound.image[k]))},
                                                       {"with_prior", json_number(std::sqrt(r.bound.with_prior[k]))}};
    }
    const auto difference = [](const Difference& d) {
      return Json{{"mean_square", json_number(d.mean_square)},
                  {"seen_mean_square", json_number(d.seen_mean_square)},
                  {"1-ms_ssim", json_number(d.structure)}};
    };
    image["truth"] = difference(r.truth);
    image["runs"] = Json::array();
    for (std::size_t run = 0; run < e.runs.size(); ++run) {
      Json one = difference(r.difference[run]);
      for (std::size_t p = 0; p < 3; ++p) one[parameter_names[p]] = as_array(r.predicted[run])[p];
      image["runs"].push_back(one);
    }
    images.push_back(image);
  }
  return table;
}

Json table3_json(const Evaluation& e) {
  Json table{{"images", e.synthesis_targets.size()},
             {"iterations", e.synthesis_options.iterations},
             {"spp", e.synthesis_options.spp},
             {"learning_rate", e.synthesis_options.learning_rate},
             {"recorded_spp", e.synthesis_options.recorded_spp}};
  constexpr std::array<const char*, 4> names{"log_sigma_t", "albedo", "g", "loss"};
  for (const SynthesisResult& s : e.syntheses)
    for (const Synthesis::Record& record : s.records) {
      Json medians{{"iteration", record.iteration}};
      for (std::size_t what = 0; what < 4; ++what)
        medians[names[what]] = json_number(median(e.synthesis_errors(record, what)));
      Json& of_start = object_in(table, "medians")[s.start];
      if (of_start.is_null()) of_start = Json::array();
      of_start.push_back(medians);
    }
  for (std::size_t what = 0; what < 3; ++what)
    object_in(table, "limit")[names[what]] = json_number(e.synthesis_limit(what));
  if (e.synthesis("rn") && e.synthesis("itn"))
    for (std::size_t what = 0; what < 4; ++what) {
      const int reached = iterations_to_reach(e, what);
      object_in(table, "itn_reaches_rn_after")[names[what]] = reached < 0 ? Json() : Json(reached);
    }
  return table;
}

}  // namespace

nlohmann::ordered_json to_json(const Evaluation& e) {
  Json runs = Json::array(), claims = Json::array();
  for (const EvaluatedRun& run : e.runs)
    runs.push_back(
        {{"path", run.path}, {"kind", run.kind}, {"fingerprint", run.fingerprint}, {"warnings", run.warnings}});
  for (const Claim& c : claims_of(e))
    claims.push_back(
        {{"text", c.text}, {"verdict", verdict_words(c.verdict)}, {"ratio", to_json(c.estimate)}, {"bound", c.bound}});
  Json json{{"schema", "itn.eval/1"},
            {"data", {{"folder", e.folder}, {"hash", e.set.hash}, {"size", e.set.size}, {"spp", e.set.spp}}},
            {"seed", e.resampling.seed},
            {"runs", runs},
            {"table1", table1_json(e)}};
  if (Json coverage = coverage_json(e); !coverage.empty()) json["coverage"] = std::move(coverage);
  if (!e.rerendered.empty()) json["table2"] = table2_json(e);
  if (!e.syntheses.empty()) json["table3"] = table3_json(e);
  json["claims"] = claims;
  json["time"] = {{"total_s", e.seconds}};
  return json;
}

}  // namespace itn
