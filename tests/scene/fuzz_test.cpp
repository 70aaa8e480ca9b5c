// Damaged scenes and meshes end in success or in an InputError: never in a crash, a hang or another exception.
#include <random>

#include "runtime/scene/mesh_file.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

std::string damaged(std::string text, std::mt19937& random) {
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

template <class Load>
void check_survival(Load load) {
  try {
    load();
  } catch (const InputError& error) {
    REQUIRE(std::string(error.what()).size() > 10);
    return;
  }
  SUCCEED();
}

}  // namespace

TEST_CASE("2000 damaged scenes are read or refused") {
  SceneFolder folder;
  folder.write_tetrahedron("t.ply");
  const std::string whole = R"(<scene version="3.0.0">
  <default name="g" value="0.5"/>
  <integrator type="volpath"><integer name="max_depth" value="-1"/></integrator>
  <medium type="homogeneous" id="skin">
    <rgb name="sigma_t" value="1, 2, 3"/><float name="albedo" value="0.9"/>
    <phase type="hg"><float name="g" value="$g"/></phase>
  </medium>
  <sensor type="perspective">
    <string name="fov_axis" value="smaller"/><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0,0,-5" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="32"/><rfilter type="box"/></film>
    <sampler type="independent"><integer name="sample_count" value="16"/></sampler>
  </sensor>
  <bsdf type="twosided" id="floor"><bsdf type="diffuse"><rgb name="reflectance" value="0.1 0.2 0.3"/></bsdf></bsdf>
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
  for (int i = 0; i < 2000; ++i) {
    folder.write("f.xml", damaged(whole, random));
    check_survival([&] { load_scene(folder.path("f.xml")); });
  }
}

TEST_CASE("2000 damaged meshes are read or refused") {
  SceneFolder folder;
  folder.write_tetrahedron("t.ply");
  std::ifstream file(folder.path("t.ply"), std::ios::binary);
  const std::string ascii((std::istreambuf_iterator<char>(file)), {});
  std::string binary = ascii.substr(0, ascii.find("end_header\n") + 11);
  binary.replace(binary.find("ascii"), 5, "binary_little_endian");
  binary += std::string(48 + 4 * 13, '\0');
  const std::string obj =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0.5\nvn 0 0 1\nf 1/1/1 3/1/1 2/1/1\nf 1 2 4\n"
      "f 2//1 3//1 4//1\nf -4/1 4/1 3/1\n";
  std::mt19937 random(2);
  for (int i = 0; i < 700; ++i) {
    folder.write("a.ply", damaged(ascii, random));
    check_survival([&] { read_mesh(folder.path("a.ply")); });
    folder.write("b.ply", damaged(binary, random));
    check_survival([&] { read_mesh(folder.path("b.ply")); });
    folder.write("c.obj", damaged(obj, random));
    check_survival([&] { read_mesh(folder.path("c.obj")); });
  }
}
