// BSDFs, textures, media and phase functions.
#include "itn/bitmap.h"
#include "itn/exr.h"
#include "itn/parameters.h"
#include "kernels/shared/declaration.h"
#include "runtime/image/png.h"
#include "runtime/image/srgb.h"
#include "runtime/scene/model/structure.h"
#include "runtime/scene/volume/volume_file.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

Bsdf load_bsdf(const std::string& element) { return SceneFolder().load(element).bsdfs.at(0); }
Medium load_medium(const std::string& content) {
  return SceneFolder().load("<medium type=\"homogeneous\" id=\"m\">" + content + "</medium>").media.at(0);
}
std::string number(const std::string& name, const std::string& value) {
  return "<float name=\"" + name + "\" value=\"" + value + "\"/>";
}
std::string text(const std::string& name, const std::string& value) {
  return "<string name=\"" + name + "\" value=\"" + value + "\"/>";
}
void check_bsdf_error(const std::string& type, const std::string& content, const std::vector<std::string>& words) {
  SceneFolder().check_error("<bsdf type=\"" + type + "\">\n" + content + "</bsdf>", 3, words);
}
void check_medium_error(const std::string& content, const std::vector<std::string>& words) {
  SceneFolder().check_error("<medium type=\"homogeneous\">\n" + content + "</medium>", 3, words);
}

}  // namespace

TEST_CASE("bsdfs that say nothing have Mitsuba's defaults") {
  CHECK(load_bsdf("<bsdf type=\"null\"/>").type() == "null");
  const Bsdf diffuse = load_bsdf("<bsdf type=\"diffuse\"/>");
  CHECK(diffuse.type() == "diffuse");
  CHECK(diffuse.value("reflectance").value == Rgb{0.5, 0.5, 0.5});
  CHECK(!diffuse.twosided);
  const Bsdf smooth = load_bsdf("<bsdf type=\"dielectric\"/>");
  CHECK(smooth.type() == "dielectric");
  CHECK(smooth.number("int_ior") == 1.5046);
  CHECK(smooth.number("ext_ior") == 1.000277);
  CHECK(smooth.value("specular_reflectance").value == Rgb{1, 1, 1});
  CHECK(smooth.value("specular_transmittance").value == Rgb{1, 1, 1});
  const Bsdf rough = load_bsdf("<bsdf type=\"roughdielectric\"/>");
  CHECK(rough.type() == "roughdielectric");
  CHECK(rough.model->variants[static_cast<std::size_t>(rough.variant)] == "beckmann");
  CHECK(rough.number("alpha") == 0.1);
}

TEST_CASE("two alphas that differ make a surface anisotropic") {
  const std::string checks = "<texture type=\"checkerboard\" name=\"alpha_v\"/>";
  for (const std::string type : {"roughconductor", "roughdielectric"}) {
    const auto load = [&](const std::string& content) {
      return load_bsdf("<bsdf type=\"" + type + "\">" + content + "</bsdf>");
    };
    const Bsdf b = load(number("alpha_u", "0.1") + number("alpha_v", "0.4") + text("distribution", "ggx"));
    CHECK(b.type() == type);
    CHECK(b.variant == 1);
    CHECK((b.model->traits & BSDF_ANISOTROPIC) != 0);
    CHECK(b.number("alpha_u") == 0.1);
    CHECK(b.number("alpha_v") == 0.4);
    CHECK(!load(number("alpha_u", "0.1") + checks).value("alpha_v").is_constant());
    CHECK((load(number("alpha_u", "0.2") + number("alpha_v", "0.2")).model->traits & BSDF_ANISOTROPIC) == 0);
  }
}

TEST_CASE("every parameter of a rough dielectric arrives") {
  const Bsdf b = load_bsdf("<bsdf type=\"roughdielectric\" id=\"glass\">" + text("distribution", "ggx") +
                           number("alpha", "0.3") + number("int_ior", "1.4") + text("ext_ior", "water") +
                           "<rgb name=\"specular_reflectance\" value=\"0.1 0.2 0.3\"/>" +
                           "<spectrum name=\"specular_transmittance\" value=\"0.9\"/>" +
                           "<boolean name=\"sample_visible\" value=\"false\"/></bsdf>");
  CHECK(b.id == "glass");
  CHECK(b.model->variants[static_cast<std::size_t>(b.variant)] == "ggx");
  CHECK(b.number("alpha") == 0.3);
  CHECK(b.number("int_ior") == 1.4);
  CHECK(b.number("ext_ior") == 1.333);
  CHECK(b.value("specular_reflectance").value == Rgb{0.1, 0.2, 0.3});
  CHECK(b.value("specular_transmittance").value == Rgb{0.9, 0.9, 0.9});
  CHECK(load_bsdf("<bsdf type=\"roughdielectric\">" + number("alpha_u", "0.2") + number("alpha_v", "0.2") + "</bsdf>")
            .number("alpha") == 0.2);
}

TEST_CASE("conductors and plastics that say nothing have Mitsuba's defaults") {
  for (const char* type : {"conductor", "roughconductor"}) {
    const Bsdf mirror = load_bsdf("<bsdf type=\"" + std::string(type) + "\"/>");
    CHECK(mirror.value("eta").value == Rgb{0, 0, 0});
    CHECK(mirror.value("k").value == Rgb{1, 1, 1});
    CHECK(mirror.value("specular_reflectance").value == Rgb{1, 1, 1});
  }
  for (const char* type : {"plastic", "roughplastic", "pplastic"}) {
    const Bsdf plastic = load_bsdf("<bsdf type=\"" + std::string(type) + "\"/>");
    CHECK(plastic.value("diffuse_reflectance").value == Rgb{0.5, 0.5, 0.5});
    CHECK(plastic.number("int_ior") == 1.49);
    CHECK(plastic.number("ext_ior") == 1.000277);
  }
  CHECK(load_bsdf("<bsdf type=\"roughplastic\"/>").number("alpha") == 0.1);
  CHECK(load_bsdf("<bsdf type=\"plastic\"/>").number("nonlinear") == 0);
  CHECK(load_bsdf("<bsdf type=\"plastic\"><boolean name=\"nonlinear\" value=\"true\"/></bsdf>").number("nonlinear") ==
        1);
  CHECK(load_bsdf("<bsdf type=\"thindielectric\"/>").number("int_ior") == 1.5046);
}

TEST_CASE("principled surfaces have Mitsuba's defaults, and are boundaries where light passes") {
  const auto load = [&](const std::string& type, const std::string& content) {
    return load_bsdf("<bsdf type=\"" + type + "\">" + content + "</bsdf>");
  };
  const std::string checks = "<texture type=\"checkerboard\" name=\"spec_trans\"/>";
  for (const char* type : {"principled", "principledthin"}) {
    const Bsdf b = load(type, "");
    CHECK(b.value("base_color").value == Rgb{0.5, 0.5, 0.5});
    CHECK(b.number("roughness") == 0.5);
    for (const char* name : {"anisotropic", "spec_tint", "sheen", "sheen_tint", "flatness"}) CHECK(b.number(name) == 0);
    CHECK(b.number("eta") == Approx(1.5));
    CHECK(b.number("diffuse_reflectance_sampling_rate") == 1);
    CHECK(!load(type, checks).value("spec_trans").is_constant());
  }
  const auto passes = [&](const std::string& content) {
    return (load("principled", content).model->traits & BSDF_TRANSMITS) != 0;
  };
  CHECK(!passes(""));
  CHECK(!passes(number("spec_trans", "0")));
  CHECK(passes(number("spec_trans", "0.1")));
  CHECK(passes(checks));
  // Mitsuba 3.9.1: eta = 2 / (1 - sqrt(0.08 specular)) - 1, and no index of 1 where light passes
  CHECK(load("principled", number("specular", "0.5")).number("eta") == Approx(1.5));
  CHECK(load("principled", number("specular", "0")).number("eta") == 1);
  CHECK(load("principled", number("specular", "0") + number("spec_trans", "1")).number("eta") ==
        Approx(2 / (1 - std::sqrt(8e-5)) - 1));
  CHECK(load("principled", number("eta", "1") + number("spec_trans", "1")).number("eta") == 1.001);
  CHECK(load("principledthin", number("diff_trans", "1.5")).number("diff_trans") == 1.5);
  check_bsdf_error("principled", number("eta", "1.4") + number("specular", "0.4"), {"specular", "one or the other"});
  check_bsdf_error("principled", number("metallic", "1.1"), {"metallic", "outside [0, 1]"});
  check_bsdf_error("principledthin", number("diff_trans", "2.1"), {"diff_trans", "outside [0, 2]"});
  SceneFolder().check_error(
      "<bsdf type=\"twosided\"><bsdf type=\"principled\">" + number("spec_trans", "1") + "</bsdf></bsdf>", 2,
      {"twosided", "spec_trans"});
}

TEST_CASE("metals have Mitsuba's names") {
  // Mitsuba 3.9.1, scalar_rgb
  const Bsdf gold = load_bsdf("<bsdf type=\"conductor\">" + text("material", "Au") + "</bsdf>");
  CHECK(gold.value("eta").value[2] == Approx(1.442045));
  CHECK(gold.value("k").value[0] == Approx(3.982997));
  const Bsdf none = load_bsdf("<bsdf type=\"roughconductor\">" + text("material", "none") +
                              "<rgb name=\"eta\" value=\"1 2 3\"/></bsdf>");
  CHECK(none.value("eta").value == Rgb{1, 2, 3});
  const Bsdf measured = load_bsdf(
      "<bsdf type=\"conductor\"><spectrum name=\"k\" value=\"300:1.92, 400:1.95, 500:1.95, 600:2.97, 700:3.8, "
      "800:5.12\"/></bsdf>");
  CHECK(measured.value("k").value[0] == Approx(3.38869).epsilon(1e-5));  // above 1, as no reflectance is
  CHECK(measured.value("k").value[2] == Approx(1.87516).epsilon(1e-5));
  check_bsdf_error("conductor", text("material", "Gold"), {"\"material\"", "unknown metal \"Gold\""});
  check_bsdf_error("conductor", "<rgb name=\"k\" value=\"1 2 3\"/>" + text("material", "Au"),
                   {"\"k\"", "one or the other"});
  const std::string board =
      "<texture type=\"checkerboard\" name=\"eta\"><rgb name=\"color1\" value=\"1 2 3\"/></texture>";
  CHECK(load_bsdf("<bsdf type=\"conductor\">" + board + "</bsdf>").value("eta").colours[1] == Rgb{1, 2, 3});
  check_bsdf_error("conductor", board + text("material", "Au"), {"\"eta\"", "one or the other"});
  check_bsdf_error("roughplastic", number("int_ior", "1"), {"int_ior", "not above ext_ior"});
}

TEST_CASE("metals take the magnitude of eta and k, as in Mitsuba, and it is told") {
  SceneFolder folder;
  const Scene scene = folder.load(
      "<bsdf type=\"roughconductor\"><rgb name=\"eta\" value=\"-0.05 0.5 1\"/><rgb name=\"k\" value=\"3 -2 "
      "1\"/></bsdf>");
  CHECK(scene.bsdfs[0].value("eta").value == Rgb{0.05, 0.5, 1});
  CHECK(scene.bsdfs[0].value("k").value == Rgb{3, 2, 1});
  REQUIRE(scene.warnings.size() == 2);
  CHECK_THAT(scene.warnings[0], Catch::Contains("eta = -0.05, 0.5, 1") && Catch::Contains("magnitude"));
  check_bsdf_error("conductor", "<rgb name=\"eta\" value=\"-2000 1 1\"/>", {"eta = 2000", "outside [0, 1000]"});
}

TEST_CASE("a texture may be a volume, of a constant or a grid") {
  SceneFolder folder;
  VoxelGrid grid;
  grid.width = 2;
  grid.height = grid.depth = 1;
  grid.data = {0.25f, 0.75f};
  write_volume_file(folder.path("g.vol"), grid);
  const auto load = [&](const std::string& bsdf, const std::string& name, const std::string& volume) {
    return folder.load("<shape type=\"sphere\"><bsdf type=\"" + bsdf + "\"><texture type=\"volume\" name=\"" + name +
                       "\"><volume name=\"volume\" " + volume + "</volume></texture></bsdf></shape>");
  };
  const std::string file = "type=\"gridvolume\"><string name=\"filename\" value=\"g.vol\"/>";
  const Scene scene =
      load("diffuse", "reflectance", file + "<transform name=\"to_world\"><translate x=\"3\"/></transform>");
  const Texture& shown = scene.bsdfs[0].value("reflectance");
  REQUIRE(shown.model);
  CHECK(shown.model->type == "volume");
  CHECK(shown.volume->grid->data == grid.data);
  CHECK(shown.volume->to_world.m[3] == 3);
  const Texture constant =
      load("diffuse", "reflectance", "type=\"constvolume\"><rgb name=\"value\" value=\"0.1 0.2 0.3\"/>")
          .bsdfs[0]
          .value("reflectance");
  CHECK(constant.volume->grid->data == std::vector<float>{0.1f, 0.2f, 0.3f});
  // No number, and nothing to be found voxel by voxel.
  const Parameter p = find_parameter(list_parameters(scene), "diffuse0.reflectance");
  CHECK((!p.has_values() && !p.not_differentiable.empty()));
  grid.data = {0.25f, 1.5f};
  write_volume_file(folder.path("g.vol"), grid);
  CHECK_THROWS_WITH(load("diffuse", "reflectance", file), Catch::Contains("0.25 to 1.5") && Catch::Contains("[0, 1]"));
  folder.check_error(
      "<shape type=\"sphere\"><bsdf type=\"diffuse\">\n<texture type=\"volume\" name=\"reflectance\"/></bsdf></shape>",
      3, {"no <volume>"});
}

TEST_CASE("refractive indices have Mitsuba's names") {
  // Spot checks of the table: Mitsuba 3.9.1's values.
  const std::pair<const char*, double> cases[] = {
      {"vacuum", 1}, {"air", 1.000277}, {"water ice", 1.31}, {"bk7", 1.5046}, {"Diamond", 2.419}};
  for (const auto& [name, value] : cases)
    CHECK(load_bsdf("<bsdf type=\"dielectric\">" + text("int_ior", name) + "</bsdf>").number("int_ior") == value);
}

TEST_CASE("twosided turns a diffuse surface into a two-sided one without touching the original") {
  const Scene scene = SceneFolder().load(
      "<bsdf type=\"diffuse\" id=\"d\"/><bsdf type=\"twosided\" id=\"t\"><ref id=\"d\"/></bsdf>"
      "<shape type=\"disk\"><ref id=\"t\"/></shape><shape type=\"disk\"><ref id=\"d\"/></shape>");
  CHECK(scene.bsdfs[static_cast<std::size_t>(scene.shapes[0].bsdf)].twosided);
  CHECK(!scene.bsdfs[static_cast<std::size_t>(scene.shapes[1].bsdf)].twosided);
}

TEST_CASE("a diffuse surface takes a bitmap, with all its parameters") {
  SceneFolder folder;
  write_png(folder.path("t.png"), 2, 1, {255, 255, 255, 188, 0, 0});
  const std::string shape =
      "<shape type=\"rectangle\"><bsdf type=\"diffuse\"><texture type=\"bitmap\" name=\"reflectance\">" +
      text("filename", "t.png");
  const Texture plain = folder.load(shape + "</texture></bsdf></shape>").bsdfs[0].value("reflectance");
  REQUIRE(plain.bitmap);
  CHECK(plain.bitmap->width == 2);
  CHECK(plain.bitmap->height == 1);
  CHECK(plain.bitmap->data[3] == Approx(srgb_decode(188 / 255.0)));
  CHECK(!plain.nearest);
  CHECK(plain.wrap == Texture::Wrap::repeat);
  const Texture other =
      folder
          .load(shape + text("filter_type", "nearest") + text("wrap_mode", "mirror") +
                "<boolean name=\"raw\" value=\"true\"/><transform name=\"to_uv\"><scale x=\"2\" y=\"3\"/>"
                "<translate x=\"0.5\" y=\"0.25\"/></transform></texture></bsdf></shape>")
          .bsdfs[0]
          .value("reflectance");
  CHECK(other.nearest);
  CHECK(other.wrap == Texture::Wrap::mirror);
  CHECK(other.bitmap->data[3] == Approx(188 / 255.0));
  CHECK(other.to_uv == std::array<double, 6>{2, 0, 0.5, 0, 3, 0.25});
}

TEST_CASE("a texture may be shared, and its file is read once") {
  SceneFolder folder;
  write_png(folder.path("t.png"), 1, 1, {1, 2, 3});
  const Scene scene = folder.load("<texture type=\"bitmap\" id=\"t\">" + text("filename", "t.png") +
                                  "</texture>"
                                  "<bsdf type=\"diffuse\"><ref name=\"reflectance\" id=\"t\"/></bsdf>"
                                  "<bsdf type=\"diffuse\"><ref name=\"reflectance\" id=\"t\"/></bsdf>");
  CHECK(scene.bsdfs[0].value("reflectance").bitmap);
  CHECK(scene.bsdfs[0].value("reflectance").bitmap == scene.bsdfs[1].value("reflectance").bitmap);
}

TEST_CASE("a diffuse surface takes a checkerboard, one-sided or two-sided") {
  const auto board = [](const std::string& content) {
    return "<texture type=\"checkerboard\" id=\"t\" name=\"reflectance\">" + content + "</texture>";
  };
  const Texture plain = load_bsdf("<bsdf type=\"diffuse\">" + board("") + "</bsdf>").value("reflectance");
  REQUIRE(!plain.is_constant());
  CHECK(plain.model->type == "checkerboard");
  CHECK(plain.id == "t");
  CHECK(plain.colours == std::vector<Rgb>{{0.4, 0.4, 0.4}, {0.2, 0.2, 0.2}});
  CHECK(plain.to_uv == std::array<double, 6>{1, 0, 0, 0, 1, 0});
  CHECK(!plain.bitmap);
  const Scene scene = SceneFolder().load("<bsdf type=\"twosided\" id=\"b\"><bsdf type=\"diffuse\">" +
                                         board(number("color1", "0.25") +
                                               "<rgb name=\"color0\" value=\"0 0.5 1\"/><transform name=\"to_uv\">"
                                               "<scale x=\"2\" y=\"3\"/><translate x=\"0.5\"/></transform>") +
                                         "</bsdf></bsdf><shape type=\"rectangle\"><ref id=\"b\"/></shape>");
  const Bsdf& other = scene.bsdfs[static_cast<std::size_t>(scene.shapes[0].bsdf)];
  CHECK(other.twosided);
  CHECK(other.value("reflectance").colours == std::vector<Rgb>{{0, 0.5, 1}, {0.25, 0.25, 0.25}});
  CHECK(other.value("reflectance").to_uv == std::array<double, 6>{2, 0, 0.5, 0, 3, 0});
}

TEST_CASE("faulty checkerboards are refused") {
  SceneFolder folder;
  const auto diffuse = [](const std::string& content) {
    return "<bsdf type=\"diffuse\"><texture type=\"checkerboard\" name=\"reflectance\">\n" + content +
           "</texture></bsdf>";
  };
  folder.check_error(diffuse(number("color0", "1.5")), 2, {"\"color0\" = 1.5", "[0, 1]"});
  folder.check_error(diffuse("<rgb name=\"color1\" value=\"0 0 -1\"/>"), 3, {"\"color1\" = -1", "[0, inf)"});
  folder.check_error("<bsdf type=\"roughconductor\"><texture type=\"checkerboard\" name=\"alpha\">\n" +
                         number("color0", "1.5") + "</texture></bsdf>",
                     2, {"\"color0\" = 1.5", "[0, 1]"});
  CHECK(folder
            .load("<bsdf type=\"principledthin\"><texture type=\"checkerboard\" name=\"diff_trans\">" +
                  number("color0", "1.5") + "</texture></bsdf>")
            .bsdfs[0]
            .value("diff_trans")
            .colours[0][0] == 1.5);
  folder.check_error(diffuse("<texture type=\"checkerboard\" name=\"color0\"/>"), 3,
                     {"\"color0\"", "no texture inside of a texture", "<rgb>"});
  folder.check_error(diffuse(number("colour0", "0.5")), 3, {"unknown parameter \"colour0\"", "color0"});
  folder.write_tetrahedron("t.ply");
  folder.check_error("<shape type=\"ply\">" + text("filename", "t.ply") + diffuse("") + "</shape>", 2,
                     {"no texture coordinates"});
}

TEST_CASE("faulty bsdfs are refused") {
  check_bsdf_error("roughdielectric", number("alpha", "0"), {"alpha = 0", "dielectric"});
  check_bsdf_error("roughdielectric", number("alpha", "-0.1"), {"alpha = -0.1"});
  check_bsdf_error("roughdielectric", number("alpha", "1.5"), {"alpha = 1.5", "at most 1"});
  check_bsdf_error("roughplastic", number("alpha_u", "0.1") + number("alpha_v", "0.2"),
                   {"alpha_u = 0.1", "alpha_v = 0.2"});
  check_bsdf_error("roughconductor", number("alpha_u", "0.1") + number("alpha_v", "1.2"), {"alpha_v = 1.2"});
  check_bsdf_error("roughdielectric", number("alpha", "0.1") + number("alpha_u", "0.2"), {"both"});
  SceneFolder().check_error("<bsdf type=\"roughdielectric\">\n" + number("alpha_u", "0.2") + "</bsdf>", 2,
                            {"only one"});
  check_bsdf_error("roughdielectric", text("distribution", "phong"), {"\"phong\"", "\"beckmann\" or \"ggx\""});
  check_bsdf_error("dielectric", number("int_ior", "0"), {"\"int_ior\"", "above 0"});
  check_bsdf_error("dielectric", number("int_ior", "1e-30"), {"\"int_ior\"", "0.001 to 1000"});
  check_bsdf_error("dielectric", text("int_ior", "watr"), {"unknown material \"watr\"", "did you mean \"water\""});
  check_bsdf_error("roughdielectric", number("int_ior", "1.4") + number("ext_ior", "1.4"), {"both 1.4", "use null"});
  check_bsdf_error("dielectric", number("alpha", "0.1"), {"unknown parameter \"alpha\""});
  check_bsdf_error("dielectric", "<rgb name=\"specular_reflectance\" value=\"0 0 1.5\"/>", {"1.5", "[0, 1]"});
  check_bsdf_error("diffuse", "<rgb name=\"reflectance\" value=\"0 0 1.5\"/>", {"1.5", "[0, 1]"});
  check_bsdf_error("diffuse", "<bsdf type=\"null\" name=\"reflectance\"/>", {"\"reflectance\"", "<texture>"});
  check_bsdf_error("twosided", "<bsdf type=\"dielectric\"/>", {"\"dielectric\"", "need \"diffuse\""});
  SceneFolder().check_error("<bsdf type=\"twosided\"/>", 2, {"empty"});
}

TEST_CASE("what XML nests around BSDFs is one BSDF with the parameters of all") {
  const std::string metal = "<bsdf type=\"roughconductor\" id=\"metal\"/>",
                    paint = "<bsdf type=\"diffuse\" id=\"paint\"/>";
  const Scene scene = SceneFolder().load(
      "<bsdf type=\"mask\" id=\"holes\"><float name=\"opacity\" value=\"0.6\"/><bsdf type=\"twosided\">"
      "<bsdf type=\"blendbsdf\" id=\"mix\"><float name=\"weight\" value=\"0.25\"/>" +
      metal + paint + "</bsdf></bsdf></bsdf><shape type=\"sphere\"><ref id=\"holes\"/></shape>");
  REQUIRE(scene.bsdfs.size() == 1);  // what is inside is no surface
  const Bsdf& bsdf = scene.bsdfs[0];
  REQUIRE(bsdf.model->structure != nullptr);
  CHECK(bsdf.type() == "mask");
  CHECK(bsdf.model->structure->leaves.size() == 3);
  CHECK(bsdf.values[bsdf.values_called("holes", "opacity").at(0)].value[0] == 0.6);
  CHECK(bsdf.values[bsdf.values_called("mix", "weight").at(0)].value[0] == 0.25);
  CHECK(bsdf.values_called("metal", "alpha").size() == 1);
  CHECK(bsdf.values_called("paint", "alpha").empty());
}

TEST_CASE("faulty nests of BSDFs are refused") {
  const std::string paint = "<bsdf type=\"diffuse\"/>";
  check_bsdf_error("blendbsdf", number("weight", "0.5") + paint, {"1 nested <bsdf>", "need two"});
  check_bsdf_error("blendbsdf", paint + paint, {"no weight"});
  check_bsdf_error("blendbsdf", number("weight", "1.5") + paint + paint, {"1.5", "[0, 1]"});
  check_bsdf_error("mask", paint + paint, {"2 nested <bsdf>", "need one"});
  SceneFolder().check_error("<bsdf type=\"mask\"/>", 2, {"empty"});
  SceneFolder().check_error("<bsdf type=\"normalmap\">" + paint + "</bsdf>", 2,
                            {"need a nested <texture name=\"normalmap\">"});
  check_bsdf_error("bumpmap", paint, {"0 textures", "heights"});
  std::string twice = paint;  // seven times: 128 surfaces
  for (int i = 0; i < 6; ++i) twice = "<bsdf type=\"blendbsdf\">" + number("weight", "0.5") + twice + twice + "</bsdf>";
  SceneFolder().check_error("<bsdf type=\"blendbsdf\">" + number("weight", "0.5") + twice + twice + "</bsdf>", 2,
                            {"128 surfaces", "64"});
  check_bsdf_error("dictionary", text("weights", "1 2") + paint, {"2 weights", "1 nested"});
  check_bsdf_error("dictionary", text("weights", "1 -2") + paint + paint, {"weight 1 is -2"});
  check_bsdf_error("dictionary", text("weights", "0, 0") + paint + paint, {"sum", "above 0"});
  SceneFolder().check_error("<bsdf type=\"dictionary\">" + text("weights", "1") + "</bsdf>", 2, {"empty"});
  SceneFolder().check_error("<bsdf type=\"dictionary\">" + paint + paint + "</bsdf>", 2, {"no \"weights\""});
  check_bsdf_error("bumpmap", paint + "<texture type=\"checkerboard\"/>", {"\"checkerboard\"", "bitmap"});
  check_bsdf_error("twosided", paint + paint + paint, {"3 nested <bsdf>"});
  check_bsdf_error("twosided", "<bsdf type=\"mask\">" + paint + "</bsdf>", {"\"mask\"", "around twosided"});
}

TEST_CASE("faulty textures are refused") {
  SceneFolder folder;
  const auto diffuse = [](const std::string& content) {
    return "<bsdf type=\"diffuse\"><texture type=\"bitmap\" name=\"reflectance\">\n" + content + "</texture></bsdf>";
  };
  folder.check_error(diffuse(text("filename", "gone.png")), 3, {"no such file", "gone.png"});
  folder.check_error(diffuse(""), 2, {"no \"filename\""});
  folder.check_error(diffuse(text("filename", "")), 3, {"empty"});
  folder.write("bad.png", "this is no picture");
  folder.check_error(diffuse(text("filename", "bad.png")), 3, {"bad.png"});
  write_png(folder.path("t.png"), 1, 1, {1, 2, 3});
  folder.check_error(diffuse(text("filename", "t.png") + "\n" + text("filter_type", "cubic")), 4,
                     {"\"cubic\"", "\"bilinear\""});
  folder.check_error(diffuse(text("filename", "t.png") + "\n" + text("wrap_mode", "tile")), 4,
                     {"\"tile\"", "\"repeat\""});
  folder.check_error("<bsdf type=\"diffuse\"><texture type=\"noise\" name=\"reflectance\"/></bsdf>", 2,
                     {"\"volume\"", "\"bitmap\", \"checkerboard\", \"mesh_attribute\" or \"volume\""});
  ExrImage image{1, 1, {"R", "G", "B"}, {0.5f, 2.0f, 0.5f}, {}};
  write_exr(folder.path("t.exr"), image);
  folder.check_error("\n" + diffuse(text("filename", "t.exr")), 3, {"to 2", "[0, 1]"});
  image.data[1] = std::numeric_limits<float>::quiet_NaN();
  write_exr(folder.path("t.exr"), image);
  folder.check_error(diffuse(text("filename", "t.exr")), 3, {"t.exr", "pixel (0, 0)", "finite"});
  folder.write_tetrahedron("t.ply");
  folder.check_error(
      "<shape type=\"ply\">" + text("filename", "t.ply") + diffuse(text("filename", "t.png")) + "</shape>", 2,
      {"no texture coordinates"});
}

TEST_CASE("media that say nothing have Mitsuba's defaults") {
  const Medium m = load_medium("");
  CHECK(m.colour("sigma_t") == Rgb{1, 1, 1});
  CHECK(m.colour("albedo") == Rgb{0.75, 0.75, 0.75});
  CHECK(m.number("scale") == 1);
  CHECK(m.phase.type() == "isotropic");
  CHECK(!m.value("sigma_t").by_component);
  CHECK(!m.value("albedo").by_component);
  const Medium hg = load_medium("<phase type=\"hg\"/>");
  CHECK(hg.phase.type() == "hg");
  CHECK(hg.phase.number("g") == 0.8);
}

TEST_CASE("every parameter of a medium arrives") {
  const Medium m = load_medium("<rgb name=\"sigma_t\" value=\"1, 2, 3\"/><spectrum name=\"albedo\" value=\"0.25\"/>" +
                               number("scale", "10") + "<phase type=\"hg\" id=\"p\">" + number("g", "-0.5") +
                               "</phase>" + "<boolean name=\"sample_emitters\" value=\"false\"/>");
  CHECK(m.id == "m");
  CHECK(m.phase.id == "p");
  CHECK(m.colour("sigma_t") == Rgb{1, 2, 3});  // without scale
  CHECK(m.value("sigma_t").by_component);
  CHECK(m.colour("albedo") == Rgb{0.25, 0.25, 0.25});
  CHECK(!m.value("albedo").by_component);
  CHECK(m.number("scale") == 10);
  CHECK(m.phase.number("g") == -0.5);
  CHECK(!m.sample_emitters);
  CHECK(load_medium("").sample_emitters);
  CHECK(load_medium("<integer name=\"sigma_t\" value=\"4\"/>").colour("sigma_t") == Rgb{4, 4, 4});
}

TEST_CASE("albedo 0 and 1, sigma_t 0 and g close to 1 are allowed") {
  CHECK(load_medium(number("albedo", "0")).colour("albedo")[0] == 0);
  CHECK(load_medium(number("albedo", "1")).colour("albedo")[0] == 1);
  CHECK(load_medium(number("sigma_t", "0")).colour("sigma_t")[0] == 0);
  CHECK(load_medium("<phase type=\"hg\">" + number("g", "0.9999") + "</phase>").phase.number("g") == 0.9999);
}

TEST_CASE("a tabulated phase function has as many parameters as values") {
  const auto medium = [](const std::string& values) {
    return "<medium type=\"homogeneous\" id=\"m\">\n<phase type=\"tabphase\" id=\"p\">\n<string name=\"values\" "
           "value=\"" +
           values + "\"/></phase></medium>";
  };
  const Scene scene = SceneFolder().load(medium("0.5, 1 2.5,0"));
  const PhaseFunction& phase = scene.media.at(0).phase;
  CHECK(phase.type() == "tabphase");
  CHECK(phase.slots() == std::vector<double>{0.5, 1, 2.5, 0});
  const std::vector<Parameter> parameters = list_parameters(scene);
  CHECK(find_parameter(parameters, "p.value_2").value == 2.5);
  CHECK(find_parameter(parameters, "p.value_2").not_differentiable.empty());
  CHECK_FALSE(find_parameter(parameters, "p.value_3").not_differentiable.empty());
  CHECK_THROWS(find_parameter(parameters, "p.value_4"));
  SceneFolder().check_error(medium("1"), 4, {"1 numbers", "2 to 128"});
  SceneFolder().check_error(medium("1, -2"), 4, {"-2 is negative"});
  SceneFolder().check_error(medium("0, 0"), 4, {"all are 0"});
  SceneFolder().check_error(medium("1, two"), 3, {"two"});
  std::string many = "1";
  for (int k = 0; k < 128; ++k) many += ", 1";
  SceneFolder().check_error(medium(many), 4, {"129 numbers"});
  SceneFolder().check_error("<medium type=\"homogeneous\">\n<phase type=\"tabphase\"/></medium>", 3, {"values"});
}

TEST_CASE("mixtures of phase functions keep the names of what they are made of") {
  const auto medium = [](const std::string& phase) {
    return "<medium type=\"homogeneous\" id=\"m\">\n" + phase + "</medium>";
  };
  const auto blend = [](const std::string& weight, const std::string& inside) {
    return "<phase type=\"blendphase\" id=\"b\">" + weight + inside + "</phase>";
  };
  const auto dictionary = [](const std::string& weights, const std::string& inside) {
    return "<phase type=\"dictionary\" id=\"d\"><string name=\"weights\" value=\"" + weights + "\"/>" + inside +
           "</phase>";
  };
  const std::string even = "<phase type=\"isotropic\"/>", hg = "<phase type=\"hg\"/>";
  const std::string peak = "<phase type=\"hg\" id=\"p\">" + number("g", "0.5") + "</phase>";
  const Scene scene =
      SceneFolder().load(medium(blend(number("weight", "0.25"), even + dictionary("3 0 1", peak + even + hg))));
  const PhaseFunction& phase = scene.media.at(0).phase;
  CHECK(phase.type() == "blendphase");
  CHECK(phase.slots() == std::vector<double>{0.25, 3, 0, 1, 0.5, 0.8});
  const std::vector<Parameter> parameters = list_parameters(scene);
  CHECK(find_parameter(parameters, "b.weight").not_differentiable.empty());
  CHECK(find_parameter(parameters, "b.weight").range() == "[0, 1]");
  CHECK(find_parameter(parameters, "d.weight_0").value == 3);
  CHECK_FALSE(find_parameter(parameters, "d.weight_1").not_differentiable.empty());
  CHECK(find_parameter(parameters, "p.g").value == 0.5);
  CHECK(find_parameter(parameters, "hg0.g").value == 0.8);
  Scene moved = scene;
  set_parameter(moved, find_parameter(parameters, "p.g"), 0.7);
  CHECK(moved.media[0].phase.slots()[4] == 0.7);

  const auto check = [&](const std::string& phase_text, const std::vector<std::string>& words) {
    SceneFolder().check_error(medium(phase_text), 3, words);
  };
  check(blend(number("weight", "0.5"), even), {"1 nested <phase>; need two"});
  check(blend(number("weight", "0.5"), even + hg + even), {"3 nested <phase>; need two"});
  check(blend("", even + hg), {"weight"});
  check(blend(number("weight", "1.5"), even + hg), {"weight = 1.5", "[0, 1]"});
  check(dictionary("1", ""), {"0 nested <phase>"});
  check(dictionary("1 2", even), {"2 weights for 1 nested <phase>"});
  check(dictionary("1 -2", even + hg), {"weight 1 is -2"});
  check(dictionary("0 0", even + hg), {"their sum is 0"});
  check(blend(number("weight", "0.5"), even + "<phase type=\"sggx\"/>"),
        {"\"sggx\"", "\"blendphase\"", "\"dictionary\""});
  std::string many, ones;
  for (int k = 0; k < 65; ++k) {
    many += even;
    ones += "1 ";
  }
  check(dictionary(ones, many), {"65 phase functions", "the most is 64"});
}

TEST_CASE("faulty media are refused") {
  check_medium_error(number("sigma_t", "-1"), {"sigma_t = -1", "[0, inf)", "per scene unit"});
  check_medium_error("<rgb name=\"sigma_t\" value=\"1 1 -2\"/>", {"sigma_t = -2"});
  check_medium_error(number("albedo", "1.01"), {"albedo = 1.01", "[0, 1]"});
  check_medium_error(number("albedo", "-0.5"), {"albedo = -0.5"});
  check_medium_error(number("scale", "-1"), {"scale = -1"});
  check_medium_error("<phase type=\"hg\">" + number("g", "1") + "</phase>", {"g = 1 ", "(-1, 1)", "mean cosine"});
  check_medium_error("<phase type=\"hg\">" + number("g", "-1.5") + "</phase>", {"g = -1.5"});
  check_medium_error("<phase type=\"sggx\"/>", {"\"sggx\"", "\"isotropic\"", "\"hg\""});
  check_medium_error(number("sigmat", "1"), {"unknown parameter \"sigmat\"", "did you mean \"sigma_t\""});
  check_medium_error("<phase type=\"hg\"/><phase type=\"hg\"/>", {"more than one <phase>"});
}

TEST_CASE("a map of normals may be one normal") {
  const auto map = [](const std::string& texture) {
    return "<shape type=\"rectangle\">\n<bsdf type=\"normalmap\" id=\"map\">" + texture +
           "<bsdf type=\"diffuse\"/></bsdf></shape>";
  };
  const Scene scene = SceneFolder().load(
      map("<texture type=\"rawconstant\" name=\"normalmap\"><vector name=\"value\" value=\"0.6, 0.5, 1\"/></texture>"));
  const Bsdf& bsdf = scene.bsdfs.at(0);
  CHECK(bsdf.values[bsdf.values_called("map", "normalmap").at(0)].value == Rgb{0.6, 0.5, 1});
  SceneFolder().check_error(
      map("<texture type=\"rawconstant\" name=\"normalmap\"><vector name=\"value\" value=\"0.6, 0.5, 2\"/></texture>"),
      3, {"normalmap = 2", "[0, 1]"});
  SceneFolder().check_error(map("<texture type=\"checkerboard\" name=\"normalmap\"/>"), 3,
                            {"bitmap of three channels"});
}
