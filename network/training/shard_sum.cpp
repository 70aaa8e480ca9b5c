#include "network/training/shard_sum.h"

#include <stdexcept>
#include <string>

namespace itn {

void ShardSum::add(Node node, std::vector<float> values) {
  for (auto& [level, index] = node; std::size_t{1} << level < shards_; ++level, index /= 2) {
    const std::size_t neighbour = index ^ 1;
    if (neighbour << level >= shards_) continue;
    const auto found = waiting_.find({level, neighbour});
    if (found == waiting_.end()) break;
    // Left plus right.
    std::vector<float> other = std::move(found->second);
    waiting_.erase(found);
    if (neighbour < index) values.swap(other);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] += other[i];
  }
  waiting_[node] = std::move(values);
}

std::vector<float> ShardSum::over(Ranks& ranks, std::size_t values) {
  if (ranks.alone()) return complete();
  const auto count = static_cast<std::size_t>(ranks.count()), rank = static_cast<std::size_t>(ranks.rank());
  const auto begin = [&](std::size_t share) { return static_cast<std::ptrdiff_t>(share_begin(values, share, count)); };
  // To each rank its share of what waits here.
  std::vector<std::string> parts(count);
  for (std::size_t r = 0; r < count; ++r)
    for (const auto& [node, sum] : waiting_)
      parts[r] += bytes_of(std::vector<float>(sum.begin() + begin(r), sum.begin() + begin(r + 1)));
  waiting_.clear();
  const std::vector<std::string> received = ranks.exchange(parts);
  const std::ptrdiff_t mine = begin(rank + 1) - begin(rank);
  ShardSum all(shards_);
  for (std::size_t r = 0; r < count; ++r) {
    // The sums that wait on a rank follow from its shards.
    ShardSum there(shards_);
    for (std::size_t s = share_begin(shards_, r, count); s < share_begin(shards_, r + 1, count); ++s) there.add(s, {});
    const auto numbers = numbers_of<float>(received[r]);
    auto from = numbers.begin();
    for (const auto& [node, nothing] : there.waiting_) {
      all.add(node, {from, from + mine});
      from += mine;
    }
  }
  std::vector<float> sum;
  for (const std::string& part : ranks.gather(bytes_of(all.complete()))) {
    const auto numbers = numbers_of<float>(part);
    sum.insert(sum.end(), numbers.begin(), numbers.end());
  }
  return sum;
}

std::vector<float> ShardSum::complete() {
  if (waiting_.size() != 1) throw std::logic_error("a sum over shards of which some are missing");
  std::vector<float> sum = std::move(waiting_.begin()->second);
  waiting_.clear();
  return sum;
}

}  // namespace itn
