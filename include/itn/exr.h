// OpenEXR files: any number of named float channels, linear, scanline 0 on top, text attributes in the header.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "itn/file.h"

namespace itn {

struct ExrImage {
  int width = 0, height = 0;
  std::vector<std::string> channels;
  std::vector<float> data;  // row-major; the channels of a pixel follow each other in the order of `channels`
  std::map<std::string, std::string> header;
  bool is_part = false;  // of what is shown: its data window is not its display window

  // Index of a channel in `channels`; -1: there is none.
  int channel(const std::string& name) const;
};

// Float32, scanlines, ZIP. file_name: for messages.
std::string encode_exr(const std::string& file_name, const ExrImage& image);

// The same as a file. Written whole or not at all (see file.h): ResultError otherwise.
void write_exr(const std::string& path, const ExrImage& image, Sync sync = Sync::now);

// Do a file's bytes begin as those of OpenEXR do?
inline bool is_exr(const std::string& bytes) { return bytes.starts_with("\x76\x2f\x31\x01"); }

// Every channel (half, float and uint become float) and text attribute of the first part.
// Throws InputError with the file's name: missing, no OpenEXR file, truncated, subsampled channels.
ExrImage read_exr(const std::string& path);

}  // namespace itn
