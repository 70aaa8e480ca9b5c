// The processes that do one job together: one, unless the program was started in several (mpi_ranks.h).
//
// All ranks run the same command on the same input. Where work can be divided, each does its share, and all get the
// whole result; the rest each does for itself, with the same numbers. Bytes never depend on how many there are: images
// are divided by pixels or by index, gradients are summed in an order of their own (sum_of_shards.h). Only the first
// rank writes files, but for the images of data sets.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

namespace itn {

class Ranks {
 public:
  virtual ~Ranks() = default;

  virtual int rank() const = 0;
  virtual int count() const = 0;
  bool alone() const { return count() == 1; }
  bool is_first() const { return rank() == 0; }

  // Collective, as all that follows: every rank calls it, in the same order. Throws Interrupted where one must not wait
  // for the others any longer.
  //
  // Returns when all have come here.
  virtual void meet() = 0;
  // Returns `mine` of every rank, indexed by rank.
  virtual std::vector<std::string> gather(const std::string& mine) = 0;
  // to_each[r] goes to rank r; returns what each has for this one, by rank.
  virtual std::vector<std::string> exchange(const std::vector<std::string>& to_each) = 0;
  // Calls work(first, end) for ranges of at most `most` of the items 0 ... count - 1, each on one rank, which asks for
  // the next when it is done: a slow one does not hold up the others. Returns when all items are done.
  using Work = std::function<void(std::size_t first, std::size_t end)>;
  virtual void hand_out(std::size_t count, std::size_t most, const Work& work) = 0;

  // Messages and bytes that this rank has sent to others so far.
  struct Traffic {
    std::uint64_t messages = 0, bytes = 0;
  };
  virtual Traffic traffic() const = 0;
};

// This process's, to be set once, at the start of a program. Unless it is, one that is alone.
Ranks& world();
void set_world(Ranks* ranks);

// Index of a rank among those on its node, from the launcher's environment (Open MPI, Slurm, MPICH), else its rank.
// Ranks of a node take its devices in this order.
int rank_on_node(const Ranks& ranks);

// Numbers as what is sent.
template <class Number>
std::string bytes_of(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}
template <class Number>
std::vector<Number> numbers_of(const std::string& bytes) {
  std::vector<Number> numbers(bytes.size() / sizeof(Number));
  if (!numbers.empty()) std::memcpy(numbers.data(), bytes.data(), bytes.size());
  return numbers;
}

// The sum over all ranks of whole numbers: their order does not matter.
void add_up(Ranks& ranks, std::vector<std::int64_t>& numbers);

// First index of a rank's share, where `count` things are divided into `shares` runs of about equal length.
inline std::size_t share_begin(std::size_t count, std::size_t share, std::size_t shares) {
  return count / shares * share + count % shares * share / shares;
}

}  // namespace itn
