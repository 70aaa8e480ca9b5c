#include "tests/fuzz/readers.h"

#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "network/safetensors.h"
#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/base/json_text.h"
#include "runtime/base/printable.h"
#include "runtime/dataset/manifest.h"
#include "runtime/image/bitmap.h"
#include "runtime/image/exr.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/volume_file.h"

namespace itn::fuzz {
namespace {

// A file in memory, whose name readers can open.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes) : descriptor_(memfd_create("fuzz", MFD_CLOEXEC)) {
    while (!bytes.empty()) {
      const ssize_t n = write(descriptor_, bytes.data(), bytes.size());
      if (n <= 0) throw std::runtime_error("cannot write a file in memory");
      bytes.remove_prefix(static_cast<std::size_t>(n));
    }
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  std::string name() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

template <class Read>
void read_or_refuse(const Read& read) {
  try {
    read();
  } catch (const InputError& error) {
    const std::string text = printable(error.what());
    if (text.empty() || !is_utf8(text)) throw std::runtime_error("a message that says nothing");
  }
}

template <class Read>
void read_file_or_refuse(std::string_view bytes, const Read& read) {
  const MemoryFile file(bytes);
  read_or_refuse([&] { read(file.name()); });
}

constexpr std::array all{
    Reader{"ply",
           [](std::string_view bytes) {
             read_file_or_refuse(bytes, [](const std::string& file) { check_mesh(read_ply(file), file); });
           }},
    Reader{"obj",
           [](std::string_view bytes) {
             read_file_or_refuse(bytes, [](const std::string& file) { check_mesh(read_obj(file), file); });
           }},
    Reader{"serialized",
           [](std::string_view bytes) {
             read_file_or_refuse(bytes, [](const std::string& file) { read_serialized(file, 0); });
             read_file_or_refuse(bytes, [](const std::string& file) { read_serialized(file, 1); });
           }},
    Reader{"vol",
           [](std::string_view bytes) {
             read_file_or_refuse(bytes,
                                 [](const std::string& file) { read_volume_file(file, VoxelValues::of_any_sign); });
           }},
    Reader{"exr",
           [](std::string_view bytes) { read_file_or_refuse(bytes, [](const std::string& file) { read_exr(file); }); }},
    Reader{"image",
           [](std::string_view bytes) {  // PNG and what else textures may be
             read_file_or_refuse(bytes, [](const std::string& file) { read_bitmap(file); });
           }},
    Reader{"safetensors", [](std::string_view bytes) { read_or_refuse([&] { parse_safetensors(bytes, "file"); }); }},
    Reader{"manifest", [](std::string_view bytes) { read_or_refuse([&] { parse_manifest(bytes, "file"); }); }},
    Reader{"json", [](std::string_view bytes) { read_or_refuse([&] { parse_json<nlohmann::json>(bytes, "file"); }); }},
};

}  // namespace

std::span<const Reader> readers() { return all; }

const Reader& reader_of(std::string_view name) {
  for (const Reader& reader : all)
    if (name == reader.name) return reader;
  throw std::out_of_range("no reader " + std::string(name));
}

}  // namespace itn::fuzz
