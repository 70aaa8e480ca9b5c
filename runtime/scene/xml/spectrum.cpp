#include "runtime/scene/xml/spectrum.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "itn/file.h"
#include "runtime/scene/xml/cie.h"
#include "runtime/scene/xml/message.h"
#include "runtime/scene/xml/values.h"

namespace itn {
namespace {

void check_order(const Spectrum& spectrum, const std::string& what) {
  if (spectrum.wavelength.size() < 2) throw InputError(what + ": need two wavelengths or more, or one value alone");
  for (std::size_t i = 1; i < spectrum.wavelength.size(); ++i)
    if (!(spectrum.wavelength[i] > spectrum.wavelength[i - 1]))
      throw InputError(fmt::format("{}: wavelength {} follows {}; need increasing ones", what, spectrum.wavelength[i],
                                   spectrum.wavelength[i - 1]));
}

// "400:0.1" -> one more pair.
void add_pair(const std::string& pair, Spectrum& spectrum, const Location& where, const std::string& what) {
  const std::size_t colon = pair.find(':');
  if (colon == std::string::npos || pair.find(':', colon + 1) != std::string::npos)
    fail(where, what + ": got " + quote(pair) + ", need wavelength:value pairs");
  spectrum.wavelength.push_back(parse_number(pair.substr(0, colon), where, what));
  spectrum.value.push_back(parse_number(pair.substr(colon + 1), where, what));
}

CieRow cie_at(double wavelength) {
  const double t = (wavelength - cie_shortest) / cie_step;
  const int below = std::min(static_cast<int>(t), cie_rows - 2);
  const CieRow &a = cie_table[static_cast<std::size_t>(below)], &b = cie_table[static_cast<std::size_t>(below) + 1];
  const double w = t - below;
  CieRow out{{}, (1 - w) * a.d65 + w * b.d65};
  for (std::size_t i = 0; i < 3; ++i) out.xyz[i] = (1 - w) * a.xyz[i] + w * b.xyz[i];
  return out;
}

double value_at(const Spectrum& spectrum, double wavelength) {
  if (spectrum.is_uniform()) return spectrum.value[0];
  const std::vector<double>& w = spectrum.wavelength;
  if (wavelength < w.front() || wavelength > w.back()) return 0;
  const auto next = std::upper_bound(w.begin() + 1, w.end() - 1, wavelength);
  const std::size_t i = static_cast<std::size_t>(next - w.begin());
  const double t = (wavelength - w[i - 1]) / (w[i] - w[i - 1]);
  return (1 - t) * spectrum.value[i - 1] + t * spectrum.value[i];
}

Rgb xyz_to_srgb(const std::array<double, 3>& xyz) {
  return {3.240479 * xyz[0] - 1.537150 * xyz[1] - 0.498535 * xyz[2],
          -0.969256 * xyz[0] + 1.875991 * xyz[1] + 0.041556 * xyz[2],
          0.055648 * xyz[0] - 0.204043 * xyz[1] + 1.057311 * xyz[2]};
}

}  // namespace

Spectrum parse_spectrum(const std::string& text, const Location& where, const std::string& what) {
  Spectrum spectrum;
  if (text.find(':') == std::string::npos) {
    spectrum.value = parse_numbers(text, where, what);
    if (spectrum.value.size() != 1)
      fail(where,
           fmt::format("{}: {} numbers in <spectrum>; need 1, or wavelength:value pairs", what, spectrum.value.size()));
    return spectrum;
  }
  std::string spaced = text;
  std::replace(spaced.begin(), spaced.end(), ',', ' ');
  std::istringstream words(spaced);
  for (std::string pair; words >> pair;) add_pair(pair, spectrum, where, what);
  try {
    check_order(spectrum, what);
  } catch (const InputError& error) {
    fail(where, error.what());
  }
  return spectrum;
}

Spectrum read_spectrum(const std::string& file) {
  constexpr std::uint64_t most_bytes = 1 << 24;
  std::istringstream stream(read_file(file, most_bytes));
  Spectrum spectrum;
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    const Location where{file, ++number, 1};
    line.resize(std::min(line.size(), line.find('#')));
    if (line.find_first_not_of(" \t\r,") == std::string::npos) continue;
    const std::vector<double> pair = parse_numbers(line, where, "spectrum");
    if (pair.size() != 2)
      fail(where, fmt::format("{} numbers in a line of a spectrum; need a wavelength and a value", pair.size()));
    spectrum.wavelength.push_back(pair[0]);
    spectrum.value.push_back(pair[1]);
  }
  check_order(spectrum, file);
  return spectrum;
}

Spectrum blackbody(double kelvin, double shortest, double longest) {
  constexpr double c = 2.99792458e8, h = 6.62607015e-34, k = 1.380649e-23;  // SI
  Spectrum spectrum;
  constexpr int steps = 1000;
  for (int i = 0; i <= steps; ++i) {
    const double nm = shortest + (longest - shortest) * i / steps, m = nm * 1e-9;
    spectrum.wavelength.push_back(nm);
    spectrum.value.push_back(1e-9 * 2 * h * c * c / (std::pow(m, 5) * std::expm1(h * c / (m * k * kelvin))));
  }
  return spectrum;
}

// Mitsuba's sum, step by step, so that scenes get the same colours: its error is below that of the tables.
Rgb integrate(const Spectrum& spectrum, bool under_daylight) {
  constexpr int steps = 1000;
  constexpr double y_of_white = 106.7502593994140625, mean_of_d65 = 98.99741751876255;
  std::array<double, 3> xyz{0, 0, 0};
  for (int i = 0; i < steps; ++i) {
    const double wavelength = cie_shortest + (cie_longest - cie_shortest) * i / (steps - 1);
    const CieRow row = cie_at(wavelength);
    const double value = value_at(spectrum, wavelength) * (under_daylight ? row.d65 / mean_of_d65 : 1);
    for (std::size_t j = 0; j < 3; ++j) xyz[j] += row.xyz[j] * value;
  }
  for (double& v : xyz) v *= (cie_longest - cie_shortest) / (y_of_white * steps);
  return xyz_to_srgb(xyz);
}

Rgb to_rgb(const Spectrum& spectrum, Quantity quantity, const Location& where, const std::string& what,
           Report& report) {
  if (spectrum.is_uniform()) {
    const double v = spectrum.value[0];
    if (quantity != Quantity::emission) return {v, v, v};
    Rgb light = xyz_to_srgb({1, 1, 1});
    for (double& channel : light) channel *= v;
    return light;
  }
  const Rgb exact = integrate(spectrum, quantity != Quantity::emission);
  const double highest = quantity == Quantity::reflectance ? 1 : HUGE_VAL;
  Rgb rgb = exact;
  for (double& v : rgb) v = std::clamp(v, 0.0, highest);
  if (rgb != exact)
    report.warn(where, fmt::format("{}: the colour ({:.4g}, {:.4g}, {:.4g}) of the spectrum is clamped to ({:.4g}, "
                                   "{:.4g}, {:.4g}), as in Mitsuba",
                                   what, exact[0], exact[1], exact[2], rgb[0], rgb[1], rgb[2]));
  return rgb;
}

}  // namespace itn
