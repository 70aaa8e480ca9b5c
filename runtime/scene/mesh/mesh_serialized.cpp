// Mitsuba's own format, .serialized, versions 3 and 4: each mesh of a file a zlib stream behind an uncompressed header,
// at the end of the file the places of all meshes.
#include <fmt/core.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/mesh/mesh_text.h"

namespace itn {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t header_size = 4;
constexpr std::size_t longest_name = 1 << 16;
constexpr std::uint64_t most_of_deflate = 1032;  // bytes that a compressed one can become
enum Flags : std::uint32_t { has_normals = 1, has_texcoords = 2, has_colours = 8, double_precision = 0x2000 };

template <class T>
T read_at(const std::string& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

class Inflater {
 public:
  Inflater(std::string_view compressed, const std::string& file) : file_(file), compressed_size_(compressed.size()) {
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(compressed.data()));
    stream_.avail_in = static_cast<uInt>(std::min<std::size_t>(compressed.size(), 0xffffffffu));
    if (inflateInit(&stream_) != Z_OK) fail("zlib cannot start; is there memory left?");
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  void read(void* to, std::size_t size) {
    stream_.next_out = static_cast<Bytef*>(to);
    stream_.avail_out = static_cast<uInt>(size);
    while (stream_.avail_out > 0) {
      const int state = inflate(&stream_, Z_NO_FLUSH);
      if (state == Z_OK || (state == Z_STREAM_END && stream_.avail_out == 0)) continue;
      fail(fmt::format("the compressed data are damaged or end early, after {} bytes; export the mesh again",
                       stream_.total_out));
    }
  }
  template <class T>
  T read() {
    T value;
    read(&value, sizeof value);
    return value;
  }

  // Refuses what the file cannot hold.
  void expect(std::uint64_t bytes, std::uint64_t vertices, std::uint64_t triangles) const {
    if (bytes > most_of_deflate * compressed_size_)
      fail(fmt::format("promises {} vertices and {} triangles, more than its {} bytes can hold; export the mesh again",
                       vertices, triangles, compressed_size_));
  }
  [[noreturn]] void fail(const std::string& what) const { throw InputError(file_ + ": " + what); }

 private:
  z_stream stream_{};
  std::string file_;
  std::size_t compressed_size_;
};

// `count` rows of numbers. Memory is taken as they arrive: a count is only a promise.
template <class Stored, class Number, std::size_t size>
void read_rows(Inflater& in, std::uint64_t count, std::vector<std::array<Number, size>>& rows) {
  constexpr std::uint64_t at_once = 1 << 16;
  std::vector<std::array<Stored, size>> part;
  for (std::uint64_t done = 0; done < count; done += part.size()) {
    part.resize(std::min(at_once, count - done));
    in.read(part.data(), part.size() * sizeof part[0]);
    for (const auto& stored : part) {
      auto& row = rows.emplace_back();
      for (std::size_t k = 0; k < size; ++k) row[k] = static_cast<Number>(stored[k]);
    }
  }
}

template <class Real>
void read_vertices(Inflater& in, std::uint32_t flags, std::uint64_t count, PlacedMesh& mesh) {
  std::vector<Vec3> positions;
  read_rows<Real>(in, count, positions);
  set_positions(mesh, positions, sizeof(Real) == sizeof(double) ? FilePrecision::full : FilePrecision::single);
  if (flags & has_normals) read_rows<Real>(in, count, mesh.normal);
  if (flags & has_texcoords) read_rows<Real>(in, count, mesh.texcoord);
  std::vector<std::array<float, 3>> colours;  // nothing here uses them
  if (flags & has_colours) read_rows<Real>(in, count, colours);
}

// Where the mesh begins. The places stand before the number of meshes, the file's last word.
std::size_t find_mesh(const std::string& bytes, const std::string& file, long index, int version) {
  if (index == 0) return 0;
  const std::size_t width = version == 3 ? sizeof(std::uint32_t) : sizeof(std::uint64_t);
  const std::size_t count = read_at<std::uint32_t>(bytes, bytes.size() - sizeof(std::uint32_t));
  const std::size_t table_end = bytes.size() - sizeof(std::uint32_t);
  if (count > table_end / width)
    throw InputError(fmt::format("{}: its table of {} meshes is longer than the file; export it again", file, count));
  if (static_cast<std::size_t>(index) >= count)
    throw InputError(fmt::format("{}: shape_index is {}; the file has {} meshes, from 0", file, index, count));
  const std::size_t at = table_end - width * (count - static_cast<std::size_t>(index));
  const std::uint64_t place = version == 3 ? read_at<std::uint32_t>(bytes, at) : read_at<std::uint64_t>(bytes, at);
  if (place >= bytes.size() - header_size)
    throw InputError(
        fmt::format("{}: mesh {} begins at byte {} of {}; export it again", file, index, place, bytes.size()));
  return place;
}

int read_version(const std::string& bytes, const std::string& file, std::size_t at) {
  if (bytes.size() < at + header_size || read_at<std::uint16_t>(bytes, at) != 0x041c)
    throw InputError(file + ": no .serialized mesh; need a file that Mitsuba or its exporters wrote");
  const int version = read_at<std::uint16_t>(bytes, at + 2);
  if (version != 3 && version != 4)
    throw InputError(fmt::format("{}: version {} of the format; need 3 or 4: export it as PLY", file, version));
  return version;
}

}  // namespace

PlacedMesh read_serialized(const std::string& file, long index) {
  const std::string bytes = read_file(file);
  const std::size_t begin = find_mesh(bytes, file, index, read_version(bytes, file, 0));
  const int version = read_version(bytes, file, begin);
  Inflater in(std::string_view(bytes).substr(begin + header_size), file);
  const auto flags = in.read<std::uint32_t>();
  if (version == 4)
    for (std::size_t length = 0; in.read<char>() != 0; ++length)
      if (length == longest_name) in.fail("the mesh's name has no end; export the mesh again");
  const auto vertices = in.read<std::uint64_t>(), triangles = in.read<std::uint64_t>();
  constexpr std::uint64_t most = 0xffffffffu;
  if (vertices > most || triangles > most)
    in.fail(fmt::format("promises {} vertices and {} triangles; need fewer than 2^32", vertices, triangles));
  const std::uint64_t numbers =
      3 + (flags & has_normals ? 3 : 0) + (flags & has_texcoords ? 2 : 0) + (flags & has_colours ? 3 : 0);
  in.expect(vertices * numbers * (flags & double_precision ? 8 : 4) + triangles * 12, vertices, triangles);
  PlacedMesh mesh;
  if (flags & double_precision)
    read_vertices<double>(in, flags, vertices, mesh);
  else
    read_vertices<float>(in, flags, vertices, mesh);
  read_rows<std::uint32_t>(in, triangles, mesh.triangle);
  check_mesh(mesh, file);
  return mesh;
}

}  // namespace itn
