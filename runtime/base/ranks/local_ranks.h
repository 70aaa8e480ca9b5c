// Ranks on this machine without MPI: a process for each of several devices, `itn ... --device 0,1`.
#pragma once
#include <atomic>
#include <memory>

#include "runtime/base/ranks/mpi_ranks.h"

namespace itn {

// Starts count - 1 copies of this process, which return from here, too, as ranks 1 and so on; they end with the first.
// Before threads and OpenCL. cancel: polled wherever one waits for the others; must outlive the result. Throws
// ResultError: the system has no more processes.
std::unique_ptr<StartedRanks> start_local_ranks(int count, const std::atomic<bool>& cancel);

}  // namespace itn
