#include "network/evaluation/claims.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "network/evaluation/paper.h"
#include "network/evaluation/tables.h"
#include "runtime/base/statistics.h"

namespace itn {
namespace {

// That a ratio is below a bound: sure where its whole interval is.
Claim below(const std::string& text, const Estimate& ratio, double bound) {
  Claim claim{"", Claim::Verdict::open, ratio, bound};
  if (ratio.high < bound) claim.verdict = Claim::Verdict::holds;
  if (ratio.low >= bound) claim.verdict = Claim::Verdict::fails;
  claim.text = fmt::format("{}: ratio {}", text, as_text(ratio));
  return claim;
}

void add_parameters(const Evaluation& e, std::vector<Claim>& claims) {
  const ParameterErrors& test = *e.errors_of("testing");
  const auto ratio_of = [&](const ParameterErrors& errors, const char* above, const char* under, std::size_t p) {
    return ratio(errors.squares.at(above)[p], errors.squares.at(under)[p], Average::root_of_mean, e.resampling);
  };
  if (e.kind("rn") && e.kind("itn"))
    for (std::size_t p = 0; p < 3; ++p) {
      const Estimate r = ratio_of(test, "itn", "rn", p);
      const double paper = paper_ratio(paper_testing, p);
      claims.push_back(below(
          fmt::format("ITN's error of {} on the test images is below RN's (paper: {:.2f})", parameter_names[p], paper),
          r, 1));
      claims.push_back(below(fmt::format("... and the ratio is at most the paper's {:.2f}", paper), r, paper));
    }
  if (e.kind("itn") && e.kind("ssn"))
    for (std::size_t p = 0; p < 3; ++p)
      claims.push_back(below(fmt::format("ITN's error of {} on the test images is below SSN's (paper: {:.2f})",
                                         parameter_names[p], paper_testing.at("itn")[p] / paper_testing.at("ssn")[p]),
                             ratio_of(test, "itn", "ssn", p), 1));
  for (const Kind& kind : e.kinds)
    for (std::size_t p = 0; p < 3; ++p)
      claims.push_back(below(fmt::format("{}'s error of {} on the test images is below the constant guess's",
                                         kind.title(), parameter_names[p]),
                             ratio_of(test, kind.name.c_str(), "constant", p), 1));
  if (e.kind("rn") && e.kind("itn"))
    for (std::size_t p = 0; p < 3; ++p)
      claims.push_back(below(fmt::format("RN's error of {} on the training images is below ITN's (paper: {:.2f})",
                                         parameter_names[p], 1 / paper_ratio(paper_training, p)),
                             ratio_of(*e.errors_of("training"), "rn", "itn", p), 1));
}

void add_appearance(const Evaluation& e, std::vector<Claim>& claims) {
  constexpr std::array<const char*, 2> names{"RMSE", "1 - MS-SSIM"};
  for (const bool structure : {false, true}) {
    const std::size_t what = structure ? 1 : 0;
    const auto ratio_of = [&](const char* above, const char* under) {
      return ratio(e.appearance(above, false, structure), e.appearance(under, false, structure),
                   structure ? Average::mean : Average::root_of_mean, e.resampling);
    };
    if (e.kind("rn") && e.kind("itn")) {
      const double paper = paper_ratio(paper_testing_images, what);
      const Estimate r = ratio_of("itn", "rn");
      claims.push_back(
          below(fmt::format("{} of test images rendered with ITN's predictions is below RN's (paper: {:.2f})",
                            names[what], paper),
                r, 1));
      claims.push_back(below(fmt::format("... and the ratio is at most the paper's {:.2f}", paper), r, paper));
    }
    if (e.kind("itn") && e.kind("ssn"))
      claims.push_back(
          below(fmt::format("{} of test images rendered with ITN's predictions is below SSN's (paper: {:.2f})",
                            names[what], paper_testing_images.at("itn")[what] / paper_testing_images.at("ssn")[what]),
                ratio_of("itn", "ssn"), 1));
    if (e.kind("rn") && e.kind("ssn"))
      claims.push_back(
          below(fmt::format("{} of test images rendered with RN's predictions is below SSN's (paper: {:.2f})",
                            names[what], paper_testing_images.at("rn")[what] / paper_testing_images.at("ssn")[what]),
                ratio_of("rn", "ssn"), 1));
  }
}

constexpr std::array<const char*, 4> synthesis_names{"squared error of log sigma_t", "squared error of albedo",
                                                     "squared error of g", "image loss"};

void add_synthesis(const Evaluation& e, std::vector<Claim>& claims) {
  const SynthesisResult *rn = e.synthesis("rn"), *itn = e.synthesis("itn");
  if (!rn || !itn) return;
  for (const std::size_t what : {3U, 0U, 1U, 2U}) {
    const auto last = [&](const SynthesisResult& s) {
      std::vector<double> values = e.synthesis_errors(s.records.back(), what);
      for (double& v : values) v = std::max(0.0, v);  // a loss below 0 is 0 and noise
      return values;
    };
    const double paper = paper_synthesis.at("itn")[what].back() / paper_synthesis.at("rn")[what].back();
    const Estimate r = ratio_of_medians(last(*itn), last(*rn), e.resampling);
    const int reached = iterations_to_reach(e, what);
    const std::string when = reached < 0 ? "ITN's starts never get there"
                                         : fmt::format("ITN's starts are there after {} of {}", std::max(1, reached),
                                                       e.synthesis_options.iterations);
    claims.push_back(below(
        fmt::format("The median {} after {} iterations from ITN's starts is below that from RN's (paper: {:.2f}; {})",
                    synthesis_names[what], e.synthesis_options.iterations, paper, when),
        r, 1));
    if (what < 3) claims.push_back(below("... and is at most half of it", r, 0.5));
  }
}

}  // namespace

std::string verdict_words(Claim::Verdict verdict) {
  return verdict == Claim::Verdict::holds   ? "holds"
         : verdict == Claim::Verdict::fails ? "does not hold"
                                            : "cannot be told at this size";
}

int iterations_to_reach(const Evaluation& e, std::size_t what) {
  const SynthesisResult *rn = e.synthesis("rn"), *itn = e.synthesis("itn");
  const double end = median(e.synthesis_errors(rn->records.back(), what));
  for (const Synthesis::Record& record : itn->records)
    if (median(e.synthesis_errors(record, what)) <= end) return record.iteration;
  return -1;
}

std::vector<Claim> claims_of(const Evaluation& e) {
  std::vector<Claim> claims;
  add_parameters(e, claims);
  if (!e.rerendered.empty()) add_appearance(e, claims);
  if (!e.syntheses.empty()) add_synthesis(e, claims);
  return claims;
}

}  // namespace itn
