// Lets a long job resume where it was stopped: a file holds the request and the progress.
//
// The request is everything that the job's numbers depend on. A job resumes only with the same request, so that a job
// that was stopped ends with the same numbers as one that was not.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "runtime/base/folder_lock.h"

namespace itn {

class StoredRun {
 public:
  using Json = nlohmann::ordered_json;

  // schema: of the file, with the version of its format. job: for messages, "a training". Throws UsageError: the file
  // is that of another kind of job; InputError: it is there and is not of this schema, or has changed since it was
  // written. Files from before there were checksums have none, and are taken as they are.
  StoredRun(std::string file, std::string schema, std::string job);

  const std::string& file() const { return file_; }

  // The value that the file held under `key` when this was made; null: no file, or no such key.
  Json before(const std::string& key) const;

  // Throws UsageError: the file held a job of another request; says what differs. Keys of the file that the request
  // lacks do not count.
  void require_same(const Json& request) const;

  // For whoever finds that what the file holds is damaged.
  [[noreturn]] void refuse() const;

  // Called by all ranks (ranks.h): the first one writes, after all have read.
  // The file becomes {"schema", "request"}, the members of `record` and a checksum, whole or not at all. indent: as
  // Json::dump(). Throws ResultError.
  void write(const Json& request, const Json& record, int indent = -1) const;

 private:
  std::string first_difference(const Json& request) const;  // empty: none

  std::string file_, schema_, job_;
  Json stored_;
  mutable bool written_ = false;
};

// The folder of one long job, locked while this lives, with the job's StoredRun.
class RunFolder {
 public:
  // Makes the folder where it is missing. Throws as refuse_folder_of_other(), FolderLock and StoredRun.
  RunFolder(std::string folder, const std::string& file, std::string schema, std::string job);

  const std::string& path() const { return folder_; }
  std::string file(const std::string& name) const;
  StoredRun& run() { return run_; }
  const StoredRun& run() const { return run_; }

 private:
  std::string folder_;
  FolderLock lock_;
  StoredRun run_;
};

}  // namespace itn
