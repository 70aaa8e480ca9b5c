// itn: one binary, sub-commands; see tools/README.md.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <new>
#include <oneapi/dnnl/dnnl.hpp>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "itn/device.h"
#include "itn/error.h"
#include "itn/file.h"
#include "network/model/threads.h"
#include "runtime/base/input_errors.h"
#include "runtime/base/limits.h"
#include "runtime/base/parallel.h"
#include "runtime/base/printable.h"
#include "runtime/base/ranks/local_ranks.h"
#include "runtime/base/ranks/mpi_ranks.h"
#include "tools/itn/common.h"
#include "tools/itn/interrupt.h"
#include "tools/itn/manual.h"
#include "tools/itn/passive_wait.h"
#include "tools/itn/version_text.h"

namespace {

using itn::printable, itn::printable_lines;

// Scripts may rely on these.
enum ExitCode { done = 0, failed = 1, bad_command_line = 2, bad_input = 3, device_failure = 4, interrupted = 130 };

constexpr const char* ended_with_others =
    "interrupted, or another rank was ended; the same command goes on from what is stored";
std::unique_ptr<itn::StartedRanks> ranks;  // none: the program was started once

// The first rank says what all ranks have found wrong; another rank says what it alone has found a moment later, unless
// it was ended by then.
void say(ExitCode code, const std::string& text) {
  const bool is_other = ranks && !ranks->is_first();
  if (is_other && code == interrupted) return;
  if (is_other) std::this_thread::sleep_for(std::chrono::seconds(1));
  const std::string who = ranks && !ranks->alone() ? "rank " + std::to_string(ranks->rank()) + ": " : "";
  std::fprintf(stderr, "itn: %s%s\n", who.c_str(), text.c_str());
}

// An interrupted command may fail in other ways first: a driver whose compiler was interrupted reports a failed build.
int report(ExitCode code, std::string text) {
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
    throw itn::UsageError(std::string(command) +
                          ": is no work for several processes; start it without mpirun, with one --device");
  itn::set_world(ranks.get());
  itn::set_writing(ranks->is_first());
  static const std::string end_text = std::string("itn: rank 0: ") + ended_with_others + "\n";
  itn::tools::say_when_ended(ranks->is_first() ? end_text.c_str() : "");
  if (!ranks->is_first() && !std::freopen("/dev/null", "w", stdout))
    throw itn::ResultError("/dev/null: cannot be opened");
}

// CLI11's help, with one empty line between groups of options, not two.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    return CLI::detail::find_and_replace(CLI::Formatter::make_help(app, std::move(name), mode), "\n\n\n", "\n\n");
  }
};

int run(int argc, char** argv) {
  CLI::App app{"Volumetric path tracing on OpenCL for translucent materials", "itn"};
  app.set_version_flag("--version", itn::tools::version_text, "Print the version, devices and libraries");
  app.require_subcommand(1);
  app.formatter(std::make_shared<HelpFormatter>());  // the commands take it over
  itn::tools::add_bench(app);
  itn::tools::add_dataset(app);
  itn::tools::add_devices(app);
  itn::tools::add_plugins(app);
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
  itn::tools::add_example(app, "itn render scenes/gallery/jade_knot.xml -o knot.exr --preview",
                          "`itn COMMAND --help` lists the options of a command.");
  // For the build.
  std::string folder;
  CLI::App* manual = app.add_subcommand("manual", "Write manual pages and completions into a folder")->group("");
  manual->add_option("folder", folder)->required();
  manual->callback([&] { itn::tools::write_manual(app, folder); });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0)
      return report(bad_command_line, printable(describe(app, error, argc > 1 ? argv[1] : "")) + "; see itn --help");
    app.exit(error);  // --help, --version
  }
  if (!std::cout.flush() || std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw itn::ResultError("standard output: cannot be written; is the disk full?");
  return done;
}

// The devices of --device, or else of ITN_DEVICE: one or several, between commas; and the place of the argument.
struct GivenDevices {
  std::vector<std::string> list;
  std::size_t argument = 0;  // 0: in the environment
  std::string before;        // of the argument: "" or "--device="
};

GivenDevices given_devices(const std::vector<std::string>& arguments) {
  const char* variable = std::getenv("ITN_DEVICE");
  GivenDevices given;
  std::string text = variable ? variable : "";
  const std::string option = "--device";
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    const bool whole = arguments[i] == option && i + 1 < arguments.size();
    if (!whole && !arguments[i].starts_with(option + "=")) continue;
    given.before = whole ? "" : option + "=";
    given.argument = whole ? i + 1 : i;
    text = arguments[given.argument].substr(given.before.size());
  }
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    given.list.push_back(text.substr(at, comma - at));
    at = comma + 1;
  }
  return given;
}

// Each takes a process, with a compiler and memory of its own.
void check_number(const std::vector<std::string>& devices) {
  constexpr std::size_t most = 64;
  if (devices.size() > most)
    throw itn::UsageError(fmt::format("--device: got {} devices, need at most {}", devices.size(), most));
  const std::size_t most_alike = std::max<std::size_t>(4, itn::core_count());
  std::map<std::string, std::size_t> times;
  for (const std::string& device : devices) {
    if (device.empty())
      throw itn::UsageError("--device: got a comma without a device beside it; need for instance 0,1");
    if (++times[device] > most_alike)
      throw itn::UsageError(
          fmt::format("--device: got {} {} times; one device is no faster in several processes: name "
                      "it once, at most {} times",
                      device, std::count(devices.begin(), devices.end(), device), most_alike));
  }
}

// Each process gets one of several devices: a process of this command its own, those that mpirun has started on a node
// one after the other.
void take_device(std::vector<std::string>& arguments) {
  const GivenDevices given = given_devices(arguments);
  const std::size_t count = given.list.size();
  if (count < 2) return;
  check_number(given.list);
  if (!ranks) ranks = itn::start_local_ranks(static_cast<int>(count), itn::tools::interrupt_flag());
  const std::string& mine = given.list[static_cast<std::size_t>(itn::rank_on_node(*ranks)) % count];
  if (given.argument > 0)
    arguments[given.argument] = given.before + mine;
  else
    setenv("ITN_DEVICE", mine.c_str(), 1);
}

// Only the commands that run networks say so: of the others OpenMP computes nothing.
void limit_threads(std::string_view command) {
  constexpr std::array<std::string_view, 3> networks{"eval", "predict", "train"};
  const int asked = itn::limit_threads();
  if (asked > 0 && std::find(networks.begin(), networks.end(), command) != networks.end())
    std::fprintf(stderr, "warning: OMP_NUM_THREADS is %d, and this machine has %d cores, for as many threads; %s\n",
                 asked, itn::threads(), itn::how_to_force_threads);
}

int run_and_report(int argc, char** argv) {
  try {
    if (argc > 1 && std::string_view(argv[1]) == "train") itn::tools::wait_asleep(argv);
    limit_threads(argc > 1 ? argv[1] : "");
    std::vector<std::string> arguments(argv, argv + argc);
    ranks = itn::join_ranks(itn::tools::interrupt_flag());
    take_device(arguments);
    itn::tools::watch_for_interrupt();  // after MPI, which has handlers of its own
    be_one_of_several(argc > 1 ? argv[1] : "");
    for (const std::string& argument : arguments)  // they become names in images, JSON and messages
      if (!itn::is_utf8(argument))
        throw itn::UsageError(argument + ": is no text in UTF-8; rename the file, or give a link to it");
    std::vector<char*> pointers;
    pointers.reserve(arguments.size());
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    return run(argc, pointers.data());
  } catch (const itn::UsageError& error) {
    return report(bad_command_line, printable_lines(error.what()));
  } catch (const itn::InputErrors& error) {
    return report(bad_input, printable_lines(error.what()));
  } catch (const itn::InputError& error) {
    return report(bad_input, printable(error.what()));
  } catch (const itn::DeviceError& error) {
    return report(device_failure, printable_lines(error.what()));
  } catch (const itn::Interrupted& error) {
    return report(interrupted, error.what());
  } catch (const itn::ResultError& error) {
    return report(failed, printable(error.what()));
  } catch (const cl::Error& error) {
    return report(device_failure, std::string(error.what()) + ": OpenCL error " + std::to_string(error.err()));
  } catch (const std::filesystem::filesystem_error& error) {
    return report(failed, printable(error.path1().string()) + ": cannot be reached; " + error.code().message());
  } catch (const std::system_error& error) {  // of fmt::print
    if (std::ferror(stdout) != 0)
      return report(failed, "standard output: cannot be written; is the disk full or the reader gone?");
    return report(failed, std::string("the system refuses: ") + error.what() + itn::limits_in_force());
  } catch (const std::bad_alloc&) {
    return report(failed, "out of memory on the host; use a smaller mesh or image" + itn::limits_in_force());
  } catch (const dnnl::error& error) {
    return report(failed, std::string("oneDNN, which computes networks, gives up: ") + printable(error.what()) +
                              "; is there memory left" + itn::limits_in_force() + "?");
  } catch (const std::exception& error) {
    const std::string limits = itn::limits_in_force();
    return report(failed, (limits.empty() ? "internal error, please report it: " : "a library gives up: ") +
                              printable(error.what()) + limits);
  }
}

}  // namespace

int main(int argc, char** argv) {
  itn::tools::open_standard_files();
  const int code = run_and_report(argc, argv);
  if (ranks && code != done) ranks->end_all(code);
  if (ranks) ranks->leave();
  return code;
}
