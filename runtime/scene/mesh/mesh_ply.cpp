// PLY, ASCII and binary of both byte orders. Assimp reads it too, but crashes on truncated files and lets others pass.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "itn/file.h"
#include "runtime/image/srgb.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/mesh/mesh_text.h"

namespace itn {
namespace {

enum class Number { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float16, float32, float64 };

Number parse_number_type(std::string_view word, const TextCursor& cursor) {
  struct Name {
    const char *plain, *sized;
    Number type;
  };
  static const Name names[] = {
      {"char", "int8", Number::int8},        {"uchar", "uint8", Number::uint8},      {"short", "int16", Number::int16},
      {"ushort", "uint16", Number::uint16},  {"int", "int32", Number::int32},        {"uint", "uint32", Number::uint32},
      {"float", "float32", Number::float32}, {"double", "float64", Number::float64}, {"long", "int64", Number::int64},
      {"ulong", "uint64", Number::uint64},   {"half", "float16", Number::float16}};
  for (const Name& name : names)
    if (word == name.plain || word == name.sized) return name.type;
  cursor.fail(
      fmt::format("unknown number type \"{}\" in the PLY header; need char, uchar, short, ushort, int, uint, "
                  "long, ulong, half, float or double",
                  word));
}

std::size_t size_of(Number type) {
  switch (type) {
    case Number::int8:
    case Number::uint8:
      return 1;
    case Number::int16:
    case Number::uint16:
    case Number::float16:
      return 2;
    case Number::int64:
    case Number::uint64:
    case Number::float64:
      return 8;
    default:
      return 4;
  }
}

// IEEE 754's binary16.
double half_value(std::uint16_t bits) {
  const int exponent = (bits >> 10) & 31, mantissa = bits & 1023;
  const double magnitude = exponent == 31 ? (mantissa ? std::nan("") : HUGE_VAL)
                           : exponent     ? std::ldexp(1024 + mantissa, exponent - 25)
                                          : std::ldexp(mantissa, -24);
  return bits & 0x8000 ? -magnitude : magnitude;
}

// Greatest value of the integers that Mitsuba takes for colours of sRGB; 0: other numbers, and unsigned bytes, which it
// takes as they are.
double greatest(Number type) {
  switch (type) {
    case Number::int8:
      return 127;
    case Number::int16:
      return 32767;
    case Number::uint16:
      return 65535;
    case Number::int32:
      return std::numeric_limits<std::int32_t>::max();
    case Number::uint32:
      return std::numeric_limits<std::uint32_t>::max();
    case Number::int64:
      return static_cast<double>(std::numeric_limits<std::int64_t>::max());
    case Number::uint64:
      return static_cast<double>(std::numeric_limits<std::uint64_t>::max());
    default:
      return 0;
  }
}

// As Mitsuba 3.9 takes attributes.
float attribute_value(Number type, double stored) {
  const double most = greatest(type);
  return static_cast<float>(most > 0 ? srgb_decode(stored / most) : stored);
}

struct Property {
  std::string name;
  Number type = Number::float32;
  bool is_list = false;
  Number count_type = Number::uint8;  // of a list
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  enum class Format { ascii, little_endian, big_endian } format = Format::ascii;
  std::vector<PlyElement> elements;
};

Header parse_header(TextCursor& cursor) {
  if (cursor.next_line() != "ply") cursor.fail("not a PLY file: the first line is not \"ply\"; export the mesh again");
  Header header;
  bool has_format = false;
  while (true) {
    if (cursor.at_end()) cursor.fail("the PLY header has no end_header: the file is truncated; export the mesh again");
    std::string_view line = cursor.next_line();
    const std::string_view keyword = take_word(line);
    if (keyword == "end_header") break;
    if (keyword == "comment" || keyword == "obj_info" || keyword.empty()) continue;
    if (keyword == "format") {
      const std::string_view format = take_word(line);
      if (format == "ascii") {
        header.format = Header::Format::ascii;
      } else if (format == "binary_little_endian") {
        header.format = Header::Format::little_endian;
      } else if (format == "binary_big_endian") {
        header.format = Header::Format::big_endian;
      } else {
        cursor.fail(
            fmt::format("unknown PLY format \"{}\"; need ascii, binary_little_endian or binary_big_endian", format));
      }
      has_format = true;
    } else if (keyword == "element") {
      PlyElement element;
      element.name = take_word(line);
      const std::string_view count = take_word(line);
      if (!parse_whole(count, element.count))
        cursor.fail(fmt::format("element {}: \"{}\" is not a count; mend the PLY header", element.name, count));
      for (const PlyElement& before : header.elements)
        if (before.name == element.name)
          cursor.fail(
              fmt::format("element {} for the second time; need each once: export the mesh again", element.name));
      header.elements.push_back(element);
    } else if (keyword == "property") {
      if (header.elements.empty()) cursor.fail("property before any element; mend the PLY header");
      Property property;
      std::string_view type = take_word(line);
      if (type == "list") {
        property.is_list = true;
        property.count_type = parse_number_type(take_word(line), cursor);
        type = take_word(line);
      }
      property.type = parse_number_type(type, cursor);
      property.name = take_word(line);
      header.elements.back().properties.push_back(property);
    } else {
      cursor.fail(
          fmt::format("unknown keyword \"{}\" in the PLY header; need format, comment, element, property or "
                      "end_header",
                      keyword));
    }
  }
  if (!has_format) cursor.fail("the PLY header has no format line; need for example \"format ascii 1.0\"");
  return header;
}

// The numbers after the header, whatever the format.
class Body {
 public:
  Body(std::string_view text, TextCursor& cursor, Header::Format format, std::string file)
      : text_(text), cursor_(cursor), format_(format), file_(std::move(file)), position_(cursor.position()) {}

  void begin(const PlyElement& element) {
    // A row takes at least one byte a number (two in ASCII, with the separator): refuse absurd counts before
    // reserving memory for them.
    std::size_t least = 0;
    for (const Property& p : element.properties)
      least += format_ == Header::Format::ascii ? 2 : size_of(p.is_list ? p.count_type : p.type);
    element_ = &element;
    row_ = 0;
    if (least > 0 && element.count > (text_.size() - position() + 1) / least) truncated();
  }
  void next_row() { ++row_; }

  double next(Number type) {
    if (format_ == Header::Format::ascii) {
      const std::string_view word = cursor_.next_word();
      if (word.empty()) truncated();
      double value = 0;
      if (!parse_whole(word, value))
        cursor_.fail(fmt::format("{} {}: \"{}\" is not a number; mend the file", element_->name, row_, word));
      return value;
    }
    const std::size_t size = size_of(type);
    if (text_.size() - position_ < size) truncated();
    unsigned char bytes[8];
    std::memcpy(bytes, text_.data() + position_, size);
    position_ += size;
    if ((format_ == Header::Format::little_endian) != (std::endian::native == std::endian::little))
      std::reverse(bytes, bytes + size);
    switch (type) {
      case Number::int8:
        return as<std::int8_t>(bytes);
      case Number::uint8:
        return as<std::uint8_t>(bytes);
      case Number::int16:
        return as<std::int16_t>(bytes);
      case Number::uint16:
        return as<std::uint16_t>(bytes);
      case Number::int32:
        return as<std::int32_t>(bytes);
      case Number::uint32:
        return as<std::uint32_t>(bytes);
      case Number::int64:
        return as<std::int64_t>(bytes);
      case Number::uint64:
        return as<std::uint64_t>(bytes);
      case Number::float16:
        return half_value(static_cast<std::uint16_t>(as<std::uint16_t>(bytes)));
      case Number::float32:
        return as<float>(bytes);
      case Number::float64:
        return as<double>(bytes);
    }
    return 0;
  }

  // Reads an integer that must not be negative or fractional.
  std::size_t next_index(Number type, const char* what) {
    const double value = next(type);
    if (!(value >= 0 && value < 4294967296.0 && value == std::floor(value)))
      fail(fmt::format("{} {}: {} is {}; need an integer from 0", element_->name, row_, what, value));
    return static_cast<std::size_t>(value);
  }

  [[noreturn]] void fail(const std::string& what) const {
    if (format_ == Header::Format::ascii) cursor_.fail(what);
    throw InputError(fmt::format("{}: byte {}: {}", file_, position_, what));
  }

 private:
  template <class T>
  static double as(const unsigned char* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
  }
  std::size_t position() const { return format_ == Header::Format::ascii ? cursor_.position() : position_; }
  [[noreturn]] void truncated() const {
    throw InputError(
        fmt::format("{}: truncated: the header promises {} of element {}, the file ends at {}; export the "
                    "mesh again",
                    file_, element_->count, element_->name,
                    row_ == 0 ? "byte " + std::to_string(text_.size()) : "number " + std::to_string(row_)));
  }

  std::string_view text_;
  TextCursor& cursor_;
  Header::Format format_;
  std::string file_;
  std::size_t position_;
  const PlyElement* element_ = nullptr;
  std::size_t row_ = 0;
};

// The column into which each vertex property goes; -1: none.
struct VertexColumns {
  bool has_normal = false, has_texcoord = false;
  std::vector<int> target;  // 0..2 position, 3..5 normal, 6..7 texture coordinate
};

VertexColumns find_columns(const PlyElement& element, const std::string& file) {
  VertexColumns columns;
  bool found[8] = {};
  for (const Property& property : element.properties) {
    static const char* const names[][3] = {{"x", "", ""},           {"y", "", ""},          {"z", "", ""},
                                           {"nx", "", ""},          {"ny", "", ""},         {"nz", "", ""},
                                           {"u", "s", "texture_u"}, {"v", "t", "texture_v"}};
    int target = -1;
    for (int i = 0; i < 8; ++i)
      for (const char* name : names[i])
        if (!property.is_list && *name && property.name == name) target = i;
    if (target >= 0) found[target] = true;
    columns.target.push_back(target);
  }
  if (!(found[0] && found[1] && found[2]))
    throw InputError(file + ": the vertices of the PLY file lack x, y or z; export the mesh again");
  columns.has_normal = found[3] && found[4] && found[5];
  columns.has_texcoord = found[6] && found[7];
  return columns;
}

// An attribute, and the properties that are its channels.
struct AttributeColumns {
  std::string name;
  std::vector<std::size_t> column;
};

std::string_view postfix_of(const std::string& name) {
  const std::size_t at = name.rfind('_');
  return at == std::string::npos ? std::string_view() : std::string_view(name).substr(at + 1);
}

bool is_number_called(const Property& property, std::string_view name) {
  return !property.is_list && property.name == name;
}

// Finds the attributes that Mitsuba makes of an element's further properties: r, g, b (or red, green, blue) are the
// attribute "color". Others are made of one property or of three that stand together and differ only in what follows
// the last underscore: x y z, 0 1 2, 1 2 3, or r g b; they have the name before it. owner: "vertex_" or "face_"
std::vector<AttributeColumns> find_attributes(const PlyElement& element, const std::string& owner) {
  const auto& all = element.properties;
  std::vector<AttributeColumns> result;
  for (const auto& names : {std::array<const char*, 3>{"r", "g", "b"}, {"red", "green", "blue"}}) {
    AttributeColumns colour{owner + "color", {}};
    for (const char* name : names)
      for (std::size_t i = 0; i < all.size(); ++i)
        if (is_number_called(all[i], name)) colour.column.push_back(i);
    if (colour.column.size() == 3 && result.empty()) result.push_back(colour);
  }
  for (std::size_t i = 0; i < all.size();) {
    const std::string_view postfix = postfix_of(all[i].name);
    static const char* const categories[] = {"xyz", "rgb", "012", "123"};
    const auto* const category = std::find_if(std::begin(categories), std::end(categories), [&](const char* letters) {
      return postfix.size() == 1 && postfix[0] == letters[0];
    });
    if (category == std::end(categories) || all[i].is_list) {
      ++i;
      continue;
    }
    const std::string prefix = all[i].name.substr(0, all[i].name.size() - 2);
    AttributeColumns found{owner + prefix + (*category == categories[1] ? "_color" : ""), {}};
    const std::size_t first = i;
    while (i < all.size() && i < first + 3 && is_number_called(all[i], prefix + "_" + (*category)[i - first]))
      found.column.push_back(i++);
    const bool is_new = std::none_of(result.begin(), result.end(),
                                     [&](const AttributeColumns& other) { return other.name == found.name; });
    if (is_new && found.column.size() != 2) result.push_back(found);
  }
  return result;
}

void add_attributes(const std::vector<AttributeColumns>& columns, Mesh& mesh) {
  for (const AttributeColumns& c : columns) mesh.attributes.push_back({c.name, c.column.size(), {}});
}

// The values of a row, `times`. first: of the element's attributes among those of the mesh
void append_row(const std::vector<AttributeColumns>& columns, const std::vector<float>& row, std::size_t first,
                std::size_t times, Mesh& mesh) {
  for (std::size_t a = 0; a < columns.size(); ++a)
    for (std::size_t n = 0; n < times; ++n)
      for (const std::size_t column : columns[a].column) mesh.attributes[first + a].values.push_back(row[column]);
}

void read_vertices(Body& body, Header::Format format, const PlyElement& element, const std::string& file,
                   PlacedMesh& mesh) {
  const VertexColumns columns = find_columns(element, file);
  std::vector<Vec3> positions;
  positions.reserve(element.count);
  if (columns.has_normal) mesh.normal.reserve(element.count);
  if (columns.has_texcoord) mesh.texcoord.reserve(element.count);
  const std::vector<AttributeColumns> attributes = find_attributes(element, "vertex_");
  const std::size_t first_attribute = mesh.attributes.size();
  add_attributes(attributes, mesh);
  std::vector<float> all(element.properties.size());
  for (std::size_t row = 0; row < element.count; ++row, body.next_row()) {
    double value[8] = {};
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& property = element.properties[i];
      for (std::size_t n = property.is_list ? body.next_index(property.count_type, "the length of a list") : 1; n > 0;
           --n) {
        const double number = body.next(property.type);
        if (columns.target[i] >= 0) value[columns.target[i]] = number;
        all[i] = attribute_value(property.type, number);
      }
    }
    const auto single = [&](std::size_t k) { return static_cast<float>(value[k]); };
    positions.push_back({value[0], value[1], value[2]});
    if (columns.has_normal) mesh.normal.push_back({single(3), single(4), single(5)});
    if (columns.has_texcoord) mesh.texcoord.push_back({single(6), single(7)});
    append_row(attributes, all, first_attribute, 1, mesh);
  }
  bool full = format == Header::Format::ascii;
  for (std::size_t i = 0; i < columns.target.size(); ++i)
    full |= columns.target[i] >= 0 && columns.target[i] < 3 && element.properties[i].type == Number::float64;
  set_positions(mesh, positions, full ? FilePrecision::full : FilePrecision::single);
}

// vertices: how many there are, which may stand behind the faces.
void read_faces(Body& body, const PlyElement& element, const std::string& file, std::size_t vertices, Mesh& mesh) {
  bool has_corners = false;
  for (const Property& p : element.properties)
    has_corners = has_corners || (p.is_list && (p.name == "vertex_indices" || p.name == "vertex_index"));
  if (!has_corners)
    throw InputError(file + ": the faces of the PLY file have no list vertex_indices; export the mesh again");
  mesh.triangle.reserve(element.count);
  const std::vector<AttributeColumns> attributes = find_attributes(element, "face_");
  const std::size_t first_attribute = mesh.attributes.size();
  add_attributes(attributes, mesh);
  std::vector<float> all(element.properties.size());
  std::vector<std::uint32_t> corners;
  for (std::size_t row = 0; row < element.count; ++row, body.next_row()) {
    const std::size_t triangles = mesh.triangle.size();
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      const Property& property = element.properties[k];
      const bool is_corners =
          property.is_list && (property.name == "vertex_indices" || property.name == "vertex_index");
      std::size_t n = property.is_list ? body.next_index(property.count_type, "the length of a list") : 1;
      if (!is_corners) {
        for (; n > 0; --n) all[k] = attribute_value(property.type, body.next(property.type));
        continue;
      }
      if (n < 3) body.fail(fmt::format("face {} has {} corners; need 3 or more", row, n));
      corners.clear();
      for (; n > 0; --n) {
        const std::size_t corner = body.next_index(property.type, "a vertex index");
        if (corner >= vertices)
          body.fail(
              fmt::format("face {}: vertex index {} is out of range; the mesh has {} vertices", row, corner, vertices));
        corners.push_back(static_cast<std::uint32_t>(corner));
      }
      for (std::size_t i = 2; i < corners.size(); ++i)
        mesh.triangle.push_back({corners[0], corners[i - 1], corners[i]});
    }
    append_row(attributes, all, first_attribute, mesh.triangle.size() - triangles, mesh);
  }
}

void skip(Body& body, const PlyElement& element) {
  if (element.properties.empty()) return;  // nothing to read, however many the header promises
  for (std::size_t row = 0; row < element.count; ++row, body.next_row())
    for (const Property& property : element.properties)
      for (std::size_t n = property.is_list ? body.next_index(property.count_type, "the length of a list") : 1; n > 0;
           --n)
        body.next(property.type);
}

}  // namespace

PlacedMesh read_ply(const std::string& file) {
  const std::string text = read_file(file);
  TextCursor cursor(text, file);
  const Header header = parse_header(cursor);
  Body body(text, cursor, header.format, file);
  PlacedMesh mesh;
  std::size_t vertices = 0;
  for (const PlyElement& element : header.elements)
    if (element.name == "vertex") vertices = element.count;
  for (const PlyElement& element : header.elements) {
    body.begin(element);
    if (element.name == "vertex")
      read_vertices(body, header.format, element, file, mesh);
    else if (element.name == "face")
      read_faces(body, element, file, vertices, mesh);
    else
      skip(body, element);
  }
  return mesh;
}

void write_ply(const std::string& file, const Mesh& mesh) {
  static_assert(std::endian::native == std::endian::little);
  std::string bytes = "ply\nformat binary_little_endian 1.0\n";
  bytes +=
      fmt::format("element vertex {}\nproperty float x\nproperty float y\nproperty float z\n", mesh.position.size());
  if (!mesh.normal.empty()) bytes += "property float nx\nproperty float ny\nproperty float nz\n";
  if (!mesh.texcoord.empty()) bytes += "property float u\nproperty float v\n";
  bytes += fmt::format("element face {}\nproperty list uchar uint vertex_indices\nend_header\n", mesh.triangle.size());
  const auto append = [&](const auto& numbers) {
    bytes.append(reinterpret_cast<const char*>(numbers.data()), sizeof numbers);
  };
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    append(mesh.position[i]);
    if (!mesh.normal.empty()) append(mesh.normal[i]);
    if (!mesh.texcoord.empty()) append(mesh.texcoord[i]);
  }
  for (const auto& triangle : mesh.triangle) {
    bytes += '\3';
    append(triangle);
  }
  write_file(file, bytes);
}

}  // namespace itn
