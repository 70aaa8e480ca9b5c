// Pages show what they are told, whatever characters and numbers it is made of.
#include "runtime/report/html.h"

#include <catch2/catch.hpp>
#include <limits>

using namespace itn;
using Catch::Contains;

namespace {

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

}  // namespace

TEST_CASE("text of users is no markup: titles, cells, captions, names of series") {
  const std::string wild = "<b>\"a\" & b</b>", tame = "&lt;b&gt;&quot;a&quot; &amp; b&lt;/b&gt;";
  const Plot plot{wild, wild, {{wild, {0, 1}, {0, 1}}, {wild, {0, 1}, {1, 0}}}};
  for (const std::string& html :
       {html_page(wild, ""), html_table({{wild}, {wild}}), html_picture("", wild), svg_plot(plot)}) {
    CHECK_THAT(html, Contains(tame));
    CHECK(html.find("<b>") == std::string::npos);
  }
}

TEST_CASE("a picture's bytes stand in the page as base64") {
  CHECK_THAT(html_picture("Man", ""), Contains("base64,TWFu\""));
  CHECK_THAT(html_picture("Ma", ""), Contains("base64,TWE=\""));
  CHECK_THAT(html_picture(std::string("\xff\x00\xfe\x01", 4), ""), Contains("base64,/wD+AQ==\""));
}

TEST_CASE("a plot leaves out what an axis cannot show, and shows all else inside of itself") {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  const Series points{"", {0, 1, 2, 3, 4}, {10, 0, -1, infinite, 1000}, true};
  CHECK(count(svg_plot({"", "", {points}, false}), "<circle") == 4);
  const std::string logarithmic = svg_plot({"", "", {points}, true});
  CHECK(count(logarithmic, "<circle") == 2);
  for (const char* tick : {">10<", ">100<", ">1000<"}) CHECK_THAT(logarithmic, Contains(tick));
  CHECK_THAT(logarithmic, !Contains("nan") && !Contains("inf"));
  CHECK_THAT(svg_plot({"", "", {}}), !Contains("nan") && !Contains("inf"));
}
