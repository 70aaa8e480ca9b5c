#include "runtime/inverse/posterior/stored_posterior.h"

#include <algorithm>
#include <cmath>

#include "itn/file.h"
#include "runtime/base/json_text.h"

namespace itn {

LogPrior log_prior_of(const std::vector<NaturalRange>& ranges) {
  return [ranges](const Eigen::VectorXd& at) {
    double sum = 0;
    for (std::size_t p = 0; p < ranges.size(); ++p) sum += ranges[p].log_prior(at[static_cast<Eigen::Index>(p)]);
    return sum;
  };
}

StoredPosterior::StoredPosterior(const std::string& folder, const StoredRun::Json& request, RenderingStore& store,
                                 ForwardModel& model, const std::vector<NaturalRange>& ranges,
                                 const std::vector<TargetImage>& targets, const PosteriorOptions& options)
    : folder_(folder, "state.json", "itn.invert.posterior.state/1", "an inversion by method posterior"),
      request_(request),
      store_(store),
      model_(model),
      ranges_(ranges),
      targets_(targets),
      most_rounds_(options.rounds) {
  check_writable(folder_.run().file());
  folder_.run().require_same(request);
  const StoredRun::Json found = folder_.run().before("found"), made = folder_.run().before("made");
  found_ = store.entries().size();
  if (!found.is_null()) {
    try {
      found_ = whole<std::size_t>(found);
      for (const StoredRun::Json& index : made) made_.push_back(whole<std::size_t>(index));
    } catch (const nlohmann::json::exception&) {
      folder_.run().refuse();
    }
    if (found_ > store.entries().size()) folder_.run().refuse();
  }
  write_state();
  std::vector<Exemplar> there;
  for (std::size_t i = 0; i < found_; ++i) there.push_back(exemplar(i));
  posterior_ = std::make_unique<Posterior>(static_cast<Eigen::Index>(ranges.size()), targets, log_prior_of(ranges),
                                           options, std::move(there));
}

void StoredPosterior::write_state() const { folder_.run().write(request_, {{"found", found_}, {"made", made_}}); }

bool StoredPosterior::is_there(std::size_t index, const std::vector<double>& values, int spp) const {
  return index < store_.entries().size() && store_.entries()[index].values == values &&
         store_.entries()[index].spp == spp;
}

void StoredPosterior::advance() {
  if (rendered_.size() == posterior_->wanted().size()) {
    posterior_->advance(std::move(rendered_));
    rendered_.clear();
    return;
  }
  const Posterior::Wanted& wanted = posterior_->wanted()[rendered_.size()];
  std::vector<double> values;
  for (std::size_t p = 0; p < ranges_.size(); ++p)
    values.push_back(ranges_[p].value(wanted.at[static_cast<Eigen::Index>(p)]));
  // Where it will be is written before it is made: killed between the two, the next run finds it, or makes the same.
  if (taken_ == made_.size() || !is_there(made_[taken_], values, wanted.spp)) {
    made_.resize(taken_);
    made_.push_back(store_.entries().size());
    write_state();
    store_.add(model_, values, wanted.spp);
  }
  rendered_.push_back(exemplar(made_[taken_]));
  ++taken_;
}

double StoredPosterior::fraction() const {
  const auto rounds = static_cast<double>(posterior_->rounds().size());
  const auto wanted = static_cast<double>(std::max<std::size_t>(1, posterior_->wanted().size()));
  return (rounds + static_cast<double>(rendered_.size()) / wanted) / most_rounds_;
}

}  // namespace itn
