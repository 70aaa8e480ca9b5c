// Programs that will be needed are compiled while others run.
#pragma once
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "itn/render_options.h"
#include "itn/scene.h"

namespace itn {

// The driver keeps compiled programs in its cache on the disk, where the next to ask for them finds them. So one is
// built and run once in a thread of its own, on a device of its own, whose queue nobody waits for.
class ProgramBuilder {
 public:
  // device: as Device's constructor takes it.
  explicit ProgramBuilder(std::string device) : device_(std::move(device)) {}
  // Waits for what is being compiled: a driver cannot be interrupted.
  ~ProgramBuilder();
  ProgramBuilder(const ProgramBuilder&) = delete;
  ProgramBuilder& operator=(const ProgramBuilder&) = delete;

  // Is the program for derivatives by options.derivatives there, or what it failed with (what the renderer will say
  // itself)? If not, and none is being compiled, begins.
  bool is_ready(const Scene& scene, const RenderOptions& options);

 private:
  void build(Scene scene, RenderOptions options);

  std::string device_;
  std::mutex mutex_;
  std::map<std::vector<std::string>, bool> done_;  // by derivatives
  bool busy_ = false;
  std::thread thread_;
};

}  // namespace itn
