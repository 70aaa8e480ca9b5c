#include "runtime/training/trained_network.h"

#include <fmt/format.h>

#include <filesystem>

#include "network/network_file.h"
#include "network/shipped.h"
#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/base/fingerprint.h"

namespace itn {

namespace {

std::string file_of(const std::string& run) {
  if (!is_there(run))
    throw InputError(fmt::format("{0}: is not there; train it first: itn train DATA --network rn -o {0}", run));
  if (!is_folder(run)) return run;
  std::string file = (std::filesystem::path(run) / "network.safetensors").string();
  if (!is_there(file))
    throw InputError(
        fmt::format("{}: is not there; itn train DATA --network rn -o {} writes it after its first epoch", file, run));
  return file;
}

}  // namespace

Network network_of(const std::string& run) {
  if (run == shipped_run) return parse_network(shipped_network(), run);
  return read_network(file_of(run));
}

std::string network_fingerprint(const std::string& run) {
  if (run == shipped_run) return fingerprint_text(shipped_network());
  return fingerprint_of(file_of(run));
}

}  // namespace itn
