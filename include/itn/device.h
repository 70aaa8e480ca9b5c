// OpenCL as the project uses it: choose a device, build a program, allocate buffers, launch kernels. Every OpenCL call
// is checked; a failure throws DeviceError with the call's name, the code's name, the device, and what to do.
#pragma once
#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#define CL_HPP_ENABLE_EXCEPTIONS
#include <CL/opencl.hpp>
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "itn/kernel_source.h"

namespace itn {

struct DeviceInfo {
  int index = 0;
  std::string platform, name, vendor, driver, version, type;  // type: "cpu", "gpu", "accelerator"
  std::uint64_t memory = 0, max_allocation = 0;               // [byte]
  int compute_units = 0;
  int preferred_width = 1;  // floats
  std::string unusable;     // empty: can be used; else why not
};

// Every device of every platform, in a stable order.
std::vector<DeviceInfo> list_devices();

// One device with its context and in-order queue.
class Device {
 public:
  // spec: index, "cpu", "gpu", or a case-insensitive part of the platform or device name. Empty: the environment
  // variable ITN_DEVICE, then the first usable GPU, then the first usable CPU. Throws DeviceError with the list of
  // devices.
  // memory_limit [byte]: allocate no more than this; 0: the environment variable ITN_MEMORY_LIMIT [MiB], else all that
  // the device has. Throws UsageError where the variable is no number.
  explicit Device(const std::string& spec = "", std::uint64_t memory_limit = 0);

  const DeviceInfo& info() const { return info_; }
  const cl::Context& context() const { return context_; }
  const cl::CommandQueue& queue() const { return queue_; }

  // Paths a work-item: 16, 8 or 4 on CPUs that vectorise explicit vectors only, 1 elsewhere.
  int default_width() const;

  // Builds kernels/<entry> (with its includes and the generated files, see kernel_source.h) with "-D name=value" for
  // each definition. The build log is part of the error. The same text and options are built once: rendering one scene
  // after the other would spend its time in the compiler's front end otherwise.
  cl::Program build(const std::string& entry, const std::map<std::string, std::string>& definitions,
                    const KernelFiles& generated = {}) const;

  // Bytes that this object has not allocated yet; others may use the device too.
  std::uint64_t free_memory() const;

  // Uninitialised (or filled from host memory) device memory; size 0 becomes one byte-aligned dummy element.
  cl::Buffer allocate(std::size_t bytes, const char* what) const;
  cl::Buffer allocate_zeroed(std::size_t bytes, const char* what) const;  // a multiple of 4
  void clear(const cl::Buffer& buffer) const;                             // to 0; of a size that is a multiple of 4
  // As many of `wanted` elements of that size as fit into half of the free memory (others want some too); halves the
  // number until the driver has room. Throws DeviceError where not even `least` fit.
  struct Elements {
    cl::Buffer buffer;
    std::size_t count = 0;
  };
  Elements allocate_most(std::size_t wanted, std::size_t least, std::size_t bytes_each, const char* what) const;
  template <class T>
  cl::Buffer upload(const std::vector<T>& data, const char* what) const {
    return upload_bytes(data.data(), data.size() * sizeof(T), what);
  }
  template <class T>
  void download(const cl::Buffer& buffer, std::vector<T>& data) const {
    download_bytes(buffer, data.data(), data.size() * sizeof(T));
  }
  // Calls use() with the first bytes of the buffer. Where the host sees the device's memory nothing is copied.
  void look_at(const cl::Buffer& buffer, std::size_t bytes, const std::function<void(const void*)>& use) const;
  // One-dimensional launch of work-groups of `local`. Does not wait. For one kernel always the same `local`: PoCL
  // compiles it anew for each.
  void launch(const cl::Kernel& kernel, std::size_t global, std::size_t local) const;
  // At least so many, in groups that suit the device: those beyond must return at once.
  void launch_at_least(const cl::Kernel& kernel, std::size_t items) const;
  void finish() const;

 private:
  bool wait_for_memory(std::uint64_t bytes) const;
  std::optional<cl::Buffer> try_allocate(std::size_t bytes, const char* what) const;
  [[noreturn]] void fail_for_memory(std::size_t bytes, const char* what) const;
  cl::Buffer upload_bytes(const void* data, std::size_t bytes, const char* what) const;
  void download_bytes(const cl::Buffer& buffer, void* data, std::size_t bytes) const;
  DeviceInfo info_;
  cl::Device device_;
  cl::Context context_;
  cl::CommandQueue queue_;
  struct Programs {
    std::mutex mutex;
    std::map<std::string, cl::Program> by_text;  // options and source
  };
  std::shared_ptr<Programs> programs_ = std::make_shared<Programs>();
  std::shared_ptr<std::atomic<std::uint64_t>> allocated_;  // [byte]; buffers may outlive this object
};

}  // namespace itn
