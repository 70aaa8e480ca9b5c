#include "runtime/report/html.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace itn {
namespace {

constexpr std::array<const char*, 6> colours{"#1f6fb4", "#d1622b", "#2f8f4e", "#8456a5", "#b23a48", "#6b6b6b"};
constexpr double width = 420, height = 240, left = 62, right = 12, top = 30, bottom = 34;

std::string base64(const std::string& bytes) {
  constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8 | (k < count ? static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[i + k])) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? digits[word >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

// From numbers to positions along an axis.
struct Axis {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  bool logarithmic = false;

  double scaled(double v) const { return logarithmic ? std::log10(v) : v; }
  bool shows(double v) const { return std::isfinite(v) && (!logarithmic || v > 0); }
  void include(double v) {
    if (!shows(v)) return;
    low = std::min(low, scaled(v));
    high = std::max(high, scaled(v));
  }
  void finish() {
    if (!(low <= high)) low = 0, high = 1;
    const double room = high > low ? 0.04 * (high - low) : std::max(1e-12, 0.1 * std::fabs(high));
    low -= room;
    high += room;
  }
  double at(double v) const { return (scaled(v) - low) / (high - low); }
  // Round numbers, 3 to 7 of them; of a logarithmic axis powers of ten, or 1, 2 and 5 times them.
  std::vector<double> ticks() const {
    std::vector<double> result;
    if (logarithmic && high - low >= 0.5) {
      const double step = std::ceil((high - low) / 6);
      for (double t = std::floor(low); t <= high; t += step)
        for (const double digit : {1.0, 2.0, 5.0})
          if ((digit == 1 || high - low < 2) && std::log10(digit) + t >= low && std::log10(digit) + t <= high)
            result.push_back(digit * std::pow(10, t));
      return result;
    }
    const double from = logarithmic ? std::pow(10, low) : low, to = logarithmic ? std::pow(10, high) : high;
    const double rough = (to - from) / 5, power = std::pow(10, std::floor(std::log10(rough)));
    const double step = (rough / power > 5 ? 10 : rough / power > 2 ? 5 : rough / power > 1 ? 2 : 1) * power;
    for (double k = std::ceil(from / step); k * step <= to; ++k) result.push_back(k == 0 ? 0 : k * step);  // not -0
    return result;
  }
};

}  // namespace

std::string html_escape(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

std::string html_page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title>\n<style>\n"
      "body {{ font: 15px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; "
      "color: #222; background: #fff }}\n"
      "table {{ border-collapse: collapse; margin: 1rem 0 }}\n"
      "th, td {{ padding: .2rem .8rem; border-bottom: 1px solid #ddd; text-align: right }}\n"
      "th:first-child, td:first-child {{ text-align: left }}\n"
      "figure {{ display: inline-block; margin: .5rem 1rem .5rem 0; vertical-align: top }}\n"
      "figure img {{ width: 18rem; image-rendering: pixelated; border: 1px solid #ddd }}\n"
      "figcaption {{ max-width: 18rem; color: #555; font-size: 13px }}\n"
      "figure.wide img {{ width: 40rem }} figure.wide figcaption {{ max-width: 40rem }}\n"
      ".good {{ color: #1b7a37 }} .bad {{ color: #b3261e }}\n"
      "</style></head>\n<body>\n<h1>{0}</h1>\n{1}</body></html>\n",
      html_escape(title), body);
}

std::string html_table(const std::vector<std::vector<std::string>>& rows) {
  std::string text = "<table>\n";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    text += "<tr>";
    for (const std::string& cell : rows[r])
      text += fmt::format("<{0}>{1}</{0}>", r == 0 ? "th" : "td", html_escape(cell));
    text += "</tr>\n";
  }
  return text + "</table>\n";
}

std::string html_picture(const std::string& png, const std::string& caption, bool wide) {
  const std::string words = html_escape(caption);
  return fmt::format(
      "<figure{}><img src=\"data:image/png;base64,{}\" alt=\"{}\"><figcaption>{}</figcaption></figure>\n",
      wide ? " class=\"wide\"" : "", base64(png), words, words);
}

std::string svg_plot(const Plot& plot) {
  Axis x, y;
  y.logarithmic = plot.log_y;
  for (const Series& s : plot.series) {
    for (const double v : s.x) x.include(v);
    for (const double v : s.y) y.include(v);
  }
  if (plot.band_low < plot.band_high) {
    y.include(plot.band_low);
    y.include(plot.band_high);
  }
  x.finish();
  y.finish();
  const auto px = [&](double v) { return left + x.at(v) * (width - left - right); };
  const auto py = [&](double v) { return height - bottom - y.at(v) * (height - top - bottom); };

  std::string svg = fmt::format(
      "<svg width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" font-size=\"11\" "
      "role=\"img\" aria-label=\"{2}\">\n<text x=\"{3}\" y=\"16\" font-size=\"13\">{2}</text>\n",
      width, height, html_escape(plot.title), left);
  if (plot.band_low < plot.band_high)
    svg += fmt::format(
        "<rect x=\"{}\" y=\"{:.1f}\" width=\"{}\" height=\"{:.1f}\" fill=\"#1f6fb4\" opacity=\".15\"/>\n", left,
        py(plot.band_high), width - left - right, std::max(1.0, py(plot.band_low) - py(plot.band_high)));
  for (const double t : y.ticks())
    svg += fmt::format(
        "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\" stroke=\"#ddd\"/>"
        "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:.4g}</text>\n",
        left, width - right, py(t), left - 6, py(t) + 4, t);
  for (const double t : x.ticks())
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:.4g}</text>\n", px(t),
                       height - bottom + 15, t);
  svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"end\" fill=\"#555\">{}</text>\n", width - right, height - 4,
                     html_escape(plot.x_label));
  for (std::size_t k = 0; k < plot.series.size(); ++k) {
    const Series& s = plot.series[k];
    const char* colour = colours[k % colours.size()];
    std::string points;
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (!y.shows(s.y[i]) || !x.shows(s.x[i])) continue;
      points += fmt::format("{:.1f},{:.1f} ", px(s.x[i]), py(s.y[i]));
      if (s.scattered || s.x.size() <= 60)
        svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\"/>\n", px(s.x[i]), py(s.y[i]),
                           s.scattered ? 1.5 : 2.2, colour);
    }
    if (!s.scattered)
      svg +=
          fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>\n", points, colour);
    if (plot.series.size() > 1)
      svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"end\" fill=\"{}\">{}</text>\n", width - right - 4,
                         top + 12 + 13 * static_cast<double>(k), colour, html_escape(s.name));
  }
  return svg + "</svg>\n";
}

}  // namespace itn
