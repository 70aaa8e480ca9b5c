// Files of the bench's scenes besides XML: meshes as PLY, images as OpenEXR. Each throws ResultError when
// the file cannot be written.
#pragma once
#include <string>

namespace itn {

// A closed tube around the (2, 3) torus knot, some 2.8 scene units wide, around the origin: 65,536 triangles.
void write_knot(const std::string& path);

// A sphere with rounded spikes that stands on z = 0, its longest side 1 scene unit: 65,712 triangles.
void write_star(const std::string& path);

// 16 x 16 light and dark tiles on size x size pixels, size a multiple of 16.
void write_tiles(const std::string& path, int size);

// A sky that darkens towards the horizon, with a window a hundred times as bright: 256 x 128 pixels of latitude and
// longitude.
void write_window_sky(const std::string& path);

// Densities from 0 to 1 in the unit cube as Mitsuba's .vol: 256 x 256 x 256 voxels, 64 MiB. A heap of cumulus, 40 % of
// the voxels empty, and a column of smoke that widens upwards, 80 % empty.
void write_cloud(const std::string& path);
void write_plume(const std::string& path);

}  // namespace itn
