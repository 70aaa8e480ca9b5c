// Renderings of one scene with derivatives at many materials, kept in a folder: of each two halves of its samples
// (posterior_rendering.h). The next photo of the same scene finds them there.
#pragma once
#include <string>
#include <vector>

#include "runtime/base/stored_run.h"
#include "runtime/inverse/forward_model.h"
#include "runtime/inverse/image_loss.h"
#include "runtime/inverse/posterior/natural_range.h"
#include "runtime/inverse/posterior/posterior_rendering.h"

namespace itn {

class RenderingStore {
 public:
  // scene: all that a rendering depends on but for the parameters' values and the number of samples. Throws UsageError:
  // the folder holds renderings of another scene; InputError: it is damaged; ResultError: another process's, or not
  // writable.
  RenderingStore(const std::string& folder, const StoredRun::Json& scene, std::size_t parameters);

  struct Entry {
    std::vector<double> values;             // of the parameters
    int spp = 0;                            // of each half
    std::vector<std::string> fingerprints;  // of the files, an image each; none: from before they were kept
  };
  const std::vector<Entry>& entries() const { return entries_; }

  // One of them, in natural coordinates. targets: an image each, of the same size and channels. Throws InputError.
  PosteriorRendering read(std::size_t index, const std::vector<NaturalRange>& ranges,
                          const std::vector<TargetImage>& targets) const;
  // Renders another and keeps it. Its samples are none that others here have. Throws as ForwardModel.
  void add(ForwardModel& model, const std::vector<double>& values, int spp);

 private:
  std::string file(std::size_t index, std::size_t image) const;
  int next_sample() const;

  RunFolder folder_;
  StoredRun::Json scene_;
  std::vector<Entry> entries_;
};

}  // namespace itn
