#include "runtime/image/tiff.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>

#include "runtime/base/error.h"
#include "runtime/image/image_size.h"

namespace itn {
namespace {

// The file's bytes, and what the library says of them.
struct Memory {
  const std::string& bytes;
  std::uint64_t at = 0;
  std::string complaint = {};
};

tmsize_t read(thandle_t handle, void* to, tmsize_t size) {
  Memory& memory = *static_cast<Memory*>(handle);
  const std::uint64_t left = memory.bytes.size() - std::min<std::uint64_t>(memory.at, memory.bytes.size());
  const std::uint64_t count = std::min(left, static_cast<std::uint64_t>(std::max<tmsize_t>(size, 0)));
  std::memcpy(to, memory.bytes.data() + (count > 0 ? memory.at : 0), count);
  memory.at += count;
  return static_cast<tmsize_t>(count);
}
tmsize_t refuse_to_write(thandle_t, void*, tmsize_t) { return 0; }
toff_t seek(thandle_t handle, toff_t offset, int whence) {
  Memory& memory = *static_cast<Memory*>(handle);
  const std::uint64_t from = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? memory.at : memory.bytes.size();
  return memory.at = from + offset;
}
int close(thandle_t) { return 0; }
toff_t size(thandle_t handle) { return static_cast<Memory*>(handle)->bytes.size(); }

int on_error(TIFF*, void* data, const char* module, const char* format, va_list arguments) {
  std::string& complaint = static_cast<Memory*>(data)->complaint;
  if (complaint.empty()) {
    char text[256];
    std::vsnprintf(text, sizeof text, format, arguments);
    complaint = fmt::format("{}: {}", module ? module : "libtiff", text);
  }
  return 1;
}
int on_warning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

class Tiff {
 public:
  Tiff(const std::string& bytes, const std::string& path) : memory_{bytes}, path_(path) {
    constexpr tmsize_t most_at_once = tmsize_t{1} << 30;
    const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(),
                                                                               TIFFOpenOptionsFree);
    TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), most_at_once);
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), on_error, &memory_);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), on_warning, nullptr);
    // m: the file is not mapped
    tiff_.reset(TIFFClientOpenExt(path.c_str(), "rm", &memory_, read, refuse_to_write, seek, itn::close, itn::size,
                                  nullptr, nullptr, options.get()));
    if (!tiff_) damaged();
  }

  // Of a tag with a default; 0: there is none.
  template <class Number>
  Number tag(std::uint32_t name) const {
    Number value = 0;
    TIFFGetFieldDefaulted(tiff_.get(), name, &value);
    return value;
  }
  TIFF* get() const { return tiff_.get(); }
  [[noreturn]] void damaged() const { throw InputError(path_ + ": TIFF file is damaged; " + memory_.complaint); }
  [[noreturn]] void refuse(const std::string& why) const { throw InputError(path_ + ": TIFF file " + why); }

 private:
  struct Close {
    void operator()(TIFF* tiff) const { TIFFClose(tiff); }
  };
  Memory memory_;
  std::string path_;
  std::unique_ptr<TIFF, Close> tiff_;
};

bool is_known(std::uint16_t compression) {
  return compression == COMPRESSION_NONE || compression == COMPRESSION_LZW ||
         compression == COMPRESSION_ADOBE_DEFLATE || compression == COMPRESSION_DEFLATE ||
         compression == COMPRESSION_PACKBITS || compression == COMPRESSION_JPEG;
}

// Sets everything but the samples.
Samples described(const Tiff& tiff, const std::string& bytes, const std::string& path) {
  const auto width = tiff.tag<std::uint32_t>(TIFFTAG_IMAGEWIDTH), height = tiff.tag<std::uint32_t>(TIFFTAG_IMAGELENGTH);
  constexpr std::uint64_t most_pixels_of_byte = 4096;  // by LZW; what else is read stays below
  check_image_size(width, height, most_pixels_of_byte, bytes.size(), path);
  const auto bits = tiff.tag<std::uint16_t>(TIFFTAG_BITSPERSAMPLE),
             channels = tiff.tag<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL),
             format = tiff.tag<std::uint16_t>(TIFFTAG_SAMPLEFORMAT),
             compression = tiff.tag<std::uint16_t>(TIFFTAG_COMPRESSION),
             photometric = tiff.tag<std::uint16_t>(TIFFTAG_PHOTOMETRIC);
  if ((bits != 8 && bits != 16) || format != SAMPLEFORMAT_UINT)
    tiff.refuse(
        fmt::format("has samples of {} bits (kind {}); need whole numbers of 8 or 16 bits: convert it, those of "
                    "floating point to OpenEXR",
                    bits, format));
  const bool in_jpeg = photometric == PHOTOMETRIC_YCBCR && compression == COMPRESSION_JPEG;
  if (photometric != PHOTOMETRIC_MINISBLACK && photometric != PHOTOMETRIC_RGB && !in_jpeg)
    tiff.refuse(fmt::format("has colours of the kind {}; need grey or RGB: convert it", photometric));
  const int colours = photometric == PHOTOMETRIC_MINISBLACK ? 1 : 3;
  if (channels != colours && channels != colours + 1)
    tiff.refuse(fmt::format("has {} samples a pixel, need {}, and one more where it has alpha", channels, colours));
  if (channels == colours + 1) {
    std::uint16_t extra = 0;
    std::uint16_t* kinds = nullptr;
    TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_EXTRASAMPLES, &extra, &kinds);
    if (extra > 0 && kinds[0] == EXTRASAMPLE_ASSOCALPHA)
      tiff.refuse("has alpha multiplied into the colours; save it with straight (unassociated) alpha");
  }
  if (!is_known(compression))
    tiff.refuse(fmt::format("is compressed by method {}; need none, LZW, Deflate, PackBits or JPEG", compression));
  if (TIFFIsTiled(tiff.get()) || (channels > 1 && tiff.tag<std::uint16_t>(TIFFTAG_PLANARCONFIG) != PLANARCONFIG_CONTIG))
    tiff.refuse("is tiled, or has a plane for each colour; save it in strips, colours together");
  if (in_jpeg) TIFFSetField(tiff.get(), TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
  const auto orientation = tiff.tag<std::uint16_t>(TIFFTAG_ORIENTATION);
  Samples result{static_cast<int>(width), static_cast<int>(height), channels, bits, true, 1, {}};
  if (orientation >= 1 && orientation <= 8) result.orientation = orientation;
  return result;
}

}  // namespace

bool is_tiff(const std::string& bytes) {
  return bytes.starts_with(std::string("II*\0", 4)) || bytes.starts_with(std::string("MM\0*", 4)) ||
         bytes.starts_with(std::string("II+\0", 4)) || bytes.starts_with(std::string("MM\0+", 4));
}

Samples read_tiff(const std::string& bytes, const std::string& path) {
  const Tiff tiff(bytes, path);
  Samples result = described(tiff, bytes, path);
  const std::size_t row = static_cast<std::size_t>(result.width) * static_cast<std::size_t>(result.channels);
  const std::size_t row_bytes = row * static_cast<std::size_t>(result.bits) / 8;
  if (static_cast<std::uint64_t>(TIFFScanlineSize64(tiff.get())) != row_bytes) tiff.damaged();
  result.data.reserve(row * static_cast<std::size_t>(result.height));
  std::vector<unsigned char> line(row_bytes);
  for (int y = 0; y < result.height; ++y) {
    if (TIFFReadScanline(tiff.get(), line.data(), static_cast<std::uint32_t>(y), 0) != 1) tiff.damaged();
    for (std::size_t i = 0; i < row; ++i) {
      std::uint16_t value = 0;
      if (result.bits == 16)
        std::memcpy(&value, &line[2 * i], 2);  // in this machine's byte order
      else
        value = static_cast<std::uint16_t>(257 * line[i]);
      result.data.push_back(value);
    }
  }
  return result;
}

}  // namespace itn
