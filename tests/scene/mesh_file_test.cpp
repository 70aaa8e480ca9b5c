// Mesh files of every format, whole and damaged.
#include "runtime/scene/mesh_file.h"

#include <cstring>

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
  check("ply\nformat ascii 1.0\nelement vertex 0\nproperty long x\nend_header\n", {"bad.ply:4: ", "\"long\""});
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
