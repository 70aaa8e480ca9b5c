// Volumes of media: what scene files say, and .vol files, whole and damaged.
#include <cmath>
#include <cstring>
#include <limits>

#include "itn/parameters.h"
#include "runtime/scene/volume/packed_voxels.h"
#include "runtime/scene/volume/volume_file.h"
#include "tests/scene/scene_folder.h"
#include "tests/support/temporary_folder.h"

using namespace itn;

namespace {

template <class Number>
std::string bytes_of(Number number) {
  std::string bytes(sizeof(number), '\0');
  std::memcpy(bytes.data(), &number, sizeof(number));
  return bytes;
}

struct File {
  std::string magic = "VOL";
  char version = 3;
  std::int32_t encoding = 1, width = 2, height = 3, depth = 4, channels = 1;
  std::array<float, 6> box{-1, -2, -3, 1, 2, 3};
  std::vector<float> values = std::vector<float>(24, 0.5F);

  std::string bytes() const {
    std::string out = magic + version;
    for (const std::int32_t n : {encoding, width, height, depth, channels}) out += bytes_of(n);
    for (const float x : box) out += bytes_of(x);
    for (const float x : values) out += bytes_of(x);
    return out;
  }
};

std::string grid(const std::string& name, const std::string& more = "") {
  return "<volume type=\"gridvolume\" name=\"" + name + "\">\n<string name=\"filename\" value=\"g.vol\"/>" + more +
         "</volume>";
}
std::string medium(const std::string& content) {
  return "<medium type=\"heterogeneous\" id=\"m\">\n" + content + "</medium>";
}

void check_bad_file(const std::string& bytes, const std::vector<std::string>& words) {
  SceneFolder folder;
  folder.write("g.vol", bytes);
  folder.check_error(medium(grid("sigma_t")), 4, words);
}

}  // namespace

TEST_CASE("heterogeneous media that say nothing have Mitsuba's defaults") {
  const Medium m = SceneFolder().load("<medium type=\"heterogeneous\"/>").media.at(0);
  CHECK(m.colour("sigma_t") == Rgb{1, 1, 1});
  CHECK(m.colour("albedo") == Rgb{0.75, 0.75, 0.75});
  CHECK(m.number("scale") == 1);
  CHECK(m.phase.type() == "isotropic");
  REQUIRE(m.value("sigma_t").volume);
  CHECK_FALSE(m.value("sigma_t").is_grid());
}

TEST_CASE("the albedo of a homogeneous medium may be a volume, its sigma_t may not") {
  SceneFolder folder;
  folder.write("g.vol", File().bytes());
  const auto homogeneous = [](const std::string& content) {
    return "<medium type=\"homogeneous\" id=\"m\">\n" + content + "</medium>";
  };
  const Scene scene = folder.load(homogeneous(grid("albedo") + "<float name=\"sigma_t\" value=\"3\"/>"));
  CHECK(scene.media.at(0).value("albedo").is_grid());
  CHECK_FALSE(scene.media[0].value("sigma_t").volume);
  CHECK_FALSE(find_parameter(list_parameters(scene), "m.albedo").not_differentiable.empty());
  CHECK(find_parameter(list_parameters(scene), "m.sigma_t").not_differentiable.empty());
  const std::string constant =
      "<volume type=\"constvolume\" name=\"albedo\"><rgb name=\"value\" value=\"0.1, 0.2, 0.3\"/></volume>";
  CHECK(folder.load(homogeneous(constant)).media.at(0).colour("albedo") == Rgb{0.1, 0.2, 0.3});
  folder.check_error(homogeneous(grid("sigma_t")), 3, {"\"sigma_t\" is a <volume>"});
}

TEST_CASE("a grid volume arrives with everything that it says") {
  SceneFolder folder;
  folder.write("g.vol", File().bytes());
  const Scene scene = folder.load(
      medium(grid("sigma_t",
                  "<string name=\"filter_type\" value=\"nearest\"/><string name=\"wrap_mode\" value=\"mirror\"/>"
                  "<boolean name=\"use_grid_bbox\" value=\"true\"/><boolean name=\"raw\" value=\"true\"/>"
                  "<transform name=\"to_world\"><scale value=\"2\"/></transform>") +
             grid("albedo") + "<float name=\"scale\" value=\"3\"/>"));
  const Medium& m = scene.media.at(0);
  const Volume& v = *m.value("sigma_t").volume;
  CHECK((v.grid->width == 2 && v.grid->height == 3 && v.grid->depth == 4 && v.grid->channels == 1));
  CHECK(v.nearest);
  CHECK(v.wrap == Volume::Wrap::mirror);
  CHECK(v.to_world.m[0] == 4);                      // twice the box
  CHECK(v.to_world.m[7] == -4);                     // its lower end in y
  CHECK(m.value("albedo").volume->grid == v.grid);  // one file is read once
  CHECK(m.value("albedo").volume->to_world.m == Transform().m);
  // A grid is no number.
  const std::vector<Parameter> parameters = list_parameters(scene);
  CHECK_THAT(find_parameter(parameters, "m.sigma_t").not_differentiable, Catch::Contains("a grid of voxels"));
  CHECK(find_parameter(parameters, "m.scale").not_differentiable.empty());
}

TEST_CASE("a grid of extinctions or albedos is differentiated by its voxels, and can be replaced") {
  SceneFolder folder;
  folder.write("g.vol", File().bytes());
  Scene scene = folder.load(medium(grid("sigma_t") + grid("albedo")));
  const Parameter p = find_parameter(list_parameters(scene), "m.sigma_t");
  CHECK(p.by_voxels);
  CHECK_THAT(p.not_differentiable, Catch::Contains("voxel by voxel"));
  CHECK(find_parameter(list_parameters(scene), "m.albedo").by_voxels);
  VoxelGrid other = values_of(scene, p);
  CHECK(other.depth == 4);
  other.data[5] = 7;
  set_values(scene, p, other);
  CHECK(grid_of(scene, p)->data[5] == 7);
  CHECK(scene.media.at(0).value("albedo").volume->grid->data[5] == 0.5F);
}

TEST_CASE("a volume file that is written is read as it was") {
  const TemporaryFolder folder;
  VoxelGrid grid;
  grid.width = 2;
  grid.height = 1;
  grid.depth = 3;
  grid.channels = 3;
  grid.low = {-1, -2, 0.5};
  grid.high = {1, 4, 8};
  for (int i = 0; i < 18; ++i) grid.data.push_back(0.25F * static_cast<float>(i));
  write_volume_file(folder / "g.vol", grid);
  const VoxelGrid again = read_volume_file(folder / "g.vol");
  CHECK((again.width == 2 && again.height == 1 && again.depth == 3 && again.channels == 3));
  CHECK((again.low == grid.low && again.high == grid.high));
  CHECK(again.data == grid.data);
}

TEST_CASE("a constant volume fills its cube") {
  const Medium m =
      SceneFolder()
          .load(medium("<volume type=\"constvolume\" name=\"sigma_t\"><rgb name=\"value\" value=\"1 2 3\"/>"
                       "<transform name=\"to_world\"><translate x=\"-0.5\"/></transform></volume>"))
          .media.at(0);
  CHECK(m.colour("sigma_t") == Rgb{1, 2, 3});
  CHECK(m.value("sigma_t").volume->to_world.m[3] == -0.5);
}

TEST_CASE("damaged .vol files are refused with what is wrong") {
  const std::string whole = File().bytes();
  check_bad_file("", {"g.vol", "does not begin with VOL"});
  check_bad_file("VO", {"does not begin with VOL"});
  check_bad_file("P6 10 10", {"does not begin with VOL"});
  check_bad_file(whole.substr(0, 20), {"ends within its header"});
  check_bad_file(whole.substr(0, whole.size() - 1), {"2 x 3 x 4 voxels", "copy the whole file"});
  const auto changed = [](const std::function<void(File&)>& change) {
    File file;
    change(file);
    return file.bytes();
  };
  check_bad_file(changed([](File& f) { f.version = 4; }), {"version 4", "need version 3"});
  check_bad_file(changed([](File& f) { f.encoding = 2; }), {"encoding 2"});
  check_bad_file(changed([](File& f) { f.channels = 2; }), {"2 channels", "need 1"});
  check_bad_file(changed([](File& f) { f.channels = 6; }), {"6 channels"});
  check_bad_file(changed([](File& f) { f.width = 0; }), {"0 x 3 x 4 voxels"});
  check_bad_file(changed([](File& f) { f.depth = -5; }), {"2 x 3 x -5 voxels"});
  check_bad_file(changed([](File& f) { f.width = std::numeric_limits<std::int32_t>::max(); }), {"along each axis"});
  check_bad_file(changed([](File& f) { f.width = f.height = f.depth = 1 << 20; }), {"2 GiB", "resample"});
  check_bad_file(changed([](File& f) { f.width = f.height = 1 << 10; }), {"bytes", "copy the whole file"});
  check_bad_file(changed([](File& f) { f.values[7] = std::nanf(""); }), {"voxel (1, 0, 1) is nan", "mend the grid"});
  check_bad_file(changed([](File& f) { f.values[0] = -1; }), {"voxel (0, 0, 0) is -1"});
  check_bad_file(changed([](File& f) { f.values[23] = std::numeric_limits<float>::infinity(); }), {"is inf"});
}

TEST_CASE("packed grids are within half a step of the file's values, and bricks of one value are stored once") {
  SceneFolder folder;
  File file;
  file.width = 20;  // three bricks, the last of which is not full
  file.height = file.depth = 8;
  file.values.assign(20 * 8 * 8, 0.25F);
  for (std::size_t i = 0; i < file.values.size(); ++i)
    if (i % 20 >= 8 && i % 20 < 16) file.values[i] = static_cast<float>(i) / 640;
  folder.write("g.vol", file.bytes());
  double sum = 0;
  for (const float value : file.values) sum += static_cast<double>(value);
  for (const int bits : {8, 16, 32}) {
    const std::string asked = "<integer name=\"bits\" value=\"" + std::to_string(bits) + "\"/>";
    const Scene scene = folder.load(medium(grid("sigma_t", asked)));
    const VoxelGrid& loaded = *scene.media.at(0).value("sigma_t").volume->grid;
    REQUIRE(loaded.packed);
    const PackedVoxels& packed = *loaded.packed;
    CHECK(loaded.data.empty());
    CHECK(packed.bricks == std::vector<std::int32_t>{0, 1, 0});
    CHECK(packed.words.size() == static_cast<std::size_t>(2 * 512 * bits / 32));
    const double half_a_step = bits == 32 ? 0 : 0.5 * (1279.0 / 640) / ((1 << bits) - 1);
    for (int i = 0; i < 20 * 8 * 8; ++i) {
      const double value = packed.value(packed.voxel({3, 1}, i % 20, i / 20 % 8, i / 160));
      REQUIRE(std::abs(value - static_cast<double>(file.values[static_cast<std::size_t>(i)])) <= half_a_step + 1e-7);
    }
    CHECK(packed.mean == Approx(sum / 1280).margin(half_a_step));
    CHECK((packed.least == file.values[8] && packed.greatest == file.values[7 * 160 + 7 * 20 + 15]));
    const Parameter p = find_parameter(list_parameters(scene), "m.sigma_t");
    CHECK_FALSE(p.by_voxels);
    CHECK(p.not_differentiable.find("packed grid") != std::string::npos);
  }
  folder.check_error(medium(grid("sigma_t", "<integer name=\"bits\" value=\"7\"/>")), 4, {"bits = 7", "8, 16 or 32"});
  for (const float bad : {std::nanf(""), 2e30F, -1.0F}) {
    file.values[21] = bad;
    folder.write("g.vol", file.bytes());
    folder.check_error(medium(grid("sigma_t", "<integer name=\"bits\" value=\"8\"/>")), 4, {"g.vol", "mend the grid"});
  }
}

TEST_CASE("grids too large for floats are refused with what would hold them") {
  SceneFolder folder;
  File file;
  file.width = file.height = file.depth = 1024;
  folder.write("g.vol", file.bytes());
  folder.check_error(medium(grid("sigma_t")), 4, {"1024 x 1024 x 1024", "2 GiB", "\"bits\" is 8 or 16"});
  folder.check_error(medium(grid("sigma_t", "<integer name=\"bits\" value=\"8\"/>")), 4, {"copy the whole file"});
  file.width = file.height = file.depth = 1 << 20;
  folder.write("g.vol", file.bytes());
  folder.check_error(medium(grid("sigma_t", "<integer name=\"bits\" value=\"8\"/>")), 4, {"resample"});
}

TEST_CASE("a picture drives a medium: a grid that is the same along its third axis") {
  SceneFolder folder;
  folder.write("p.pgm", std::string("P5 3 2 255\n") + std::string("\0\xff\0\xff\0\0", 6));
  const auto picture = [](const std::string& more, const std::string& inside = "") {
    return "<volume type=\"texturevolume\" name=\"albedo\">" + more +
           "\n<texture type=\"bitmap\"><string name=\"filename\" value=\"p.pgm\"/>" + inside + "</texture></volume>";
  };
  const std::string turned = "<transform name=\"to_world\"><scale z=\"3\"/></transform>";
  Scene scene = folder.load(medium(picture(turned,
                                           "<string name=\"filter_type\" value=\"nearest\"/>"
                                           "<string name=\"wrap_mode\" value=\"clamp\"/>")));
  const Volume& v = *scene.media.at(0).value("albedo").volume;
  CHECK((v.grid->width == 3 && v.grid->height == 2 && v.grid->depth == 1 && v.grid->channels == 1));
  CHECK(v.grid->data == std::vector<float>{0, 1, 0, 1, 0, 0});
  CHECK(v.nearest);
  CHECK(v.wrap == Volume::Wrap::clamp);
  CHECK(v.to_world.m[10] == 3);
  CHECK(find_parameter(list_parameters(scene), "m.albedo").by_voxels);
  folder.check_error(medium("<volume type=\"texturevolume\" name=\"albedo\"/>"), 3, {"no <texture>", "bitmap"});
  folder.check_error(
      medium("<volume type=\"texturevolume\" name=\"albedo\">\n<texture type=\"checkerboard\"/></volume>"), 4,
      {"\"checkerboard\"", "need a <texture type=\"bitmap\">"});
  folder.check_error(medium(picture("", "<transform name=\"to_uv\"><scale value=\"2\"/></transform>")), 4,
                     {"to_uv", "to_world"});
}

TEST_CASE("grids stand for numbers of phase functions, alone and within a blend of two") {
  SceneFolder folder;
  File cosines;
  cosines.values.assign(24, 0.25F);
  cosines.values[0] = -0.75F;
  folder.write("g.vol", cosines.bytes());
  const auto phase = [](const std::string& type, const std::string& content) {
    return "<phase type=\"" + type + "\" id=\"" + type + "\">\n" + content + "</phase>";
  };
  Scene scene = folder.load(medium(phase("hg", grid("g"))));
  const PhaseFunction& alone = scene.media.at(0).phase;
  REQUIRE(alone.value("g").is_grid());
  CHECK(alone.number("g") == Approx((23 * 0.25 - 0.75) / 24));  // their mean
  const Parameter p = find_parameter(list_parameters(scene), "hg.g");
  CHECK(p.by_voxels);
  CHECK(values_of(scene, p).data == cosines.values);
  VoxelGrid other = values_of(scene, p);
  other.data[3] = 0.5F;
  set_values(scene, p, other);
  CHECK(scene.media[0].phase.value("g").volume->grid->data[3] == 0.5F);

  folder.write("w.vol", File().bytes());
  const std::string weight =
      "<volume type=\"gridvolume\" name=\"weight\"><string name=\"filename\" value=\"w.vol\"/></volume>";
  const std::string blend = phase("blendphase", weight + phase("hg", grid("g")) + "<phase type=\"isotropic\"/>");
  const Scene blended = folder.load(medium(blend));
  for (const char* name : {"blendphase.weight", "hg.g"})
    CHECK(find_parameter(list_parameters(blended), name).by_voxels);
  const std::string constant = "<volume type=\"constvolume\" name=\"g\"><float name=\"value\" value=\"0.5\"/></volume>";
  CHECK(folder.load(medium(phase("hg", constant))).media.at(0).phase.number("g") == 0.5);

  const std::string nested =
      phase("dictionary", "<string name=\"weights\" value=\"1 2\"/>" + blend + "<phase type=\"rayleigh\"/>");
  folder.check_error(medium(nested), 4, {"a weight that is a grid", "numbers"});
  folder.check_error(medium("<float name=\"sigma_s_prime\" value=\"1\"/><float name=\"sigma_a\" value=\"1\"/>" +
                            phase("hg", grid("g"))),
                     3, {"reduced scattering", "sigma_s and sigma_a"});
  cosines.values[5] = 1;
  folder.write("g.vol", cosines.bytes());
  folder.check_error(medium(phase("hg", grid("g"))), 4, {"\"g\"", "from -0.75 to 1", "-0.999999"});
  cosines.channels = 3;
  cosines.values.assign(72, 0.1F);
  folder.write("g.vol", cosines.bytes());
  folder.check_error(medium(phase("hg", grid("g"))), 4, {"3 channels", "need one"});
}

TEST_CASE("volumes that make no sense are refused where they stand") {
  SceneFolder folder;
  File file;
  file.values[3] = 1.5F;
  file.box[3] = -1;
  folder.write("g.vol", file.bytes());
  folder.check_error(medium(grid("albedo")), 3, {"albedo", "from 0.5 to 1.5", "need [0, 1]"});
  folder.check_error(medium(grid("sigma_t", "\n<boolean name=\"use_grid_bbox\" value=\"true\"/>")), 5,
                     {"from -1 to -1 along axis x"});
  folder.check_error(medium(grid("sigma_t", "\n<transform name=\"to_world\"><scale x=\"0\"/></transform>")), 5,
                     {"singular"});
  folder.check_error(medium(grid("sigma_t", "\n<string name=\"filter_type\" value=\"cubic\"/>")), 5, {"trilinear"});
  folder.check_error(medium("<volume type=\"voxels\" name=\"sigma_t\"/>"), 3, {"unknown type", "gridvolume"});
  folder.check_error("<medium type=\"homogeneous\">\n" + grid("sigma_t") + "</medium>", 3, {"sigma_t"});
}
