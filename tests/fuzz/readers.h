// Each reader of files as a function of bytes, for the fuzzers and for the replay of their corpora.
#pragma once
#include <span>
#include <string>
#include <string_view>

namespace itn::fuzz {

struct Reader {
  const char* name;  // of the fuzzer and of its corpus
  // Reads the bytes as a file. Throws what is no InputError: that is a finding.
  void (*read)(std::string_view bytes);
};

std::span<const Reader> readers();

// Throws std::out_of_range.
const Reader& reader_of(std::string_view name);

}  // namespace itn::fuzz
