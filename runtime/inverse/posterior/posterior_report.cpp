// What --method posterior leaves in its folder.
#include <fmt/format.h>

#include <utility>

#include "itn/exr.h"
#include "itn/file.h"
#include "runtime/image/png.h"
#include "runtime/image/preview.h"
#include "runtime/inverse/posterior/posterior_outcome.h"
#include "runtime/report/corner_plot.h"
#include "runtime/report/html.h"

namespace itn {
namespace {

std::string samples_table(const PosteriorOutcome& outcome) {
  std::string text;
  for (const std::string& name : outcome.names) text += name + ",";
  text += "log_density,peak,holds\n";  // holds: 0 where the intervals do not
  for (std::size_t s = 0; s < outcome.log_density.size(); ++s) {
    for (const auto& values : outcome.samples) text += fmt::format("{:.9g},", values[s]);
    text += fmt::format("{:.6g},{},{:d}\n", outcome.log_density[s], outcome.peak_of[s], outcome.intervals_hold());
  }
  return text;
}

// Images and pictures of one target; returns the pictures for the page.
std::string images(const PosteriorOutcome& outcome, std::size_t t, const TargetImage& target,
                   const std::string& number) {
  const Rendering& image = outcome.images[t];
  const auto channels = static_cast<std::size_t>(target.channels);
  std::vector<float> residual, relative;
  for (std::size_t i = 0; i < target.value.size(); ++i) {
    const bool compared = target.weight[i / channels] > 0;
    const double left = compared ? static_cast<double>(image.mean[i]) - static_cast<double>(target.value[i]) : 0;
    residual.push_back(static_cast<float>(left));
    relative.push_back(static_cast<float>(outcome.white[t].value[i]));
  }
  const std::vector<std::string> letters =
      channels == 1 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"};
  ExrImage exr{target.width, target.height, {}, {}, {}};
  for (const char* prefix : {"", "stderr.", "residual."})
    for (const std::string& letter : letters) exr.channels.push_back(prefix + letter);
  for (std::size_t pixel = 0; pixel < target.weight.size(); ++pixel)
    for (const std::vector<float>* data : {&image.mean, &image.stderr_, &std::as_const(residual)})
      for (std::size_t c = 0; c < channels; ++c) exr.data.push_back((*data)[pixel * channels + c]);
  const std::string folder = outcome.question.folder + "/";
  write_exr(folder + "rerender" + number + ".exr", exr);
  std::string pictures;
  const auto picture = [&](const std::string& name, const std::vector<std::uint8_t>& bytes,
                           const std::string& caption) {
    const std::string path = folder + name + number + ".png";
    write_png(path, target.width, target.height, bytes);
    pictures += html_picture(read_file(path), caption);
  };
  picture("target", tone_mapped(target.value, target.channels), outcome.question.targets[t]);
  picture("rerender", tone_mapped(image.mean, target.channels), "rendered with the likeliest sample");
  const SignedPicture left = red_blue(relative, target.channels);
  picture("residual", left.bytes,
          fmt::format("rendered minus target, in standard deviations of the noise: blue -{0:.2g}, red {0:.2g}",
                      left.scale));
  return pictures;
}

std::vector<std::string> row(const Interval& i) {
  return {i.name, fmt::format("{:.5g}", i.value), fmt::format("{:.5g} to {:.5g}{}", i.low, i.high, mark(i)),
          fmt::format("{:.3g}", i.stderr_)};
}

std::string correlations(const PosteriorOutcome& outcome) {
  std::vector<std::vector<std::string>> rows{{"correlation"}};
  for (const Interval& i : outcome.parameters) rows[0].push_back(i.name);
  for (std::size_t p = 0; p < outcome.parameters.size(); ++p) {
    rows.push_back({outcome.parameters[p].name});
    for (std::size_t q = 0; q < outcome.parameters.size(); ++q)
      rows.back().push_back(
          fmt::format("{:.2f}", outcome.correlation(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(q))));
  }
  return html_table(rows);
}

std::string rounds(const PosteriorOutcome& outcome) {
  std::vector<std::vector<std::string>> rows{
      {"round", "renderings", "used", "means moved [deviations]", "emulator's share", "leave-one-out", "residual"}};
  for (std::size_t k = 0; k < outcome.rounds.size(); ++k) {
    const PosteriorRound& r = outcome.rounds[k];
    rows.push_back({std::to_string(k), std::to_string(r.exemplars), std::to_string(r.local),
                    k == 0 ? "" : fmt::format("{:.2f}", r.shift), fmt::format("{:.0f} %", 100 * r.emulator_share),
                    fmt::format("{:.2f}", r.leave_one_out), fmt::format("{:.2f}", r.residual)});
  }
  return html_table(rows);
}

}  // namespace

void write_posterior(const PosteriorOutcome& outcome, const std::vector<Coordinate>& coordinates,
                     const std::vector<TargetImage>& targets) {
  std::string pictures;
  for (std::size_t t = 0; t < targets.size(); ++t)
    pictures += images(outcome, t, targets[t], targets.size() == 1 ? "" : "_" + std::to_string(t));
  std::string body;
  for (const std::string& sentence : verdict(outcome))
    body += fmt::format("<p{}>{}</p>\n", sentence.starts_with("NOT") ? " class=\"bad\"" : "", html_escape(sentence));
  std::vector<std::vector<std::string>> rows{{"parameter", "mean", "95 % interval", "standard deviation"}};
  for (const auto* of : {&outcome.parameters, &outcome.coefficients, &outcome.exposures})
    for (const Interval& i : *of) rows.push_back(row(i));
  body += html_table(rows);
  std::vector<CornerNumber> numbers;
  for (std::size_t p = 0; p < outcome.parameters.size(); ++p)
    numbers.push_back({outcome.names[p], outcome.samples[p], outcome.parameters[p].low, outcome.parameters[p].high});
  body += "<h2>The posterior</h2>\n" + corner_plot(numbers) +
          fmt::format("<p>{} samples (samples.csv); shaded: 95 %.</p>\n", outcome.log_density.size()) +
          correlations(outcome);
  body += "<h2>What the images tell apart</h2>\n<ul>\n";
  for (const std::string& sentence : ambiguity_words(outcome, coordinates))
    body += "<li>" + html_escape(sentence) + "</li>\n";
  body += "</ul>\n<h2>Images</h2>\n" + pictures + "<h2>Rounds</h2>\n" + rounds(outcome);
  body += fmt::format("<p>{}, {:.1f} s.</p>\n", html_escape(outcome.question.scene), outcome.seconds);
  const std::string folder = outcome.question.folder + "/";
  write_file(folder + "samples.csv", samples_table(outcome));
  write_file(folder + "report.html", html_page("Posterior of " + outcome.question.scene, body));
  write_file(folder + "result.json", to_json(outcome, coordinates).dump(1) + "\n");
}

}  // namespace itn
