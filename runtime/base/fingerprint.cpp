#include "runtime/base/fingerprint.h"

#include <fmt/format.h>

#include "itn/file.h"

namespace itn {

std::string fingerprint_text(std::uint64_t fingerprint) { return fmt::format("{:016x}", fingerprint); }

std::string fingerprint_text(std::string_view bytes) { return fingerprint_text(fingerprint(bytes)); }

std::string fingerprint_of(const std::string& file) { return fingerprint_text(read_file(file)); }

}  // namespace itn
