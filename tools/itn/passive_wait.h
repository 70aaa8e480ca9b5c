// The way in which the network's threads wait for each other.
#pragma once

namespace itn::tools {

// Asleep, not in a busy loop: where a machine has other work too (another process, OpenCL's own threads), that is
// several times faster. OpenMP reads OMP_WAIT_POLICY when the program is loaded, so the program starts itself again
// with it; where somebody has set it already, or that fails, this returns. To be called before there are threads.
void wait_asleep(char** argv);

}  // namespace itn::tools
