// Output files that are there whole or not at all.
#pragma once
#include <string>
#include <string_view>

namespace itn {

// Writes to a temporary name beside the target, then renames it. A failure (missing or read-only folder, disk full)
// throws ResultError and leaves nothing behind. A target that exists and is no regular file (a pipe, a device) is
// written directly.
void write_file(const std::string& path, std::string_view bytes);

// Throws what write_file would throw for a missing or read-only folder: asked before work that takes long.
void check_writable(const std::string& path);

// Removes the temporary file that a write_file in progress has opened. For signal handlers that end the program.
void remove_unfinished_file() noexcept;

// The whole file. Throws InputError when it cannot be read.
std::string read_file(const std::string& path);

}  // namespace itn
