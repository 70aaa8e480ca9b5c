// Ctrl-C, SIGTERM and SIGHUP: an orderly end within a second, without a partial file. Until watch_for_interrupt() they
// end the program at once, from before the libraries' own start on. SIGQUIT, SIGUSR1 and SIGUSR2 end it by the signal.
#pragma once
#include <atomic>

namespace itn::tools {

// The first signal sets the flag for whoever polls it. What cannot poll (loading a scene, a driver compiling kernels)
// is ended 0.5 s later, or at once by a second signal: an unfinished output file is removed, the exit code is 130.
void watch_for_interrupt();

// Sets the text that is printed when a signal ends the program at once, instead of "interrupted". It must live as long.
void say_when_ended(const char* text);

// If standard input, output or error is closed, the next file that is opened would take its place and get what is
// meant for it. To be called before any file is opened.
void open_standard_files();

const std::atomic<bool>& interrupt_flag();

// While one lives, the flag is polled, and what was done is stored before the end: the first signal only sets the flag.
// A second one still ends at once.
class OrderlyEnd {
 public:
  OrderlyEnd();
  ~OrderlyEnd();
  OrderlyEnd(const OrderlyEnd&) = delete;
  OrderlyEnd& operator=(const OrderlyEnd&) = delete;
};

}  // namespace itn::tools
