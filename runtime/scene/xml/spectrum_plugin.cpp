// <spectrum type="...">, <texture type="..."> of a spectrum, and <volume type="constvolume">.
#include <fmt/core.h>

#include <algorithm>

#include "runtime/scene/xml/cie.h"
#include "runtime/scene/xml/plugins.h"
#include "runtime/scene/xml/properties.h"
#include "runtime/scene/xml/spectrum.h"
#include "runtime/scene/xml/values.h"

namespace itn {

std::vector<std::string> spectrum_types() {
  return {"uniform", "srgb", "d65", "regular", "irregular", "rawconstant", "blackbody", "constvolume"};
}

namespace {

struct Range {
  double shortest, longest;  // [nm]
};

Range wavelengths(Properties& properties) {
  const Range range{properties.number("wavelength_min", cie_shortest),
                    properties.number("wavelength_max", cie_longest)};
  if (!(range.shortest > 0 && range.longest > range.shortest))
    properties.fail_at("wavelength_max", fmt::format("wavelengths from {} to {}; need increasing ones above 0 [nm]",
                                                     range.shortest, range.longest));
  return range;
}

std::vector<double> numbers(Properties& properties, const std::string& name) {
  const std::string text = properties.text(name);
  return parse_numbers(text, properties.element().where, properties.title() + ": " + quote(name));
}

Spectrum parse_regular(Properties& properties) {
  const Range range = wavelengths(properties);
  Spectrum spectrum;
  spectrum.value = numbers(properties, "values");
  if (spectrum.value.size() < 2) properties.fail_at("values", "one value; need two or more");
  const double step = (range.longest - range.shortest) / static_cast<double>(spectrum.value.size() - 1);
  for (std::size_t i = 0; i < spectrum.value.size(); ++i)
    spectrum.wavelength.push_back(range.shortest + step * static_cast<double>(i));
  return spectrum;
}

Spectrum parse_irregular(Properties& properties) {
  Spectrum spectrum{numbers(properties, "wavelengths"), numbers(properties, "values")};
  if (spectrum.wavelength.size() != spectrum.value.size() || spectrum.value.size() < 2)
    properties.fail_at("values", fmt::format("{} values for {} wavelengths; need as many, and two or more",
                                             spectrum.value.size(), spectrum.wavelength.size()));
  for (std::size_t i = 1; i < spectrum.wavelength.size(); ++i)
    if (!(spectrum.wavelength[i] > spectrum.wavelength[i - 1]))
      properties.fail_at("wavelengths", "the wavelengths do not increase");
  return spectrum;
}

Spectrum parse_blackbody(Properties& properties) {
  const double kelvin = properties.number("temperature");
  if (!(kelvin > 0)) properties.fail_at("temperature", fmt::format("temperature = {}; need kelvins above 0", kelvin));
  const Range range = wavelengths(properties);
  return blackbody(kelvin, range.shortest, range.longest);
}

// In Mitsuba's rgb variants D65 itself is white, and what it multiplies stays as it is.
Rgb parse_d65(const Document& document, Properties& properties, Quantity quantity, Report& report) {
  const double scale = properties.number("scale", 1);
  if (const Element* nested = properties.object("texture")) {
    if (!is_spectrum_type(nested->attribute("type")))
      properties.fail_at("", "a nested texture; need a spectrum that is the same everywhere");
    return spectrum_plugin(document, *nested, quantity, report);
  }
  Rgb rgb = properties.color("color", {{1, 1, 1}}, Quantity::unbounded).value;
  for (double& v : rgb) v *= scale;
  return rgb;
}

}  // namespace

bool is_spectrum_type(const std::string& type) {
  const std::vector<std::string> types = spectrum_types();
  return std::find(types.begin(), types.end(), type) != types.end();
}

Rgb spectrum_plugin(const Document& document, const Element& element, Quantity quantity, Report& report) {
  Properties properties(document, element, report);
  const auto seen = [&](const Spectrum& spectrum) {
    return to_rgb(spectrum, quantity, element.where, properties.title(), report);
  };
  Rgb rgb{0, 0, 0};
  if (properties.type() == "uniform") {
    const double value = properties.number("value");
    wavelengths(properties);
    rgb = {value, value, value};
  } else if (properties.type() == "srgb") {
    rgb = properties.color("color", {{0, 0, 0}}, Quantity::unbounded).value;
    properties.boolean("unbounded", false);
  } else if (properties.type() == "rawconstant") {
    const double grey = properties.is_vector("value") ? 0 : properties.number("value");
    rgb = properties.is_vector("value") ? properties.vector("value", {0, 0, 0}) : Rgb{grey, grey, grey};
  } else if (properties.type() == "constvolume") {
    rgb = properties.color("value", {{1, 1, 1}}, quantity).value;
    properties.transform("to_world");  // moves nothing
  } else if (properties.type() == "d65") {
    rgb = parse_d65(document, properties, quantity, report);
  } else if (properties.type() == "regular") {
    rgb = seen(parse_regular(properties));
  } else if (properties.type() == "irregular") {
    rgb = seen(parse_irregular(properties));
  } else {
    rgb = seen(parse_blackbody(properties));
  }
  properties.finish();
  return rgb;
}

}  // namespace itn
