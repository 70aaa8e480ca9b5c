#include "runtime/base/inputs.h"

#include <sys/stat.h>

#include <mutex>
#include <set>
#include <stdexcept>
#include <utility>

#include "itn/error.h"
#include "itn/file.h"
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

// All 0 where there is none.
struct stat status_of(const std::string& file) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return {};
  return status;
}

bool keeps_fingerprints() {
  Record& r = record();
  const std::lock_guard guard(r.mutex);
  return r.noting && r.with_fingerprints;
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
  note_fingerprint(file, keeps_fingerprints() ? fingerprint_text(bytes) : "");
}

void note_fingerprint(const std::string& file, const std::string& fingerprint) {
  Record& r = record();
  const std::lock_guard guard(r.mutex);
  if (!r.noting) return;
  if (FileNumber number; number_of(file, number)) r.numbers.insert(number);
  if (r.with_fingerprints) r.fingerprints[file] = fingerprint;
}

ForeignInput::ForeignInput(const std::string& file) : file_(file), status_(status_of(file)) {
  if (keeps_fingerprints()) fingerprint_ = fingerprint_of(file);
}

void ForeignInput::note() const {
  const auto same = [](const timespec& a, const timespec& b) { return a.tv_sec == b.tv_sec && a.tv_nsec == b.tv_nsec; };
  const struct stat now = status_of(file_);
  if (now.st_dev != status_.st_dev || now.st_ino != status_.st_ino || now.st_size != status_.st_size ||
      !same(now.st_mtim, status_.st_mtim) || !same(now.st_ctim, status_.st_ctim))
    throw InputError(file_ + ": has changed while it was read; call the command again");
  note_fingerprint(file_, fingerprint_);
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
