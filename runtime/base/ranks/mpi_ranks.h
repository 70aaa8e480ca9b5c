// Ranks by MPI: `mpirun -n N itn ...`. The one place that knows MPI; a build without it has another mpi_ranks.
#pragma once
#include <atomic>
#include <memory>

#include "runtime/base/ranks.h"

namespace itn {

class StartedRanks : public Ranks {
 public:
  // Takes leave of the others: at the end of a program in which nothing failed.
  virtual void leave() = 0;
  // Ends all ranks with this exit code. Does not return.
  [[noreturn]] virtual void end_all(int exit_code) = 0;
};

// Null where the program was not started as one of several. cancel: polled wherever one waits for the others; must
// outlive the result. Throws UsageError: as one of several, and the build knows no MPI.
std::unique_ptr<StartedRanks> join_ranks(const std::atomic<bool>& cancel);

}  // namespace itn
