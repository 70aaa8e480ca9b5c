#include <cstdlib>
#include <string>

#include "itn/error.h"
#include "runtime/base/ranks/mpi_ranks.h"

namespace itn {

std::unique_ptr<StartedRanks> join_ranks(const std::atomic<bool>& /*cancel*/) {
  const char* count = std::getenv("OMPI_COMM_WORLD_SIZE");
  if (count && std::string(count) != "1")
    throw UsageError(
        "started by mpirun, and this itn was built without MPI: install libopenmpi-dev and build it again, or start it "
        "once (data sets: once for each part, K/N)");
  return nullptr;
}

}  // namespace itn
