#include "runtime/report/corner_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/report/html.h"

namespace itn {
namespace {

constexpr double cell = 130, gap = 12, left = 70, bottom = 46;
constexpr std::size_t most_points = 800;
constexpr std::size_t bins = 24;

struct Range {
  double low, high;
  // In [0, 1].
  double at(double v) const { return std::clamp((v - low) / (high - low), 0.0, 1.0); }
};

Range range_of(const std::vector<double>& samples) {
  const auto [low, high] = std::minmax_element(samples.begin(), samples.end());
  const double margin = *high > *low ? 0.03 * (*high - *low) : std::max(1e-12, 0.01 * std::fabs(*low));
  return {*low - margin, *high + margin};
}

std::string histogram(const CornerNumber& number, const Range& range, double x, double y) {
  std::vector<double> count(bins, 0);
  for (const double v : number.samples) count[std::min(bins - 1, static_cast<std::size_t>(range.at(v) * bins))] += 1;
  const double most = *std::max_element(count.begin(), count.end());
  const double from = x + cell * range.at(number.low), to = x + cell * range.at(number.high);
  std::string svg =
      fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{}\" fill=\"#1f6fb4\" opacity=\".15\"/>\n",
                  from, y, std::max(1.0, to - from), cell);
  for (std::size_t b = 0; b < bins; ++b) {
    const double height = 0.9 * cell * count[b] / most;
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#1f6fb4\"/>\n",
                       x + cell * static_cast<double>(b) / bins, y + cell - height, cell / bins - 0.5, height);
  }
  return svg;
}

}  // namespace

std::string corner_plot(const std::vector<CornerNumber>& numbers) {
  const auto count = static_cast<double>(numbers.size());
  const double width = left + count * (cell + gap), height = count * (cell + gap) + bottom;
  std::string svg = fmt::format(
      "<svg width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" font-size=\"10\" "
      "role=\"img\" "
      "aria-label=\"samples of the posterior\">\n",
      width, height);
  std::vector<Range> ranges;
  ranges.reserve(numbers.size());
  for (const CornerNumber& number : numbers) ranges.push_back(range_of(number.samples));
  for (std::size_t row = 0; row < numbers.size(); ++row)
    for (std::size_t column = 0; column <= row; ++column) {
      const double x = left + static_cast<double>(column) * (cell + gap), y = static_cast<double>(row) * (cell + gap);
      svg += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#bbb\"/>\n", x, y,
                         cell, cell);
      if (row == column) {
        svg += histogram(numbers[row], ranges[row], x, y);
      } else {
        const std::vector<double>&a = numbers[column].samples, &b = numbers[row].samples;
        const std::size_t step = std::max<std::size_t>(1, a.size() / most_points);
        for (std::size_t s = 0; s < a.size(); s += step)
          svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"1\" fill=\"#1f6fb4\" opacity=\".4\"/>\n",
                             x + cell * ranges[column].at(a[s]), y + cell * (1 - ranges[row].at(b[s])));
      }
      if (row + 1 == numbers.size()) {
        svg += fmt::format(
            "<text x=\"{}\" y=\"{}\">{:.3g}</text><text x=\"{}\" y=\"{}\" text-anchor=\"end\">{:.3g}</text>\n", x,
            y + cell + 13, ranges[column].low, x + cell, y + cell + 13, ranges[column].high);
        svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" font-size=\"11\">{}</text>\n", x + cell / 2,
                           y + cell + 28, html_escape(numbers[column].name));
      }
      if (column == 0 && row > 0)
        svg += fmt::format(
            "<text x=\"{0}\" y=\"{1}\" text-anchor=\"end\">{2:.3g}</text><text x=\"{0}\" y=\"{3}\" "
            "text-anchor=\"end\">{4:.3g}</text>"
            "<text transform=\"translate(12 {5}) rotate(-90)\" text-anchor=\"middle\" font-size=\"11\">{6}</text>\n",
            left - 4, y + 10, ranges[row].high, y + cell, ranges[row].low, y + cell / 2,
            html_escape(numbers[row].name));
    }
  return svg + "</svg>\n";
}

}  // namespace itn
