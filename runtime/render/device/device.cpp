#include "itn/device.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <sstream>
#include <thread>

#include "itn/error.h"
#include "runtime/base/limits.h"
#include "runtime/base/parallel.h"
#include "runtime/base/ranks.h"
#include "runtime/render/device/driver_faults.h"
#include "runtime/render/device/kernel_cache.h"

namespace itn {
namespace {

constexpr std::size_t gpu_group = 64;  // work-items: 32, 64 and 128 are equally fast on an H200, 256 is slower

// The codes a user can meet; the numbers are those of CL/cl.h.
std::string error_name(cl_int code) {
  static const std::map<cl_int, const char*> names{
      {CL_DEVICE_NOT_FOUND, "CL_DEVICE_NOT_FOUND"},
      {CL_DEVICE_NOT_AVAILABLE, "CL_DEVICE_NOT_AVAILABLE"},
      {CL_COMPILER_NOT_AVAILABLE, "CL_COMPILER_NOT_AVAILABLE"},
      {CL_MEM_OBJECT_ALLOCATION_FAILURE, "CL_MEM_OBJECT_ALLOCATION_FAILURE"},
      {CL_OUT_OF_RESOURCES, "CL_OUT_OF_RESOURCES"},
      {CL_OUT_OF_HOST_MEMORY, "CL_OUT_OF_HOST_MEMORY"},
      {CL_BUILD_PROGRAM_FAILURE, "CL_BUILD_PROGRAM_FAILURE"},
      {CL_INVALID_VALUE, "CL_INVALID_VALUE"},
      {CL_INVALID_DEVICE, "CL_INVALID_DEVICE"},
      {CL_INVALID_CONTEXT, "CL_INVALID_CONTEXT"},
      {CL_INVALID_COMMAND_QUEUE, "CL_INVALID_COMMAND_QUEUE"},
      {CL_INVALID_MEM_OBJECT, "CL_INVALID_MEM_OBJECT"},
      {CL_INVALID_BUILD_OPTIONS, "CL_INVALID_BUILD_OPTIONS"},
      {CL_INVALID_PROGRAM, "CL_INVALID_PROGRAM"},
      {CL_INVALID_PROGRAM_EXECUTABLE, "CL_INVALID_PROGRAM_EXECUTABLE"},
      {CL_INVALID_KERNEL_NAME, "CL_INVALID_KERNEL_NAME"},
      {CL_INVALID_KERNEL, "CL_INVALID_KERNEL"},
      {CL_INVALID_ARG_INDEX, "CL_INVALID_ARG_INDEX"},
      {CL_INVALID_ARG_VALUE, "CL_INVALID_ARG_VALUE"},
      {CL_INVALID_ARG_SIZE, "CL_INVALID_ARG_SIZE"},
      {CL_INVALID_KERNEL_ARGS, "CL_INVALID_KERNEL_ARGS"},
      {CL_INVALID_WORK_GROUP_SIZE, "CL_INVALID_WORK_GROUP_SIZE"},
      {CL_INVALID_WORK_ITEM_SIZE, "CL_INVALID_WORK_ITEM_SIZE"},
      {CL_INVALID_GLOBAL_WORK_SIZE, "CL_INVALID_GLOBAL_WORK_SIZE"},
      {CL_INVALID_BUFFER_SIZE, "CL_INVALID_BUFFER_SIZE"},
      {CL_INVALID_OPERATION, "CL_INVALID_OPERATION"},
  };
  const auto found = names.find(code);
  return found == names.end() ? "OpenCL error " + std::to_string(code) : found->second;
}

bool out_of_memory(cl_int code) {
  return code == CL_MEM_OBJECT_ALLOCATION_FAILURE || code == CL_OUT_OF_RESOURCES || code == CL_OUT_OF_HOST_MEMORY ||
         code == CL_INVALID_BUFFER_SIZE;
}

std::string readable_size(std::uint64_t bytes) {
  const bool small = bytes < std::uint64_t{16} << 20;
  return std::to_string(bytes >> (small ? 10 : 20)) + (small ? " KiB" : " MiB");
}

[[noreturn]] void fail(const DeviceInfo& device, const std::string& what, const cl::Error& error) {
  std::string message = device.name + ": " + what + " failed: " + error.what() + ": " + error_name(error.err());
  if (out_of_memory(error.err()))
    message += "; the device's memory is used up: render with smaller meshes or images, or choose another device";
  else
    message += "; see 'itn devices', try another device";
  throw DeviceError(message);
}

std::string trimmed(std::string text) {
  while (!text.empty() && (text.back() == '\0' || std::isspace(static_cast<unsigned char>(text.back()))))
    text.pop_back();
  const auto first = text.find_first_not_of(" \t");
  return first == std::string::npos ? std::string() : text.substr(first);
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// "OpenCL 3.0 ..." -> 300
int version_number(const std::string& version) {
  int major = 0, minor = 0;
  if (std::sscanf(version.c_str(), "OpenCL %d.%d", &major, &minor) != 2) return 0;
  return major * 100 + minor * 10;
}

DeviceInfo describe(const std::string& platform, const cl::Device& device) {
  DeviceInfo info;
  info.platform = platform;
  try {
    info.name = trimmed(device.getInfo<CL_DEVICE_NAME>());
    info.vendor = trimmed(device.getInfo<CL_DEVICE_VENDOR>());
    info.driver = trimmed(device.getInfo<CL_DRIVER_VERSION>());
    info.version = trimmed(device.getInfo<CL_DEVICE_VERSION>());
    const auto type = device.getInfo<CL_DEVICE_TYPE>();
    info.type = type & CL_DEVICE_TYPE_CPU ? "cpu" : type & CL_DEVICE_TYPE_GPU ? "gpu" : "accelerator";
    info.memory = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
    info.max_allocation = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
    info.compute_units = static_cast<int>(device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>());
    info.preferred_width = static_cast<int>(std::max(device.getInfo<CL_DEVICE_PREFERRED_VECTOR_WIDTH_FLOAT>(),
                                                     device.getInfo<CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT>()));
    if (!device.getInfo<CL_DEVICE_AVAILABLE>())
      info.unusable = "the driver says the device is not available";
    else if (!device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>())
      info.unusable = "the driver has no compiler for OpenCL C";
    else if (version_number(info.version) < 120)
      info.unusable = "has " + info.version + ", needs OpenCL 1.2";
    else if (!device.getInfo<CL_DEVICE_ENDIAN_LITTLE>())
      info.unusable = "is big-endian";
  } catch (const cl::Error& error) {
    info.unusable = std::string("cannot be asked for its properties: ") + error.what() + ": " + error_name(error.err());
  }
  return info;
}

struct Candidate {
  DeviceInfo info;
  cl::Device device;
};

// PoCL runs LLVM's own vectorisers over each kernel, which is a tenth of the time to compile and finds nothing in
// kernels of explicit vectors: without them the same bits at the same speed. It reads this when it is first asked for
// devices.
void leave_out_vectorisers() { setenv("POCL_WORK_GROUP_METHOD", "loops", 0); }

// PoCL links what it compiles with the system's linker, and ends the process where it finds none.
void let_linkers_be_found() {
  std::array<char, 256> usual{};
  confstr(_CS_PATH, usual.data(), usual.size());
  const char* path = std::getenv("PATH");
  const std::string given = path ? path : "", whole = ":" + given + ":";
  std::string more;
  std::istringstream folders{std::string(usual.data())};
  for (std::string folder; std::getline(folders, folder, ':');)
    if (whole.find(":" + folder + ":") == std::string::npos) more += ":" + folder;
  if (more.empty()) return;
  setenv("PATH", given.empty() ? more.substr(1).c_str() : (given + more).c_str(), 1);
}

// More than one a core wait for each other, and thousands end the process.
void limit_threads() {
  constexpr const char* variable = "POCL_MAX_PTHREAD_COUNT";
  const char* given = std::getenv(variable);
  if (!given || std::getenv("ITN_FORCE_THREADS") || std::strtoull(given, nullptr, 10) <= core_count()) return;
  setenv(variable, std::to_string(core_count()).c_str(), 1);
}

std::vector<Candidate> candidates() {
  leave_out_vectorisers();
  let_linkers_be_found();
  limit_threads();
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error&) {
    return {};  // the loader reports "no platform" as an error
  }
  std::vector<Candidate> all;
  for (const cl::Platform& platform : platforms) {
    std::vector<cl::Device> devices;
    std::string name;
    try {
      name = trimmed(platform.getInfo<CL_PLATFORM_NAME>());
      platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
    } catch (const cl::Error&) {
      continue;  // a platform without devices reports an error
    }
    for (const cl::Device& device : devices) {
      all.push_back({describe(name, device), device});
      all.back().info.index = static_cast<int>(all.size()) - 1;
    }
  }
  return all;
}

std::string listing(const std::vector<Candidate>& all) {
  std::string text;
  for (const Candidate& c : all)
    text += "\n  " + std::to_string(c.info.index) + "  " + c.info.type + "  " + c.info.name + " (" + c.info.platform +
            ")" + (c.info.unusable.empty() ? "" : "  unusable: " + c.info.unusable);
  return text;
}

bool matches(const DeviceInfo& info, const std::string& spec) {
  if (spec.find_first_not_of("0123456789") == std::string::npos) return std::to_string(info.index) == spec;
  const std::string wanted = lower(spec);
  if (wanted == "cpu" || wanted == "gpu") return info.type == wanted;
  return lower(info.platform).find(wanted) != std::string::npos || lower(info.name).find(wanted) != std::string::npos;
}

const Candidate* first_usable(const std::vector<Candidate>& all, const std::string& spec) {
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const Candidate& c) { return c.info.unusable.empty() && matches(c.info, spec); });
  return found == all.end() ? nullptr : &*found;
}

// Ranks of a node take devices of a kind one after the other. In containers of one device each sees its own.
const Candidate& of_this_rank(const std::vector<Candidate>& all, const Candidate& first) {
  std::vector<const Candidate*> alike;
  for (const Candidate& c : all)
    if (c.info.unusable.empty() && c.info.type == first.info.type && c.info.name == first.info.name)
      alike.push_back(&c);
  return *alike[static_cast<std::size_t>(rank_on_node(world())) % alike.size()];
}

const Candidate& choose(const std::vector<Candidate>& all, const std::string& option) {
  if (const std::string fault = all.empty() ? kernel_cache_fault() : ""; !fault.empty())
    throw DeviceError("no OpenCL device: PoCL, if it is installed, cannot keep compiled programs in " +
                      kernel_cache_folder() + ": " + fault);
  if (all.empty()) throw DeviceError(no_device_reason());
  const char* variable = std::getenv("ITN_DEVICE");
  const std::string spec = !option.empty() ? option : variable ? variable : "";
  if (spec.empty()) {
    for (const char* type : {"gpu", "cpu"})
      if (const Candidate* found = first_usable(all, type)) return of_this_rank(all, *found);
    throw DeviceError("no usable OpenCL device among" + listing(all));
  }
  if (const Candidate* found = first_usable(all, spec))
    return spec == "gpu" || spec == "cpu" ? of_this_rank(all, *found) : *found;
  const std::string source = option.empty() ? "ITN_DEVICE" : "device";
  for (const Candidate& c : all)
    if (matches(c.info, spec)) throw DeviceError(source + " " + spec + ": the device cannot be used:" + listing({c}));
  throw DeviceError(source + " " + spec + ": no such device; give an index, cpu, gpu or a part of a name of" +
                    listing(all));
}

std::uint64_t memory_limit_of_environment() {
  const char* text = std::getenv("ITN_MEMORY_LIMIT");
  if (!text) return 0;
  char* end = nullptr;
  const unsigned long long mib = std::strtoull(text, &end, 10);
  if (end == text || *end != '\0' || mib == 0)
    throw UsageError(std::string("ITN_MEMORY_LIMIT: got '") + text + "', need a positive number of MiB");
  return static_cast<std::uint64_t>(mib) << 20;
}

// Takes a buffer's size off the count when the driver frees it.
struct Tally {
  std::shared_ptr<std::atomic<std::uint64_t>> allocated;
  std::uint64_t bytes;
};
void CL_CALLBACK buffer_freed(cl_mem, void* tally) {
  const std::unique_ptr<Tally> mine(static_cast<Tally*>(tally));
  *mine->allocated -= mine->bytes;
}

}  // namespace

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> infos;
  for (Candidate& c : candidates()) infos.push_back(std::move(c.info));
  return infos;
}

Device::Device(const std::string& spec, std::uint64_t memory_limit)
    : allocated_(std::make_shared<std::atomic<std::uint64_t>>(0)) {
  const std::vector<Candidate> all = candidates();
  const Candidate& chosen = choose(all, spec);
  info_ = chosen.info;
  device_ = chosen.device;
  if (memory_limit == 0) memory_limit = memory_limit_of_environment();
  if (memory_limit > 0) info_.memory = std::min(info_.memory, memory_limit);
  info_.max_allocation = std::min(info_.max_allocation, info_.memory);
  try {
    context_ = cl::Context(device_);
    queue_ = cl::CommandQueue(context_, device_);
  } catch (const cl::Error& error) {
    fail(info_, "opening the device", error);
  }
}

int Device::default_width() const {
  // PoCL leaves scalar work-items scalar (kernels/README.md); Intel's CPU runtime and GPUs run work-items side by side.
  const std::string platform = lower(info_.platform);
  if (info_.type != "cpu" ||
      (platform.find("portable computing") == std::string::npos && platform.find("pocl") == std::string::npos))
    return 1;
  for (const int width : {16, 8})
    if (info_.preferred_width >= width) return width;
  return 4;
}

cl::Program Device::build(const std::string& entry, const std::map<std::string, std::string>& definitions,
                          const KernelFiles& generated) const {
  std::string options = "-cl-std=CL1.2 -cl-single-precision-constant";
  for (const auto& [name, value] : definitions) options += " -D " + name + "=" + value;
  const std::string source = kernel_source(entry, generated);
  try {
    const std::lock_guard lock(programs_->mutex);
    const std::string text = options + "\n" + source;
    if (const auto found = programs_->by_text.find(text); found != programs_->by_text.end()) return found->second;
    cl::Program program(context_, source);
    program.build({device_}, options.c_str());
    programs_->by_text.emplace(text, program);
    return program;
  } catch (const cl::BuildError& error) {
    std::string log;
    for (const auto& [device, text] : error.getBuildLog()) log += with_kernel_files(trimmed(text), source);
    if (const std::string fault = kernel_cache_fault(); !fault.empty())
      throw DeviceError(info_.name + ": building kernels/" + entry + " failed, and its results cannot be kept in " +
                        kernel_cache_folder() + ": " + fault);
    throw DeviceError(info_.name + ": building kernels/" + entry + " failed: " + error_name(error.err()) +
                      "; options: " + options + "; log:\n" + (log.empty() ? "(the driver gave none)" : log) +
                      limits_in_force());
  } catch (const cl::Error& error) {
    fail(info_, "building kernels/" + entry, error);
  }
}

std::uint64_t Device::free_memory() const {
  const std::uint64_t allocated = *allocated_;
  return allocated < info_.memory ? info_.memory - allocated : 0;
}

// NVIDIA's driver says that a buffer is gone a moment after it was released, on a thread of its own.
bool Device::wait_for_memory(std::uint64_t bytes) const {
  for (int milliseconds = 0; milliseconds < 50 && bytes > free_memory(); ++milliseconds)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return bytes <= free_memory();
}

std::optional<cl::Buffer> Device::try_allocate(std::size_t bytes, const char* what) const {
  bytes = std::max<std::size_t>(bytes, 16);
  if (bytes > info_.max_allocation || !wait_for_memory(bytes)) return std::nullopt;
  try {
    cl::Buffer buffer(context_, CL_MEM_READ_WRITE, bytes);
    if (bytes >= 1u << 20) {  // drivers may put the work off until a buffer is used
      queue_.enqueueFillBuffer(buffer, cl_uint{0}, 0, 16);
      queue_.finish();
    }
    buffer.setDestructorCallback(buffer_freed, new Tally{allocated_, bytes});
    *allocated_ += bytes;
    return buffer;
  } catch (const cl::Error& error) {
    if (out_of_memory(error.err())) return std::nullopt;
    fail(info_, "allocating " + readable_size(bytes) + " for " + what, error);
  }
}

void Device::fail_for_memory(std::size_t bytes, const char* what) const {
  throw DeviceError(info_.name + ": " + what + ": no room for " + readable_size(bytes) + "; " +
                    readable_size(free_memory()) + " of " + readable_size(info_.memory) +
                    " are free, a buffer holds at most " + readable_size(info_.max_allocation) +
                    "; use a smaller mesh or image, or choose another device (see 'itn devices', ITN_MEMORY_LIMIT)");
}

cl::Buffer Device::allocate(std::size_t bytes, const char* what) const {
  std::optional<cl::Buffer> buffer = try_allocate(bytes, what);
  if (!buffer) fail_for_memory(bytes, what);
  return *buffer;
}

cl::Buffer Device::allocate_zeroed(std::size_t bytes, const char* what) const {
  cl::Buffer buffer = allocate(bytes, what);
  clear(buffer);
  return buffer;
}

void Device::clear(const cl::Buffer& buffer) const {
  const auto bytes = buffer.getInfo<CL_MEM_SIZE>();
  try {
    queue_.enqueueFillBuffer(buffer, cl_uint{0}, 0, bytes);
  } catch (const cl::Error& error) {
    fail(info_, "clearing " + readable_size(bytes), error);
  }
}

Device::Elements Device::allocate_most(std::size_t wanted, std::size_t least, std::size_t bytes_each,
                                       const char* what) const {
  const std::uint64_t half = free_memory() / 2 / bytes_each;
  for (std::size_t count = std::max<std::size_t>(std::min<std::uint64_t>(wanted, half), least);;
       count = std::max(count / 2, least)) {
    if (std::optional<cl::Buffer> buffer = try_allocate(count * bytes_each, what)) return {*buffer, count};
    if (count == least) fail_for_memory(count * bytes_each, what);
  }
}

cl::Buffer Device::upload_bytes(const void* data, std::size_t bytes, const char* what) const {
  cl::Buffer buffer = allocate(bytes, what);
  if (bytes == 0) return buffer;
  try {
    queue_.enqueueWriteBuffer(buffer, CL_TRUE, 0, bytes, data);
  } catch (const cl::Error& error) {
    fail(info_, std::string("copying ") + readable_size(bytes) + " to the device for " + what, error);
  }
  return buffer;
}

void Device::download_bytes(const cl::Buffer& buffer, void* data, std::size_t bytes) const {
  if (bytes == 0) return;
  try {
    queue_.enqueueReadBuffer(buffer, CL_TRUE, 0, bytes, data);
  } catch (const cl::Error& error) {
    fail(info_, "reading " + readable_size(bytes) + " from the device", error);
  }
}

void Device::look_at(const cl::Buffer& buffer, std::size_t bytes, const std::function<void(const void*)>& use) const {
  try {
    void* data = queue_.enqueueMapBuffer(buffer, CL_TRUE, CL_MAP_READ, 0, bytes);
    use(data);
    queue_.enqueueUnmapMemObject(buffer, data);
    queue_.finish();  // until then the queue keeps the buffer, and its memory counts
  } catch (const cl::Error& error) {
    fail(info_, "reading " + readable_size(bytes) + " from the device", error);
  }
}

void Device::launch(const cl::Kernel& kernel, std::size_t global, std::size_t local) const {
  try {
    queue_.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(global), cl::NDRange(local));
  } catch (const cl::Error& error) {
    fail(info_, "starting kernel " + kernel.getInfo<CL_KERNEL_FUNCTION_NAME>(), error);
  }
}

void Device::launch_at_least(const cl::Kernel& kernel, std::size_t items) const {
  const std::size_t local = info_.type == "cpu" ? 1 : gpu_group;
  launch(kernel, (items + local - 1) / local * local, local);
}

void Device::finish() const {
  try {
    queue_.finish();
  } catch (const cl::Error& error) {
    fail(info_, "running kernels", error);
  }
}

}  // namespace itn
