// Signals, at any moment of a command's life.
#include <signal.h>
#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <filesystem>
#include <thread>

#include "itn/file.h"
#include "tests/support/made_up_dataset.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

namespace {

using Catch::Contains;

constexpr rlim_t no_core = 0;

std::vector<std::string> endless_render(const std::string& output) {
  return {"render", ball, "-o", output, "--spp", "100000000", "--size", "64x64"};
}

}  // namespace

TEST_CASE("SIGQUIT, SIGUSR1 and SIGUSR2 end a command by the signal, also once the driver has compiled") {
  for (const int signal_number : {SIGQUIT, SIGUSR1, SIGUSR2}) {
    CAPTURE(signal_number);
    const TemporaryFolder folder;
    // A cache of its own, so that something is compiled: LLVM then sets handlers, SIGILL's among them.
    Process process(endless_render(folder / "a.exr"),
                    {.environment = {{"POCL_CACHE_DIR", folder / "cache"}}, .limits = {{RLIMIT_CORE, no_core}}});
    wait_until([&] { return process.handles(SIGILL) || process.cpu_seconds() > 8; });
    process.send(signal_number);
    CHECK(process.wait().exit_code == -signal_number);
    CHECK_FALSE(itn::is_there(folder / "a.exr"));
  }
}

TEST_CASE("a command that is asked to end as soon as it has begun says that it was interrupted") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 16, 4);
  set.write_manifest();
  const std::vector<std::string> train{"train",   set.folder, "--network", "rn",     "--width", "2",
                                       "--batch", "4",        "--epochs",  "100000", "-o",      folder / "run"};
  for (const int signal_number : {SIGINT, SIGTERM, SIGHUP})
    for (const std::vector<std::string>& arguments : {endless_render(folder / "a.exr"), train})
      for (const int milliseconds : {0, 1, 3, 10, 30, 60, 100}) {
        CAPTURE(signal_number, milliseconds, arguments.front());
        // train starts itself again in that time.
        Process process(arguments, {.environment = {{"OMP_NUM_THREADS", "1"}}});
        wait_until([&] { return process.handles(signal_number); });
        std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
        process.send(signal_number);
        const Result result = process.wait();
        CHECK(result.exit_code == 130);
        CHECK_THAT(result.error, Contains("interrupted"));
      }
}

TEST_CASE("a command whose processor time ends says so") {
  const TemporaryFolder folder;
  const Result result = run_itn(endless_render(folder / "a.exr"), {.limits = {{RLIMIT_CPU, 2}}});
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.error, Contains("ulimit -t"));
  CHECK(folder.empty());
}
