// Limits that a shell sets, and surroundings that lack something: the exit codes of the contract, with a message.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

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

std::vector<std::string> small_render(const std::string& output) {
  return {"render", ball, "-o", output, "--spp", "2", "--size", "4x4"};
}

}  // namespace

TEST_CASE("help and the version that cannot be printed are a failed result") {
  for (const auto& arguments :
       std::vector<std::vector<std::string>>{{"--help"}, {"--version"}, {"render", "--help"}, {"train", "-h"}}) {
    const Result result = run_itn(arguments, {.output_file = "/dev/full"});
    CAPTURE(arguments.front());
    CHECK(result.exit_code == 1);
    CHECK_THAT(result.error, Contains("standard output"));
  }
}

TEST_CASE("memory that ends is said, whatever runs out of it") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 16, 4);
  set.write_manifest();
  const std::vector<std::vector<std::string>> commands{
      {"parameters", ball},
      small_render(folder / "a.exr"),
      {"devices"},
      {"train", set.folder, "--network", "rn", "--epochs", "1", "--batch", "4", "--width", "2", "--threads", "1", "-o",
       folder / "run"}};
  for (const rlim_t mib : {130, 150, 170, 200, 230, 270, 320, 400, 600})
    for (const std::vector<std::string>& arguments : commands) {
      const Result result = run_itn(arguments, {.limits = {{RLIMIT_AS, mib << 20}}});
      CAPTURE(mib, arguments.front(), result.error);
      if (result.exit_code == 127) continue;  // the system cannot even load the program
      CHECK((result.exit_code == 0 || result.exit_code == 1 || result.exit_code == 4));
      if (result.exit_code != 0) CHECK(!result.error.empty());
      CHECK_THAT(result.error, !Contains("report it") && !Contains("no installed driver"));
    }
}

TEST_CASE("files may be neither too large nor too many") {
  const TemporaryFolder folder;
  const Process::Options short_files{.limits = {{RLIMIT_FSIZE, 6000}}};  // messages have to fit
  const std::string network = ITN_SOURCE_DIR "/network/weights/network.safetensors";
  const Result large = run_itn({"export", network, "-o", folder / "large.onnx"}, short_files);
  CHECK(large.exit_code == 1);
  CHECK_THAT(large.error, Contains("large.onnx") && Contains("ulimit -f"));
  std::vector<std::string> picture = small_render(folder / "large.exr");
  picture.back() = "64x64";
  const Result rendered = run_itn(picture, short_files);  // PoCL writes files, too
  CHECK((rendered.exit_code == 1 || rendered.exit_code == 4));
  CHECK_THAT(rendered.error, Contains("ulimit -f"));
  CHECK(folder.empty());
  for (const rlim_t most : {4, 6, 8, 12, 20}) {
    const Result many = run_itn(small_render(folder / "many.exr"), {.limits = {{RLIMIT_NOFILE, most}}});
    CAPTURE(most, many.error);
    if (many.exit_code == 127) continue;
    CHECK((many.exit_code == 0 || many.exit_code == 1 || many.exit_code == 3 || many.exit_code == 4));
    if (many.exit_code != 0) CHECK_THAT(many.error, Contains("open files") || Contains("ulimit"));
  }
}

TEST_CASE("a program that is compiled is linked without PATH, too") {
  const TemporaryFolder folder;
  for (const char* path : {"", "/nowhere"}) {
    const Result result = run_itn(small_render(folder / "a.exr"),
                                  {.environment = {{"PATH", path}, {"POCL_CACHE_DIR", folder / "cache"}}});
    CAPTURE(path, result.error);
    CHECK(result.exit_code == 0);
    std::filesystem::remove_all(folder / "cache");
  }
}

TEST_CASE("a pipe is no output while nobody reads it, and gets the whole file where somebody does") {
  const TemporaryFolder folder;
  const std::string pipe = folder / "pipe";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           small_render(pipe), {"parameters", ball, "--json", pipe}, {"devices", "--json", pipe}}) {
    const Result result = run_itn(arguments);
    CHECK(result.exit_code == 1);
    CHECK_THAT(result.error, Contains("nobody reads from it"));
  }
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  REQUIRE(reader >= 0);
  Process process(small_render(pipe), {});
  std::string bytes;
  fcntl(reader, F_SETFL, 0);
  wait_until([&] {
    char part[4096];
    const ssize_t n = read(reader, part, sizeof part);
    if (n > 0) bytes.append(part, static_cast<std::size_t>(n));
    return n == 0 && !bytes.empty();
  });
  close(reader);
  CHECK(process.wait().exit_code == 0);
  CHECK_THAT(bytes, Catch::StartsWith("\x76\x2f\x31\x01"));
}

TEST_CASE("no more threads than cores, unless they are forced") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 16, 4);
  set.write_manifest();
  const auto train = [&](const std::string& run, const std::vector<std::string>& more,
                         const std::map<std::string, std::string>& environment) {
    std::vector<std::string> arguments{"train",    set.folder, "--network", "rn", "--width", "2",
                                       "--epochs", "1",        "--batch",   "8",  "-o",      folder / run};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_itn(arguments, {.environment = environment});
  };
  const Result many = train("many", {}, {{"OMP_NUM_THREADS", "5000"}});
  CHECK(many.exit_code == 0);
  CHECK_THAT(many.error, Contains("OMP_NUM_THREADS is 5000") && Contains("ITN_FORCE_THREADS"));
  const Result option = train("option", {"--threads", "1024"}, {});
  CHECK(option.exit_code == 2);
  CHECK_THAT(option.error, Contains("1024 threads") && Contains("ITN_FORCE_THREADS"));
  const std::string some = std::to_string(std::thread::hardware_concurrency() + 1);
  CHECK(train("forced", {"--threads", some}, {{"ITN_FORCE_THREADS", "1"}}).exit_code == 0);
  CHECK(run_itn(small_render(folder / "a.exr"),
                {.environment = {{"OMP_NUM_THREADS", "5000"}, {"POCL_MAX_PTHREAD_COUNT", "5000"}}})
            .exit_code == 0);
}

TEST_CASE("a device is named a few times at most") {
  const TemporaryFolder folder;
  std::string list = "0";
  for (int i = 0; i < 300; ++i) list += ",0";
  for (const std::map<std::string, std::string>& environment :
       std::vector<std::map<std::string, std::string>>{{}, {{"ITN_DEVICE", list}}}) {
    std::vector<std::string> arguments = small_render(folder / "a.exr");
    if (environment.empty()) arguments.insert(arguments.end(), {"--device", list});
    const auto begin = std::chrono::steady_clock::now();
    const Result result = run_itn(arguments, {.environment = environment});
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.error, Contains("--device: got"));
    CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(20));
  }
}
