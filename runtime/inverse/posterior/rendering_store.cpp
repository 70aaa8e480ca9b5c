#include "runtime/inverse/posterior/rendering_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "runtime/base/fingerprint.h"
#include "runtime/base/json_text.h"
#include "runtime/base/sample_index.h"

namespace itn {
namespace {

constexpr const char* halves[2] = {"a.", "b."};

std::vector<std::string> letters(int channels) {
  return channels == 1 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"};
}

// Of each image and its derivatives the mean's and then the standard error's channels.
std::vector<std::string> channel_names(const std::string& half, std::size_t parameters, int channels) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k <= parameters; ++k)
    for (const char* what : {"mean", "stderr"})
      for (const std::string& letter : letters(channels))
        names.push_back(
            fmt::format("{}{}{}.{}", half, k == 0 ? "" : fmt::format("derivative{}.", k - 1), what, letter));
  return names;
}

ExrImage read_image(const std::string& file, const TargetImage& target) {
  ExrImage image = read_exr(file);
  if (image.width != target.width || image.height != target.height)
    throw InputError(
        fmt::format("{}: {} x {} pixels, where the scene's image has {} x {}: not this scene's rendering; "
                    "remove the folder or give the renderings another",
                    file, image.width, image.height, target.width, target.height));
  const auto bad = std::find_if(image.data.begin(), image.data.end(), [](float v) { return !std::isfinite(v); });
  if (bad != image.data.end())
    throw InputError(
        fmt::format("{}: values that are not finite: damaged; remove the folder or give the renderings "
                    "another",
                    file));
  return image;
}

}  // namespace

RenderingStore::RenderingStore(const std::string& folder, const StoredRun::Json& scene, std::size_t parameters)
    : folder_(folder, "renderings.json", "itn.renderings/1", "renderings"), scene_(scene) {
  check_writable(folder_.run().file());
  folder_.run().require_same(scene_);
  try {
    for (const StoredRun::Json& entry : folder_.run().before("renderings"))
      entries_.push_back({entry.at("values").get<std::vector<double>>(), whole<int>(entry.at("spp")),
                          entry.value("files", std::vector<std::string>())});
  } catch (const nlohmann::json::exception&) {
    folder_.run().refuse();
  }
  std::int64_t samples = 0;
  for (const Entry& entry : entries_) {
    if (entry.values.size() != parameters || entry.spp < 1) folder_.run().refuse();
    samples += 2 * std::int64_t{entry.spp};
    if (samples > std::numeric_limits<int>::max() / 2) folder_.run().refuse();
  }
}

std::string RenderingStore::file(std::size_t index, std::size_t image) const {
  return folder_.file(fmt::format("{:06}_{}.exr", index, image));
}

int RenderingStore::next_sample() const {
  std::int64_t sum = 0;
  for (const Entry& entry : entries_) sum += 2 * std::int64_t{entry.spp};
  return following_sample(0, sum);
}

Exemplar RenderingStore::read(std::size_t index, const std::vector<NaturalRange>& ranges,
                              const std::vector<TargetImage>& targets) const {
  const Entry& entry = entries_[index];
  Exemplar exemplar;
  exemplar.at.resize(static_cast<Eigen::Index>(ranges.size()));
  for (std::size_t p = 0; p < ranges.size(); ++p)
    exemplar.at[static_cast<Eigen::Index>(p)] = ranges[p].of(entry.values[p]);
  for (std::size_t t = 0; t < targets.size(); ++t) {
    const ExrImage image = read_image(file(index, t), targets[t]);
    if (t < entry.fingerprints.size() && fingerprint_of(file(index, t)) != entry.fingerprints[t])
      throw InputError(fmt::format("{}: has changed since it was written; remove the folder", file(index, t)));
    const auto count = static_cast<std::size_t>(targets[t].channels), all = image.channels.size();
    const std::size_t pixels = image.data.size() / all;
    ExemplarView view{entry.spp, {}};
    for (std::size_t h = 0; h < 2; ++h) {
      HalfImages& half = view.half[h];
      const auto rows = static_cast<Eigen::Index>(1 + ranges.size()),
                 columns = static_cast<Eigen::Index>(pixels * count);
      half.value.resize(rows, columns);
      half.error.resize(rows, columns);
      const std::vector<std::string> names = channel_names(halves[h], ranges.size(), targets[t].channels);
      for (std::size_t k = 0; k < names.size(); ++k) {
        const int channel = image.channel(names[k]);
        if (channel < 0) throw InputError(fmt::format("{}: no channel {}", file(index, t), names[k]));
        const std::size_t row = k / (2 * count), c = k % count;
        ImageRows& to = (k / count) % 2 == 0 ? half.value : half.error;
        const auto r = static_cast<Eigen::Index>(row);
        const double slope = row == 0 ? 1 : ranges[row - 1].slope(exemplar.at[r - 1]);
        for (std::size_t i = 0; i < pixels; ++i)
          to(r, static_cast<Eigen::Index>(i * count + c)) =
              static_cast<float>(slope) * image.data[i * all + static_cast<std::size_t>(channel)];
      }
    }
    exemplar.views.push_back(std::move(view));
  }
  return exemplar;
}

void RenderingStore::add(ForwardModel& model, const std::vector<double>& values, int spp) {
  const int first = next_sample();
  Entry entry{values, spp, {}};
  const std::vector<Rendering> a = model.render_values(values, first, spp),
                               b = model.render_values(values, following_sample(first, spp), spp);
  for (std::size_t t = 0; t < a.size(); ++t) {
    ExrImage image{a[t].width, a[t].height, {}, {}, {}};
    for (const char* half : halves) {
      const std::vector<std::string> names = channel_names(half, a[t].derivatives.size(), a[t].channels);
      image.channels.insert(image.channels.end(), names.begin(), names.end());
    }
    const auto channels = static_cast<std::size_t>(a[t].channels);
    for (std::size_t pixel = 0; pixel < a[t].mean.size() / channels; ++pixel)
      for (const Rendering* half : {&a[t], &b[t]})
        for (std::size_t k = 0; k <= half->derivatives.size(); ++k) {
          const Image& of = k == 0 ? static_cast<const Image&>(*half) : half->derivatives[k - 1];
          for (const auto* numbers : {&of.mean, &of.stderr_})
            for (std::size_t c = 0; c < channels; ++c) image.data.push_back((*numbers)[pixel * channels + c]);
        }
    const std::string name = file(entries_.size(), t), bytes = encode_exr(name, image);
    write_file(name, bytes, Sync::later);
    entry.fingerprints.push_back(fingerprint_text(bytes));
  }
  entries_.push_back(std::move(entry));
  StoredRun::Json list = StoredRun::Json::array();
  for (const Entry& each : entries_)
    list.push_back({{"values", each.values}, {"spp", each.spp}, {"files", each.fingerprints}});
  folder_.run().write(scene_, {{"renderings", list}});
}

}  // namespace itn
