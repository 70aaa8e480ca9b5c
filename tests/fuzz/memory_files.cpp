// In the place of runtime/base/file.cpp: the readers' files are in memory, and there are no others.
#include <stdexcept>
#include <utility>

#include "itn/error.h"
#include "itn/file.h"
#include "tests/fuzz/input_files.h"

namespace itn {
namespace {

std::map<std::string, std::string>* files = nullptr;

constexpr std::string_view folder = "/fuzz/";

const std::string* bytes_of(const std::string& path) {
  if (files == nullptr || !path.starts_with(folder)) return nullptr;
  const auto found = files->find(path.substr(folder.size()));
  return found == files->end() ? nullptr : &found->second;
}

}  // namespace

namespace fuzz {

InputFiles::InputFiles(std::map<std::string, std::string> bytes) : bytes_(std::move(bytes)) { files = &bytes_; }
InputFiles::~InputFiles() { files = nullptr; }
std::string InputFiles::path(const std::string& name) const { return std::string(folder) + name; }

}  // namespace fuzz

void write_file(const std::string& path, std::string_view bytes, Sync /*sync*/) {
  if (files == nullptr || !path.starts_with(folder)) throw std::logic_error(path + ": written by a reader");
  (*files)[path.substr(folder.size())] = bytes;
}

// For folder_lock.cpp, which is linked with what stores states: readers lock nothing.
bool is_writing() { return false; }
void make_folder(const std::string& path) { throw std::logic_error(path + ": made by a reader"); }
void remove_remains(const std::string& path, const std::string& /*of*/) {
  throw std::logic_error(path + ": cleaned by a reader");
}

bool is_there(const std::string& path) { return bytes_of(path) != nullptr; }
bool is_folder(const std::string& path) {
  return path + "/" == folder ||
         (files != nullptr && path.starts_with(folder) &&
          files->lower_bound(path.substr(folder.size()) + "/") != files->lower_bound(path.substr(folder.size()) + "0"));
}
bool is_reachable(const std::string& path) { return is_there(path) || is_folder(path); }

void check_regular_file(const std::string& path) {
  if (!is_there(path)) throw InputError(path + ": cannot be read; it is not there");
}

std::string read_file(const std::string& path, std::uint64_t most) {
  check_regular_file(path);
  const std::string& bytes = *bytes_of(path);
  if (bytes.size() > most) throw InputError(path + ": is too large");
  return bytes;
}

}  // namespace itn
