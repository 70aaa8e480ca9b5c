// An inversion of textures, stored in a folder after every iteration (state.json beside the unknowns in state-0.bin or
// state-1.bin, and a line in iterations.jsonl), so that the same request goes on where it was stopped.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/base/fingerprint.h"
#include "runtime/base/stored_run.h"
#include "runtime/inverse/textures/texture_inversion.h"

namespace itn {

class StoredTextureInversion {
 public:
  // request: all that the numbers depend on. inversion must outlive this. Throws UsageError: the folder holds an
  // inversion of another request; InputError: it is damaged; ResultError: not writable or another process's.
  StoredTextureInversion(const std::string& folder, const StoredRun::Json& request, TextureInversion& inversion);

  const TextureInversionState& state() const { return state_; }
  // One iteration, which is stored. Throws Interrupted: nothing has changed then.
  const TextureInversionStep& advance();
  const std::vector<TextureInversionStep>& steps() const { return steps_; }
  std::string file(const std::string& name) const { return folder_.file(name); }

 private:
  void load(std::size_t steps);
  void store();

  RunFolder folder_;
  StoredRun::Json request_;
  TextureInversion& inversion_;
  TextureInversionState state_;
  std::vector<TextureInversionStep> steps_;
  std::uint64_t lines_ = fingerprint({});  // of iterations.jsonl
};

}  // namespace itn
