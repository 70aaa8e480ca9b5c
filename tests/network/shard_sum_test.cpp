// Sums over shards: the same bits whoever has computed which shard.
#include "network/training/shard_sum.h"

#include <barrier>
#include <catch2/catch.hpp>
#include <thread>
#include <vector>

namespace {

// Ranks are threads here, and meet at this table.
struct Table {
  explicit Table(int ranks) : meeting(ranks), given(static_cast<std::size_t>(ranks)) {}
  std::barrier<> meeting;
  std::vector<std::vector<std::string>> given;  // by rank, to each
};

class ThreadRank : public itn::Ranks {
 public:
  ThreadRank(Table& table, int rank) : table_(table), rank_(rank) {}
  int rank() const override { return rank_; }
  int count() const override { return static_cast<int>(table_.given.size()); }
  void meet() override { table_.meeting.arrive_and_wait(); }
  std::vector<std::string> gather(const std::string& mine) override {
    return exchange(std::vector<std::string>(table_.given.size(), mine));
  }
  std::vector<std::string> exchange(const std::vector<std::string>& to_each) override {
    table_.given[static_cast<std::size_t>(rank_)] = to_each;
    meet();
    std::vector<std::string> received;
    for (const auto& from : table_.given) received.push_back(from[static_cast<std::size_t>(rank_)]);
    meet();
    return received;
  }
  void hand_out(std::size_t, std::size_t, const Work&) override {}
  Traffic traffic() const override { return {}; }

 private:
  Table& table_;
  int rank_;
};

// Numbers whose sum depends on its order.
std::vector<float> values_of(std::size_t shard) {
  std::vector<float> values;
  for (std::size_t i = 0; i < 7; ++i)
    values.push_back(1 / static_cast<float>(3 + 5 * shard + 11 * i) * (shard % 2 ? -1.0F : 1000.0F));
  return values;
}

std::vector<float> sum_over(std::size_t shards, int ranks) {
  Table table(ranks);
  std::vector<std::vector<float>> sums(static_cast<std::size_t>(ranks));
  {
    std::vector<std::jthread> threads;
    for (int r = 0; r < ranks; ++r)
      threads.emplace_back([&, r] {
        ThreadRank rank(table, r);
        const auto own = static_cast<std::size_t>(r), count = static_cast<std::size_t>(ranks);
        itn::ShardSum sum(shards);
        const std::size_t first = itn::share_begin(shards, own, count), end = itn::share_begin(shards, own + 1, count);
        for (std::size_t s = end; s-- > first;) sum.add(s, values_of(s));
        sums[own] = sum.over(rank, 7);
      });
  }
  for (const auto& sum : sums) CHECK(sum == sums.front());
  return sums.front();
}

}  // namespace

TEST_CASE("a sum over shards has the same bits however many ranks there are") {
  for (std::size_t shards = 1; shards <= 9; ++shards) {
    const std::vector<float> alone = sum_over(shards, 1);
    for (std::size_t i = 0; i < alone.size(); ++i) {
      double exact = 0;
      for (std::size_t s = 0; s < shards; ++s) exact += static_cast<double>(values_of(s)[i]);
      CHECK(alone[i] == Approx(exact).epsilon(1e-5));
    }
    for (int ranks = 2; ranks <= static_cast<int>(shards); ++ranks) {
      CAPTURE(shards, ranks);
      CHECK(sum_over(shards, ranks) == alone);
    }
  }
}

TEST_CASE("shares are runs of about equal length that make up all") {
  for (const std::size_t count : {0, 1, 7, 20000})
    for (const std::size_t shares : {1, 3, 8}) {
      CHECK(itn::share_begin(count, 0, shares) == 0);
      CHECK(itn::share_begin(count, shares, shares) == count);
      for (std::size_t s = 0; s < shares; ++s) {
        const std::size_t size = itn::share_begin(count, s + 1, shares) - itn::share_begin(count, s, shares);
        CHECK((size == count / shares || size == count / shares + 1));
      }
    }
}
