// The posterior of a scene's parameters with its renderings kept (rendering_store.h): stopped at any moment, the same
// request goes on with the renderings that are there, and ends with the same numbers.
#pragma once
#include <string>
#include <vector>

#include "runtime/inverse/posterior/posterior.h"
#include "runtime/inverse/posterior/rendering_store.h"

namespace itn {

class StoredPosterior {
 public:
  // request: all that the numbers depend on. What is given must outlive this. Throws as RunFolder and RenderingStore.
  StoredPosterior(const std::string& folder, const StoredRun::Json& request, RenderingStore& store, ForwardModel& model,
                  const std::vector<NaturalRange>& ranges, const std::vector<TargetImage>& targets,
                  const PosteriorOptions& options);

  bool done() const { return posterior_->done(); }
  // One rendering more, or, if this round has them all, its end. Throws Interrupted: nothing has changed then.
  void advance();
  int most_rounds() const { return most_rounds_; }
  // The share that is done of the renderings that all rounds may take.
  double fraction() const;

  const Posterior& posterior() const { return *posterior_; }
  // Renderings that were there at the beginning, and those that were made since.
  std::size_t found() const { return found_; }
  std::size_t made() const { return made_.size(); }
  std::string file(const std::string& name) const { return folder_.file(name); }

 private:
  PosteriorRendering rendering(std::size_t index) const { return store_.read(index, ranges_, targets_); }
  bool is_there(std::size_t index, const std::vector<double>& values, int spp) const;
  void write_state() const;

  RunFolder folder_;
  StoredRun::Json request_;
  RenderingStore& store_;
  ForwardModel& model_;
  const std::vector<NaturalRange>& ranges_;
  const std::vector<TargetImage>& targets_;
  int most_rounds_;
  std::size_t found_ = 0, taken_ = 0;
  std::vector<std::size_t> made_;  // where in the store they are, of which taken_ are used
  std::unique_ptr<Posterior> posterior_;
  std::vector<PosteriorRendering> rendered_;  // of this round
};

// Log of the prior by the natural coordinates: the sum over the parameters.
LogPrior log_prior_of(const std::vector<NaturalRange>& ranges);

}  // namespace itn
