// Further formats, through Assimp, in a process of its own: on broken files it crashes, hangs and asks for all memory.
#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/DefaultLogger.hpp>
#include <assimp/Importer.hpp>
#include <assimp/LogStream.hpp>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <string_view>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/base/child_process.h"
#include "runtime/base/fingerprint.h"
#include "runtime/base/inputs.h"
#include "runtime/scene/mesh/mesh_file.h"

namespace itn {
namespace {

constexpr ChildLimits limits{std::uint64_t{4} << 30, 60, 600};

constexpr std::array formats{".3ds", ".dae", ".fbx", ".glb", ".gltf", ".off", ".stl"};

void append(const aiMesh& part, Mesh& mesh, bool with_normals, bool with_texcoords) {
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& p = part.mVertices[i];
    mesh.position.push_back({p.x, p.y, p.z});
    if (with_normals) mesh.normal.push_back({part.mNormals[i].x, part.mNormals[i].y, part.mNormals[i].z});
    if (with_texcoords) mesh.texcoord.push_back({part.mTextureCoords[0][i].x, part.mTextureCoords[0][i].y});
  }
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices == 3)  // points and lines are no surface
      mesh.triangle.push_back({first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
  }
}

using Fingerprints = std::map<std::string, std::string>;  // by name

// Knows which files are read, those of glTF name others, and the fingerprints of the bytes that Assimp gets.
class NotedFiles : public Assimp::DefaultIOSystem {
 public:
  explicit NotedFiles(Fingerprints& files) : files_(files) {}
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) return nullptr;
    const std::unique_ptr<Assimp::IOStream> on_disk(DefaultIOSystem::Open(file, mode));
    if (!on_disk) return nullptr;
    const std::size_t size = on_disk->FileSize();
    auto bytes = std::make_unique<std::uint8_t[]>(size);
    if (on_disk->Read(bytes.get(), 1, size) != size) return nullptr;
    const std::string sum = fingerprint_text({reinterpret_cast<const char*>(bytes.get()), size});
    if (files_.emplace(file, sum).first->second != sum) return nullptr;  // changed since it was opened before
    return new Assimp::MemoryIOStream(bytes.release(), size, /*own=*/true);
  }

 private:
  Fingerprints& files_;
};

// Warnings about what is not read here: a mesh's appearance, motion, light or visibility, and other contents of its
// file. All others are about its shape: vertices or faces that are missing, left out or cut off.
bool is_of_no_shape(std::string message) {
  constexpr std::array harmless{"anim",  "bone", "camera",    "color",   "colour", "light", "material", "metadata",
                                "pivot", "skin", "smoothing", "texture", "uv",     "video", "unit",     "axis"};
  std::transform(message.begin(), message.end(), message.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::any_of(harmless.begin(), harmless.end(),
                     [&](const char* word) { return message.find(word) != std::string::npos; });
}

// Catches the first error that Assimp would repair in silence, such as an index out of range, or a file that ends
// early.
class FirstError : public Assimp::LogStream {
 public:
  explicit FirstError(std::string& text) : text_(text) {}
  void write(const char* message) override {
    const std::string_view text(message);
    if (text_.empty() && !(text.starts_with("Warn") && is_of_no_shape(message))) text_ = message;
  }

 private:
  std::string& text_;
};

struct MeshFile {
  PlacedMesh mesh;
  Fingerprints files;  // that it was in
};

MeshFile import(const std::string& file) {
  MeshFile result;
  std::string error;
  Assimp::DefaultLogger::create("", Assimp::Logger::NORMAL, 0);
  Assimp::DefaultLogger::get()->attachStream(new FirstError(error), Assimp::Logger::Err | Assimp::Logger::Warn);
  Assimp::Importer importer;
  importer.SetIOHandler(new NotedFiles(result.files));
  // Identical corners become one vertex again, so that normals computed later are smooth across faces.
  const aiScene* scene =
      importer.ReadFile(file, aiProcess_Triangulate | aiProcess_PreTransformVertices | aiProcess_JoinIdenticalVertices);
  if (!scene) throw InputError(std::string("not a readable mesh: ") + importer.GetErrorString() + "; export it again");
  while (!error.empty() && error.back() == '\n') error.pop_back();
  if (!error.empty()) throw InputError("is damaged: " + error + "; export it again");
  bool with_normals = true, with_texcoords = true;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    with_normals = with_normals && scene->mMeshes[i]->HasNormals();
    with_texcoords = with_texcoords && scene->mMeshes[i]->HasTextureCoords(0);
  }
  for (unsigned i = 0; i < scene->mNumMeshes; ++i)
    append(*scene->mMeshes[i], result.mesh, with_normals, with_texcoords);
  return result;
}

// Serializes a mesh in the process that has read it, to send it back.
class Writer {
 public:
  template <class Value>
  void put(const std::vector<Value>& values) {
    const std::uint64_t count = values.size();
    bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
    bytes.append(reinterpret_cast<const char*>(values.data()), count * sizeof(Value));
  }
  std::string bytes;
};

class Taker {
 public:
  explicit Taker(const std::string& bytes) : bytes_(bytes) {}
  template <class Value>
  void take(std::vector<Value>& values) {
    std::uint64_t count = 0;
    copy(&count, sizeof count);
    // A reader that was taken over could write anything.
    if (count > (bytes_.size() - at_) / sizeof(Value)) throw InputError("crashes its reader: it is broken");
    values.resize(count);
    if (count > 0) copy(values.data(), count * sizeof(Value));
  }

 private:
  void copy(void* to, std::size_t size) {
    if (size > bytes_.size() - at_) throw InputError("crashes its reader: it is broken");
    std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
  }
  const std::string& bytes_;
  std::size_t at_ = 0;
};

std::string bytes_of(const MeshFile& file) {
  Writer out;
  out.put(file.mesh.position);
  out.put(file.mesh.normal);
  out.put(file.mesh.texcoord);
  out.put(file.mesh.triangle);
  std::vector<char> files;
  for (const auto& [name, sum] : file.files)
    for (const std::string* text : {&name, &sum})
      files.insert(files.end(), text->c_str(), text->c_str() + text->size() + 1);
  out.put(files);
  return std::move(out.bytes);
}

MeshFile from_bytes(const std::string& bytes) {
  Taker in(bytes);
  MeshFile file;
  in.take(file.mesh.position);
  in.take(file.mesh.normal);
  in.take(file.mesh.texcoord);
  in.take(file.mesh.triangle);
  std::vector<char> files;
  in.take(files);
  for (auto begin = files.begin(); begin != files.end();) {
    std::array<std::string, 2> name_and_sum;
    for (std::string& text : name_and_sum) {
      const auto end = std::find(begin, files.end(), '\0');
      text.assign(begin, end);
      begin = end == files.end() ? end : end + 1;
    }
    file.files[name_and_sum[0]] = name_and_sum[1];
  }
  return file;
}

}  // namespace

PlacedMesh read_with_assimp(const std::string& file, const std::string& extension) {
  if (std::find(formats.begin(), formats.end(), extension) == formats.end()) {
    std::string all = ".ply, .obj, .serialized";
    for (const char* format : formats) all += std::string(", ") + format;
    throw InputError(file + ": not a readable mesh: its name ends in \"" + extension + "\"; need one of " + all +
                     ": export it as PLY");
  }
  check_regular_file(file);
  try {
    MeshFile read = from_bytes(in_child_process([&] { return bytes_of(import(file)); }, limits));
    for (const auto& [name, sum] : read.files) note_fingerprint(name, sum);
    std::vector<Vec3> positions;
    positions.reserve(read.mesh.position.size());
    for (const auto& p : read.mesh.position) positions.push_back({p[0], p[1], p[2]});
    set_positions(read.mesh, positions, FilePrecision::single);
    return std::move(read.mesh);
  } catch (const InputError& error) {
    throw InputError(file + ": " + error.what());
  }
}

}  // namespace itn
