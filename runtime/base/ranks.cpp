#include "runtime/base/ranks.h"

#include <algorithm>
#include <cstdlib>

namespace itn {
namespace {

class OneRank : public Ranks {
 public:
  int rank() const override { return 0; }
  int count() const override { return 1; }
  void meet() override {}
  std::vector<std::string> gather(const std::string& mine) override { return {mine}; }
  std::vector<std::string> exchange(const std::vector<std::string>& to_each) override { return to_each; }
  void hand_out(std::size_t count, std::size_t most, const Work& work) override {
    for (std::size_t first = 0; first < count; first += most) work(first, std::min(count, first + most));
  }
  Traffic traffic() const override { return {}; }
};

Ranks*& the_world() {
  static OneRank alone;
  static Ranks* ranks = &alone;
  return ranks;
}

}  // namespace

Ranks& world() { return *the_world(); }
void set_world(Ranks* ranks) { the_world() = ranks; }

int rank_on_node(const Ranks& ranks) {
  if (ranks.alone()) return 0;
  for (const char* name : {"OMPI_COMM_WORLD_LOCAL_RANK", "SLURM_LOCALID", "MPI_LOCALRANKID"})
    if (const char* text = std::getenv(name)) return std::max(0, std::atoi(text));
  return ranks.rank();
}

void add_up(Ranks& ranks, std::vector<std::int64_t>& numbers) {
  if (ranks.alone()) return;
  // Each rank sums a share of the numbers, and gives it to all.
  const auto shares = static_cast<std::size_t>(ranks.count());
  std::vector<std::string> parts;
  for (std::size_t s = 0; s < shares; ++s) {
    const auto at = [&](std::size_t share) {
      return numbers.begin() + static_cast<std::ptrdiff_t>(share_begin(numbers.size(), share, shares));
    };
    parts.push_back(bytes_of(std::vector<std::int64_t>(at(s), at(s + 1))));
  }
  std::vector<std::int64_t> sum(parts[static_cast<std::size_t>(ranks.rank())].size() / sizeof(std::int64_t));
  for (const std::string& part : ranks.exchange(parts)) {
    const auto values = numbers_of<std::int64_t>(part);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += values[i];
  }
  numbers.clear();
  for (const std::string& part : ranks.gather(bytes_of(sum))) {
    const auto values = numbers_of<std::int64_t>(part);
    numbers.insert(numbers.end(), values.begin(), values.end());
  }
}

}  // namespace itn
