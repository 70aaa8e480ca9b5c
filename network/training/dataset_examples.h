// Examples from a data set's folder (network/dataset/README.md).
#pragma once
#include <atomic>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "network/dataset/manifest.h"
#include "network/model/input.h"
#include "network/training/examples.h"
#include "network/training/faults.h"

namespace itn {

// Channels to read from a set's files.
struct Wanted {
  int colours = 1;  // of the radiance: 1, luminance, or 3
  bool flash = false, shapes = false;
};
Wanted wanted_by(const NetworkDescription& network);

// The images of one split of a set, or of several sets, in memory.
struct DatasetImages {
  std::vector<Manifest::Image> images;                  // in the manifest's order
  std::vector<std::vector<float>> radiance;             // one an image, (colours, size, size)
  std::vector<std::vector<float>> errors;               // their standard errors
  std::vector<std::vector<float>> flash, flash_errors;  // likewise; empty where nobody asked for them
  // Empty where nobody asked for them; else one a shape of the manifests, or, with cameras all around, one an image.
  std::vector<SeenShape> shapes;
  std::vector<std::size_t> shape_of;          // one an image: where in `shapes` its own is
  std::vector<std::array<double, 3>> lights;  // one an image: towards the light, as its camera sees it
  bool linear_sigma_t = false;                // Manifest
};

// Throws UsageError: wants what the set does not have (colours, flash); InputError: no images of that split,
// and what radiance_of() and read_seen_shape() throw, or that an image is of another data set; Interrupted soon after
// *cancel is set. read: called after each image, by one thread at a time.
DatasetImages read_images(
    const std::string& folder, const Manifest& manifest, Manifest::Split split, const Wanted& wanted,
    const std::atomic<bool>& cancel, const std::function<void()>& read = [] {});

// Puts another set's images after those of `all`.
void append(DatasetImages& all, DatasetImages more);

// The mean over all pixels of all images: what a network takes for NetworkDescription::luminance. Throws InputError
// where it is not above 0.
double mean_luminance(const DatasetImages& images);

// The set's parameters: sigma_t, albedo and g, or in colours sigma_t.R and so on.
std::vector<std::string> parameters_of(const Manifest::Image& image);

// Ranges of the outputs. For luminance the default ranges, as far as they go, made wide enough for every parameter of
// the images; in colours, and for a sigma_t whose differences count, those of the images.
std::vector<OutputRange> output_ranges(const DatasetImages& images);

class DatasetExamples : public Examples {
 public:
  // Augmentation of the images.
  struct Variation {
    bool mirrored = false;  // after all of them their mirror images, left for right, follow as examples of their own
    double noise = 0;       // normal noise added at every epoch anew, of up to so many of the image's standard errors
    std::uint64_t seed = 0;
  };

  // images must outlive this. Throws UsageError: an output that images do not have, a network that sees what was not
  // read.
  DatasetExamples(const DatasetImages& images, NetworkDescription network, const Variation& variation);
  DatasetExamples(const DatasetImages& images, NetworkDescription network)
      : DatasetExamples(images, std::move(network), Variation()) {}

  std::size_t count() const override { return (variation_.mirrored ? 2 : 1) * images_.images.size(); }
  void read(std::size_t index, std::uint64_t look, std::span<float> image, std::span<double> truth) const override;

  // The photographs of an example, not mirrored; examples from originals() on are to be mirrored.
  Photographs photographs(std::size_t index, std::uint64_t look) const;
  std::size_t originals() const { return images_.images.size(); }
  // An example, before originals(), of another shape than that of `index`; of another image where there is one shape.
  // random: which one.
  std::size_t of_another_shape(std::size_t index, std::uint64_t random) const;

 private:
  // With noise of its own. stream: of the random numbers.
  std::vector<float> noisy(const std::vector<float>& radiance, const std::vector<float>& errors, double strength,
                           std::uint64_t stream) const;

  const DatasetImages& images_;
  std::vector<CutOut> objects_;  // of images_.shapes, where the network sees objects alone
  NetworkDescription network_;
  Variation variation_;
};

// The image's "sigma_t", "albedo" or "g", or one of a colour: "albedo.R". Throws UsageError for other names.
double parameter_of(const Manifest::Image& image, const std::string& name);

}  // namespace itn
