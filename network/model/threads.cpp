#include "network/model/threads.h"

#include <omp.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <string>

#include "itn/error.h"
#include "runtime/base/parallel.h"

namespace itn {
namespace {

int most_threads() {
  const char* force = std::getenv("ITN_FORCE_THREADS");
  return force && *force ? std::numeric_limits<int>::max() : static_cast<int>(core_count());
}

}  // namespace

int threads() { return std::min(omp_get_max_threads(), most_threads()); }

void set_threads(int count) {
  if (count > most_threads())
    throw UsageError(std::to_string(count) + " threads: this machine has " + std::to_string(core_count()) +
                     " cores, for as many; " + how_to_force_threads);
  omp_set_num_threads(count);
}

int limit_threads() {
  const int asked = omp_get_max_threads();
  if (asked <= most_threads()) return 0;
  omp_set_num_threads(most_threads());
  return asked;
}

}  // namespace itn
