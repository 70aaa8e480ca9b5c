#include "network/dataset/stored_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <string_view>
#include <utility>

#include "itn/error.h"
#include "runtime/base/fingerprint.h"

namespace itn {
namespace {

constexpr const char* checksum_name = "checksum";

using Texts = std::map<std::string, std::string>;

std::string parameters_text(const Manifest::Image& image) {
  const auto values = [](double one, const std::array<double, 3>* colours) {
    return colours ? fmt::format("[{},{},{}]", (*colours)[0], (*colours)[1], (*colours)[2]) : fmt::format("{}", one);
  };
  return fmt::format(R"({{"sigma_t":{},"albedo":{},"g":{}}})",
                     values(image.sigma_t, image.colours ? &image.colours->sigma_t : nullptr),
                     values(image.albedo, image.colours ? &image.colours->albedo : nullptr), image.g);
}

Texts header_of(const Manifest& set, const Manifest::Image& image) {
  return {{"hash", set.hash},
          {"spp", std::to_string(set.spp)},
          {"seed", std::to_string(image.seed)},
          {"parameters", parameters_text(image)}};
}

Texts header_of(const Manifest& set, const Manifest::Shape& shape) {
  return {{"hash", set.hash}, {"shape", shape.name}};
}

const std::string& file_of(const Manifest::Image& image) { return image.file; }
const std::string& file_of(const Manifest::Shape& shape) { return shape.buffers; }

std::string path_of(const std::string& folder, const std::string& file) {
  return (std::filesystem::path(folder) / file).string();
}

// Checksum over names, texts and values, sorted by name, as OpenEXR sorts the channels.
std::string checksum_of(const ExrImage& content) {
  std::uint64_t sum = fingerprint(fmt::format("{} {}", content.width, content.height));
  for (const auto& [name, value] : content.header)
    if (name != checksum_name) sum = fingerprint(fmt::format("{}={}\n", name, value), sum);
  std::vector<std::pair<std::string, std::size_t>> channels;
  for (std::size_t c = 0; c < content.channels.size(); ++c) channels.emplace_back(content.channels[c], c);
  std::sort(channels.begin(), channels.end());
  for (const auto& [name, c] : channels) {
    sum = fingerprint(name, sum);
    for (std::size_t i = c; i < content.data.size(); i += content.channels.size())
      sum = fingerprint({reinterpret_cast<const char*>(&content.data[i]), sizeof(float)}, sum);
  }
  return fingerprint_text(sum);
}

template <class Item>
void write(const std::string& folder, const Manifest& set, const Item& item, ExrImage content) {
  for (auto& [name, value] : header_of(set, item)) content.header[name] = value;
  content.header[checksum_name] = checksum_of(content);
  write_exr(path_of(folder, file_of(item)), content, Sync::later);
}

enum class Checksum { where_there, needed };

template <class Item>
ExrImage read(const std::string& folder, const Manifest& set, const Item& item, Checksum checksum) {
  const std::string file = path_of(folder, file_of(item));
  ExrImage content = read_exr(file);
  if (content.width != set.size || content.height != set.size)
    throw InputError(
        fmt::format("{}: has {} x {} pixels, need {} x {}", file, content.width, content.height, set.size, set.size));
  for (const auto& [name, value] : header_of(set, item)) {
    const auto found = content.header.find(name);
    if (found != content.header.end() && found->second == value) continue;
    const std::string is = found == content.header.end() ? "none" : found->second;
    if (name == "hash")
      throw InputError(fmt::format("{}: is of another data set (hash {}, need {}); render it again", file, is, value));
    throw InputError(
        fmt::format("{}: is not what the manifest says: {} {}, need {}; remove the file, and itn dataset "
                    "renders it again",
                    file, name, is, value));
  }
  const auto found = content.header.find(checksum_name);
  const bool has = found != content.header.end();
  if (has ? found->second != checksum_of(content) : checksum == Checksum::needed)
    throw InputError(file + ": is damaged, its checksum is wrong; remove the file, and itn dataset renders it again");
  return content;
}

template <class Item>
bool is_whole(const std::string& folder, const Manifest& set, const Item& item) {
  if (!is_there(path_of(folder, file_of(item)))) return false;
  try {
    read(folder, set, item, Checksum::needed);
    return true;
  } catch (const InputError&) {
    return false;
  }
}

}  // namespace

const std::array<const char*, 5> buffer_names{"normal.X", "normal.Y", "normal.Z", "depth", "mask"};

std::vector<std::string> colour_names(const Manifest& set) {
  return set.in_colours ? std::vector<std::string>{"R", "G", "B"} : std::vector<std::string>{"Y"};
}

void write_stored(const std::string& folder, const Manifest& set, const Manifest::Image& image, ExrImage content) {
  write(folder, set, image, std::move(content));
}
void write_stored(const std::string& folder, const Manifest& set, const Manifest::Shape& shape, ExrImage content) {
  write(folder, set, shape, std::move(content));
}

ExrImage read_stored(const std::string& folder, const Manifest& set, const Manifest::Image& image) {
  return read(folder, set, image, Checksum::where_there);
}
ExrImage read_stored(const std::string& folder, const Manifest& set, const Manifest::Shape& shape) {
  return read(folder, set, shape, Checksum::where_there);
}

bool is_stored(const std::string& folder, const Manifest& set, const Manifest::Image& image) {
  return is_whole(folder, set, image);
}
bool is_stored(const std::string& folder, const Manifest& set, const Manifest::Shape& shape) {
  return is_whole(folder, set, shape);
}

}  // namespace itn
