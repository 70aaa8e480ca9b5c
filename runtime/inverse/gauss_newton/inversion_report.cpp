#include "runtime/inverse/gauss_newton/inversion_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "itn/exr.h"
#include "itn/file.h"
#include "runtime/image/png.h"
#include "runtime/image/preview.h"
#include "runtime/report/html.h"

namespace itn {
namespace {

// The model of target t (camera's factors times rendered image), its standard error, and what is left of the target.
struct Residual {
  std::vector<float> model, error, residual;  // as TargetImage::value
  std::vector<float> relative;                // residual over the standard deviation of its noise
};

Residual residual_of(const Inversion::Conclusion& end, std::size_t t, const TargetImage& target) {
  const Rendering& image = end.images[t];
  Residual r;
  for (std::size_t i = 0; i < target.value.size(); ++i) {
    const double model =
        end.factors[t][i % static_cast<std::size_t>(target.channels)] * static_cast<double>(image.mean[i]);
    const double variance = end.references[t].noise.sample[i] / image.spp;
    const bool compared = target.weight[i / static_cast<std::size_t>(target.channels)] > 0;
    const double left = compared ? model - static_cast<double>(target.value[i]) : 0;
    r.model.push_back(static_cast<float>(model));
    r.error.push_back(static_cast<float>(std::sqrt(variance)));
    r.residual.push_back(static_cast<float>(left));
    r.relative.push_back(static_cast<float>(end.white[t].value[i]));
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
  return {i.name, fmt::format("{:.5g}", i.value), fmt::format("{:.5g} to {:.5g}{}", i.low, i.high, mark(i)),
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

void write_inversion(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates,
                     const std::vector<TargetImage>& targets) {
  if (!is_writing()) return;  // another rank does
  const Inversion::Conclusion& end = outcome.found().end;
  const std::string folder = outcome.question.folder + "/";
  std::string pictures;
  for (std::size_t t = 0; t < targets.size(); ++t) {
    const Residual r = residual_of(end, t, targets[t]);
    const std::string number = targets.size() == 1 ? "" : "_" + std::to_string(t);
    write_images(folder + "rerender" + number + ".exr", r, targets[t]);
    const auto picture = [&](const std::string& name, const std::vector<std::uint8_t>& bytes,
                             const std::string& caption) {
      const std::string path = folder + name + number + ".png";
      write_png(path, targets[t].width, targets[t].height, bytes);
      pictures += html_picture(read_file(path), caption);
    };
    picture("target", tone_mapped(targets[t].value, targets[t].channels), outcome.question.targets[t]);
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
  body += fmt::format("<p>{} with {}, {:.1f} s.</p>\n", html_escape(outcome.question.scene), outcome.question.method,
                      outcome.seconds);
  write_file(folder + "report.html", html_page("Inversion of " + outcome.question.scene, body));
  write_file(folder + "result.json", to_json(outcome, coordinates).dump(1) + "\n");
}

}  // namespace itn
