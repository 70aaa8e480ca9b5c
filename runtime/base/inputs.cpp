#include "runtime/base/inputs.h"

#include <sys/stat.h>

#include <mutex>
#include <set>
#include <stdexcept>
#include <utility>

#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/base/fingerprint.h"

namespace itn {
namespace {

using FileNumber = std::pair<dev_t, ino_t>;  // tells files apart, whatever their names

struct Record {
  std::mutex mutex;  // files are read by several threads
  bool alive = false, noting = false, with_fingerprints = false;
  std::map<std::string, std::string> fingerprints;
  std::set<FileNumber> numbers;
};

Record& record() {
  static Record one;
  return one;
}

bool number_of(const std::string& file, FileNumber& number) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return false;
  number = {status.st_dev, status.st_ino};
  return true;
}

}  // namespace

Inputs::Inputs(Keep keep) {
  Record& r = record();
  const std::lock_guard guard(r.mutex);
  if (r.alive) throw std::logic_error("two Inputs at a time");
  r.alive = r.noting = true;
  r.with_fingerprints = keep == Keep::fingerprints;
}

Inputs::~Inputs() {
  Record& r = record();
  const std::lock_guard guard(r.mutex);
  r.alive = r.noting = false;
  r.fingerprints.clear();
  r.numbers.clear();
}

void Inputs::end() {
  Record& r = record();
  const std::lock_guard guard(r.mutex);
  r.noting = false;
}

std::map<std::string, std::string> Inputs::fingerprints() const {
  Record& r = record();
  const std::lock_guard guard(r.mutex);
  return r.fingerprints;
}

void note_input(const std::string& file, std::string_view bytes) {
  Record& r = record();
  const std::lock_guard guard(r.mutex);
  if (!r.noting) return;
  if (FileNumber number; number_of(file, number)) r.numbers.insert(number);
  if (r.with_fingerprints) r.fingerprints[file] = fingerprint_text(bytes);
}

void note_input(const std::string& file) {
  bool whole = false;
  {
    Record& r = record();
    const std::lock_guard guard(r.mutex);
    whole = r.noting && r.with_fingerprints;
  }
  if (whole)
    read_file(file);
  else
    note_input(file, "");
}

void refuse_input(const std::string& file) {
  FileNumber number;
  if (!number_of(file, number)) return;
  Record& r = record();
  const std::lock_guard guard(r.mutex);
  if (r.alive && r.numbers.count(number))
    throw UsageError(file + ": would be written over, and is read by the same command; choose another name");
}

}  // namespace itn
