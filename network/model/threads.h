// Number of threads that the network's layers and the making of its inputs use: the bits of its gradients depend on it
// (README.md).
#pragma once

namespace itn {

int threads();  // OMP_NUM_THREADS, else one a core, unless set; at most one a core

// Throws UsageError for more than one a core: they wait for each other, and thousands end the process.
void set_threads(int count);

// To be called before anything is computed: holds OpenMP, which has read OMP_NUM_THREADS, to one thread a core. Returns
// what OMP_NUM_THREADS said where it was more, else 0.
int limit_threads();

// Digits depend on the number of threads: those of a larger machine are had so.
inline constexpr const char* how_to_force_threads =
    "ITN_FORCE_THREADS=1 in the environment takes as many as are asked for";

}  // namespace itn
