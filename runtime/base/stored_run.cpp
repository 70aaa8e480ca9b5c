#include "runtime/base/stored_run.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <utility>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/base/fingerprint.h"
#include "runtime/base/folder_owner.h"
#include "runtime/base/json_text.h"
#include "runtime/base/ranks.h"

namespace itn {
namespace {

// Whatever the order of an object's members.
bool same(const StoredRun::Json& a, const StoredRun::Json& b) { return nlohmann::json(a) == nlohmann::json(b); }

// A schema's name without the version of its format.
std::string kind_of(const std::string& schema) { return schema.substr(0, schema.rfind('/')); }

// The jobs that keep a file of this format, by the names of its schemas.
struct Kind {
  const char *name, *job;
};
constexpr std::array kinds{Kind{"itn.invert.state", "an inversion by method gauss-newton or adam"},
                           Kind{"itn.invert.posterior.state", "an inversion by method posterior"},
                           Kind{"itn.invert.textures.state", "an inversion of textures or grids"},
                           Kind{"itn.run", "a training"},
                           Kind{"itn.renderings", "renderings of a posterior"},
                           Kind{"itn.eval.inversions", "inversions of itn eval"}};

constexpr const char* checksum_name = "checksum";

// Checksum over the values of all members but itself; the file's layout does not count.
std::string checksum_of(StoredRun::Json all) {
  all.erase(checksum_name);
  return fingerprint_text(all.dump());
}

}  // namespace

StoredRun::StoredRun(std::string file, std::string schema, std::string job)
    : file_(std::move(file)), schema_(std::move(schema)), job_(std::move(job)) {
  if (!is_there(file_)) return;
  const std::string text = read_file(file_);
  check_structure(text, file_);
  stored_ = Json::parse(text, nullptr, false);
  const auto has = [&](const char* key) { return stored_.is_object() && stored_.contains(key); };
  if (has("schema") && stored_["schema"].is_string()) {
    const std::string kind = kind_of(stored_["schema"].get<std::string>());
    for (const Kind& other : kinds)
      if (kind == other.name && kind != kind_of(schema_))
        throw UsageError(fmt::format("{}: holds {}, not {}; give another folder with -o, or remove this one",
                                     std::filesystem::path(file_).parent_path().string(), other.job, job_));
  }
  if (!has("schema") || stored_["schema"] != schema_ || !has("request") || !stored_["request"].is_object()) refuse();
  if (has(checksum_name) && stored_[checksum_name] != checksum_of(stored_))
    throw InputError(file_ +
                     ": has changed since it was written: its checksum differs; remove its folder to begin anew");
}

void StoredRun::refuse() const {
  throw InputError(fmt::format("{}: not {} by this version; remove its folder to begin anew", file_, job_));
}

StoredRun::Json StoredRun::before(const std::string& key) const {
  return stored_.is_null() ? Json() : stored_.value(key, Json());
}

std::string StoredRun::first_difference(const Json& request) const {
  const Json& before = stored_.at("request");
  for (const auto& [key, value] : request.items())
    if (!before.contains(key) || !same(before.at(key), value)) return key;
  return "";
}

void StoredRun::require_same(const Json& request) const {
  if (stored_.is_null()) return;
  const std::string key = first_difference(request);
  if (key.empty()) return;
  throw UsageError(
      fmt::format("{}: holds {} with another {} ({}, now {}); give another folder with -o, or remove this one",
                  std::filesystem::path(file_).parent_path().string(), job_, key,
                  stored_.at("request").value(key, Json()).dump(), request.at(key).dump()));
}

void StoredRun::write(const Json& request, const Json& record, int indent) const {
  Json all{{"schema", schema_}, {"request", request}};
  all.update(record);
  all[checksum_name] = checksum_of(all);
  if (!std::exchange(written_, true)) world().meet();
  write_file(file_, all.dump(indent) + "\n");
}

RunFolder::RunFolder(std::string folder, const std::string& file, std::string schema, std::string job)
    : folder_((refuse_folder_of_other(folder, file), std::move(folder))),
      lock_(folder_),
      run_(this->file(file), std::move(schema), std::move(job)) {}

std::string RunFolder::file(const std::string& name) const { return (std::filesystem::path(folder_) / name).string(); }

}  // namespace itn
