// Spectra over wavelengths to linear sRGB, as Mitsuba's rgb variants convert them.
#pragma once
#include <string>
#include <vector>

#include "itn/scene.h"
#include "runtime/scene/xml/document.h"

namespace itn {

// Linear between the wavelengths and 0 beyond them; without wavelengths: one value everywhere.
struct Spectrum {
  std::vector<double> wavelength;  // [nm], increasing
  std::vector<double> value;

  bool is_uniform() const { return wavelength.empty(); }
};

// "0.5" or "400:0.1, 700:0.2". Throws InputError at `where`.
Spectrum parse_spectrum(const std::string& text, const Location& where, const std::string& what);
// A wavelength and a value a line, # for comments (.spd). Throws InputError.
Spectrum read_spectrum(const std::string& file);
// Values of a blackbody [W / m^2 / sr / nm] from `shortest` to `longest` nm.
Spectrum blackbody(double kelvin, double shortest, double longest);

// Integral with the CIE 1931 colour-matching functions, weighted by D65 where `under_daylight`; may leave [0, 1].
Rgb integrate(const Spectrum& spectrum, bool under_daylight);

// The colour, clamped to what the quantity may be, with a warning where that changes it. Mitsuba 3.9 does the same.
Rgb to_rgb(const Spectrum& spectrum, Quantity quantity, const Location& where, const std::string& what, Report& report);

// Plugins that are the same everywhere: uniform, srgb, d65, regular, irregular, rawconstant, blackbody, constvolume.
bool is_spectrum_type(const std::string& type);
Rgb spectrum_plugin(const Document& document, const Element& element, Quantity quantity, Report& report);

}  // namespace itn
