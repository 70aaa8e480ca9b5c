#include "network/evaluation/tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "network/evaluation/paper.h"
#include "runtime/base/statistics.h"

namespace itn {
namespace {

using Row = std::vector<std::string>;

std::string number(double value) { return std::isfinite(value) ? fmt::format("{:.3g}", value) : "-"; }

// With several runs also how far apart they are.
std::string cell(const Runs& runs, Average how, const Resampling& resampling) {
  const Estimate all = estimate(runs, how, resampling);
  if (runs.size() < 2) return as_text(all);
  double square = 0;
  for (const Clustered& run : runs) square += std::pow(average(run, how) - all.value, 2);
  const double spread = std::sqrt(square / static_cast<double>(runs.size() - 1));
  return fmt::format("{} ± {} ({} to {})", number(all.value), number(spread), number(all.low), number(all.high));
}

template <std::size_t count>
std::string paper_cell(const std::map<std::string, std::array<double, count>>* figures, const std::string& kind) {
  if (!figures || !figures->count(kind)) return "";
  return fmt::format("{}", fmt::join(figures->at(kind), "  "));
}

template <std::size_t count>
std::string paper_ratio_cell(const std::map<std::string, std::array<double, count>>* figures) {
  if (!figures) return "";
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += fmt::format("{}{:.2f}", i ? "  " : "", paper_ratio(*figures, i));
  return text;
}

std::string title_of(const Kind& kind) {
  return kind.runs.size() == 1 ? kind.title() : fmt::format("{}, {} runs", kind.title(), kind.runs.size());
}

void add_limits(const Evaluation& e, ReportTable& table) {
  Row with_prior{"information limit: image and prior"}, alone{"information limit: image alone, median"};
  for (Eigen::Index p = 0; p < 3; ++p) {
    double sum = 0, count = 0;
    std::vector<double> variances;
    for (const RerenderedResult& r : e.rerendered) {
      if (r.training) continue;
      sum += r.bound.with_prior[p];
      count += 1;
      variances.push_back(r.bound.image[p]);
    }
    with_prior.push_back(number(std::sqrt(sum / count)));
    alone.push_back(number(std::sqrt(median(variances))));
  }
  with_prior.emplace_back();
  alone.emplace_back();
  table.rows.push_back(with_prior);
  table.rows.push_back(alone);
  table.notes.emplace_back(
      "Information limit: Cramer-Rao bound of the re-rendered test images from their derivatives at the truth and "
      "their "
      "noise, for known shape and light; with the variance of the training's parameters as prior: root of the mean "
      "variance; without it: median standard deviation (- where noise hides a direction in most images).");
}

ReportTable table1(const Evaluation& e, const ParameterErrors& errors) {
  const std::map<std::string, std::array<double, 3>>* paper = errors.name == "training"  ? &paper_training
                                                              : errors.name == "testing" ? &paper_testing
                                                                                         : nullptr;
  ReportTable table{fmt::format("Table 1, {}: RMSE of the parameters ({} images of {} combinations of shape and light)",
                                errors.name, errors.images, errors.cells),
                    {{"", "sigma_t [1/mm]", "albedo", "g", paper ? "paper" : ""}},
                    {}};
  for (const Kind& kind : e.kinds) {
    Row row{title_of(kind)};
    for (std::size_t p = 0; p < 3; ++p)
      row.push_back(cell(errors.squares.at(kind.name)[p], Average::root_of_mean, e.resampling));
    row.push_back(paper_cell(paper, kind.name));
    table.rows.push_back(row);
  }
  if (e.kind("rn") && e.kind("itn")) {
    Row row{"ITN / RN"};
    for (std::size_t p = 0; p < 3; ++p)
      row.push_back(
          as_text(ratio(errors.squares.at("itn")[p], errors.squares.at("rn")[p], Average::root_of_mean, e.resampling)));
    row.push_back(paper_ratio_cell(paper));
    table.rows.push_back(row);
  }
  Row constant{"constant guess"};
  for (std::size_t p = 0; p < 3; ++p)
    constant.push_back(number(average(errors.squares.at("constant")[p].front(), Average::root_of_mean)));
  constant.emplace_back();
  table.rows.push_back(constant);
  if (errors.name == "testing" && !e.rerendered.empty()) add_limits(e, table);
  if (errors.name == "testing")
    table.notes.emplace_back(
        "In brackets: 95 % intervals, by bootstrap over combinations of shape and light, and over runs where a kind "
        "has "
        "several; ±: standard deviation between runs. Constant guess: the mean of the training's parameters.");
  return table;
}

ReportTable coverage_table(const Evaluation& e, const ParameterErrors& errors) {
  ReportTable table{
      fmt::format("Coverage, {}: how often the 95 % intervals hold the truth ({} images)", errors.name, errors.images),
      {{"", "sigma_t", "albedo", "g", "jointly", "ranks by tenths: sigma_t", "albedo", "g"}},
      {}};
  for (const auto& [kind, coverage] : errors.coverage) {
    Row row{title_of(*e.kind(kind))};
    for (const Runs& held : coverage.held) row.push_back(cell(held, Average::mean, e.resampling));
    for (const auto& ranks : coverage.ranks) row.push_back(fmt::format("{}", fmt::join(ranks, " ")));
    table.rows.push_back(row);
  }
  if (errors.name == "testing")
    table.notes.emplace_back(
        "Coverage: `jointly` is the ellipsoid of all three parameters that should hold 95 %. Ranks: images with the "
        "truth in each tenth of the distribution, from the low end; as many in each where it is calibrated.");
  return table;
}

ReportTable table2(const Evaluation& e, bool training) {
  const auto& paper = training ? paper_training_images : paper_testing_images;
  const auto images = std::count_if(e.rerendered.begin(), e.rerendered.end(),
                                    [&](const RerenderedResult& r) { return r.training == training; });
  ReportTable table{fmt::format("Table 2, {}: images rendered with the predictions ({} images, {} samples a pixel)",
                                training ? "training" : "testing", images, e.spp),
                    {{"", "RMSE", "1 - MS-SSIM", "paper"}},
                    {}};
  const auto add = [&](const std::string& title, const std::string& who, const std::string& of_paper) {
    table.rows.push_back({title, cell(e.appearance(who, training, false), Average::root_of_mean, e.resampling),
                          cell(e.appearance(who, training, true), Average::mean, e.resampling), of_paper});
  };
  for (const Kind& kind : e.kinds) add(title_of(kind), kind.name, paper_cell(&paper, kind.name));
  if (e.kind("rn") && e.kind("itn"))
    table.rows.push_back({"ITN / RN",
                          as_text(ratio(e.appearance("itn", training, false), e.appearance("rn", training, false),
                                        Average::root_of_mean, e.resampling)),
                          as_text(ratio(e.appearance("itn", training, true), e.appearance("rn", training, true),
                                        Average::mean, e.resampling)),
                          paper_ratio_cell(&paper)});
  add("truth: what noise leaves", "truth", "");
  if (!training)
    table.notes.emplace_back(
        "RMSE: root of the mean over images and pixels of the squared difference of luminance, less the variance of "
        "both "
        "images' noise; in this renderer's units of radiance, so of the paper's figures only ratios compare. 1 - "
        "MS-SSIM "
        "includes the noise: the row `truth` is what noise alone makes of it.");
  return table;
}

ReportTable table3(const Evaluation& e) {
  ReportTable table{
      fmt::format("Table 3: analysis by synthesis, medians over {} images of test shapes", e.synthesis_targets.size()),
      {{"", "start"}},
      {}};
  const std::vector<Synthesis::Record>& records = e.syntheses.front().records;
  // The paper's, or of a short run the records nearest to those shares of it.
  std::vector<std::size_t> columns;
  for (const int iteration : paper_iterations) {
    const double share = iteration == 1 ? 0 : iteration / 200.0;
    columns.push_back(static_cast<std::size_t>(std::lround(share * static_cast<double>(records.size() - 1))));
  }
  for (const std::size_t c : columns) table.rows[0].push_back(std::to_string(std::max(1, records[c].iteration)));
  constexpr std::array<const char*, 4> names{"log sigma_t", "albedo", "g", "image loss"};
  for (const std::size_t what : {3U, 0U, 1U, 2U}) {
    for (const SynthesisResult& s : e.syntheses) {
      Row row{names[what], s.start == "truth" ? "truth" : Kind{s.start, {}}.title()};
      for (const std::size_t c : columns) row.push_back(number(median(e.synthesis_errors(s.records[c], what))));
      table.rows.push_back(row);
    }
    if (what < 3) {
      Row limit{names[what], "limit"};
      limit.resize(1 + columns.size());
      limit.push_back(number(e.synthesis_limit(what)));
      table.rows.push_back(limit);
    }
    for (const auto& [kind, figures] : paper_synthesis) {
      Row row{names[what], "paper, " + Kind{kind, {}}.title()};
      for (const double figure : figures[what]) row.push_back(number(figure));
      table.rows.push_back(row);
    }
  }
  table.notes.emplace_back(fmt::format(
      "Squared errors of the parameters, and the mean squared difference of the images. {} iterations of Adam with {} "
      "samples a pixel, first step {} in log sigma_t and the logits of albedo and g. The image loss is rendered with "
      "{} "
      "samples, the same random numbers for all starts, less the variance of both images' noise: without bias, so it "
      "can "
      "come out below 0; the row `truth` at iteration 1 is its noise. "
      "`limit`: what the input images' noise alone makes of a perfect fit without prior knowledge, from their "
      "Cramer-Rao "
      "bounds; in the end no start can be expected below it. Columns beyond the paper's iterations stand for "
      "the same share of all iterations.",
      e.synthesis_options.iterations, e.synthesis_options.spp, e.synthesis_options.learning_rate,
      e.synthesis_options.recorded_spp));
  return table;
}

// Characters, not bytes.
std::size_t length(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0U) != 0x80; }));
}

}  // namespace

std::string as_text(const Estimate& estimate) {
  if (!std::isfinite(estimate.low) && !std::isfinite(estimate.high)) return number(estimate.value);
  return fmt::format("{} ({} to {})", number(estimate.value), number(estimate.low), number(estimate.high));
}

std::vector<ReportTable> tables_of(const Evaluation& e) {
  std::vector<ReportTable> tables;
  for (const ParameterErrors& errors : e.errors) tables.push_back(table1(e, errors));
  for (const ParameterErrors& errors : e.errors)
    if (!errors.coverage.empty()) tables.push_back(coverage_table(e, errors));
  if (!e.rerendered.empty())
    for (const bool training : {true, false}) tables.push_back(table2(e, training));
  if (!e.syntheses.empty()) tables.push_back(table3(e));
  return tables;
}

std::string as_text(const ReportTable& table) {
  std::vector<std::size_t> width;
  for (const Row& row : table.rows) {
    width.resize(std::max(width.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) width[c] = std::max(width[c], length(row[c]));
  }
  std::string text = table.title + "\n";
  for (const Row& row : table.rows) {
    std::string line = "  ";
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string padding(width[c] - length(row[c]), ' ');
      line += c == 0 ? row[c] + padding : "   " + padding + row[c];
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

}  // namespace itn
