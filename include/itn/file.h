// Input files that are files, and output files that are there whole or not at all.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace itn {

// now: a power cut leaves the file before or this one. later: for the many files of a set, before sync_folder().
enum class Sync { now, later };

// Writes to a temporary name beside the target, then renames it. A failure (missing or read-only folder, disk full)
// throws ResultError and leaves nothing behind. A target that exists and is no regular file (a pipe, a device) is
// written directly. Throws UsageError for a file that the command reads (inputs.h).
void write_file(const std::string& path, std::string_view bytes, Sync sync = Sync::now);

// Turns the writing of files off or on and returns the former setting; on at first. One process of several that do one
// job (runtime/base/ranks) writes its files; in the others write_file() and check_writable() do nothing.
bool set_writing(bool on);
bool is_writing();

// Everything that was written to the folder's file system is on the disk after this.
void sync_folder(const std::string& folder);

// Throws what write_file would throw for a missing or read-only folder: asked before work that takes long. Removes what
// a killed process has left of the same file.
void check_writable(const std::string& path);

// Removes the temporary file that a write_file in progress has opened. For signal handlers that end the program.
void remove_unfinished_file() noexcept;

// Removes what killed processes have left in the folder: of one file, or of all.
void remove_remains(const std::string& folder, const std::string& of = "");

// Is there something by this name? True, too, where that cannot be told (no permission, a loop of links): whoever opens
// it then says why it cannot be opened.
bool is_there(const std::string& path);
bool is_reachable(const std::string& path);  // there for certain
bool is_folder(const std::string& path);

// With those above it; nothing where it is there. Throws ResultError.
void make_folder(const std::string& folder);

// Makes the checks of read_file() for a file that a foreign library will read. Throws InputError.
void check_regular_file(const std::string& path);

constexpr std::uint64_t largest_file = std::uint64_t{16} << 30;

// The whole file. Throws InputError when it cannot be read, is no regular file (a pipe would hang, a device never end)
// or is larger.
std::string read_file(const std::string& path, std::uint64_t most = largest_file);

}  // namespace itn
