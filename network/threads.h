// How many threads the network's layers use, and those that make what it sees: the bits of its gradients depend on it
// (README.md).
#pragma once

namespace itn {

int threads();  // OMP_NUM_THREADS, else one a core, unless set
void set_threads(int count);

}  // namespace itn
