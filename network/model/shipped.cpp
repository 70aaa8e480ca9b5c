#include "itn/shipped.h"

// The assembler reads the files: no compiler takes megabytes of literals gladly. ITN_SHIPPED_...: their paths.
#define EMBED(name, file)                           \
  asm("  .section .rodata\n"                        \
      "  .balign 16\n"                              \
      "  .globl " name ", " name "_end\n" name      \
      ":\n"                                         \
      "  .incbin \"" file "\"\n" name               \
      "_end:\n"                                     \
      "  .byte 0\n"                                 \
      "  .previous\n"                               \
      "  .section .note.GNU-stack,\"\",@progbits\n" \
      "  .previous\n")

EMBED("itn_shipped_network", ITN_SHIPPED_NETWORK);
EMBED("itn_shipped_photo_network", ITN_SHIPPED_PHOTO_NETWORK);
EMBED("itn_shipped_photo_judge", ITN_SHIPPED_PHOTO_JUDGE);

extern "C" const char itn_shipped_network[], itn_shipped_network_end[];
extern "C" const char itn_shipped_photo_network[], itn_shipped_photo_network_end[];
extern "C" const char itn_shipped_photo_judge[], itn_shipped_photo_judge_end[];

namespace itn {

std::string_view shipped_network() {
  return {itn_shipped_network, static_cast<std::size_t>(itn_shipped_network_end - itn_shipped_network)};
}

std::string_view shipped_photo_network() {
  return {itn_shipped_photo_network,
          static_cast<std::size_t>(itn_shipped_photo_network_end - itn_shipped_photo_network)};
}

std::string_view shipped_photo_judge() {
  return {itn_shipped_photo_judge, static_cast<std::size_t>(itn_shipped_photo_judge_end - itn_shipped_photo_judge)};
}

}  // namespace itn
