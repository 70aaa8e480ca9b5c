#include "tools/invert_report.h"

#include <fmt/format.h>

#include <cmath>

#include "runtime/image/exr.h"
#include "runtime/image/file.h"
#include "runtime/image/png.h"
#include "runtime/image/preview.h"
#include "tools/html.h"

namespace itn::tools {
namespace {

// The model of target t (exposure times rendered image), its standard error, and what is left of the target.
struct Residual {
  std::vector<float> model, error, residual;  // as TargetImage::value
  std::vector<float> relative;                // residual over the standard deviation of its noise
};

Residual residual_of(const Inversion::Conclusion& end, std::size_t t, std::size_t parameters,
                     const TargetImage& target) {
  const double exposure = end.x.size() > parameters ? std::exp(end.x[parameters + t]) : 1;
  const Rendering& image = end.images[t];
  Residual r;
  for (std::size_t i = 0; i < target.value.size(); ++i) {
    const double model = exposure * static_cast<double>(image.mean[i]);
    const double variance = end.references[t].sample[i] / image.spp;
    const bool compared = target.weight[i / static_cast<std::size_t>(target.channels)] > 0;
    const double left = compared ? model - static_cast<double>(target.value[i]) : 0;
    const double all = variance + end.references[t].target[i];
    r.model.push_back(static_cast<float>(model));
    r.error.push_back(static_cast<float>(std::sqrt(variance)));
    r.residual.push_back(static_cast<float>(left));
    r.relative.push_back(static_cast<float>(all > 0 ? left / std::sqrt(all) : 0));
  }
  return r;
}

void write_images(const std::string& path, const Residual& r, const TargetImage& target) {
  ExrImage exr{target.width, target.height, {}, {}, {}};
  const auto channels = static_cast<std::size_t>(target.channels);
  const std::vector<std::string> letters =
      channels == 1 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"};
  for (const char* prefix : {"", "stderr.", "residual."})
    for (const std::string& letter : letters) exr.channels.push_back(prefix + letter);
  for (std::size_t pixel = 0; pixel < target.weight.size(); ++pixel)
    for (const auto* data : {&r.model, &r.error, &r.residual})
      for (std::size_t c = 0; c < channels; ++c) exr.data.push_back((*data)[pixel * channels + c]);
  write_exr(path, exr);
}

std::vector<std::string> row(const Interval& i) {
  return {i.name, fmt::format("{:.5g}", i.value), fmt::format("{:.5g} to {:.5g}", i.low, i.high),
          fmt::format("{:.2g} %", 100 * i.stderr_ / std::fabs(i.value))};
}

std::string plots(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates) {
  const InversionRun& run = outcome.found();
  std::string html;
  Plot loss{"image loss (mean squared difference)", "iteration", {}, true};
  for (std::size_t k = 0; k < outcome.runs.size(); ++k) {
    Series s{fmt::format("start {}", k), {}, {}};
    for (const InversionStep& step : outcome.runs[k].steps) {
      s.x.push_back(step.iteration);
      s.y.push_back(step.loss);
    }
    loss.series.push_back(std::move(s));
  }
  html += svg_plot(loss);
  for (std::size_t p = 0; p < coordinates.size(); ++p) {
    const Interval& interval = outcome.parameters[p];
    Plot plot{interval.name + ", band: its 95 % interval", "iteration", {}, false, interval.low, interval.high};
    for (std::size_t k = 0; k < outcome.runs.size(); ++k) {
      Series s{fmt::format("start {}", k), {}, {}};
      for (const InversionStep& step : outcome.runs[k].steps) {
        s.x.push_back(step.iteration);
        s.y.push_back(coordinates[p].value(step.x[p]));
      }
      s.x.push_back(static_cast<double>(outcome.runs[k].steps.size()));
      s.y.push_back(coordinates[p].value(outcome.runs[k].end.x[p]));
      plot.series.push_back(std::move(s));
    }
    html += svg_plot(plot);
  }
  std::string spp;
  for (const InversionStep& step : run.steps) spp += (spp.empty() ? "" : " ") + std::to_string(step.spp);
  return html + "<p>Samples a pixel: " + spp + "</p>\n";
}

}  // namespace

nlohmann::ordered_json to_json(const InversionStep& step, const std::vector<Coordinate>& coordinates) {
  nlohmann::ordered_json values = nlohmann::ordered_json::object();
  for (std::size_t p = 0; p < coordinates.size(); ++p)
    values[coordinates[p].parameter().name] = coordinates[p].value(step.x[p]);
  return {
      {"iteration", step.iteration},     {"spp", step.spp},           {"parameters", values},     {"loss", step.loss},
      {"loss_stderr", step.loss_stderr}, {"accepted", step.accepted}, {"distance", step.distance}};
}

nlohmann::ordered_json to_json(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates) {
  const auto list = [](const std::vector<Interval>& intervals) {
    nlohmann::ordered_json json = nlohmann::ordered_json::object();
    for (const Interval& i : intervals)
      json[i.name] = {{"value", i.value}, {"low", i.low}, {"high", i.high}, {"stderr", i.stderr_}};
    return json;
  };
  nlohmann::ordered_json directions = nlohmann::ordered_json::array();
  const std::vector<std::string> texts = ambiguity_words(outcome, coordinates);
  for (std::size_t k = 0; k < outcome.directions.size(); ++k) {
    nlohmann::ordered_json parts = nlohmann::ordered_json::object();
    for (std::size_t p = 0; p < coordinates.size(); ++p)
      parts[coordinates[p].parameter().name] = outcome.directions[k].part[p];
    directions.push_back(
        {{"direction", parts}, {"relative_uncertainty", outcome.directions[k].uncertainty}, {"words", texts[k]}});
  }
  nlohmann::ordered_json starts = nlohmann::ordered_json::array();
  for (const InversionRun& run : outcome.runs) {
    nlohmann::ordered_json from = nlohmann::ordered_json::object(), to = from;
    for (std::size_t p = 0; p < coordinates.size(); ++p) {
      from[coordinates[p].parameter().name] = run.start[p];
      to[coordinates[p].parameter().name] = coordinates[p].value(run.end.x[p]);
    }
    starts.push_back({{"from", from},
                      {"to", to},
                      {"loss", run.end.loss},
                      {"iterations", run.steps.size()},
                      {"converged", run.end.converged}});
  }
  const Inversion::Conclusion& end = outcome.found().end;
  return {{"schema", "itn.invert/1"},
          {"scene", outcome.scene},
          {"method", outcome.method},
          {"converged", end.converged},
          {"parameters", list(outcome.parameters)},
          {"coefficients", list(outcome.coefficients)},
          {"exposures", list(outcome.exposures)},
          {"prior", outcome.prior},
          {"ambiguity", directions},
          {"loss", end.loss},
          {"loss_stderr", end.loss_stderr},
          {"residual", end.residual},
          {"distance", end.distance},
          {"iterations", outcome.found().steps.size()},
          {"starts", starts},
          {"verdict", verdict(outcome, coordinates)},
          {"time", {{"total_s", outcome.seconds}}}};
}

std::vector<std::string> verdict(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates) {
  const Inversion::Conclusion& end = outcome.found().end;
  std::vector<std::string> text;
  text.push_back(
      end.converged ? fmt::format("Converged after {} iterations.", outcome.found().steps.size())
      : !end.determined
          ? fmt::format("NOT converged after {} iterations.", outcome.found().steps.size())
          : fmt::format("NOT converged after {} iterations: the least-squares solution is about {:.1f} standard errors "
                        "away; the intervals do not hold. Give it more iterations, or start nearer.",
                        outcome.found().steps.size(), end.distance));
  if (!end.determined)
    text.emplace_back(
        "A direction of the parameters shows so little in the images that the noise of the derivatives hides it: the "
        "intervals do not hold. Give it more samples (--spp), fewer parameters, or what is known of them beforehand "
        "(--prior).");
  else if (end.hidden)
    text.emplace_back(
        "A direction of the parameters shows so little in the images that the noise of the derivatives hides it: along "
        "it the result is what was known before. More samples (--spp) may tell more.");
  for (std::size_t p = 0; p < coordinates.size(); ++p)
    if (coordinates[p].at_edge(end.x[p]))
      text.push_back(fmt::format("{} ended on the edge of its range: its interval does not hold.",
                                 coordinates[p].parameter().name));
  if (!outcome.prior.empty())
    text.push_back(fmt::format("The result and its intervals count in what was known before (95 %): {}.",
                               fmt::join(outcome.prior, "; ")));
  const double chance = 1 + 5 * std::sqrt(2 / end.residuals);
  if (!outcome.noise_known)
    text.emplace_back(
        "The targets' noise is not known (no standard errors in the files, no --noise): 1 % of the radiance was "
        "assumed "
        "to weigh the pixels; the intervals come from what is left of the targets, so they hold if that is noise.");
  else if (end.residual > std::max(1.2, chance))
    text.push_back(fmt::format(
        "What is left of the targets has {:.3g} times the variance that their noise explains: shape, light, camera or "
        "noise are not those of the scene, and the parameters may be off by more than their intervals say.",
        end.residual));
  else
    text.push_back(
        fmt::format("What is left of the targets is their noise ({:.3g} times its variance).", end.residual));
  std::size_t same = 0;
  for (const InversionRun& run : outcome.runs) {
    bool near = run.end.converged;
    for (std::size_t p = 0; p < coordinates.size(); ++p) {
      const auto k = static_cast<Eigen::Index>(p);
      near &= std::fabs(run.end.x[p] - end.x[p]) <= 4 * std::sqrt(end.covariance(k, k) + run.end.covariance(k, k));
    }
    same += near;
  }
  if (outcome.runs.size() > 1)
    text.push_back(fmt::format("{} of {} starts end at the same parameters.", same, outcome.runs.size()));
  return text;
}

std::vector<std::string> ambiguity_words(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates) {
  std::vector<std::string> text;
  for (const Direction& direction : outcome.directions)
    text.push_back(fmt::format("known to {:.2g} % (one standard error): {} together", 100 * direction.uncertainty,
                               words(direction, coordinates)));
  return text;
}

void write_inversion(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates,
                     const std::vector<TargetImage>& targets) {
  const Inversion::Conclusion& end = outcome.found().end;
  const std::string folder = outcome.folder + "/";
  std::string pictures;
  for (std::size_t t = 0; t < targets.size(); ++t) {
    const Residual r = residual_of(end, t, coordinates.size(), targets[t]);
    const std::string number = targets.size() == 1 ? "" : "_" + std::to_string(t);
    write_images(folder + "rerender" + number + ".exr", r, targets[t]);
    const auto picture = [&](const std::string& name, const std::vector<std::uint8_t>& bytes,
                             const std::string& caption) {
      const std::string path = folder + name + number + ".png";
      write_png(path, targets[t].width, targets[t].height, bytes);
      pictures += html_picture(read_file(path), caption);
    };
    picture("target", tone_mapped(targets[t].value, targets[t].channels), outcome.targets[t]);
    picture("rerender", tone_mapped(r.model, targets[t].channels), "rendered with the parameters found");
    const SignedPicture left = red_blue(r.relative, targets[t].channels);
    picture("residual", left.bytes,
            fmt::format("rendered minus target, in standard deviations of the noise: blue -{0:.2g}, red {0:.2g}",
                        left.scale));
  }

  std::string body;
  for (const std::string& sentence : verdict(outcome, coordinates))
    body += fmt::format("<p{}>{}</p>\n", sentence.starts_with("NOT") ? " class=\"bad\"" : "", html_escape(sentence));
  std::vector<std::vector<std::string>> rows{{"parameter", "found", "95 % interval", "standard error", "start"}};
  for (std::size_t p = 0; p < coordinates.size(); ++p) {
    rows.push_back(row(outcome.parameters[p]));
    rows.back().push_back(fmt::format("{:.5g}", outcome.found().start[p]));
  }
  body += html_table(rows);
  if (!outcome.coefficients.empty() || !outcome.exposures.empty()) {
    rows = {{"what follows", "value", "95 % interval", "standard error"}};
    for (const Interval& i : outcome.coefficients) rows.push_back(row(i));
    for (const Interval& i : outcome.exposures) rows.push_back(row(i));
    body += html_table(rows);
  }
  body += "<h2>What the images tell apart</h2>\n<ul>\n";
  for (const std::string& sentence : ambiguity_words(outcome, coordinates))
    body += "<li>" + html_escape(sentence) + "</li>\n";
  body += "</ul>\n<h2>Images</h2>\n" + pictures + "<h2>Convergence</h2>\n" + plots(outcome, coordinates);
  body += fmt::format("<p>{} with {}, {:.1f} s.</p>\n", html_escape(outcome.scene), outcome.method, outcome.seconds);
  write_file(folder + "report.html", html_page("Inversion of " + outcome.scene, body));
  write_file(folder + "result.json", to_json(outcome, coordinates).dump(1) + "\n");
}

}  // namespace itn::tools
