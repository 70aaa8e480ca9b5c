#include "itn/exr.h"

#include <ImfChannelList.h>
#include <ImfCompression.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <ImfVersion.h>
#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/base/parallel.h"
#include "runtime/image/exr_header.h"

namespace itn {
namespace {

// Points OpenEXR at interleaved data whose first pixel is the corner of the data window.
Imf::FrameBuffer frame_buffer(const ExrImage& image, float* data, int x_min, int y_min) {
  const std::size_t pixel = image.channels.size() * sizeof(float), row = pixel * static_cast<std::size_t>(image.width);
  const auto corner = static_cast<std::ptrdiff_t>(pixel) * x_min + static_cast<std::ptrdiff_t>(row) * y_min;
  Imf::FrameBuffer buffer;
  for (std::size_t c = 0; c < image.channels.size(); ++c)
    buffer.insert(image.channels[c], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(data + c) - corner, pixel, row));
  return buffer;
}

void use_every_core() {
  static const bool once = [] {
    Imf::setGlobalThreadCount(static_cast<int>(core_count()));
    return true;
  }();
  (void)once;
}

}  // namespace

int ExrImage::channel(const std::string& name) const {
  const auto found = std::find(channels.begin(), channels.end(), name);
  return found == channels.end() ? -1 : static_cast<int>(found - channels.begin());
}

std::string encode_exr(const std::string& file_name, const ExrImage& image) {
  const std::size_t values =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * image.channels.size();
  if (image.width <= 0 || image.height <= 0 || image.channels.empty() || image.data.size() != values)
    throw std::logic_error("encode_exr: data and size disagree");
  use_every_core();
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  constexpr std::size_t longest_name = 255;
  for (const std::string& name : image.channels)  // OpenEXR would cut it, and lose a channel of the same beginning
    if (name.size() > longest_name)
      throw ResultError(fmt::format("{}: the channel name {} has {} characters; OpenEXR takes {}", file_name, name,
                                    name.size(), longest_name));
  for (const std::string& name : image.channels) header.channels().insert(name, Imf::Channel(Imf::FLOAT));
  for (const auto& [name, value] : image.header) header.insert(name, Imf::StringAttribute(value));
  Imf::StdOSStream memory;
  {
    Imf::OutputFile file(memory, header);
    file.setFrameBuffer(frame_buffer(image, const_cast<float*>(image.data.data()), 0, 0));
    file.writePixels(image.height);
  }
  return memory.str();
}

void write_exr(const std::string& path, const ExrImage& image, Sync sync) {
  write_file(path, encode_exr(path, image), sync);
}

ExrImage read_exr(const std::string& path) {
  const std::string bytes = read_file(path);  // says why when it cannot be read
  if (bytes.size() < 4 || !Imf::isImfMagic(bytes.data()))
    throw InputError(path + ": is no OpenEXR file; the first bytes are wrong");
  check_exr_header(bytes, path);
  use_every_core();
  try {
    Imf::StdISStream memory;
    memory.str(bytes);
    Imf::InputFile file(memory);
    const Imath::Box2i window = file.header().dataWindow();
    ExrImage image;
    image.width = window.max.x - window.min.x + 1;
    image.height = window.max.y - window.min.y + 1;
    image.is_part = window != file.header().displayWindow();
    for (auto c = file.header().channels().begin(); c != file.header().channels().end(); ++c) {
      if (c.channel().xSampling != 1 || c.channel().ySampling != 1)
        throw InputError(path + ": channel " + c.name() + " is subsampled; save it with a sample for each pixel");
      image.channels.emplace_back(c.name());
    }
    for (auto a = file.header().begin(); a != file.header().end(); ++a)
      if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute()))
        image.header[a.name()] = text->value();
    if (!file.isComplete()) throw InputError(path + ": OpenEXR file is incomplete; copy or render it again");
    const std::size_t pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
    image.data.resize(pixels * image.channels.size());
    file.setFrameBuffer(frame_buffer(image, image.data.data(), window.min.x, window.min.y));
    file.readPixels(window.min.y, window.max.y);
    return image;
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    throw InputError(path + ": OpenEXR file is damaged; " + error.what());
  }
}

}  // namespace itn
