// Damaged scenes and meshes end in success or in an InputError: never in a crash, a hang or another exception.
#include <zlib.h>

#include <array>
#include <random>

#include "itn/bitmap.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

// Digits become other digits and bits of binary numbers turn: most of these are files that can be read.
std::string with_other_numbers(std::string text, std::mt19937& random) {
  for (std::size_t count = 1 + random() % 4; count > 0; --count) {
    char& c = text[random() % text.size()];
    if (c >= '0' && c <= '9')
      c = static_cast<char>('0' + random() % 10);
    else if (c < ' ')
      c = static_cast<char>(c ^ 1);
  }
  return text;
}

std::string damaged(std::string text, std::mt19937& random) {
  if (random() % 4 == 0) return with_other_numbers(std::move(text), random);
  const auto below = [&](std::size_t n) { return n == 0 ? 0 : random() % n; };
  static const std::string alphabet = "<>\"/=$ &;0123456789.-+eE\n\tnaiftx,#:_";
  for (std::size_t count = 1 + below(4); count > 0 && !text.empty(); --count) {
    const std::size_t at = below(text.size());
    switch (below(6)) {
      case 0:
        text.resize(at);
        break;
      case 1:
        text[at] = static_cast<char>(random() % 256);
        break;
      case 2:
        text[at] = alphabet[below(alphabet.size())];
        break;
      case 3:
        text.insert(at, 1, alphabet[below(alphabet.size())]);
        break;
      case 4:
        text.erase(at, 1 + below(20));
        break;
      case 5:
        text.insert(below(text.size()), text.substr(at, 1 + below(60)));
        break;
    }
  }
  return text;
}

// The body of a mesh of version 3 of Mitsuba's format.
std::string serialized_tetrahedron() {
  std::string body;
  const auto append = [&](auto value) { body.append(reinterpret_cast<const char*>(&value), sizeof value); };
  append(std::uint32_t{0x1000});
  append(std::uint64_t{4});
  append(std::uint64_t{4});
  for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f}) append(x);
  for (const std::uint32_t v : {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2}) append(v);
  return body;
}

// With whole compressed data and a right table, so that damage reaches the numbers.
std::string serialized(const std::string& body) {
  std::string packed(compressBound(body.size()), '\0');
  uLongf size = packed.size();
  REQUIRE(compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(body.data()),
                    body.size(), Z_NO_COMPRESSION) == Z_OK);
  return std::string("\x1c\x04\x03\x00", 4) + packed.substr(0, size) + std::string("\0\0\0\0\1\0\0\0", 8);
}

// The fate of damaged files: were nearly all refused, or nearly none, little would be tested.
struct Counts {
  int read = 0, refused = 0;

  template <class Load>
  void add(Load load) {
    try {
      load();
      ++read;
    } catch (const InputError& error) {
      REQUIRE(std::string(error.what()).size() > 10);
      ++refused;
    }
  }
  void check(int least_read, int least_refused) const {
    INFO(read << " read, " << refused << " refused");
    CHECK(read >= least_read);
    CHECK(refused >= least_refused);
  }
};

}  // namespace

TEST_CASE("2000 damaged scenes are read or refused") {
  SceneFolder folder;
  folder.write_tetrahedron("t.ply");
  folder.write("part.xml", "<bsdf version=\"3.0.0\" type=\"null\"/>");
  const std::string whole = R"(<scene version="0.6.0">
  <default name="g" value="0.5"/><path value="."/><include filename="part.xml"/>
  <integrator type="volpath"><integer name="max_depth" value="-1"/></integrator>
  <medium type="homogeneous" id="skin">
    <spectrum name="sigmaT" value="400:1, 500:2, 700:3"/><float name="albedo" value="0.9"/>
    <phase type="hg"><float name="g" value="$g"/></phase>
  </medium>
  <sensor type="perspective">
    <string name="fov_axis" value="smaller"/><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0,0,-5" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="32"/><rfilter type="box"/></film>
    <sampler type="independent"><integer name="sample_count" value="16"/></sampler>
  </sensor>
  <bsdf type="twosided" id="floor"><bsdf type="diffuse"><ref name="reflectance" id="grey"/></bsdf></bsdf>
  <spectrum type="irregular" id="gray"><string name="wavelengths" value="400 700"/><string name="values" value="0.1 1"/>
  </spectrum><alias id="gray" as="grey"/>
  <shape type="ply">
    <string name="filename" value="t.ply"/>
    <transform name="to_world"><rotate y="1" angle="30"/><scale value="2"/><translate x="1"/></transform>
    <bsdf type="roughdielectric"><float name="alpha" value="0.2"/><string name="int_ior" value="water"/></bsdf>
    <ref name="interior" id="skin"/>
  </shape>
  <shape type="rectangle"><ref id="floor"/></shape>
  <emitter type="sunsky"><vector name="sun_direction" x="0" y="1" z="1"/></emitter>
</scene>)";
  std::mt19937 random(1);
  Counts scenes;
  for (int i = 0; i < 2000; ++i) {
    folder.write("f.xml", damaged(whole, random));
    scenes.add([&] { load_scene(folder.path("f.xml")); });
  }
  scenes.check(5, 1000);
}

TEST_CASE("1000 damaged images are read or refused") {
  SceneFolder folder;
  const std::string pixels = "\x10\x20\x30\x81\x50\x60\x70\x80\x90\xa0\xb0\xc0";
  const std::vector<std::string> whole = {
      "P6\n2 2\n255\n" + pixels,
      std::string("\0\0\2\0\0\0\0\0\0\0\0\0\2\0\2\0\x18\0", 18) + pixels,
      std::string("BM\x42\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\2\0\0\0\1\0\0\0\1\0\x18\0", 30) + std::string(24, '\0') +
          pixels,
      "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 3\n" + pixels,
  };
  std::mt19937 random(3);
  Counts images;
  for (int i = 0; i < 1000; ++i) {
    folder.write("a.img", damaged(whole[static_cast<std::size_t>(i) % whole.size()], random));
    images.add([&] { read_bitmap(folder.path("a.img")); });
  }
  images.check(50, 200);
}

TEST_CASE("2800 damaged meshes are read or refused") {
  SceneFolder folder;
  folder.write_tetrahedron("t.ply");
  std::ifstream file(folder.path("t.ply"), std::ios::binary);
  const std::string ascii((std::istreambuf_iterator<char>(file)), {});
  std::string binary = ascii.substr(0, ascii.find("end_header\n") + 11);
  binary.replace(binary.find("ascii"), 5, "binary_little_endian");
  const auto append = [&](auto value) { binary.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for (const float x : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F}) append(x);
  for (const std::array<int, 3>& face : {std::array{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}) {
    append('\3');
    for (const int vertex : face) append(vertex);
  }
  const std::string obj =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0.5\nvn 0 0 1\nf 1/1/1 3/1/1 2/1/1\nf 1 2 4\n"
      "f 2//1 3//1 4//1\nf -4/1 4/1 3/1\n";
  const std::string tetrahedron = serialized_tetrahedron();
  std::mt19937 random(2);
  Counts ascii_ply, binary_ply, obj_mesh, serialized_mesh;
  for (int i = 0; i < 700; ++i) {
    folder.write("a.ply", damaged(ascii, random));
    ascii_ply.add([&] { read_mesh(folder.path("a.ply")); });
    folder.write("b.ply", damaged(binary, random));
    binary_ply.add([&] { read_mesh(folder.path("b.ply")); });
    folder.write("d.serialized", serialized(damaged(tetrahedron, random)));
    serialized_mesh.add([&] { read_mesh(folder.path("d.serialized")); });
    folder.write("c.obj", damaged(obj, random));
    obj_mesh.add([&] { read_mesh(folder.path("c.obj")); });
  }
  ascii_ply.check(5, 100);
  binary_ply.check(5, 100);
  obj_mesh.check(5, 100);
  serialized_mesh.check(5, 100);
}
