// itn: one binary, sub-commands; see tools/README.md.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>

#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/base/printable.h"
#include "runtime/cluster/mpi_ranks.h"
#include "runtime/device/device.h"
#include "tools/common.h"
#include "tools/interrupt.h"
#include "tools/manual.h"
#include "tools/passive_wait.h"
#include "tools/version_text.h"

namespace {

// What scripts may rely on.
enum ExitCode { done = 0, failed = 1, bad_command_line = 2, bad_input = 3, device_failure = 4, interrupted = 130 };

constexpr const char* ended_with_others =
    "interrupted, or another rank was ended; the same command goes on from what is stored";
std::unique_ptr<itn::StartedRanks> ranks;  // none: the program was started once

// What all ranks have found wrong the first says; what only another has found, that one says a moment later, unless it
// was ended by then.
void say(ExitCode code, const char* text) {
  const bool is_other = ranks && !ranks->is_first();
  if (is_other && code == interrupted) return;
  if (is_other) std::this_thread::sleep_for(std::chrono::seconds(1));
  const std::string who = ranks && !ranks->alone() ? "rank " + std::to_string(ranks->rank()) + ": " : "";
  std::fprintf(stderr, "itn: %s%s\n", who.c_str(), itn::printable(text).c_str());
}

// An interrupted command may fail in other ways first: a driver whose compiler was interrupted reports a failed build.
int report(ExitCode code, const char* text) {
  if (itn::tools::interrupt_flag()) {
    code = interrupted;
    text = ranks && !ranks->alone() ? ended_with_others : "interrupted";
  }
  say(code, text);
  return code;
}

std::string describe(const CLI::App& app, const CLI::ParseError& error, const std::string& first_argument) {
  if (!app.get_subcommands().empty()) return app.get_subcommands().front()->get_name() + ": " + error.what();
  std::string names;
  for (const CLI::App* command : app.get_subcommands({})) names += (names.empty() ? "" : ", ") + command->get_name();
  return "got " + (first_argument.empty() ? "no sub-command" : first_argument) + ", need one of " + names;
}

// Writing and printing is for the first rank.
void be_one_of_several(std::string_view command) {
  constexpr std::array<std::string_view, 6> shared{"dataset", "eval", "gradient", "invert", "render", "train"};
  if (!ranks || ranks->alone()) return;
  if (std::find(shared.begin(), shared.end(), command) == shared.end())
    throw itn::UsageError(std::string(command) + ": is no work for several processes; start it without mpirun");
  itn::set_world(ranks.get());
  itn::set_writing(ranks->is_first());
  static const std::string end_text = std::string("itn: rank 0: ") + ended_with_others + "\n";
  itn::tools::say_when_ended(ranks->is_first() ? end_text.c_str() : "");
  if (!ranks->is_first() && !std::freopen("/dev/null", "w", stdout))
    throw itn::ResultError("/dev/null: cannot be opened");
}

int run(int argc, char** argv) {
  CLI::App app{"Volumetric path tracing on OpenCL for translucent materials", "itn"};
  app.set_version_flag("--version", itn::tools::version_text, "version, devices, and libraries");
  app.require_subcommand(1);
  itn::tools::add_bench(app);
  itn::tools::add_dataset(app);
  itn::tools::add_devices(app);
  itn::tools::add_eval(app);
  itn::tools::add_export(app);
  itn::tools::add_gradcheck(app);
  itn::tools::add_render(app);
  itn::tools::add_gradient(app);
  itn::tools::add_invert(app);
  itn::tools::add_parameters(app);
  itn::tools::add_predict(app);
  itn::tools::add_shapes(app);
  itn::tools::add_train(app);
  itn::tools::add_view(app);
  // For the build.
  std::string folder;
  CLI::App* manual = app.add_subcommand("manual", "writes manual pages and completions into a folder")->group("");
  manual->add_option("folder", folder)->required();
  manual->callback([&] { itn::tools::write_manual(app, folder); });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    return report(bad_command_line, (describe(app, error, argc > 1 ? argv[1] : "") + "; see itn --help").c_str());
  }
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw itn::ResultError("standard output: cannot be written; is the disk full?");
  return done;
}

int run_and_report(int argc, char** argv) {
  try {
    ranks = itn::join_ranks(itn::tools::interrupt_flag());
    itn::tools::watch_for_interrupt();  // after MPI, which has handlers of its own
    be_one_of_several(argc > 1 ? argv[1] : "");
    for (int i = 1; i < argc; ++i)  // they become names in images, JSON and messages
      if (!itn::is_utf8(argv[i]))
        throw itn::UsageError(std::string(argv[i]) + ": is no text in UTF-8; rename the file, or give a link to it");
    return run(argc, argv);
  } catch (const itn::UsageError& error) {
    return report(bad_command_line, error.what());
  } catch (const itn::InputError& error) {
    return report(bad_input, error.what());
  } catch (const itn::DeviceError& error) {
    return report(device_failure, error.what());
  } catch (const itn::Interrupted& error) {
    return report(interrupted, error.what());
  } catch (const itn::ResultError& error) {
    return report(failed, error.what());
  } catch (const cl::Error& error) {
    return report(device_failure,
                  (std::string(error.what()) + ": OpenCL error " + std::to_string(error.err())).c_str());
  } catch (const std::filesystem::filesystem_error& error) {
    return report(failed, (error.path1().string() + ": cannot be reached; " + error.code().message()).c_str());
  } catch (const std::system_error& error) {  // of fmt::print
    if (std::ferror(stdout) != 0)
      return report(failed, "standard output: cannot be written; is the disk full or the reader gone?");
    return report(failed, (std::string("the system refuses: ") + error.what()).c_str());
  } catch (const std::bad_alloc&) {
    return report(failed, "out of memory on the host; use a smaller mesh or image");
  } catch (const std::exception& error) {
    return report(failed, (std::string("internal error, please report it: ") + error.what()).c_str());
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "train") itn::tools::wait_asleep(argv);
  itn::tools::open_standard_files();
  const int code = run_and_report(argc, argv);
  if (ranks && code != done) ranks->end_all(code);
  if (ranks) ranks->leave();
  return code;
}
