// The machine's memory, asked before much of it is taken.
#pragma once
#include <cstdint>
#include <string>

namespace itn {

// [bytes] that can be had without pushing others out; the greatest number where the system does not say.
std::uint64_t free_memory();

// Throws InputError, which names `what` and what to do, where more is needed than there is.
void require_memory(double bytes, const std::string& what, const std::string& remedy);

}  // namespace itn
