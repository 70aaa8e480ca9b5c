// Images of a data set are what the manifest says, bit for bit.
#include "network/dataset/stored_image.h"

#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "itn/error.h"
#include "itn/file.h"
#include "network/training/dataset_examples.h"
#include "tests/support/made_up_dataset.h"
#include "tests/support/temporary_folder.h"

using namespace itn;

namespace {

void train_on(const MadeUpDataset& set) {
  const std::atomic<bool> cancel = false;
  read_images(set.folder, set.manifest, Manifest::Split::train, {.shapes = true}, cancel);
}

}  // namespace

TEST_CASE("two images of a data set that were exchanged are neither learnt from nor taken as rendered") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 2, 1);
  const Manifest::Image &a = set.manifest.images[0], &b = set.manifest.images[1];
  train_on(set);
  CHECK(is_stored(set.folder, set.manifest, a));
  std::filesystem::rename(set.path(a.file), set.path("x"));
  std::filesystem::rename(set.path(b.file), set.path(a.file));
  std::filesystem::rename(set.path("x"), set.path(b.file));
  CHECK_FALSE(is_stored(set.folder, set.manifest, a));
  CHECK_FALSE(is_stored(set.folder, set.manifest, b));
  CHECK_THROWS_WITH(train_on(set), Catch::Contains("is not what the manifest says") && Catch::Contains("parameters"));
}

TEST_CASE("buffers of another shape are refused") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 2, 1);
  std::filesystem::copy_file(set.path(set.manifest.shapes[1].buffers), set.path(set.manifest.shapes[0].buffers),
                             std::filesystem::copy_options::overwrite_existing);
  CHECK_FALSE(is_stored(set.folder, set.manifest, set.manifest.shapes[0]));
  CHECK_THROWS_WITH(train_on(set), Catch::Contains("shape"));
}

TEST_CASE("a value that changed by a bit is seen") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 2, 1);
  const Manifest::Image& image = set.manifest.images[0];
  ExrImage content = read_exr(set.path(image.file));
  content.data[5] = std::nextafter(content.data[5], 100.0F);
  write_exr(set.path(image.file), content);
  CHECK_FALSE(is_stored(set.folder, set.manifest, image));
  CHECK_THROWS_WITH(train_on(set), Catch::Contains("checksum is wrong"));
}

TEST_CASE("images from before there were checksums are learnt from, and rendered again where a set is gone on with") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 2, 1);
  const Manifest::Image& image = set.manifest.images[0];
  ExrImage content = read_exr(set.path(image.file));
  content.header.erase("checksum");
  write_exr(set.path(image.file), content);
  train_on(set);
  CHECK_FALSE(is_stored(set.folder, set.manifest, image));
}

TEST_CASE("an image of depth alone with the set's hash is no image of the set") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 2, 1);
  const Manifest::Image& image = set.manifest.images[0];
  ExrImage content{set.manifest.size, set.manifest.size, {"Z"}, {}, read_exr(set.path(image.file)).header};
  content.data.assign(static_cast<std::size_t>(content.width * content.height), 1.0F);
  write_exr(set.path(image.file), content);
  CHECK_FALSE(is_stored(set.folder, set.manifest, image));
  CHECK_THROWS_AS(train_on(set), InputError);
}
