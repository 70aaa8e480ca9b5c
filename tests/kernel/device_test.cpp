#include "itn/device.h"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "itn/error.h"

namespace {

// kernels/<name> replaced by `text` while the object lives.
class KernelFile {
 public:
  KernelFile(const std::string& name, const std::string& text) {
    folder_ = std::filesystem::temp_directory_path() / ("itn_device_test_" + std::to_string(std::rand()));
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / name) << text;
    setenv("ITN_KERNEL_DIR", folder_.c_str(), 1);
  }
  ~KernelFile() {
    unsetenv("ITN_KERNEL_DIR");
    std::filesystem::remove_all(folder_);
  }
  KernelFile(const KernelFile&) = delete;
  KernelFile& operator=(const KernelFile&) = delete;

 private:
  std::filesystem::path folder_;
};

template <class Function>
std::string message_of(Function&& f) {
  try {
    f();
  } catch (const itn::DeviceError& error) {
    return error.what();
  }
  return "no DeviceError";
}

}  // namespace

TEST_CASE("a kernel gives the same result at width 1 and 16") {
  const itn::Device device;
  const KernelFile file("axpy.cl", R"(
#if WIDTH == 1
typedef float REAL;
#define LOAD(p, i) p[i]
#define STORE(p, i, v) p[i] = v
#else
typedef float16 REAL;
#define LOAD(p, i) vload16(i, p)
#define STORE(p, i, v) vstore16(v, i, p)
#endif
__kernel void axpy(__global const float* x, __global float* y, float a) {
  const size_t i = get_global_id(0);
  REAL value = LOAD(y, i) + a * LOAD(x, i);
  STORE(y, i, value);
}
)");
  std::vector<float> x(4096), y(4096);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = static_cast<float>(i), y[i] = 1.0f;
  for (const std::size_t width : {1u, 16u}) {
    const cl::Program program = device.build("axpy.cl", {{"WIDTH", std::to_string(width)}});
    cl::Kernel kernel(program, "axpy");
    const cl::Buffer bx = device.upload(x, "x"), by = device.upload(y, "y");
    kernel.setArg(0, bx);
    kernel.setArg(1, by);
    kernel.setArg(2, 0.5f);
    device.launch(kernel, x.size() / width, 1);
    device.finish();
    std::vector<float> result(y.size());
    device.download(by, result);
    for (std::size_t i = 0; i < x.size(); ++i) REQUIRE(result[i] == 1.0f + 0.5f * x[i]);
  }
}

TEST_CASE("a constant without suffix is single precision") {
  const itn::Device device;
  const KernelFile file("size.cl", "__kernel void size(__global int* out) { out[0] = (int)sizeof(0.5); }\n");
  cl::Kernel kernel(device.build("size.cl", {}), "size");
  std::vector<int> result{0};
  const cl::Buffer out = device.upload(result, "out");
  kernel.setArg(0, out);
  device.launch(kernel, 1, 1);
  device.download(out, result);
  CHECK(result[0] == 4);
}

TEST_CASE("a failed build carries the compiler's log with file and line") {
  const itn::Device device;
  const KernelFile file("broken.cl", "__kernel void broken() {\n  int x = undeclared_name;\n}\n");
  const std::string message = message_of([&] { (void)device.build("broken.cl", {{"WIDTH", "16"}}); });
  INFO(message);
  CHECK(message.find("undeclared_name") != std::string::npos);
  CHECK(message.find("kernels/broken.cl:2") != std::string::npos);
  CHECK(message.find("WIDTH=16") != std::string::npos);
}

TEST_CASE("a log that counts the lines of the whole text is given files and their lines") {
  const KernelFile file("broken.cl", "#include \"program/made.h\"\nint x = undeclared_name;\n");
  const std::string source = itn::kernel_source("broken.cl", {{"program/made.h", "int made;\nint too;\n"}});
  CHECK(itn::with_kernel_files("<kernel>:6:9: error\n<kernel>:4:1: error\n<kernel>:99: error", source) ==
        "kernels/broken.cl:2:9: error\nkernels/program/made.h:2:1: error\n<kernel>:99: error");
}

TEST_CASE("an unknown device is refused with the list of those that exist") {
  const std::string message = message_of([] { itn::Device("no such device"); });
  INFO(message);
  CHECK(message.find("device no such device") != std::string::npos);
  for (const itn::DeviceInfo& info : itn::list_devices()) CHECK(message.find(info.name) != std::string::npos);
  CHECK(message_of([] { itn::Device("999"); }).find("no such device") != std::string::npos);
}

TEST_CASE("ITN_DEVICE chooses the device and the option goes first") {
  const char* before = std::getenv("ITN_DEVICE");
  const std::string kept = before ? before : "";
  setenv("ITN_DEVICE", "no such device", 1);
  CHECK(message_of([] { itn::Device(); }).find("ITN_DEVICE no such device") != std::string::npos);
  CHECK(itn::Device("0").info().index == 0);
  kept.empty() ? unsetenv("ITN_DEVICE") : setenv("ITN_DEVICE", kept.c_str(), 1);
}

TEST_CASE("too large a buffer is refused with its size and the device's limit") {
  const itn::Device device;
  const std::string message =
      message_of([&] { (void)device.allocate(device.info().max_allocation + (1u << 20), "the film"); });
  INFO(message);
  CHECK(message.find("the film") != std::string::npos);
  CHECK(message.find("MiB") != std::string::npos);
}

TEST_CASE("a memory limit counts what is allocated, and frees what is released") {
  const itn::Device device("", 8u << 20);
  CHECK(device.info().memory == 8u << 20);
  {
    const cl::Buffer kept = device.allocate(5u << 20, "kept");
    CHECK(device.free_memory() == 3u << 20);
    const std::string message = message_of([&] { (void)device.allocate(4u << 20, "the film"); });
    CHECK_THAT(message,
               Catch::Contains("the film: no room for 4096 KiB") && Catch::Contains("3072 KiB of 8192 KiB are free"));
    const itn::Device::Elements most = device.allocate_most(6u << 20, 1, 1, "many");
    CHECK(most.count == 3u << 19);
    const cl::Buffer rest = device.allocate(device.free_memory(), "rest");
    CHECK_THAT(message_of([&] { (void)device.allocate_most(100, 10, 1, "many"); }), Catch::Contains("many: no room"));
  }
  CHECK_NOTHROW(device.allocate(7u << 20, "once more"));
}

TEST_CASE("an empty vector becomes a buffer that a kernel can be given") {
  const itn::Device device;
  CHECK(device.upload(std::vector<float>{}, "nothing").getInfo<CL_MEM_SIZE>() >= 4);
}
