#include "network/evaluation/report.h"

#include <fmt/format.h>

#include <algorithm>

#include "itn/file.h"
#include "network/evaluation/claims.h"
#include "network/evaluation/tables.h"
#include "runtime/base/statistics.h"
#include "runtime/image/png.h"
#include "runtime/image/preview.h"
#include "runtime/report/html.h"

namespace itn {
namespace {

constexpr std::size_t most_points = 300;  // of a scatter plot's series

std::string claims_html(const std::vector<Claim>& claims) {
  std::string html =
      "<h2>What holds here</h2>\n<p>A claim <em>holds</em> where the whole 95 % interval of the ratio says so, and "
      "<em>does not hold</em> where the whole interval says the opposite. It is about the networks at hand: other "
      "trainings, data sets and sizes may give others.</p>\n<ul>\n";
  for (const Claim& c : claims)
    html += fmt::format("<li>{}: <b{}>{}</b>.</li>\n", html_escape(c.text),
                        c.verdict == Claim::Verdict::holds   ? " class=\"good\""
                        : c.verdict == Claim::Verdict::fails ? " class=\"bad\""
                                                             : "",
                        verdict_words(c.verdict));
  return html + "</ul>\n";
}

// Predicted against true, a plot a parameter and kind (its first run), a series a test split.
std::string scatter_plots(const Evaluation& e) {
  std::string html =
      "<h2>Predicted against true</h2>\n<p>Test images; of each kind the first run. The line is the truth.</p>\n";
  for (const Kind& kind : e.kinds)
    for (std::size_t p = 0; p < 3; ++p) {
      Plot plot{kind.title() + ": " + parameter_names[p], "true", {}};
      Series line{"truth", {}, {}};
      for (const SplitPredictions& split : e.splits) {
        if (split.split == Manifest::Split::train) continue;
        Series points{split_name(split.split), {}, {}, true};
        const std::size_t step = std::max<std::size_t>(1, split.images.size() / most_points);
        for (std::size_t i = 0; i < split.images.size(); i += step) {
          const Manifest::Image& image = split.images[i];
          points.x.push_back(std::array{image.sigma_t, image.albedo, image.g}[p]);
          points.y.push_back(as_array(split.predicted[kind.runs.front()][i])[p]);
        }
        for (const double x : points.x) line.x.push_back(x);
        plot.series.push_back(std::move(points));
      }
      const auto [least, most] = std::minmax_element(line.x.begin(), line.x.end());
      line.x = line.y = {*least, *most};
      plot.series.push_back(std::move(line));
      html += svg_plot(plot);
    }
  return html;
}

std::string learning_curves(const Evaluation& e) {
  std::string html;
  for (const auto& [key, title] : {std::pair{"validation", "validation loss (supervised)"},
                                   {"supervised", "training loss, supervised part"},
                                   {"image", "training loss, image part"}}) {
    Plot plot{title, "epoch", {}, true};
    for (const EvaluatedRun& run : e.runs) {
      Series s{run.kind + " " + run.path, {}, {}};
      for (const nlohmann::json& point : run.curve)
        if (point.contains(key)) {
          s.x.push_back(point.at("epoch").get<double>());
          s.y.push_back(point.at(key).get<double>());
        }
      if (!s.x.empty()) plot.series.push_back(std::move(s));
    }
    if (!plot.series.empty()) html += svg_plot(plot);
  }
  return html.empty() ? "" : "<h2>Learning curves</h2>\n" + html;
}

// Above: the input and what each kind's first run makes of it, in one exposure. Below: rendered minus input.
std::string picture(const std::string& folder, const Evaluation& e, const RerenderedResult& r) {
  const auto size = static_cast<std::size_t>(e.set.size), columns = e.kinds.size() + 1, rows = std::size_t{2};
  const std::vector<float>& input = r.target.input.value;
  std::vector<float> images = input, differences;
  for (const Kind& kind : e.kinds) {
    const std::vector<float>& image = r.image[kind.runs.front()];
    images.insert(images.end(), image.begin(), image.end());
    for (std::size_t i = 0; i < image.size(); ++i) differences.push_back(image[i] - input[i]);
  }
  const std::vector<std::uint8_t> toned = tone_mapped(images, 1);
  const SignedPicture coloured = red_blue(differences, 1);
  std::vector<std::uint8_t> bytes(rows * columns * size * size * 3, 255);
  const auto paste = [&](const std::vector<std::uint8_t>& from, std::size_t tile, std::size_t row, std::size_t column) {
    for (std::size_t y = 0; y < size; ++y)
      std::copy_n(from.begin() + static_cast<std::ptrdiff_t>((tile * size + y) * size * 3), size * 3,
                  bytes.begin() + static_cast<std::ptrdiff_t>((((row * size + y) * columns) + column) * size * 3));
  };
  for (std::size_t c = 0; c < columns; ++c) paste(toned, c, 0, c);
  for (std::size_t k = 0; k < e.kinds.size(); ++k) paste(coloured.bytes, k, 1, k + 1);
  std::string name = r.target.image.file;
  std::replace(name.begin(), name.end(), '/', '_');
  const std::string path = folder + "/" + name + ".png";
  write_png(path, static_cast<int>(columns * size), static_cast<int>(rows * size), bytes);
  const Manifest::Image& image = r.target.image;
  std::string caption =
      fmt::format("{} ({}, {}), sigma_t {:.0f}, albedo {:.2f}, g {:.2f}. From the left: the input", image.file,
                  split_name(image.split), e.set.shapes[static_cast<std::size_t>(image.shape)].name, image.sigma_t,
                  image.albedo, image.g);
  for (const Kind& kind : e.kinds) {
    const DatasetMaterial& m = r.predicted[kind.runs.front()];
    caption += fmt::format("; {} (sigma_t {:.0f}, albedo {:.2f}, g {:.2f})", kind.title(), m.sigma_t, m.albedo, m.g);
  }
  caption += fmt::format(". Below: rendered minus input, red {0:.2g}, blue -{0:.2g}", coloured.scale);
  return html_picture(read_file(path), caption, true);
}

std::string pictures(const std::string& folder, const Evaluation& e) {
  std::string html;
  for (const RerenderedResult& r : e.rerendered)
    if (!r.image.empty()) html += picture(folder, e, r);
  return html.empty() ? "" : "<h2>Test images and their re-renderings</h2>\n" + html;
}

std::string convergence(const Evaluation& e) {
  std::string html = "<h2>Analysis by synthesis</h2>\n";
  constexpr std::array<const char*, 4> names{"squared error of log sigma_t", "squared error of albedo",
                                             "squared error of g", "image loss, without noise"};
  for (const std::size_t what : {3U, 0U, 1U, 2U}) {
    Plot plot{std::string("median ") + names[what], "iteration", {}, true};
    for (const SynthesisResult& s : e.syntheses) {
      Series series{s.start, {}, {}};
      for (const Synthesis::Record& record : s.records) {
        series.x.push_back(record.iteration);
        series.y.push_back(median(e.synthesis_errors(record, what)));
      }
      plot.series.push_back(std::move(series));
    }
    html += svg_plot(plot);
  }
  return html;
}

std::string html_of(const ReportTable& table) {
  std::string html = "<h3>" + html_escape(table.title) + "</h3>\n" + html_table(table.rows);
  for (const std::string& note : table.notes) html += "<p>" + html_escape(note) + "</p>\n";
  return html;
}

}  // namespace

void write_evaluation(const std::string& folder, const Evaluation& e) {
  if (!is_writing()) return;  // another rank does
  std::string body = fmt::format("<p>Data set {} ({} images of {} × {} pixels, {} samples each). Runs:</p>\n<ul>\n",
                                 html_escape(e.folder), e.set.images.size(), e.set.size, e.set.size, e.set.spp);
  for (const EvaluatedRun& run : e.runs) {
    body += fmt::format("<li>{}: {}", run.kind, html_escape(run.path));
    for (const std::string& text : run.warnings) body += "; <b>" + html_escape(text) + "</b>";
    body += "</li>\n";
  }
  body += "</ul>\n<h2>Tables</h2>\n";
  for (const ReportTable& table : tables_of(e)) body += html_of(table);
  if (!e.syntheses.empty()) body += convergence(e);
  body += scatter_plots(e) + learning_curves(e) + pictures(folder, e) + claims_html(claims_of(e));
  body += fmt::format("<p>{:.0f} s.</p>\n", e.seconds);
  write_file(folder + "/result.json", to_json(e).dump(1) + "\n");
  write_file(folder + "/report.html", html_page("Evaluation on " + e.folder, body));
}

}  // namespace itn
