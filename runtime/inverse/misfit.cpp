#include "runtime/inverse/misfit.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "runtime/image/accumulation.h"
#include "runtime/inverse/gauss_newton/least_squares.h"
#include "runtime/inverse/smoothing.h"

namespace itn {
namespace {

constexpr double least_share = 0.3;  // of the residual that a cause explains, to be named
constexpr double worth_a_number =
    0.1;  // of the residual, that a cause with more numbers must explain beyond one with fewer
constexpr double most_of_noise = 0.5;  // of the residual that a cause must explain where it might be noise
constexpr double sure = 5;             // standard deviations of noise
constexpr double own = 0.02;      // of a pattern's square that the parameters must leave: else they would have taken it
constexpr double steepest = 0.1;  // of the pixels: edges
constexpr double along_edges = 0.6;  // of the squares, to be called so
constexpr double brightest = 0.99;   // of the brightest value: may be cut off there

// Patterns that misfits leave.
enum Pattern { to_right, down, outwards, around, all, red, green, blue, constant, bent, sharper, patterns };

struct Fault {
  const char* kind;
  std::vector<Pattern> of;
};

// From few numbers to many.
const std::vector<Fault>& faults() {
  static const std::vector<Fault> result{{"brightness", {all}},
                                         {"offset", {constant}},
                                         {"blur", {sharper}},
                                         {"shift", {to_right, down}},
                                         {"curve", {all, bent}},
                                         {"size", {to_right, down, outwards}},
                                         {"rotation", {to_right, down, around}},
                                         {"colour", {red, green, blue}}};
  return result;
}

// The image found, in the target's unit.
struct FoundImage {
  explicit FoundImage(const ComparedImage& of)
      : width(of.target.width), height(of.target.height), channels(of.target.channels) {
    double sum = 0;
    for (std::size_t i = 0; i < of.image.mean.size(); ++i) {
      value.push_back(of.factors[i % static_cast<std::size_t>(channels)] * static_cast<double>(of.image.mean[i]));
      sum += value.back();
    }
    mean = sum / static_cast<double>(value.size());
  }
  double at(int x, int y, int c) const {
    return value[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
                     static_cast<std::size_t>(channels) +
                 static_cast<std::size_t>(c)];
  }
  // Differences leave a pixel's own noise out, which what is left of the target has, too. 0 at the image's edge.
  std::array<double, 2> slope(int x, int y, int c) const {
    if (x < 1 || y < 1 || x + 1 >= width || y + 1 >= height) return {0, 0};
    return {(at(x + 1, y, c) - at(x - 1, y, c)) / 2, (at(x, y + 1, c) - at(x, y - 1, c)) / 2};
  }
  double curvature(int x, int y, int c) const {
    if (x < 2 || y < 2 || x + 2 >= width || y + 2 >= height) return 0;
    const double far = at(x + 2, y, c) + at(x - 2, y, c) + at(x, y + 2, c) + at(x, y - 2, c);
    return (far - at(x + 1, y, c) - at(x - 1, y, c) - at(x, y + 1, c) - at(x, y - 1, c)) / 3;
  }
  std::array<double, patterns> pattern(int x, int y, int c) const {
    const double right = x - (width - 1) / 2.0, below = y - (height - 1) / 2.0, v = at(x, y, c);
    const auto [dx, dy] = slope(x, y, c);
    std::array<double, patterns> result{dx, dy, right * dx + below * dy, right * dy - below * dx, v};
    if (channels == 3) result[static_cast<std::size_t>(red) + static_cast<std::size_t>(c)] = v;
    result[constant] = mean;
    result[bent] = v > 0 ? v * std::log(v / mean) : 0;
    result[sharper] = curvature(x, y, c);
    return result;
  }

  int width, height, channels;
  std::vector<double> value;
  double mean = 0;
};

// Sums of products over all compared values, each over the noise: of what the parameters change, the patterns, and at
// last what is left of the target.
Eigen::MatrixXd products(const ComparedImage& of, const FoundImage& model, bool exposure, bool white_balance) {
  std::vector<std::vector<double>> by_parameter;
  for (const auto& derivative : of.image.derivatives) {
    std::vector<double> column;
    for (std::size_t i = 0; i < derivative.mean.size(); ++i)
      column.push_back(of.factors[i % static_cast<std::size_t>(model.channels)] *
                       static_cast<double>(derivative.mean[i]));
    by_parameter.push_back(smoothed(column, model.width, model.height, model.channels, 1));
  }
  const auto parameters = static_cast<Eigen::Index>(by_parameter.size()), camera = parameters + (exposure ? 1 : 0),
             first = camera + (white_balance ? 2 : 0), size = first + patterns + 1;
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd row(size);
  std::size_t i = 0;
  for (int y = 0; y < model.height; ++y)
    for (int x = 0; x < model.width; ++x)
      for (int c = 0; c < model.channels; ++c, ++i) {
        // A pixel that is right to the last digit speaks against a pattern that would have changed it.
        if (!(of.target.weight[i / static_cast<std::size_t>(model.channels)] > 0) || !(of.white.deviation[i] > 0))
          continue;
        row.setZero();
        for (Eigen::Index p = 0; p < parameters; ++p) row[p] = by_parameter[static_cast<std::size_t>(p)][i];
        if (exposure) row[parameters] = model.value[i];
        if (white_balance && c != 1) row[camera + (c == 0 ? 0 : 1)] = model.value[i];
        const auto pattern = model.pattern(x, y, c);
        for (Eigen::Index k = 0; k < patterns; ++k) row[first + k] = pattern[static_cast<std::size_t>(k)];
        row /= of.white.deviation[i];
        row[size - 1] = of.white.value[i];
        sum.selfadjointView<Eigen::Lower>().rankUpdate(row);
      }
  sum.triangularView<Eigen::StrictlyUpper>() = sum.transpose();
  // The parameters have taken their own: what a pattern has in common with them is taken out.
  const Eigen::VectorXd before = sum.diagonal();
  for (Eigen::Index p = 0; p < first; ++p)
    if (sum(p, p) > 1e-9 * before[p]) sum -= (sum.col(p) * sum.row(p) / sum(p, p)).eval();
  Eigen::MatrixXd result = sum.bottomRightCorner(patterns + 1, patterns + 1);
  for (Eigen::Index k = 0; k < patterns; ++k)
    if (!(result(k, k) > own * before[first + k])) {
      result.row(k).setZero();
      result.col(k).setZero();
    }
  return result;
}

// Share of the squares that a cause explains beyond what as many numbers explain of noise, and its numbers.
struct Explanation {
  const char* kind;
  double explained = 0;
  Eigen::VectorXd number;
};

// sums: of products().
Explanation explanation(const Fault& fault, const Eigen::MatrixXd& sums, double noise) {
  const auto n = static_cast<Eigen::Index>(fault.of.size());
  Eigen::MatrixXd normal(n, n);
  Eigen::VectorXd right(n);
  for (Eigen::Index a = 0; a < n; ++a) {
    const Pattern of_a = fault.of[static_cast<std::size_t>(a)];
    for (Eigen::Index b = 0; b < n; ++b) normal(a, b) = sums(of_a, fault.of[static_cast<std::size_t>(b)]);
    right[a] = sums(of_a, patterns);
    if (!(normal(a, a) > 0)) return {fault.kind, 0, {}};
  }
  const Eigen::VectorXd number = Eigen::LDLT<Eigen::MatrixXd>(normal).solve(right);
  return {fault.kind, number.dot(right) - noise * static_cast<double>(n), number};
}

double square_of(const WhiteResidual& white) {
  double sum = 0;
  for (const double v : white.value) sum += v * v;
  return sum;
}

// Squared standard deviation of what is left, were it normal: pixels far off do not count.
double middle_square(const WhiteResidual& white) {
  std::vector<double> size;
  for (const double v : white.value)
    if (v != 0) size.push_back(std::fabs(v));
  if (size.empty()) return 1;
  std::nth_element(size.begin(), size.begin() + static_cast<std::ptrdiff_t>(size.size() / 2), size.end());
  return std::pow(1.4826 * size[size.size() / 2], 2);
}

// The median of what is left over the value that is there, as a standard deviation.
double relative_noise(const ComparedImage& of, const FoundImage& model) {
  std::vector<double> size;
  for (std::size_t i = 0; i < of.white.value.size(); ++i)
    if (of.white.value[i] != 0 && model.value[i] > 0)
      size.push_back(std::fabs(of.white.value[i]) * of.white.deviation[i] / model.value[i]);
  if (size.empty()) return 0;
  std::nth_element(size.begin(), size.begin() + static_cast<std::ptrdiff_t>(size.size() / 2), size.end());
  return 1.4826 * size[size.size() / 2];
}

std::string way(double v, const char* back, const char* forth) {
  return fmt::format("{:.2g} pixels {}", std::fabs(v), v < 0 ? back : forth);
}

std::string words_of(const Misfit& m, const Eigen::VectorXd& number) {
  const std::string most = fmt::format(" ({:.0f} % of what is more than noise)", 100 * m.share);
  if (m.kind == "shift") {
    const double small = 0.2 * std::hypot(m.x, m.y);
    std::string where;
    if (std::fabs(m.x) > small) where = way(m.x, "to the left", "to the right");
    if (std::fabs(m.y) > small) where += (where.empty() ? "" : " and ") + way(m.y, "up", "down");
    return fmt::format(
        "It looks like the image found, shifted by {}{}: check where the camera and the thing stand, and the camera's "
        "direction.",
        where, most);
  }
  if (m.kind == "size")
    return fmt::format(
        "It looks like the image found, {:.2g} % {}{}: check the size of the thing, the camera's distance and its "
        "field of view.",
        100 * std::fabs(m.change), m.change > 0 ? "larger" : "smaller", most);
  if (m.kind == "rotation")
    return fmt::format("It looks like the image found, turned by {:.2g} degrees{}: check how camera and thing stand.",
                       std::fabs(number[2]) * 57.29578, most);
  if (m.kind == "brightness")
    return fmt::format(
        "It looks like the image found, {:.2g} % {}{}: check how strong the light is, or let the exposure be found "
        "(exposure).",
        100 * std::fabs(m.change), m.change > 0 ? "brighter" : "darker", most);
  if (m.kind == "colour")
    return fmt::format(
        "It looks like the image found with other colours, red {:+.2g} %, green {:+.2g} %, blue {:+.2g} %{}: check the "
        "light's colour, or let the camera's be found (exposure, white balance).",
        -100 * number[0], -100 * number[1], -100 * number[2], most);
  if (m.kind == "offset")
    return fmt::format(
        "It looks like the image found, {} by the same everywhere, {:.2g} % of its mean{}: check the camera's black "
        "level, stray light and the light from all around.",
        m.change > 0 ? "brighter" : "darker", 100 * std::fabs(m.change), most);
  if (m.kind == "curve")
    return "It looks like the image found with its brightness bent" + most +
           ": check the camera's curve (curve) and the exposure.";
  if (m.kind == "blur")
    return fmt::format("It looks like the image found, {}{}: check the camera's focus and the film's filter.",
                       number[0] < 0 ? "blurred" : "sharpened", most);
  if (m.kind == "saturation")
    return "It is the brightest pixels, which look cut off" + most +
           ": leave them out (saturation, mask), or take a shorter exposure.";
  if (m.kind == "edges")
    return "It looks like no shift, no other size and no other brightness, and lies along edges" + most +
           ": check the shape, where it stands, and the camera.";
  return "It looks like no shift, no other size and no other brightness, and lies in areas rather than along edges: "
         "check "
         "the light, what stands around, the surface, and what is inside of the thing.";
}

// The noise was said to be another than it is.
Misfit noise_misfit(const ComparedImage& of, const FoundImage& model, const ImageFit& fit, std::size_t target) {
  Misfit m;
  m.target = target;
  m.share = 1;
  m.change = std::sqrt(fit.chi_square);
  const double found = relative_noise(of, model);
  if (fit.size() < 0) {
    m.kind = "noise_too_large";
    m.words = fmt::format(
        "What is said of the noise is about {:.2g} times what is left, which is {:.2g} % of the value: say less "
        "(noise), "
        "or nothing, so that it is measured.",
        1 / std::max(1e-300, m.change), 100 * found);
  } else {
    m.kind = "noise_too_small";
    m.words = fmt::format(
        "What is left looks like noise {:.2g} times as strong as was said, {:.2g} % of the value: if it is noise, say "
        "so "
        "(noise {:.2g}); else the scene is not that of the targets.",
        m.change, 100 * found, found);
  }
  return m;
}

// The share of the squares in pixels where the image found is steepest.
double share_along_edges(const ComparedImage& of, const FoundImage& model) {
  std::vector<std::pair<double, double>> pixels;  // steepness, square
  double sum = 0, along = 0;
  std::size_t i = 0;
  for (int y = 0; y < model.height; ++y)
    for (int x = 0; x < model.width; ++x) {
      double steep = 0, square = 0;
      for (int c = 0; c < model.channels; ++c, ++i) {
        if (of.white.value[i] == 0 || !(of.white.deviation[i] > 0)) continue;
        const auto [dx, dy] = model.slope(x, y, c);
        steep += (dx * dx + dy * dy) / (of.white.deviation[i] * of.white.deviation[i]);
        square += of.white.value[i] * of.white.value[i];
      }
      if (square > 0) pixels.emplace_back(steep, square);
      sum += square;
    }
  if (pixels.empty()) return 0;
  std::sort(pixels.begin(), pixels.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  for (std::size_t k = 0; static_cast<double>(k) < steepest * static_cast<double>(pixels.size()); ++k)
    along += pixels[k].second;
  return along / sum;
}

// The share of the squares in the brightest pixels of the target, where the image found is brighter still.
double share_cut_off(const ComparedImage& of) {
  float most = 0;
  for (std::size_t i = 0; i < of.target.value.size(); ++i)
    if (of.white.value[i] != 0) most = std::max(most, of.target.value[i]);
  double sum = 0, above = 0, count = 0, values = 0;
  for (std::size_t i = 0; i < of.target.value.size(); ++i) {
    const double left = of.white.value[i];
    sum += left * left;
    values += left != 0;
    if (left == 0 || static_cast<double>(of.target.value[i]) < brightest * static_cast<double>(most)) continue;
    ++count;
    above += left > 0 ? left * left : 0;
  }
  return count >= std::max(4.0, 0.003 * values) && sum > 0 ? above / sum : 0;
}

}  // namespace

Misfit misfit_of(const std::vector<ComparedImage>& images, const ImageFit& fit, bool exposure, bool white_balance) {
  Misfit result;
  if (fit.fits() || images.empty()) return result;
  for (std::size_t t = 1; t < images.size(); ++t)
    if (square_of(images[t].white) > square_of(images[result.target].white)) result.target = t;
  const ComparedImage& worst = images[result.target];
  const FoundImage model(worst);
  if (fit.size() < 0 && !fit.many_unknowns) return noise_misfit(worst, model, fit, result.target);

  double values = 0;
  for (const double v : worst.white.value) values += v != 0;
  const double noise = fit.noise_known ? 1 : middle_square(worst.white);
  const Eigen::MatrixXd sums = products(worst, model, exposure, white_balance);
  std::vector<Explanation> explanations;
  double beyond = sums(patterns, patterns) - noise * values;
  for (const Fault& fault : faults()) {
    if (fault.kind == std::string("colour") && model.channels != 3) continue;
    if (const auto e = explanation(fault, sums, noise); e.explained > sure * sure * noise) explanations.push_back(e);
    if (!explanations.empty()) beyond = std::max(beyond, explanations.back().explained);
  }
  Eigen::VectorXd number;
  for (const Explanation& e : explanations) {
    const double share = e.explained / beyond;
    // The best cause is taken, but one with more numbers only if it is better by far.
    const double needed = e.number.size() > number.size() ? result.share + worth_a_number : result.share;
    if (share < least_share || share < needed) continue;
    result.kind = e.kind;
    result.share = share;
    number = e.number;
  }
  if (const double cut = share_cut_off(worst); cut > std::max(0.5, result.share - worth_a_number)) {
    result.kind = "saturation";
    result.share = cut;
  }
  // Uncorrelated neighbours mean noise, unless a cause explains most of it.
  if (fit.looks_alike() && !fit.many_unknowns && result.share < most_of_noise)
    return noise_misfit(worst, model, fit, result.target);
  if (result.kind.empty()) {
    const double along = share_along_edges(worst, model);
    result.kind = along > along_edges ? "edges" : "areas";
    result.share = along > along_edges ? along : 1 - along;
  }
  if (result.kind == "shift" || result.kind == "size" || result.kind == "rotation") {
    result.x = number[0];
    result.y = number[1];
  }
  if (result.kind == "size") result.change = number[2];
  if (result.kind == "brightness" || result.kind == "offset") result.change = -number[0];
  result.words = words_of(result, number);
  if (images.size() > 1) result.words = fmt::format("Of target {}: {}", result.target, result.words);
  return result;
}

ImageComparison compare_images(const std::vector<std::vector<Rendering>>& groups,
                               const std::vector<TargetImage>& targets, const std::vector<double>& exposures,
                               bool found, double relative_noise, bool noise_known, bool many_unknowns) {
  std::vector<Rendering> images(targets.size());
  std::vector<WhiteResidual> white;
  white.reserve(targets.size());  // whose places are told to others
  std::vector<ComparedImage> compared;
  const auto is_black = [](const std::vector<float>& v) {
    return std::all_of(v.begin(), v.end(), [](float x) { return x == 0; });
  };
  for (std::size_t t = 0; t < targets.size(); ++t) {
    const std::array<double, 3> factors{exposures[t], exposures[t], exposures[t]};
    Accumulation first_half, second_half;
    for (std::size_t g = 0; g < groups[t].size(); ++g)
      (2 * g < groups[t].size() ? first_half : second_half).add(groups[t][g]);
    const Rendering& of_noise = first_half.rendering();
    images[t] = second_half.rendering();
    if (is_black(of_noise.mean) || is_black(images[t].mean)) {  // without noise
      if (is_black(targets[t].value)) continue;
      ImageComparison nothing;
      nothing.fit.chance = 0;
      nothing.misfit = {"brightness", 1, t, 0, 0, 0, "The image found is black, and the target is not."};
      return nothing;
    }
    white.push_back(
        white_residual(images[t], targets[t], factors, noise_of(of_noise, targets[t], factors, relative_noise)));
    compared.push_back({images[t], factors, targets[t], white.back()});
  }
  ImageComparison result{image_fit(white, noise_known), {}};
  result.fit.many_unknowns = many_unknowns;
  result.misfit = misfit_of(compared, result.fit, found, false);
  return result;
}

std::string misfit_words(const ImageComparison& comparison) {
  const ImageFit& fit = comparison.fit;
  return fmt::format("{}; the intervals do not hold.{}",
                     !fit.many_unknowns && (fit.looks_alike() || fit.size() < 0)
                         ? "what is left of the targets is not as large as their noise"
                         : "the image found does not fit",
                     comparison.misfit.words.empty() ? "" : " " + comparison.misfit.words);
}

nlohmann::ordered_json to_json(const Misfit& misfit) {
  if (misfit.kind.empty()) return {};
  nlohmann::ordered_json json{{"looks_like", misfit.kind}, {"share", misfit.share}, {"target", misfit.target}};
  if (misfit.kind == "shift" || misfit.kind == "size" || misfit.kind == "rotation") {
    json["x"] = misfit.x;
    json["y"] = misfit.y;
  }
  if (misfit.change != 0) json["change"] = misfit.change;
  json["words"] = misfit.words;
  return json;
}

}  // namespace itn
