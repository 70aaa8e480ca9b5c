// Processes of one machine that work together.
#include "runtime/base/ranks/local_ranks.h"

#include <signal.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <thread>

#include "itn/error.h"

using namespace itn;

namespace {

const std::atomic<bool> never{false};

// Every rank's answers to all that ranks can do together: of long messages, too, which no socket takes at once.
std::string answers(StartedRanks& ranks) {
  const auto name = [](int from, int to) { return std::string(300000, static_cast<char>('a' + 4 * from + to)); };
  std::string wrong;
  const std::vector<std::string> all = ranks.gather(name(ranks.rank(), 0));
  for (int r = 0; r < ranks.count(); ++r)
    if (all.at(static_cast<std::size_t>(r)) != name(r, 0)) wrong += "gather ";
  std::vector<std::string> to_each;
  for (int r = 0; r < ranks.count(); ++r) to_each.push_back(r == 1 ? "" : name(ranks.rank(), r));
  const std::vector<std::string> mine = ranks.exchange(to_each);
  for (int r = 0; r < ranks.count(); ++r)
    if (mine.at(static_cast<std::size_t>(r)) != (ranks.rank() == 1 ? "" : name(r, ranks.rank()))) wrong += "exchange ";
  std::vector<std::int64_t> numbers{1, 2, 3, 4, 5};
  add_up(ranks, numbers);
  if (numbers[4] != 5 * ranks.count()) wrong += "add_up ";
  // A slow rank holds nobody up, and every item is done once.
  std::vector<std::int64_t> done(100);
  ranks.hand_out(done.size(), 8, [&](std::size_t first, std::size_t end) {
    if (ranks.rank() == 1) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    for (std::size_t i = first; i < end; ++i) ++done[i];
  });
  add_up(ranks, done);
  if (done != std::vector<std::int64_t>(100, 1)) wrong += "hand_out ";
  return wrong;
}

}  // namespace

TEST_CASE("processes of one machine gather, exchange, add up and share work as ranks do") {
  const std::unique_ptr<StartedRanks> ranks = start_local_ranks(3, never);
  const std::string wrong = answers(*ranks);
  const std::vector<std::string> of_all = ranks->gather(wrong);
  if (!ranks->is_first()) _exit(0);
  ranks->leave();
  CHECK(of_all == std::vector<std::string>(3));
}

TEST_CASE("where one of the processes is killed the first says so, and does not wait for it") {
  const std::unique_ptr<StartedRanks> ranks = start_local_ranks(2, never);
  if (!ranks->is_first()) {
    raise(SIGKILL);
    _exit(1);
  }
  CHECK_THROWS_WITH(ranks->hand_out(10, 1, [](std::size_t, std::size_t) {}),
                    Catch::Contains("another device has ended"));
}

TEST_CASE("an interrupted process does not wait for the others") {
  std::atomic<bool> interrupted{false};
  const std::unique_ptr<StartedRanks> ranks = start_local_ranks(2, interrupted);
  if (!ranks->is_first()) {
    pause();
    _exit(1);
  }
  interrupted = true;
  CHECK_THROWS_AS(ranks->meet(), Interrupted);
}
