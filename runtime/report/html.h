// Reports for people: one HTML file with everything in it, pictures and plots included.
#pragma once
#include <string>
#include <vector>

namespace itn {

std::string html_escape(const std::string& text);

// A whole page; body is HTML already.
std::string html_page(const std::string& title, const std::string& body);

// First row: headings. Cells are text, not HTML; all but the first column are set to the right.
std::string html_table(const std::vector<std::vector<std::string>>& rows);

// A PNG file's bytes as a picture with a caption, enlarged without smoothing. wide: a row of the page for itself.
std::string html_picture(const std::string& png, const std::string& caption, bool wide = false);

struct Series {
  std::string name;
  std::vector<double> x, y;
  bool scattered = false;  // points without a line
};

struct Plot {
  std::string title, x_label;
  std::vector<Series> series;
  bool log_y = false;                  // values of 0 and below are left out
  double band_low = 0, band_high = 0;  // a shaded band of y; none where they are equal
};

// An SVG picture to stand in a page.
std::string svg_plot(const Plot& plot);

}  // namespace itn
