// For a program that starts itself again.
#pragma once

namespace itn::tools {

// Ctrl-C, SIGTERM and SIGHUP wait, also beyond an execv(), until the program's next start takes them (interrupt.cpp).
void hold_signals();

}  // namespace itn::tools
