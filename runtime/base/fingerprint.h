// Tells texts and files apart, not safe against intent.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace itn {

// FNV-1a, 64 bits. Goes on from the fingerprint of what came before.
inline std::uint64_t fingerprint(std::string_view bytes, std::uint64_t before = 14695981039346656037ULL) {
  for (const char c : bytes) before = (before ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return before;
}

// The fingerprint as 16 hexadecimal digits.
std::string fingerprint_text(std::string_view bytes);
std::string fingerprint_text(std::uint64_t fingerprint);

// The same of a file's bytes. Throws InputError when it cannot be read.
std::string fingerprint_of(const std::string& file);

}  // namespace itn
