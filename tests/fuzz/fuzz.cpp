// One libFuzzer program a reader: ITN_FUZZ_READER names it. See tools/fuzz.
#include <cstddef>
#include <cstdint>

#include "tests/fuzz/readers.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const itn::fuzz::Reader& reader = itn::fuzz::reader_of(ITN_FUZZ_READER);
  reader.read({reinterpret_cast<const char*>(data), size});
  return 0;
}
