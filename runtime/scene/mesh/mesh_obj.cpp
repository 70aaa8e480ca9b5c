// Wavefront OBJ: positions, texture coordinates, normals and faces; groups and materials are not used. Assimp reads it
// too, but splits every corner into a vertex of its own, and then does not know which ones were shared.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <map>

#include "itn/file.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/mesh/mesh_text.h"

namespace itn {
namespace {

constexpr std::uint32_t none = 0xffffffffu;

// Corners that agree in position, texture coordinate and normal are one vertex, in order of first appearance. Those at
// one position are a list, as there are few; where there are many, a table knows them, too.
class Corners {
 public:
  std::uint32_t find_or_add(std::uint32_t position, std::uint32_t texcoord, std::uint32_t normal) {
    if (position >= first_.size()) first_.resize(position + 1, none);
    std::uint32_t* link = &first_[position];
    int listed = 0;
    for (; *link != none; ++listed) {
      const Corner& c = corners[*link];
      if (c.texcoord == texcoord && c.normal == normal) return *link;
      link = &corners[*link].next;
    }
    const auto index = static_cast<std::uint32_t>(corners.size());
    if (listed == most_listed) {
      const auto [known, is_new] = further_.try_emplace({position, texcoord, normal}, index);
      if (!is_new) return known->second;
    } else {
      *link = index;
    }
    corners.push_back({position, texcoord, normal, none});
    return index;
  }

  struct Corner {
    std::uint32_t position, texcoord, normal;
    std::uint32_t next;  // another one at the same position; none behind the last that is listed
  };
  std::vector<Corner> corners;

 private:
  static constexpr int most_listed = 32;
  std::vector<std::uint32_t> first_;
  std::map<std::array<std::uint32_t, 3>, std::uint32_t> further_;
};

template <class Number, std::size_t size>
std::array<Number, size> parse_numbers(std::string_view line, const TextCursor& cursor, const char* what) {
  std::array<Number, size> out{};
  for (Number& value : out) {
    const std::string_view word = take_word(line);
    double number = 0;
    if (word.empty())
      cursor.fail(fmt::format("{} has fewer than {} numbers; the file is damaged or truncated", what, size));
    if (!parse_whole(word, number)) cursor.fail(fmt::format("{}: \"{}\" is not a number; mend the file", what, word));
    value = static_cast<Number>(number);
  }
  return out;
}

// One of the numbers of "position/texcoord/normal": from 1, or from -1 backwards. `none` for an empty word.
std::uint32_t parse_index(std::string_view word, std::size_t count, const char* what, const TextCursor& cursor) {
  if (word.empty()) return none;
  long index = 0;
  if (!parse_whole(word, index)) cursor.fail(fmt::format("face: \"{}\" is not an index; mend the file", word));
  const long resolved = index < 0 ? static_cast<long>(count) + index : index - 1;
  if (resolved < 0 || resolved >= static_cast<long>(count))
    cursor.fail(fmt::format("face: {} index {} is out of range; {} are defined above this line", what, index, count));
  return static_cast<std::uint32_t>(resolved);
}

bool is_ignored(std::string_view keyword) {
  static const char* const names[] = {"o",        "g",      "s",      "mg",         "usemtl",   "mtllib",
                                      "l",        "p",      "vp",     "bevel",      "lod",      "c_interp",
                                      "d_interp", "maplib", "usemap", "shadow_obj", "trace_obj"};
  return std::any_of(std::begin(names), std::end(names), [&](const char* name) { return keyword == name; });
}

}  // namespace

PlacedMesh read_obj(const std::string& file) {
  const std::string text = read_file(file);
  TextCursor cursor(text, file);
  std::vector<Vec3> position;
  std::vector<std::array<float, 3>> normal;
  std::vector<std::array<float, 2>> texcoord;
  Corners vertices;
  PlacedMesh mesh;
  std::string joined;
  std::vector<std::uint32_t> face;
  while (!cursor.at_end()) {
    std::string_view line = cursor.next_line();
    if (!line.empty() && line.back() == '\\') {  // continued on the next line
      joined.clear();
      while (!line.empty() && line.back() == '\\') {
        joined += line.substr(0, line.size() - 1);
        joined += ' ';
        line = cursor.next_line();
      }
      joined += line;
      line = joined;
    }
    line = line.substr(0, line.find('#'));
    const std::string_view keyword = take_word(line);
    if (keyword.empty() || is_ignored(keyword)) continue;
    if (keyword == "v") {
      position.push_back(parse_numbers<double, 3>(line, cursor, "vertex"));
    } else if (keyword == "vn") {
      normal.push_back(parse_numbers<float, 3>(line, cursor, "normal"));
    } else if (keyword == "vt") {
      texcoord.push_back(parse_numbers<float, 2>(line, cursor, "texture coordinate"));
    } else if (keyword == "f") {
      face.clear();
      for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
        std::string_view part[3];
        for (std::string_view& p : part) {
          const std::size_t slash = std::min(word.find('/'), word.size());
          p = word.substr(0, slash);
          word.remove_prefix(std::min(slash + 1, word.size()));
        }
        if (part[0].empty()) cursor.fail("face: a corner without a vertex index; mend the file");
        face.push_back(vertices.find_or_add(parse_index(part[0], position.size(), "vertex", cursor),
                                            parse_index(part[1], texcoord.size(), "texture coordinate", cursor),
                                            parse_index(part[2], normal.size(), "normal", cursor)));
      }
      if (face.size() < 3)
        cursor.fail(fmt::format("face has {} corners; need 3 or more: the file is damaged or truncated", face.size()));
      for (std::size_t i = 2; i < face.size(); ++i) mesh.triangle.push_back({face[0], face[i - 1], face[i]});
    } else {
      cursor.fail(
          fmt::format("unknown OBJ keyword \"{}\"; need v, vt, vn, f, or groups and materials; free-form surfaces "
                      "are not supported: export triangles",
                      keyword.substr(0, 20)));
    }
  }
  bool with_normals = true, with_texcoords = false;
  for (const auto& corner : vertices.corners) {
    with_normals = with_normals && corner.normal != none;
    with_texcoords = with_texcoords || corner.texcoord != none;
  }
  std::vector<Vec3> places;
  places.reserve(vertices.corners.size());
  for (const auto& corner : vertices.corners) {
    places.push_back(position[corner.position]);
    if (with_normals) mesh.normal.push_back(normal[corner.normal]);
    if (with_texcoords)
      mesh.texcoord.push_back(corner.texcoord == none ? std::array<float, 2>{0, 0} : texcoord[corner.texcoord]);
  }
  set_positions(mesh, places, FilePrecision::full);
  return mesh;
}

}  // namespace itn
