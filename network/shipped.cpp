#include "network/shipped.h"

// The assembler reads the file: no compiler takes megabytes of literals gladly. ITN_SHIPPED_NETWORK: its path.
asm(R"(
  .section .rodata
  .balign 16
  .globl itn_shipped_network, itn_shipped_network_end
itn_shipped_network:
  .incbin ")" ITN_SHIPPED_NETWORK R"("
itn_shipped_network_end:
  .byte 0
  .previous
  .section .note.GNU-stack,"",@progbits
  .previous
)");

extern "C" const char itn_shipped_network[], itn_shipped_network_end[];

namespace itn {

std::string_view shipped_network() {
  return {itn_shipped_network, static_cast<std::size_t>(itn_shipped_network_end - itn_shipped_network)};
}

}  // namespace itn
