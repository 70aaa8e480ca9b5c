#include "runtime/scene/volume/surface_volume.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/base/parallel.h"
#include "runtime/scene/mesh/nearest_point.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

std::size_t wrapped(Texture::Wrap wrap, double place, int size) {
  const auto i = static_cast<long>(std::floor(place)), n = static_cast<long>(size);
  if (wrap == Texture::Wrap::clamp) return static_cast<std::size_t>(std::clamp(i, 0L, n - 1));
  const long period = wrap == Texture::Wrap::mirror ? 2 * n : n, m = (i % period + period) % period;
  return static_cast<std::size_t>(m < n ? m : period - 1 - m);
}

// Value of a bitmap at texture coordinates (kernels/model/texture/bitmap.h), one for each of its channels.
void bitmap_value(const Texture& picture, const Vec2& uv, float* value) {
  const Bitmap& bitmap = *picture.bitmap;
  const auto& m = picture.to_uv;
  const double x = (m[0] * uv[0] + m[1] * uv[1] + m[2]) * bitmap.width,
               y = (m[3] * uv[0] + m[4] * uv[1] + m[5]) * bitmap.height, half = picture.nearest ? 0 : 0.5;
  const double right = picture.nearest ? 0 : x - half - std::floor(x - half),
               down = picture.nearest ? 0 : y - half - std::floor(y - half);
  const auto channels = static_cast<std::size_t>(bitmap.channels);
  for (std::size_t c = 0; c < channels; ++c) {
    double sum = 0;
    for (int k = 0; k < 4; ++k) {
      const double weight = (k & 1 ? right : 1 - right) * (k >> 1 ? down : 1 - down);
      const std::size_t row = wrapped(picture.wrap, y - half + (k >> 1), bitmap.height),
                        column = wrapped(picture.wrap, x - half + (k & 1), bitmap.width);
      const std::size_t at = (row * static_cast<std::size_t>(bitmap.width) + column) * channels + c;
      sum += weight * static_cast<double>(bitmap.data[at]);
    }
    value[c] = static_cast<float>(sum);
  }
}

}  // namespace

Volume surface_volume(const Mesh& mesh, const Texture& picture, int resolution) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Vec3 low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity};
  for (const auto& p : mesh.position)
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], static_cast<double>(p[a]));
      high[a] = std::max(high[a], static_cast<double>(p[a]));
    }
  const Vec3 extent = high - low, middle = 0.5 * (low + high);
  const double edge = *std::max_element(extent.begin(), extent.end()) / resolution;
  std::array<int, 3> size{};
  Vec3 box{};
  for (std::size_t a = 0; a < 3; ++a) {
    size[a] = std::clamp(static_cast<int>(std::ceil(extent[a] / edge - 1e-9)), 1, resolution);
    box[a] = size[a] * edge;
  }
  const Vec3 corner = middle - 0.5 * box;
  auto grid = std::make_shared<VoxelGrid>();
  grid->width = size[0];
  grid->height = size[1];
  grid->depth = size[2];
  grid->channels = picture.bitmap->channels;
  const auto width = static_cast<std::size_t>(size[0]), height = static_cast<std::size_t>(size[1]),
             rows = height * static_cast<std::size_t>(size[2]), channels = static_cast<std::size_t>(grid->channels);
  grid->data.resize(width * rows * channels);
  const NearestPoint nearest(mesh);
  parallel_for(rows, [&](std::size_t row) {
    const std::size_t y = row % height, z = row / height;
    for (std::size_t x = 0; x < width; ++x) {
      const Vec3 voxel{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
      const NearestPoint::Place place = nearest(corner + edge * (voxel + Vec3{0.5, 0.5, 0.5}));
      const auto& t = mesh.triangle[place.triangle];
      Vec2 uv{};
      for (std::size_t k = 0; k < 2; ++k)
        uv[k] = (1 - place.b - place.c) * static_cast<double>(mesh.texcoord[t[0]][k]) +
                place.b * static_cast<double>(mesh.texcoord[t[1]][k]) +
                place.c * static_cast<double>(mesh.texcoord[t[2]][k]);
      bitmap_value(picture, uv, grid->data.data() + (row * width + x) * channels);
    }
  });
  Volume volume;
  volume.to_world = translate(corner) * scale(box);
  volume.grid = std::move(grid);
  return volume;
}

}  // namespace itn
