#include "network/evaluation/synthesis.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "itn/parameters.h"
#include "network/dataset/dataset_mesh.h"
#include "runtime/base/json_text.h"
#include "runtime/inverse/state_json.h"

namespace itn {
namespace {

std::vector<Coordinate> coordinates_of(const Manifest& set, const std::string& folder) {
  const Scene scene = dataset_scene(set, dataset_mesh(set.shapes.front(), folder));
  const std::vector<Parameter> parameters = list_parameters(scene);
  std::vector<Coordinate> coordinates;
  for (const char* name : {dataset_sigma_t, dataset_albedo, dataset_g})
    coordinates.emplace_back(find_parameter(parameters, name));
  return coordinates;
}

}  // namespace

Synthesis::Synthesis(RenderedLoss& renderer, const Manifest& set, const std::string& folder,
                     const std::vector<SynthesisTarget>& targets, const std::vector<DatasetMaterial>& starts,
                     const SynthesisOptions& options)
    : renderer_(renderer),
      set_(set),
      targets_(targets),
      options_(options),
      coordinates_(coordinates_of(set, folder)),
      moments_(targets.size()) {
  for (const DatasetMaterial& start : starts)
    x_.push_back({coordinates_[0].of(start.sigma_t * set.mm_per_unit), coordinates_[1].of(start.albedo),
                  coordinates_[2].of(start.g)});
}

DatasetMaterial Synthesis::material(std::size_t image) const {
  const std::vector<double>& x = x_[image];
  return {coordinates_[0].value(x[0]) / set_.mm_per_unit, coordinates_[1].value(x[1]), coordinates_[2].value(x[2])};
}

std::vector<RerenderedImage> Synthesis::images(EvaluationStream stream, std::uint64_t first_index) const {
  std::vector<RerenderedImage> result;
  for (std::size_t i = 0; i < targets_.size(); ++i)
    result.push_back({&targets_[i].image, material(i), image_seed(options_.seed, stream, first_index + i),
                      &targets_[i].input.value});
  return result;
}

void Synthesis::advance() {
  const bool due = iteration_ % options_.record_every == 0 || iteration_ == options_.iterations;
  if (due && !recorded())
    record();
  else
    step();
}

void Synthesis::record() {
  Record record{iteration_, {}, {}};
  const std::vector<Rendering> renderings =
      rerender(renderer_, images(EvaluationStream::recorded_loss, 0), set_.size, options_.recorded_spp, {});
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    record.material.push_back(material(i));
    record.loss.push_back(difference(renderings[i], targets_[i].input).mean_square);
  }
  records_.push_back(std::move(record));
}

void Synthesis::step() {
  const std::vector<RerenderedImage> all =
      images(EvaluationStream::iterations, static_cast<std::uint64_t>(iteration_) * targets_.size());
  std::vector<LossGradient> losses;
  in_batches(all.size(), images_per_batch(set_.size, options_.spp), [&](std::size_t first, std::size_t end) {
    for (LossGradient& loss :
         renderer_.evaluate(std::vector<RerenderedImage>(all.begin() + static_cast<std::ptrdiff_t>(first),
                                                         all.begin() + static_cast<std::ptrdiff_t>(end)),
                            options_.spp))
      losses.push_back(std::move(loss));
  });
  for (std::size_t i = 0; i < x_.size(); ++i) {
    std::vector<double> gradient;
    for (std::size_t p = 0; p < x_[i].size(); ++p)
      gradient.push_back(losses[i].gradient[p] * coordinates_[p].slope(x_[i][p]));
    gradient[0] /= set_.mm_per_unit;
    adam_step(x_[i], gradient, moments_[i], iteration_, options_.iterations, options_.learning_rate);
    for (std::size_t p = 0; p < x_[i].size(); ++p) x_[i][p] = coordinates_[p].clamp(x_[i][p]);
  }
  ++iteration_;
}

nlohmann::json Synthesis::state() const {
  nlohmann::json json{
      {"iteration", iteration_}, {"x", x_}, {"moments", moments_}, {"records", nlohmann::json::array()}};
  for (const Record& record : records_) {
    nlohmann::json materials = nlohmann::json::array();
    for (const DatasetMaterial& m : record.material) materials.push_back({m.sigma_t, m.albedo, m.g});
    json["records"].push_back({{"iteration", record.iteration}, {"material", materials}, {"loss", record.loss}});
  }
  return json;
}

void Synthesis::restore(const nlohmann::json& state) {
  auto moments = state.at("moments").get<std::vector<AdamMoments>>();
  std::vector<Record> records;
  for (const nlohmann::json& stored : state.at("records")) {
    Record record{whole<int>(stored.at("iteration")), {}, stored.at("loss").get<std::vector<double>>()};
    for (const nlohmann::json& m : stored.at("material"))
      record.material.push_back({m.at(0).get<double>(), m.at(1).get<double>(), m.at(2).get<double>()});
    records.push_back(std::move(record));
  }
  auto x = state.at("x").get<std::vector<std::vector<double>>>();
  const int iteration = whole<int>(state.at("iteration"));
  // Files may have been edited.
  const auto is_point = [&](const std::vector<double>& v) {
    return v.size() == coordinates_.size() &&
           std::all_of(v.begin(), v.end(), [](double coordinate) { return std::isfinite(coordinate); });
  };
  const auto is_of_point = [&](const std::vector<double>& v) { return v.empty() || is_point(v); };
  const bool fits = x.size() == targets_.size() && moments.size() == targets_.size() && iteration >= 0 &&
                    iteration <= options_.iterations && std::all_of(x.begin(), x.end(), is_point) &&
                    std::all_of(moments.begin(), moments.end(),
                                [&](const AdamMoments& m) { return is_of_point(m.first) && is_of_point(m.second); }) &&
                    std::all_of(records.begin(), records.end(), [&](const Record& r) {
                      return r.material.size() == targets_.size() && r.loss.size() == targets_.size();
                    });
  if (!fits) throw std::out_of_range("other images, or no state that was stored");
  iteration_ = iteration;
  x_ = std::move(x);
  moments_ = std::move(moments);
  records_ = std::move(records);
}

}  // namespace itn
