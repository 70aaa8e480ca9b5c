// Mesh files of every format, whole and damaged.
#include "runtime/scene/mesh/mesh_file.h"

#include <zlib.h>

#include <cstring>

#include "runtime/base/fingerprint.h"
#include "runtime/base/inputs.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

template <class T>
void append(std::string& out, T value, bool big_endian) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  if (big_endian) std::reverse(bytes, bytes + sizeof(T));
  out.append(bytes, sizeof(T));
}

// A quadrilateral with normals and texture coordinates, and properties that do not matter.
template <class Real>
std::string binary_ply(bool big_endian, const std::string& real) {
  std::string out = "ply\nformat " + std::string(big_endian ? "binary_big_endian" : "binary_little_endian") +
                    " 1.0\ncomment made here\nelement vertex 4\n";
  for (const std::string name : {"x", "y", "z", "nx", "ny", "nz", "u", "v"})
    out += "property " + real + " " + name + "\n";
  out +=
      "property uchar red\nelement face 1\nproperty list uchar uint vertex_index\nproperty short material\n"
      "element edge 1\nproperty int a\nend_header\n";
  for (int i = 0; i < 4; ++i) {
    const double x = i == 1 || i == 2, y = i >= 2;
    for (const double v : {x, y, 0.5, 0.0, 0.0, 1.0, x / 2, y / 4}) append(out, static_cast<Real>(v), big_endian);
    append(out, static_cast<unsigned char>(7), big_endian);
  }
  append(out, static_cast<unsigned char>(4), big_endian);
  for (std::uint32_t i = 0; i < 4; ++i) append(out, i, big_endian);
  append(out, static_cast<std::int16_t>(3), big_endian);
  append(out, std::int32_t{9}, big_endian);
  return out;
}

void check_quadrilateral(const Mesh& m) {
  REQUIRE(m.position.size() == 4);
  CHECK(m.position[2] == std::array<float, 3>{1, 1, 0.5f});
  REQUIRE(m.normal.size() == 4);
  CHECK(m.normal[3] == std::array<float, 3>{0, 0, 1});
  REQUIRE(m.texcoord.size() == 4);
  CHECK(m.texcoord[2] == std::array<float, 2>{0.5f, 0.25f});
  REQUIRE(m.triangle.size() == 2);
  CHECK(m.triangle[0] == std::array<std::uint32_t, 3>{0, 1, 2});
  CHECK(m.triangle[1] == std::array<std::uint32_t, 3>{0, 2, 3});
}

// Reading fails with a message that names the file, then contains the words.
void check_error(SceneFolder& folder, const std::string& name, const std::string& text,
                 const std::vector<std::string>& words) {
  folder.write(name, text);
  std::string message = "no error";
  try {
    read_mesh(folder.path(name));
  } catch (const InputError& error) {
    message = error.what();
  }
  INFO(message);
  CHECK_THAT(message, Catch::StartsWith(folder.path(name) + ":"));
  for (const std::string& word : words) CHECK_THAT(message, Catch::Contains(word));
}

const std::string header =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";

// The message with which such a file is refused; empty where it is read.
std::string serialized_error(SceneFolder& folder, const std::string& bytes, long index) {
  folder.write("bad.serialized", bytes);
  try {
    read_serialized(folder.path("bad.serialized"), index);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST_CASE("PLY is read in both byte orders and both precisions") {
  SceneFolder folder;
  folder.write("a.ply", binary_ply<float>(false, "float"));
  check_quadrilateral(read_mesh(folder.path("a.ply")));
  folder.write("b.ply", binary_ply<float>(true, "float32"));
  check_quadrilateral(read_mesh(folder.path("b.ply")));
  folder.write("c.ply", binary_ply<double>(false, "double"));
  check_quadrilateral(read_mesh(folder.path("c.ply")));
  folder.write("d.PLY", binary_ply<double>(true, "float64"));
  check_quadrilateral(read_mesh(folder.path("d.PLY")));
}

TEST_CASE("ASCII PLY is read with any line ends and number formats") {
  SceneFolder folder;
  std::string text = header + "0 -0.0 0\n1e0 0 0\n  0 +1.0 1E-3\n3 0 1 2\n";
  for (std::size_t i = 0; (i = text.find('\n', i)) != std::string::npos; i += 2) text.replace(i, 1, "\r\n");
  folder.write("a.ply", text);
  const Mesh m = read_mesh(folder.path("a.ply"));
  CHECK(m.position[2] == std::array<float, 3>{0, 1, 0.001f});
  CHECK(m.normal.empty());
  CHECK(m.texcoord.empty());
}

TEST_CASE("a PLY file cut anywhere is refused, never read in part") {
  SceneFolder folder;
  for (const std::string& whole : {binary_ply<float>(false, "float"), binary_ply<double>(true, "double"),
                                   header + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2"}) {
    for (std::size_t size = 0; size < whole.size(); ++size) {
      folder.write("cut.ply", whole.substr(0, size));
      REQUIRE_THROWS_AS(read_mesh(folder.path("cut.ply")), InputError);
    }
  }
}

TEST_CASE("damaged PLY files say what is wrong and where") {
  SceneFolder folder;
  const auto check = [&](const std::string& text, const std::vector<std::string>& words) {
    check_error(folder, "bad.ply", text, words);
  };
  check("", {"bad.ply:1: ", "not a PLY file"});
  check("solid x\n", {"not a PLY file"});
  check(header.substr(0, header.find("end_header")), {"truncated"});
  check("ply\nformat ascii 1.0\nelement vertex many\nend_header\n", {"bad.ply:3: ", "\"many\""});
  check("ply\nformat text 1.0\n", {"bad.ply:2: ", "\"text\""});
  check("ply\nelement vertex 0\nend_header\n", {"no format"});
  check("ply\nformat ascii 1.0\nelement vertex 0\nproperty quad x\nend_header\n", {"bad.ply:4: ", "\"quad\""});
  check("ply\nformat ascii 1.0\nproperty float x\nend_header\n", {"before any element"});
  check("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", {"lack x, y or z"});
  check("ply\nformat ascii 1.0\nelements 1\nend_header\n", {"bad.ply:3: ", "\"elements\""});
  check(header + "0 0 0\n1 0 0\n0 1 0\n", {"truncated", "promises 1 of element face"});
  check(header + "0 0 0\n1 0\n", {"truncated", "promises 3 of element vertex"});
  check(header + "0 0 0\n1 0 zero\n0 1 0\n3 0 1 2\n", {"bad.ply:11: ", "\"zero\""});
  check(header + "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", {"bad.ply:13: ", "index 3 is out of range", "3 vertices"});
  check(header + "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", {"bad.ply:13: ", "-1"});
  check(header + "0 0 0\n1 0 0\n0 1 0\n2 0 1\n", {"2 corners"});
  check(header + "0 0 0\n1 0 0\n0 1 0\n3 0 1 1.5\n", {"1.5"});
  check(header + "0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n", {"position of vertex 0 is nan"});
  check(header + "0 0 0\n1 0 0\n0 -inf 0\n3 0 1 2\n", {"position of vertex 2 is -inf"});
  check(
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n",
      {"the mesh is empty"});
  std::string huge = header;
  huge.replace(huge.find("vertex 3"), 8, "vertex 4000000000000");
  check(huge, {"truncated", "4000000000000"});
}

TEST_CASE("OBJ corners that share their indices are one vertex, others are not") {
  SceneFolder folder;
  folder.write("a.obj",
               "# a comment\nmtllib x.mtl\no thing\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0 0\n"
               "usemtl y\ns 1\nf 1/1 2/2 3/1\nf 1/1 3/1 \\\n4/1\ng other\nf -4/-1 2/2 -1/1\n");
  const Mesh m = read_mesh(folder.path("a.obj"));
  // Corners in order: 1/1 2/2 3/1, 4/1, then 1/2 is new (its texture coordinate differs).
  REQUIRE(m.position.size() == 5);
  CHECK(m.triangle == std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}, {4, 1, 3}});
  CHECK(m.position[4] == m.position[0]);
  CHECK(m.texcoord[4] == std::array<float, 2>{1, 0});
  CHECK(m.normal.empty());
}

TEST_CASE("OBJ polygons become fans, with normals where every corner has one") {
  SceneFolder folder;
  const std::string points = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\n";
  folder.write("a.obj", points + "f 1//1 2//1 3//1 4//1\n");
  const Mesh with = read_mesh(folder.path("a.obj"));
  CHECK(with.triangle.size() == 2);
  CHECK(with.normal.size() == 4);
  folder.write("a.obj", points + "f 1//1 2//1 3//1\nf 1 3 4\n");
  CHECK(read_mesh(folder.path("a.obj")).normal.empty());
}

TEST_CASE("damaged OBJ files say what is wrong and in which line") {
  SceneFolder folder;
  const auto check = [&](const std::string& text, const std::vector<std::string>& words) {
    check_error(folder, "bad.obj", text, words);
  };
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  check("", {"the mesh is empty"});
  check(points, {"the mesh is empty"});
  check(points + "f 1 2 4\n", {"bad.obj:4: ", "vertex index 4 is out of range", "3 are defined"});
  check(points + "f 1 2 0\n", {"bad.obj:4: ", "index 0"});
  check(points + "f 1 2 -4\n", {"bad.obj:4: ", "index -4"});
  check(points + "f 1/1 2/1 3/1\n", {"texture coordinate index 1", "0 are defined"});
  check(points + "f 1//1 2//1 3//1\n", {"normal index 1"});
  check(points + "f 1 2\n", {"bad.obj:4: ", "2 corners", "truncated"});
  check(points + "f 1 2 x\n", {"\"x\""});
  check(points + "f /1 2 3\n", {"without a vertex index"});
  check("v 0 0\n", {"bad.obj:1: ", "fewer than 3"});
  check("v 0 0 1.5e\n", {"\"1.5e\""});
  check("v 0 nan 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {"position of vertex 0 is nan"});
  check("\nvertex 0 0 0\n", {"bad.obj:2: ", "\"vertex\""});
}

TEST_CASE("other formats come through Assimp") {
  SceneFolder folder;
  folder.write("t.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
  CHECK(read_mesh(folder.path("t.off")).triangle.size() == 4);
  check_error(folder, "t.xyzw", "nothing", {"not a readable mesh"});
  const Scene scene = folder.load(
      "<shape type=\"mesh\"><string name=\"filename\" value=\"t.off\"/>"
      "<medium type=\"homogeneous\" name=\"interior\"/></shape>");
  CHECK(scene.shapes[0].mesh->triangle.size() == 4);
}

TEST_CASE("a missing file is named") {
  CHECK_THROWS_WITH(read_mesh("/nowhere/a.ply"), Catch::Contains("/nowhere/a.ply"));
}

namespace {

struct SerializedMesh {
  int version = 4;
  std::uint32_t flags = 0x1000;
  std::uint64_t vertices = 4, triangles = 4;
};

template <class Real>
std::string serialized_body(const SerializedMesh& mesh) {
  std::string body;
  append(body, mesh.flags, false);
  if (mesh.version == 4) body += std::string("made here") + '\0';
  append(body, mesh.vertices, false);
  append(body, mesh.triangles, false);
  const Real corner[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, Real(0.5)}};
  const auto rows = [&](int size, const auto& value) {
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < size; ++k) append(body, static_cast<Real>(value(i, k)), false);
  };
  rows(3, [&](int i, int k) { return corner[i][k]; });
  if (mesh.flags & 1) rows(3, [](int i, int k) { return k == i % 3; });
  if (mesh.flags & 2) rows(2, [](int i, int k) { return 0.25 * i + 0.125 * k; });
  if (mesh.flags & 8) rows(3, [](int, int k) { return 0.3 * k; });
  for (const std::uint32_t v : {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2}) append(body, v, false);
  return body;
}

// Header and compressed body.
std::string serialized(const SerializedMesh& mesh) {
  const std::string body = mesh.flags & 0x2000 ? serialized_body<double>(mesh) : serialized_body<float>(mesh);
  std::string packed(compressBound(body.size()), '\0');
  uLongf size = packed.size();
  REQUIRE(compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(body.data()),
                   body.size()) == Z_OK);
  std::string out;
  append(out, std::uint16_t{0x041c}, false);
  append(out, static_cast<std::uint16_t>(mesh.version), false);
  return out + packed.substr(0, size);
}

// Several meshes and the table of their places.
std::string serialized_file(const std::vector<SerializedMesh>& meshes) {
  std::string out, table;
  for (const SerializedMesh& mesh : meshes) {
    if (mesh.version == 4)
      append(table, static_cast<std::uint64_t>(out.size()), false);
    else
      append(table, static_cast<std::uint32_t>(out.size()), false);
    out += serialized(mesh);
  }
  append(table, static_cast<std::uint32_t>(meshes.size()), false);
  return out + table;
}

}  // namespace

TEST_CASE("serialized meshes of versions 3 and 4 arrive with all that they have, in both precisions") {
  SceneFolder folder;
  for (const int version : {3, 4})
    for (const std::uint32_t precision : {0x1000u, 0x2000u})
      for (std::uint32_t parts = 0; parts < 16; ++parts) {
        if (parts & 4) continue;
        folder.write("m.serialized", serialized_file({{.version = version, .flags = precision | parts}}));
        const Mesh mesh = read_mesh(folder.path("m.serialized"));
        CHECK(mesh.position == std::vector<std::array<float, 3>>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0.5f}});
        CHECK(mesh.triangle == std::vector<std::array<std::uint32_t, 3>>{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}});
        REQUIRE(mesh.normal.size() == (parts & 1 ? 4 : 0));
        REQUIRE(mesh.texcoord.size() == (parts & 2 ? 4 : 0));
        if (parts & 1) CHECK(mesh.normal[1] == std::array<float, 3>{0, 1, 0});
        if (parts & 2) CHECK(mesh.texcoord[3] == std::array<float, 2>{0.75f, 0.875f});
      }
}

TEST_CASE("shape_index chooses one of the meshes of a serialized file") {
  SceneFolder folder;
  for (const int version : {3, 4}) {
    folder.write("m.serialized", serialized_file({{.version = version, .flags = 0x1000},
                                                  {.version = version, .flags = 0x1001},
                                                  {.version = version, .flags = 0x2002}}));
    const std::string file = folder.path("m.serialized");
    CHECK(read_serialized(file, 0).normal.empty());
    CHECK(read_serialized(file, 1).normal.size() == 4);
    CHECK(read_serialized(file, 2).texcoord.size() == 4);
    CHECK_THROWS_WITH(read_serialized(file, 3), Catch::Contains("shape_index is 3") && Catch::Contains("has 3 meshes"));
  }
  const std::string shape = "<shape type=\"serialized\">\n<string name=\"filename\" value=\"m.serialized\"/>";
  CHECK(folder.load(shape + "<integer name=\"shape_index\" value=\"2\"/></shape>").shapes[0].mesh->texcoord.size() ==
        4);
  CHECK(folder.load(shape + "<boolean name=\"face_normals\" value=\"true\"/></shape>").shapes[0].mesh->normal.empty());
  CHECK(folder.load(shape + "</shape>").shapes[0].mesh->normal.size() == 4);
  folder.check_error(shape + "<integer name=\"shape_index\" value=\"-1\"/></shape>", 3, {"shape_index = -1"});
  folder.check_error(shape + "<integer name=\"shape_index\" value=\"7\"/></shape>", 3, {"shape_index is 7"});
}

TEST_CASE("a serialized file that lies about its lengths is refused without taking the memory") {
  SceneFolder folder;
  const auto error = [&](const std::string& bytes, long index = 0) { return serialized_error(folder, bytes, index); };
  CHECK_THAT(error(serialized_file({{.vertices = 4'000'000'000}})),
             Catch::Contains("4000000000 vertices") && Catch::Contains("can hold"));
  CHECK_THAT(error(serialized_file({{.triangles = 0xffffffffffffffff}})), Catch::Contains("fewer than 2^32"));
  CHECK_THAT(error(serialized_file({{.vertices = 9}})), Catch::Contains("end early"));
  CHECK_THAT(error(serialized_file({{.vertices = 2}})), Catch::Contains("more than the mesh"));
  CHECK_THAT(error(serialized_file({{.triangles = 0}})), Catch::Contains("more than the mesh"));
  std::string future = serialized_file({{}});
  future[2] = 5;
  CHECK_THAT(error(future), Catch::Contains("version 5") && Catch::Contains("PLY"));
  CHECK_THAT(error("solid cube"), Catch::Contains("no .serialized mesh"));
  CHECK_THAT(error(""), Catch::Contains("no .serialized mesh"));
}

TEST_CASE("a serialized file whose table is cut or wrong, or whose compressed data are not whole, is refused") {
  SceneFolder folder;
  const auto error = [&](const std::string& bytes, long index = 0) { return serialized_error(folder, bytes, index); };
  const auto with_table = [](std::string bytes, const std::vector<std::uint64_t>& places, std::uint32_t count) {
    for (const std::uint64_t place : places) append(bytes, place, false);
    append(bytes, count, false);
    return bytes;
  };
  const std::string mesh = serialized({.flags = 0x1003});
  REQUIRE(error(with_table(mesh, {0}, 1)).empty());
  REQUIRE(error(with_table(mesh + mesh, {0, mesh.size()}, 2), 1).empty());
  // Tables that are missing, too long, lead nowhere, or not to the first mesh: whichever mesh is asked for.
  for (const long index : {0L, 1L})
    for (const std::string& bytes :
         {mesh, with_table(mesh, {}, 0x7fffffff), with_table(mesh, {0}, 0),
          with_table(mesh, {0, std::uint64_t{1} << 60}, 2), with_table(mesh + mesh, {4, mesh.size()}, 2),
          with_table(mesh + mesh, {mesh.size(), 0}, 2), with_table(mesh + mesh, {0, 0}, 2),
          with_table(mesh + mesh, {0, 2 * mesh.size() + 1}, 2)})
      CHECK_THAT(error(bytes, index), Catch::Contains("table of meshes"));
  CHECK_THAT(error(with_table(mesh + mesh, {0, mesh.size() + 1}, 2)), Catch::Contains("bytes follow their end"));
  CHECK_THAT(error(with_table(mesh + mesh, {0, mesh.size() - 1}, 2)), Catch::Contains("end early"));
  // The last four bytes of the stream are its checksum.
  std::string sum = mesh;
  sum.back() = static_cast<char>(sum.back() ^ 1);
  CHECK_THAT(error(with_table(sum, {0}, 1)), Catch::Contains("incorrect data check"));
  // Cut anywhere, or with any byte of the table wrong.
  const std::string whole = with_table(mesh + mesh, {0, mesh.size()}, 2);
  for (std::size_t size = 0; size < whole.size(); ++size)
    CHECK_THAT(error(whole.substr(0, size)), Catch::Contains("bad.serialized: "));
  for (std::size_t at = 2 * mesh.size(); at < whole.size(); ++at) {
    std::string wrong = whole;
    wrong[at] = static_cast<char>(wrong[at] + 1);
    CHECK_THAT(error(wrong) + error(wrong, 1), Catch::Contains("bad.serialized: "));
  }
}

TEST_CASE("further properties of a PLY file are attributes, called as Mitsuba calls them") {
  SceneFolder folder;
  folder.write("a.ply",
               "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
               "property float red\nproperty float green\nproperty float blue\nproperty float heat_0\n"
               "property float wind_x\nproperty float wind_y\nproperty float wind_z\nproperty float pair_0\n"
               "property float pair_1\nproperty float plain\nproperty float tint_r\nproperty float tint_g\n"
               "property float tint_b\nelement face 1\nproperty list uchar int vertex_indices\n"
               "property float weight_1\nend_header\n"
               "0 0 0 .1 .2 .3 .4 1 2 3 0 0 9 .7 .8 .9\n1 0 0 0 0 0 .5 4 5 6 0 0 9 0 0 0\n"
               "1 1 0 0 0 0 .6 7 8 9 0 0 9 0 0 0\n0 1 0 0 0 0 .7 1 1 1 0 0 9 0 0 0\n4 0 1 2 3 .25\n");
  const Mesh m = read_mesh(folder.path("a.ply"));
  REQUIRE(m.attributes.size() == 5);
  CHECK(!m.attribute("vertex_pair"));  // neither one nor three
  CHECK(!m.attribute("vertex_plain"));
  REQUIRE(m.attribute("vertex_color"));
  CHECK(m.attribute("vertex_color")->channels == 3);
  CHECK(m.attribute("vertex_color")->values[1] == 0.2f);
  CHECK(m.attribute("vertex_heat")->values == std::vector<float>{0.4f, 0.5f, 0.6f, 0.7f});
  CHECK(m.attribute("vertex_wind")->values[5] == 6);
  CHECK(m.attribute("vertex_tint_color")->values[2] == 0.9f);
  // both triangles of the square
  CHECK(m.attribute("face_weight")->values == std::vector<float>{0.25f, 0.25f});
}

TEST_CASE("faces may stand before the vertices of a PLY file") {
  SceneFolder folder;
  folder.write("a.ply",
               "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement vertex 3\n"
               "property float x\nproperty float y\nproperty float z\nend_header\n3 0 2 1\n0 0 0\n1 0 0\n0 1 0\n");
  const Mesh m = read_mesh(folder.path("a.ply"));
  CHECK(m.triangle == std::vector<std::array<std::uint32_t, 3>>{{0, 2, 1}});
  CHECK(m.position.size() == 3);
}

TEST_CASE("integers of a PLY file are colours of sRGB, but for unsigned bytes, as in Mitsuba 3.9.1") {
  SceneFolder folder;
  const auto colours = [&](const std::string& type, const std::string& row) {
    folder.write("a.ply",
                 "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                 "property " +
                     type + " r\nproperty " + type + " g\nproperty " + type +
                     " b\nelement face 1\n"
                     "property list uchar int vertex_indices\nend_header\n"
                     "0 0 0 " +
                     row + "\n1 0 0 " + row + "\n0 1 0 " + row + "\n3 0 1 2\n");
    return read_mesh(folder.path("a.ply")).attribute("vertex_color")->values;
  };
  const std::vector<float> bytes = colours("uchar", "255 128 0"), shorts = colours("ushort", "65535 6554 13107");
  CHECK(bytes[0] == 255);
  CHECK(bytes[1] == 128);
  CHECK(colours("char", "127 64 0")[1] == Approx(0.21770316));
  CHECK(shorts[1] == Approx(0.0100).epsilon(0.01));
  CHECK(shorts[2] == Approx(0.0331).epsilon(0.001));
  CHECK(colours("float", "1 0.5 0")[1] == 0.5f);
}

TEST_CASE("a PLY file may have halves and 64-bit integers") {
  SceneFolder folder;
  const auto big = [](auto value) {
    std::string bytes(sizeof value, ' ');
    for (std::size_t i = 0; i < sizeof value; ++i) bytes[i] = static_cast<char>(value >> 8 * (sizeof value - 1 - i));
    return bytes;
  };
  std::string bytes =
      "ply\nformat binary_big_endian 1.0\nelement extra 1\nproperty long id\nelement vertex 3\nproperty half x\n"
      "property half y\nproperty half z\nelement face 1\nproperty list uchar ulong vertex_index\nend_header\n" +
      big(std::uint64_t{7});
  for (const int half : {0, 0, 0, 0x3c00, 0, 0, 0, 0xc180, 0x0001}) bytes += big(static_cast<std::uint16_t>(half));
  bytes += "\3" + big(std::uint64_t{0}) + big(std::uint64_t{1}) + big(std::uint64_t{2});
  folder.write("a.ply", bytes);
  const Mesh m = read_mesh(folder.path("a.ply"));
  CHECK(m.position[1] == std::array<float, 3>{1, 0, 0});
  CHECK(m.position[2] == std::array<float, 3>{0, -2.75f, 0x1p-24f});
  CHECK(m.triangle[0] == std::array<std::uint32_t, 3>{0, 1, 2});
}

TEST_CASE("inputs know the fingerprint of every file that Assimp has read") {
  SceneFolder folder;
  const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  folder.write("t.bin", std::string(reinterpret_cast<const char*>(corners), sizeof corners));
  folder.write(
      "t.gltf",
      R"({"asset":{"version":"2.0"},"buffers":[{"uri":"t.bin","byteLength":36}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],)"
      R"("scenes":[{"nodes":[0]}],"scene":0})");
  const Inputs inputs(Inputs::Keep::fingerprints);
  CHECK(read_mesh(folder.path("t.gltf")).triangle.size() == 1);
  const std::map<std::string, std::string> found = inputs.fingerprints();
  REQUIRE(found.size() == 2);
  for (const char* name : {"t.gltf", "t.bin"}) CHECK(found.at(folder.path(name)) == fingerprint_of(folder.path(name)));
}
