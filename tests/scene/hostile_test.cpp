// Files that are meant to do harm, one case for each cause that once did (docs/hardening.md).
#include <sys/resource.h>
#include <sys/stat.h>

#include <chrono>

#include "itn/bitmap.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "tests/scene/scene_folder.h"

using namespace itn;
using Catch::Contains;

namespace {

std::string refusal(const SceneFolder& folder, const std::string& mesh) {
  try {
    read_mesh(folder.path(mesh));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string string(const std::string& name, const std::string& value) {
  return "<string name=\"" + name + "\" value=\"" + value + "\"/>";
}

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

TEST_CASE("PLY elements that come twice are refused, and normals for some vertices alone") {
  SceneFolder folder;
  const std::string begin = "ply\nformat ascii 1.0\n",
                    face = "element face 1\nproperty list uchar int vertex_indices\n",
                    position = "property float x\nproperty float y\nproperty float z\n",
                    normal = "property float nx\nproperty float ny\nproperty float nz\n";
  folder.write("t.ply", begin + "element vertex 3\n" + position + normal + "element vertex 3\n" + position + face +
                            "end_header\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n0 0 1\n1 0 1\n0 1 1\n3 3 4 5\n");
  CHECK_THAT(refusal(folder, "t.ply"), Contains("t.ply:10: element vertex for the second time"));
  folder.write("f.ply", begin + "element vertex 3\n" + position + face + face +
                            "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 2\n");
  CHECK_THAT(refusal(folder, "f.ply"), Contains("element face for the second time"));
  Mesh mesh;
  mesh.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangle = {{0, 1, 2}};
  mesh.normal = {{0, 0, 1}};
  CHECK_THROWS_WITH(check_mesh(mesh, "m"), Contains("1 normals for 3 vertices"));
  mesh.normal.clear();
  mesh.texcoord = {{0, 0}, {1, 0}};
  CHECK_THROWS_WITH(check_mesh(mesh, "m"), Contains("2 texture coordinates for 3 vertices"));
  mesh.texcoord.clear();
  mesh.attributes.push_back({"vertex_heat", 1, {1, 2}});
  CHECK_THROWS_WITH(check_mesh(mesh, "m"), Contains("vertex_heat"));
}

TEST_CASE("coordinates beyond what single precision can multiply are refused, wherever they stand") {
  SceneFolder folder;
  folder.write_ply("far.ply", {"0 0 0", "1e13 0 0", "0 1 0", "0 0 1"}, {"3 0 2 1", "3 0 1 3", "3 1 2 3", "3 0 3 2"});
  folder.write_tetrahedron("t.ply");
  const std::string scale = "<transform name=\"to_world\"><scale value=\"1e13\"/></transform>";
  for (const std::string& body :
       {"<shape type=\"ply\">" + string("filename", "far.ply") + "</shape>",
        "<shape type=\"ply\">" + string("filename", "t.ply") + scale + "</shape>",
        std::string("<shape type=\"sphere\"><float name=\"radius\" value=\"1e13\"/></shape>"),
        std::string("<shape type=\"sphere\"><point name=\"center\" x=\"1e20\" y=\"0\" z=\"0\"/></shape>"),
        "<shape type=\"rectangle\">" + scale + "</shape>", "<sensor type=\"perspective\">" + scale + "</sensor>",
        std::string("<emitter type=\"point\"><point name=\"position\" x=\"0\" y=\"0\" z=\"-1e20\"/></emitter>")}) {
    CAPTURE(body);
    CHECK_THAT(folder.error_of(body), Contains("1e+12"));
  }
  CHECK_THAT(folder.error_of("<emitter type=\"constant\"><rgb name=\"radiance\" value=\"3e38\"/></emitter>"),
             Contains("1e30"));
  folder.load("<shape type=\"sphere\"><float name=\"radius\" value=\"1e12\"/></shape>");
}

TEST_CASE("meshes of foreign formats crash, hang and fill the memory in a process of their own") {
  SceneFolder folder;
  folder.write("short.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n");
  folder.write("index.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n");
  std::string deep = "{\"asset\":{\"version\":\"2.0\"},\"extras\":";
  for (int i = 0; i < 200000; ++i) deep += "[";
  folder.write("deep.gltf", deep);
  folder.write("tiny.glb", std::string("glTF\2\0\0\0\x14\0\0\0\xff\xff\xff\xffJSON", 20));
  for (const char* file : {"short.off", "index.off", "deep.gltf", "tiny.glb"}) {
    CAPTURE(file);
    CHECK_THAT(refusal(folder, file), Contains(std::string(file) + ": "));
  }
  for (const char* file : {"a.smd", "a.bvh", "a.x3d", "a.blend", "a", "a.exr"}) {
    CAPTURE(file);
    folder.write(file, "version 1\n");
    CHECK_THAT(refusal(folder, file), Contains("need one of .ply, .obj"));
  }
  folder.write("t.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
  CHECK(read_mesh(folder.path("t.off")).triangle.size() == 4);
}

TEST_CASE("what Assimp warns of is an error where it is about the shape: a mesh that is cut off") {
  SceneFolder folder;
  const auto facet = [](const char* corners) {
    return "facet normal 0 0 0\nouter loop\n" + std::string(corners) + "endloop\nendfacet\n";
  };
  const std::string whole = "solid a\n" + facet("vertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\n") +
                            facet("vertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\n") +
                            facet("vertex 1 0 0\nvertex 0 1 0\nvertex 0 0 1\n") +
                            facet("vertex 0 0 0\nvertex 0 0 1\nvertex 0 1 0\n");
  folder.write("t.stl", whole + "endsolid a\n");
  CHECK(read_mesh(folder.path("t.stl")).triangle.size() == 4);
  int tried = 0;
  for (std::size_t size = whole.size(); size > 200; size -= 11, ++tried) {
    CAPTURE(size);
    folder.write("cut.stl", whole.substr(0, size));
    CHECK_THAT(refusal(folder, "cut.stl"), Contains("cut.stl: "));
  }
  CHECK(tried > 10);
  // A texture that is not there says nothing of the shape.
  folder.write("t.gltf", R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],"materials":[{"name":"unknown"}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}]})");
  CHECK(read_mesh(folder.path("t.gltf")).triangle.size() == 1);
}

TEST_CASE("names that are no UTF-8, or hold control characters, are refused at loading") {
  SceneFolder folder;
  CHECK_THAT(folder.error_of("<medium type=\"homogeneous\" id=\"a\xff\"/>"), Contains("UTF-8"));
  CHECK_THAT(folder.error_of("<shape type=\"ply\">" + string("filename", "a\xff.ply") + "</shape>"), Contains("UTF-8"));
  CHECK_THAT(folder.error_of("<medium type=\"homogeneous\" id=\"a&#27;[2J\"/>"), Contains("control character"));
  CHECK_THAT(folder.error_of("<medium type=\"homogeneous\" id=\"" + std::string(2000, 'x') + "\"/>"),
             Contains("2000 characters"));
  CHECK(folder.error_of("<medium type=\"homogeneous\" id=\"Wei\xc3\x9f\"/>").empty());
}

TEST_CASE("includes in diamonds and defaults that double end soon") {
  SceneFolder folder;
  const std::string begin = "<scene version=\"3.0.0\">", end = "</scene>";
  for (int i = 0; i < 14; ++i) {
    const std::string next = "<include filename=\"d" + std::to_string(i + 1) + ".xml\"/>";
    folder.write("d" + std::to_string(i) + ".xml", begin + next + next + next + end);
  }
  folder.write("d14.xml", begin + end);
  CHECK_THAT(folder.error_of("<include filename=\"d0.xml\"/>"), Contains("more than"));
  // 100 KB of them: each value is allowed, all together are not
  std::string doubling = "<default name=\"a\" value=\"" + std::string(900000, 'x') + "\"/>";
  for (int i = 0; i < 3000; ++i) doubling += "<default name=\"b" + std::to_string(i) + "\" value=\"$a\"/>";
  CHECK_THAT(folder.error_of(doubling), Contains("characters of what names like"));
}

TEST_CASE("more than a million elements are refused") {
  SceneFolder folder;
  std::string many;
  for (int i = 0; i < 1'000'000; ++i) many += "<bsdf type=\"null\"/>";  // and the scene itself
  CHECK_THAT(folder.error_of(many), Contains("more than 1000000 elements"));
}

TEST_CASE("a pipe or a device in place of a scene, a mesh or an image is refused at once") {
  SceneFolder folder;
  REQUIRE(mkfifo(folder.path("pipe.xml").c_str(), 0600) == 0);
  for (const char* name : {"pipe.ply", "pipe.obj", "pipe.off", "pipe.exr", "pipe.vol", "pipe.serialized", "pipe.vdb"})
    REQUIRE(mkfifo(folder.path(name).c_str(), 0600) == 0);
  CHECK_THROWS_WITH(load_scene(folder.path("pipe.xml")), Contains("is a pipe"));
  CHECK_THROWS_WITH(load_scene("/dev/zero"), Contains("is a pipe"));
  CHECK_THAT(folder.error_of("<include filename=\"pipe.xml\"/>"), Contains("is a pipe"));
  for (const char* name : {"pipe.ply", "pipe.obj", "pipe.off", "pipe.serialized"})
    CHECK_THAT(refusal(folder, name), Contains("is a pipe"));
  CHECK_THROWS_WITH(read_bitmap(folder.path("pipe.exr")), Contains("is a pipe"));
  for (const std::string file : {"pipe.vol", "pipe.vdb"}) {
    const std::string type = file == "pipe.vol" ? "gridvolume" : "vdbvolume";
    CHECK_THAT(folder.error_of("<medium type=\"heterogeneous\"><volume type=\"" + type + "\" name=\"sigma_t\">" +
                               string("filename", file) + "</volume></medium>"),
               Contains("is a pipe"));
  }
}

TEST_CASE("loops of links and names that are too long are said as such") {
  SceneFolder folder;
  std::filesystem::create_symlink(folder.path("a.ply"), folder.path("b.ply"));
  std::filesystem::create_symlink(folder.path("b.ply"), folder.path("a.ply"));
  CHECK_THAT(folder.error_of("<shape type=\"ply\">" + string("filename", "a.ply") + "</shape>"),
             Contains("cannot be read; Too many levels of symbolic links"));
  CHECK_THAT(folder.error_of("<shape type=\"ply\">" + string("filename", std::string(300, 'x') + ".ply") + "</shape>"),
             Contains("File name too long"));
  CHECK_THROWS_AS(load_scene(std::string(5000, 'x')), InputError);
}

TEST_CASE("a second outermost element or one behind a character 0 is refused") {
  SceneFolder folder;
  const std::string whole = "<scene version=\"3.0.0\"><emitter type=\"constant\"/></scene>";
  const auto refused = [&](const std::string& text) {
    folder.write("s.xml", text);
    try {
      load_scene(folder.path("s.xml"));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK(refused("<?xml version=\"1.0\"?>\n<!-- a -->\n" + whole + "\n<!-- b -->\n").empty());
  CHECK_THAT(refused(whole + "\n" + whole), Contains("s.xml:2:1: a second outermost element"));
  CHECK(refused(whole + "\nrest").empty());  // as Mitsuba reads it
  CHECK_THAT(load_scene(folder.path("s.xml")).warnings.at(0),
             Contains("s.xml:2:1: ") && Contains("\"rest\" is left out"));
  CHECK_THAT(refused(whole + std::string("\0<shape/>", 9)), Contains("a character 0"));
  CHECK_THAT(refused(std::string("<scene version=\"3.0.0\">\0</scene>", 32)), Contains("a character 0"));
  CHECK_THAT(refused(""), Contains("s.xml:1:1"));
  CHECK_THAT(refused("<!-- nothing -->"), Contains("no element"));
}

TEST_CASE("many normals on one vertex of an OBJ file take time in proportion") {
  SceneFolder folder;
  const auto fan = [](int normals) {
    std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (int i = 0; i < normals; ++i) text += "vn 0 0 " + std::to_string(i + 1) + "\n";
    for (int i = 1; i <= normals; ++i) {
      const std::string n = std::to_string(i);
      text += "f 1//" + n + " 2//1 3//1\n";
    }
    return text;
  };
  folder.write("fan.obj", fan(60000));
  Mesh mesh;
  CHECK(seconds_of([&] { mesh = read_mesh(folder.path("fan.obj")); }) < 5);  // once a minute
  CHECK(mesh.position.size() == 60002);
  for (std::size_t i = 0; i < mesh.triangle.size(); ++i) {
    REQUIRE(mesh.normal[mesh.triangle[i][0]][2] == static_cast<float>(i + 1));
    REQUIRE(mesh.triangle[i][1] == 1);
  }
  // Corners that come again are the same vertex, listed or not.
  folder.write("twice.obj", fan(100) + fan(100).substr(fan(100).find("f ")));
  CHECK(read_mesh(folder.path("twice.obj")).position.size() == 102);
}

TEST_CASE("two media in one and the same surface are warned of") {
  SceneFolder folder;
  folder.write_tetrahedron("t.ply");
  const std::string media =
      "<medium type=\"homogeneous\" id=\"a\"/><medium type=\"homogeneous\" id=\"b\"><float name=\"sigma_t\" "
      "value=\"3\"/></medium>";
  const auto ball = [](const std::string& medium, const std::string& radius) {
    return "<shape type=\"sphere\"><float name=\"radius\" value=\"" + radius +
           "\"/><bsdf type=\"null\"/><ref name=\"interior\" id=\"" + medium + "\"/></shape>";
  };
  const auto body = [](const std::string& medium) {
    return "<shape type=\"ply\">" + string("filename", "t.ply") + "<bsdf type=\"null\"/><ref name=\"interior\" id=\"" +
           medium + "\"/></shape>";
  };
  const auto warned = [&](const std::string& shapes) {
    const Scene scene = folder.load(media + shapes);
    return std::any_of(scene.warnings.begin(), scene.warnings.end(),
                       [](const std::string& w) { return w.find("is the same surface as") != std::string::npos; });
  };
  CHECK(warned(ball("a", "1") + ball("b", "1")));
  CHECK(warned(body("a") + body("b")));
  CHECK_FALSE(warned(ball("a", "1") + ball("b", "0.5")));
  CHECK_FALSE(warned(ball("a", "1") + body("b")));
}
