#include "tests/fuzz/readers.h"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "itn/bitmap.h"
#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "itn/load_scene.h"
#include "itn/measured_brdf.h"
#include "itn/network_file.h"
#include "itn/safetensors.h"
#include "network/dataset/config.h"
#include "network/dataset/manifest.h"
#include "network/training/trainer.h"
#include "runtime/base/json_text.h"
#include "runtime/base/printable.h"
#include "runtime/base/stored_run.h"
#include "runtime/image/jpeg.h"
#include "runtime/image/tiff.h"
#include "runtime/inverse/gauss_newton/started_inversion.h"
#include "runtime/scene/mesh/curve_mesh.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/volume/volume_file.h"
#include "runtime/scene/xml/spectrum.h"
#include "tests/fuzz/input_files.h"

namespace itn::fuzz {
namespace {

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
  const InputFiles files({{"file", std::string(bytes)}});
  read_or_refuse([&] { read(files.path("file")); });
}

// A scene, then lines "=== name" before the files that it names.
std::map<std::string, std::string> scene_files(std::string_view bytes) {
  constexpr std::string_view mark = "\n=== ";
  std::map<std::string, std::string> files;
  std::string name = "scene.xml";
  for (;;) {
    const std::size_t end = bytes.find(mark);
    files[name] = bytes.substr(0, end);
    if (end == std::string_view::npos) return files;
    bytes.remove_prefix(end + mark.size());
    const std::size_t line = std::min(bytes.find('\n'), bytes.size());
    name = bytes.substr(0, line);
    // Names that stay in the folder, where the files are on a disk.
    constexpr std::size_t longest = 40;
    const bool plain = name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_.") == std::string::npos;
    if (name.empty() || name[0] == '.' || name.size() > longest || !plain) name = "other";
    bytes.remove_prefix(std::min(line + 1, bytes.size()));
  }
}

void read_scene(std::string_view bytes) {
  const InputFiles files(scene_files(bytes));
  read_or_refuse([&] { load_scene(files.path("scene.xml")); });
}

NetworkDescription small_network() {
  NetworkDescription description;
  description.channels = 1;
  description.size = 8;
  description.width = 1;
  return description;
}

class NoExamples : public Examples {
 public:
  std::size_t count() const override { return 4; }
  void read(std::size_t /*index*/, std::uint64_t /*look*/, std::span<float> /*image*/,
            std::span<double> /*truth*/) const override {
    throw std::logic_error("a reader that trains");
  }
};

// As when training goes on: into a network that is there. The bytes are what the metadata says of the progress; the
// rest of the file, some 300 KB of weights for the smallest network, is as it was written: what the checksum no longer
// fits is refused once the progress has been read.
void read_checkpoint(std::string_view bytes) {
  static Network network(small_network());
  static const NoExamples examples;
  TrainingOptions options;
  options.batch = 2;
  static Trainer trainer(network, examples, examples, options);
  static Safetensors content = [] {
    const InputFiles files({});
    trainer.write_checkpoint(files.path("file"));
    Safetensors written = parse_safetensors(read_file(files.path("file")), "file");
    for (std::size_t i = 0, count = network.weights().size(); i < count; ++i) {
      Tensor best = network.weights()[i];
      best.name.insert(0, "best.");
      written.tensors.push_back(std::move(best));
    }
    return written;
  }();
  if (!is_utf8(bytes)) return;  // what no JSON holds
  content.metadata["progress"] = bytes;
  read_file_or_refuse(safetensors_bytes(content, Precision::single),
                      [](const std::string& file) { trainer.read_checkpoint(file); });
}

void read_inversion(std::string_view bytes) {
  read_file_or_refuse(bytes, [](const std::string& file) {
    const StoredRun run(file, "itn.invert.state/4", "an inversion");
    const StoredRun::Json request{{"seed", 5}};
    try {
      run.require_same(request);
    } catch (const UsageError&) {  // of another request
    }
    started_inversions(run, {2, 3, 2});
  });
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
             for (const int bits : {0, 8, 32})
               read_file_or_refuse(
                   bytes, [=](const std::string& file) { read_volume_file(file, VoxelValues::of_any_sign, bits); });
           }},
    Reader{"exr",
           [](std::string_view bytes) { read_file_or_refuse(bytes, [](const std::string& file) { read_exr(file); }); }},
    Reader{"image",
           [](std::string_view bytes) {  // PNG and what else textures may be
             read_file_or_refuse(bytes, [](const std::string& file) { read_bitmap(file); });
           }},
    Reader{"jpeg", [](std::string_view bytes) { read_or_refuse([&] { read_jpeg(std::string(bytes), "file"); }); }},
    Reader{"tiff", [](std::string_view bytes) { read_or_refuse([&] { read_tiff(std::string(bytes), "file"); }); }},
    Reader{"safetensors", [](std::string_view bytes) { read_or_refuse([&] { parse_safetensors(bytes, "file"); }); }},
    Reader{"manifest", [](std::string_view bytes) { read_or_refuse([&] { parse_manifest(bytes, "file"); }); }},
    Reader{"scene", read_scene},
    Reader{"config",
           [](std::string_view bytes) {
             read_file_or_refuse(bytes, [](const std::string& file) { read_dataset_config(file); });
           }},
    Reader{"spectrum",
           [](std::string_view bytes) {
             read_file_or_refuse(
                 bytes, [](const std::string& file) { integrate(read_spectrum(file), /*under_daylight=*/true); });
           }},
    Reader{"curves",
           [](std::string_view bytes) {
             read_file_or_refuse(bytes, [](const std::string& file) { read_curves(file, 2); });
           }},
    Reader{"merl",
           [](std::string_view bytes) {
             read_file_or_refuse(bytes, [](const std::string& file) { read_merl_file(file); });
           }},
    Reader{"network", [](std::string_view bytes) { read_or_refuse([&] { parse_network(bytes, "file"); }); }},
    Reader{"checkpoint", read_checkpoint},
    Reader{"inversion", read_inversion},
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
