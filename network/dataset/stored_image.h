// The images and shape buffers of a data set: each file names its content, and has a checksum.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "itn/exr.h"
#include "network/dataset/manifest.h"

namespace itn {

// Channels of the images' light: Y, or R, G and B. Standard errors are stderr.Y and so on, the flash's light flash.Y,
// flash.stderr.Y.
std::vector<std::string> colour_names(const Manifest& set);

// The shape as the camera sees it.
extern const std::array<const char*, 5> buffer_names;

// Adds to the header of `content` the entry of the manifest and a checksum over header and values, and writes it.
// Sync::later: sync_folder() follows.
void write_stored(const std::string& folder, const Manifest& set, const Manifest::Image& image, ExrImage content);
void write_stored(const std::string& folder, const Manifest& set, const Manifest::Shape& shape, ExrImage content);

// Throws InputError: the file is not there, damaged, of another set, or has another content than the manifest says; of
// sets from before there were checksums, those are not compared.
ExrImage read_stored(const std::string& folder, const Manifest& set, const Manifest::Image& image);
ExrImage read_stored(const std::string& folder, const Manifest& set, const Manifest::Shape& shape);

// Is the file there as write_stored() would write it?
bool is_stored(const std::string& folder, const Manifest& set, const Manifest::Image& image);
bool is_stored(const std::string& folder, const Manifest& set, const Manifest::Shape& shape);

}  // namespace itn
