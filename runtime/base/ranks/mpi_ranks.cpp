#include "runtime/base/ranks/mpi_ranks.h"

#include <mpi.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <climits>
#include <cstdlib>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>

#include "itn/error.h"
#include "runtime/base/parallel.h"
#include "runtime/base/ranks/work_queue.h"

namespace itn {
namespace {

using Clock = std::chrono::steady_clock;

enum Tag { ASK = 1, GIVE = 2 };

void check(int code, const char* what) {
  if (code != MPI_SUCCESS) throw ResultError(std::string("MPI: ") + what + " failed; was another rank killed?");
}

int as_int(std::size_t bytes) {
  if (bytes > INT_MAX) throw ResultError("MPI: more than 2 GiB in one message; use more ranks, or a smaller job");
  return static_cast<int>(bytes);
}

// A loop that asks all the time takes a core from whoever works. For a moment, since most messages come soon; then with
// pauses.
void pause_since(Clock::time_point start) {
  const auto waited = Clock::now() - start;
  if (waited < std::chrono::microseconds(100)) return;
  std::this_thread::sleep_for(waited < std::chrono::milliseconds(20) ? std::chrono::microseconds(50)
                                                                     : std::chrono::microseconds(500));
}

std::vector<int> offsets_of(const std::vector<int>& counts) {
  std::vector<int> offsets(counts.size());
  std::exclusive_scan(counts.begin(), counts.end(), offsets.begin(), 0);
  return offsets;
}

std::vector<std::string> cut(const std::string& all, const std::vector<int>& counts) {
  std::vector<std::string> parts;
  std::size_t at = 0;
  for (const int count : counts) {
    parts.push_back(all.substr(at, static_cast<std::size_t>(count)));
    at += static_cast<std::size_t>(count);
  }
  return parts;
}

class MpiRanks : public StartedRanks {
 public:
  explicit MpiRanks(const std::atomic<bool>& cancel) : cancel_(cancel) {
    int provided = MPI_THREAD_SINGLE;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided);
    if (provided < MPI_THREAD_SERIALIZED)
      throw ResultError("MPI: this library allows calls from the first thread only; install Open MPI, or build it so");
    MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &count_);
  }

  int rank() const override { return rank_; }
  int count() const override { return count_; }

  void meet() override {
    MPI_Request request = MPI_REQUEST_NULL;
    check(MPI_Ibarrier(MPI_COMM_WORLD, &request), "waiting for all ranks");
    wait(request);
    traffic_.messages += 1;
  }

  std::vector<std::string> gather(const std::string& mine) override {
    const std::vector<int> counts = sizes_from_all(std::vector<int>(size_t(count_), as_int(mine.size())));
    const std::vector<int> offsets = offsets_of(counts);
    std::string all(total(counts), '\0');
    MPI_Request request = MPI_REQUEST_NULL;
    check(MPI_Iallgatherv(mine.data(), as_int(mine.size()), MPI_BYTE, all.data(), counts.data(), offsets.data(),
                          MPI_BYTE, MPI_COMM_WORLD, &request),
          "gathering");
    wait(request);
    count_traffic(mine.size() * (size_t(count_) - 1));
    return cut(all, counts);
  }

  std::vector<std::string> exchange(const std::vector<std::string>& to_each) override {
    std::string out;
    std::vector<int> sent;
    for (const std::string& part : to_each) {
      out += part;
      sent.push_back(as_int(part.size()));
    }
    as_int(out.size());
    const std::vector<int> received = sizes_from_all(sent);
    const std::vector<int> from = offsets_of(sent), to = offsets_of(received);
    std::string in(total(received), '\0');
    MPI_Request request = MPI_REQUEST_NULL;
    check(MPI_Ialltoallv(out.data(), sent.data(), from.data(), MPI_BYTE, in.data(), received.data(), to.data(),
                         MPI_BYTE, MPI_COMM_WORLD, &request),
          "exchanging");
    wait(request);
    count_traffic(out.size() - to_each[size_t(rank_)].size());
    return cut(in, received);
  }

  // The first rank answers from a thread of its own; MPI is then called from nowhere else there.
  void hand_out(std::size_t count, std::size_t most, const Work& work) override {
    meet();
    if (is_first()) {
      WorkQueue queue(count, most, count_);
      std::jthread server([&](const std::stop_token& stop) { serve(queue, stop); });
      for (WorkRange range = queue.take(); range[0] < range[1]; range = queue.take()) work(range[0], range[1]);
      server_done_.wait(false);
      server_done_ = false;
    } else {
      for (WorkRange range = ask(); range[0] < range[1]; range = ask()) work(range[0], range[1]);
    }
    meet();
  }

  Traffic traffic() const override { return traffic_; }

  void leave() override { MPI_Finalize(); }
  [[noreturn]] void end_all(int exit_code) override {
    MPI_Abort(MPI_COMM_WORLD, exit_code);
    _exit(exit_code);
  }

 private:
  static std::size_t total(const std::vector<int>& counts) {
    std::size_t sum = 0;
    for (const int count : counts) sum += static_cast<std::size_t>(count);
    as_int(sum);
    return sum;
  }

  void wait(MPI_Request& request) const {
    const auto start = Clock::now();
    for (int done = 0;;) {
      check(MPI_Test(&request, &done, MPI_STATUS_IGNORE), "waiting for another rank");
      if (done) return;
      if (cancel_) throw Interrupted();
      pause_since(start);
    }
  }

  std::vector<int> sizes_from_all(const std::vector<int>& to_each) {
    std::vector<int> sizes(to_each.size());
    MPI_Request request = MPI_REQUEST_NULL;
    check(MPI_Ialltoall(to_each.data(), 1, MPI_INT, sizes.data(), 1, MPI_INT, MPI_COMM_WORLD, &request), "exchanging");
    wait(request);
    count_traffic(sizeof(int) * (to_each.size() - 1));
    return sizes;
  }

  void count_traffic(std::size_t bytes) {
    traffic_.messages += size_t(count_) - 1;
    traffic_.bytes += bytes;
  }

  void serve(WorkQueue& queue, const std::stop_token& stop) {
    int working = count_ - 1;
    for (auto idle = Clock::now(); working > 0 && !stop.stop_requested();) {
      int found = 0;
      MPI_Status status;
      if (MPI_Iprobe(MPI_ANY_SOURCE, ASK, MPI_COMM_WORLD, &found, &status) != MPI_SUCCESS) break;
      if (!found) {
        pause_since(idle);
        continue;
      }
      MPI_Recv(nullptr, 0, MPI_BYTE, status.MPI_SOURCE, ASK, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
      const WorkRange range = queue.take();
      working -= range[0] == range[1];
      MPI_Send(range.data(), 2, MPI_UINT64_T, status.MPI_SOURCE, GIVE, MPI_COMM_WORLD);
      traffic_.messages += 1;
      traffic_.bytes += sizeof range;
      idle = Clock::now();
    }
    server_done_ = true;
    server_done_.notify_one();
  }

  WorkRange ask() {
    WorkRange range{};
    check(MPI_Send(nullptr, 0, MPI_BYTE, 0, ASK, MPI_COMM_WORLD), "asking for work");
    MPI_Request request = MPI_REQUEST_NULL;
    check(MPI_Irecv(range.data(), 2, MPI_UINT64_T, 0, GIVE, MPI_COMM_WORLD, &request), "asking for work");
    wait(request);
    traffic_.messages += 1;
    return range;
  }

  const std::atomic<bool>& cancel_;
  int rank_ = 0, count_ = 1;
  Traffic traffic_;
  std::atomic<bool> server_done_{false};
};

// A rank on a node with others takes its share of the node's cores, unless the user has said how many.
void share_cores() {
  const char* here = std::getenv("OMPI_COMM_WORLD_LOCAL_SIZE");
  const long on_node = here ? std::strtol(here, nullptr, 10) : 1, cores = sysconf(_SC_NPROCESSORS_ONLN);
  if (on_node <= 1) return;
  const long bound = static_cast<long>(core_count());  // to which the launcher may have bound this rank
  const std::string threads = std::to_string(std::max(1L, std::min(bound, cores / on_node)));
  setenv("POCL_MAX_PTHREAD_COUNT", threads.c_str(), 0);
  setenv("OMP_NUM_THREADS", threads.c_str(), 0);
}

}  // namespace

std::unique_ptr<StartedRanks> join_ranks(const std::atomic<bool>& cancel) {
  // Set by Open MPI's mpirun, by Slurm's srun --mpi=pmix or pmi2, and by other launchers. Without one, nothing is
  // begun: it would take a tenth of a second.
  const auto is_set = [](const char* name) { return std::getenv(name) != nullptr; };
  if (!is_set("OMPI_COMM_WORLD_SIZE") && !is_set("PMIX_RANK") && !is_set("PMI_RANK")) return nullptr;
  share_cores();
  return std::make_unique<MpiRanks>(cancel);
}

}  // namespace itn
