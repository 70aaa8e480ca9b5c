// Inversions from several starts, stored in a folder after every iteration (state.json, and iterations.jsonl to read
// along), so that the same request goes on where it was stopped.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "runtime/base/stored_run.h"
#include "runtime/inverse/gauss_newton/started_inversion.h"

namespace itn {

// The coordinates where `count` inversions start: the first at `first`, the others at random, all between the two
// numbers that `ranges` has for the parameter's name. Throws UsageError: not two numbers in its range, the smaller
// first.
std::vector<std::vector<double>> inversion_starts(const std::vector<Coordinate>& coordinates,
                                                  const std::vector<double>& first, int count, std::uint64_t seed,
                                                  const std::map<std::string, std::pair<double, double>>& ranges = {});

class StoredInversion {
 public:
  // request: all that the numbers depend on. inversion must outlive this. Throws UsageError: the folder holds an
  // inversion of another request; InputError: it is damaged; ResultError: not writable or another process's.
  // starts: all that there may be; wanted: how many of them are run without another(); 0: all.
  StoredInversion(const std::string& folder, const StoredRun::Json& request, Inversion& inversion,
                  const std::vector<Coordinate>& coordinates, std::vector<std::vector<double>> starts,
                  std::size_t wanted = 0);

  bool finished() const;  // those that are wanted
  // One more start is wanted, if there is one. True: there is.
  bool another();
  // The current start, which is heading for an earlier one's end, is done; it is stored.
  void join(std::size_t earlier);
  // The start whose iteration is next, or was last.
  std::size_t current() const { return started_.size() - 1; }
  // One iteration of the first start that is not done; it is stored. Throws Interrupted: nothing has changed then.
  const InversionStep& advance();
  // The fraction done of the wanted starts, if each took `most` iterations.
  double fraction(int most) const;
  const std::vector<StartedInversion>& started() const { return started_; }

 private:
  void store() const;

  RunFolder folder_;
  StoredRun::Json request_;
  Inversion& inversion_;
  const std::vector<Coordinate>& coordinates_;
  std::vector<std::vector<double>> starts_;
  std::size_t wanted_;
  std::vector<StartedInversion> started_;
};

}  // namespace itn
