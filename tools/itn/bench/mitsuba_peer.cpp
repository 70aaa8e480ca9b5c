#include "tools/itn/bench/mitsuba_peer.h"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "itn/file.h"

namespace itn {

// The text of mitsuba_peer.py (CMakeLists.txt).
const char* embedded_script(const std::string& path);

namespace {

// tools/peers notes beside the interpreter which LLVM library Mitsuba shall load.
void set_llvm_path(const std::string& python) {
  const auto note = std::filesystem::path(python).parent_path().parent_path() / "llvm_path";
  if (std::getenv("DRJIT_LIBLLVM_PATH") || !std::filesystem::exists(note)) return;
  std::string path = read_file(note.string());
  while (!path.empty() && path.back() == '\n') path.pop_back();
  setenv("DRJIT_LIBLLVM_PATH", path.c_str(), 1);
}

}  // namespace

MitsubaPeer::MitsubaPeer(const std::string& python, std::string folder, const std::string& variant)
    : folder_(std::move(folder)) {
  if (access(python.c_str(), X_OK) != 0)
    throw UsageError("--peer-python " + python +
                     ": no such program; run tools/peers, which installs Mitsuba, or name the "
                     "python of an environment that has it");
  set_llvm_path(python);
  int input[2], output[2];
  if (pipe(input) != 0 || pipe(output) != 0)
    throw ResultError(std::string("bench: cannot make a pipe: ") + std::strerror(errno));
  // A peer that died shows as an empty answer, not as a signal.
  std::signal(SIGPIPE, SIG_IGN);
  process_ = fork();
  if (process_ < 0) throw ResultError(std::string("bench: cannot start a process: ") + std::strerror(errno));
  if (process_ == 0) {
    dup2(input[0], STDIN_FILENO);
    dup2(output[1], STDOUT_FILENO);
    for (const int fd : {input[0], input[1], output[0], output[1]}) close(fd);
    execl(python.c_str(), python.c_str(), "-c", embedded_script("mitsuba_peer.py"), variant.c_str(),
          static_cast<char*>(nullptr));
    _exit(127);
  }
  close(input[0]);
  close(output[1]);
  to_ = fdopen(input[1], "w");
  from_ = fdopen(output[0], "r");
  const std::string greeting = read_line();
  if (greeting.empty())
    throw UsageError("--peer-python " + python +
                     ": Mitsuba does not start there (its message is above); run tools/peers");
  const auto hello = nlohmann::json::parse(greeting);
  version_ = hello.at("mitsuba").get<std::string>() + " " + hello.at("variant").get<std::string>();
}

MitsubaPeer::~MitsubaPeer() {
  if (to_) std::fclose(to_);  // end of input: the script ends
  if (from_) std::fclose(from_);
  if (process_ > 0) waitpid(process_, nullptr, 0);
}

std::string MitsubaPeer::read_line() {
  std::string line;
  for (int c = std::fgetc(from_); c != EOF && c != '\n'; c = std::fgetc(from_)) line += static_cast<char>(c);
  return line;
}

std::string MitsubaPeer::ask(const std::string& job, const std::string& scene) {
  std::fputs((job + "\n").c_str(), to_);
  std::fflush(to_);
  std::string answer = read_line();
  if (answer.empty()) throw ResultError("bench: Mitsuba ended while rendering " + scene + "; its message is above");
  return answer;
}

PeerGradient MitsubaPeer::differentiate(const std::string& scene, int spp, std::uint64_t seed) {
  const nlohmann::json job{{"scene", scene}, {"spp", spp}, {"seed", seed}, {"gradient", true}};
  const auto result = nlohmann::json::parse(ask(job.dump(), scene));
  const auto sum = [&](const char* name) {
    double total = 0;
    for (const auto& value : result.at("gradient").at(name)) total += value.get<double>();
    return total;
  };
  return {result.at("seconds").get<double>(), sum("sigma_t"), sum("albedo"), sum("g")};
}

PeerImage MitsubaPeer::ask_for_image(const std::string& job, const std::string& scene) {
  const auto result = nlohmann::json::parse(ask(job, scene));
  const std::string bytes = read_file(image_file());
  PeerImage image{result.at("seconds").get<double>(), std::vector<float>(bytes.size() / sizeof(float))};
  std::memcpy(image.pixels.data(), bytes.data(), image.pixels.size() * sizeof(float));
  return image;
}

PeerImage MitsubaPeer::render(const std::string& scene, int spp, std::uint64_t seed) {
  const nlohmann::json job{{"scene", scene}, {"spp", spp}, {"seed", seed}, {"output", image_file()}};
  return ask_for_image(job.dump(), scene);
}

PeerImage MitsubaPeer::differentiate_by_texels(const std::string& scene, const std::string& texture, int spp,
                                               std::uint64_t seed) {
  const nlohmann::json job{
      {"scene", scene}, {"spp", spp}, {"seed", seed}, {"texture", texture}, {"output", image_file()}};
  return ask_for_image(job.dump(), scene);
}

}  // namespace itn
