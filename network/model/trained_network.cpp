#include "itn/trained_network.h"

#include <fmt/format.h>

#include <filesystem>

#include "itn/error.h"
#include "itn/file.h"
#include "itn/network_file.h"
#include "itn/shipped.h"
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

// The bytes of a network that ships with the program; empty: there is none of this name.
std::string_view shipped(const std::string& run) {
  if (run == shipped_run) return shipped_network();
  if (run == shipped_photos_run) return shipped_photo_network();
  if (run == shipped_photos_judge) return shipped_photo_judge();
  return {};
}

}  // namespace

Network network_of(const std::string& run) {
  const std::string_view bytes = shipped(run);
  return bytes.empty() ? read_network(file_of(run)) : parse_network(bytes, run);
}

std::string network_fingerprint(const std::string& run) {
  const std::string_view bytes = shipped(run);
  return bytes.empty() ? fingerprint_of(file_of(run)) : fingerprint_text(bytes);
}

}  // namespace itn
