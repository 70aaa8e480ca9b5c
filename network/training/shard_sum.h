// Sums of vectors, one a shard of a mini-batch, whose bits do not depend on who has computed which shard: pairs of
// neighbours are added, then pairs of pairs, and so on. Where the number of shards is no power of two, what has no
// neighbour goes up as it is.
#pragma once
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "runtime/base/ranks.h"

namespace itn {

class ShardSum {
 public:
  explicit ShardSum(std::size_t shards) : shards_(shards) {}

  // Each shard once, in any order.
  void add(std::size_t shard, std::vector<float> values) { add({0, shard}, std::move(values)); }

  // The sum over all shards of all ranks, on every rank; values: of a vector. Each rank has added the shards
  // [share_begin(shards, rank, ranks), share_begin(shards, rank + 1, ranks)), and sums a share of the values.
  std::vector<float> over(Ranks& ranks, std::size_t values);

 private:
  using Node = std::pair<std::size_t, std::size_t>;  // level, index: the shards index << level and those that follow

  void add(Node node, std::vector<float> values);
  std::vector<float> complete();  // of all shards, which are here

  std::size_t shards_;
  std::map<Node, std::vector<float>> waiting_;  // for their neighbours
};

}  // namespace itn
