// Mitsuba's own format, .serialized, versions 3 and 4: each mesh of a file a zlib stream behind an uncompressed header,
// at the end of the file the places of all meshes.
#include <fmt/core.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <string_view>

#include "itn/error.h"
#include "itn/file.h"
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
T read_at(std::string_view bytes, std::size_t at) {
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
      fail(fmt::format("the compressed data are damaged or end early, after {} bytes{}; export the mesh again",
                       stream_.total_out, stream_.msg ? fmt::format(" ({})", stream_.msg) : ""));
    }
  }
  template <class T>
  T read() {
    T value;
    read(&value, sizeof value);
    return value;
  }

  // Behind the last number: the stream has to end here, with the right checksum, and nothing may follow.
  void end() {
    char beyond = 0;
    stream_.next_out = reinterpret_cast<Bytef*>(&beyond);
    stream_.avail_out = 1;
    const bool ended = inflate(&stream_, Z_NO_FLUSH) == Z_STREAM_END;
    if (!ended || stream_.avail_out == 0 || stream_.avail_in > 0)
      fail(fmt::format("the compressed data are damaged: {}; export the mesh again",
                       stream_.msg              ? stream_.msg
                       : stream_.avail_out == 0 ? "they hold more than the mesh"
                       : !ended                 ? "they end early"
                                                : "bytes follow their end"));
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

// The mesh, from its header on. The places of all stand before their number, the file's last word; all are looked at,
// whichever is asked for: a file that is cut has no table, or another.
std::string_view find_mesh(std::string_view bytes, const std::string& file, long index, int version) {
  const std::size_t width = version == 3 ? sizeof(std::uint32_t) : sizeof(std::uint64_t);
  const auto broken = [&](const std::string& what) {
    return InputError(
        fmt::format("{}: its table of meshes, at the end, is cut or wrong: {}; copy the whole file, or "
                    "export it again",
                    file, what));
  };
  const std::size_t table_end = bytes.size() - sizeof(std::uint32_t);
  const std::size_t count = read_at<std::uint32_t>(bytes, table_end);
  if (count == 0 || count > table_end / width) throw broken(fmt::format("{} meshes in {} bytes", count, bytes.size()));
  if (index < 0 || static_cast<std::size_t>(index) >= count)
    throw InputError(fmt::format("{}: shape_index is {}; the file has {} meshes, from 0", file, index, count));
  const std::size_t table = table_end - width * count;
  const auto place = [&](std::size_t i) -> std::uint64_t {
    if (i == count) return table;
    const std::size_t at = table + width * i;
    return version == 3 ? read_at<std::uint32_t>(bytes, at) : read_at<std::uint64_t>(bytes, at);
  };
  if (place(0) != 0) throw broken(fmt::format("mesh 0 begins at byte {}, need 0", place(0)));
  for (std::size_t i = 0; i < count; ++i)
    if (place(i) > table || place(i + 1) > table || place(i) + header_size > place(i + 1))
      throw broken(fmt::format("mesh {} is from byte {} to {} of {}", i, place(i), place(i + 1), table));
  const auto i = static_cast<std::size_t>(index);
  return bytes.substr(place(i), place(i + 1) - place(i));
}

int read_version(std::string_view bytes, const std::string& file) {
  if (bytes.size() < header_size || read_at<std::uint16_t>(bytes, 0) != 0x041c)
    throw InputError(file + ": no .serialized mesh; need a file that Mitsuba or its exporters wrote");
  const int version = read_at<std::uint16_t>(bytes, 2);
  if (version != 3 && version != 4)
    throw InputError(fmt::format("{}: version {} of the format; need 3 or 4: export it as PLY", file, version));
  return version;
}

}  // namespace

PlacedMesh read_serialized(const std::string& file, long index) {
  const std::string bytes = read_file(file);
  const std::string_view part = find_mesh(bytes, file, index, read_version(bytes, file));
  const int version = read_version(part, file);
  Inflater in(part.substr(header_size), file);
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
  in.end();
  check_mesh(mesh, file);
  return mesh;
}

}  // namespace itn
