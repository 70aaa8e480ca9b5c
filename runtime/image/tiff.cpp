#include "runtime/image/tiff.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>

#include "itn/error.h"
#include "runtime/base/zlib_check.h"
#include "runtime/image/image_size.h"

namespace itn {
namespace {

// The file's bytes, and what the library says of them.
struct Memory {
  const std::string& bytes;
  std::uint64_t at = 0;
  bool decoding = false;       // its pixels; else its tags
  std::string complaint = {};  // the first error, which says why the library gives up where it does
  std::string doubt = {};      // the first message, warnings too, by which the pixels are a guess
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

// Is it the pixels that a message is about? While they are decoded: unless it says that more is there than is needed,
// or that their JPEG is of a kind that readers need not take. Before, while tags are read: where it names one without
// which pixels cannot be placed or decoded. Unknown tags, those in another order, and broken ones that say who made a
// picture, when, where and with what, are none of these.
bool is_about_pixels(const std::string& message, bool decoding) {
  constexpr std::array harmless{"JPEG strip size exceeds expected dimensions", "is encoded with progressive mode"};
  constexpr std::array tags{"BitsPerSample",       "Compression",     "ExtraSamples",
                            "FillOrder",           "ImageLength",     "ImageWidth",
                            "JPEGTables",          "Orientation",     "PhotometricInterpretation",
                            "PlanarConfiguration", "Predictor",       "RowsPerStrip",
                            "SampleFormat",        "SamplesPerPixel", "StripByteCounts",
                            "StripOffsets",        "YCbCrSubsampling"};
  const auto has = [&](const std::string& text) { return message.find(text) != std::string::npos; };
  if (decoding) return std::none_of(harmless.begin(), harmless.end(), has);
  return std::any_of(tags.begin(), tags.end(), [&](const std::string& tag) { return has('"' + tag + '"'); });
}

std::string words(const char* module, const char* format, va_list arguments) {
  char text[256];
  std::vsnprintf(text, sizeof text, format, arguments);
  return fmt::format("{}: {}", module ? module : "libtiff", text);
}

// 1: the message goes nowhere else.
int on_warning(TIFF*, void* data, const char* module, const char* format, va_list arguments) {
  Memory& memory = *static_cast<Memory*>(data);
  const std::string message = words(module, format, arguments);
  if (memory.doubt.empty() && is_about_pixels(message, memory.decoding)) memory.doubt = message;
  return 1;
}

int on_error(TIFF* tiff, void* data, const char* module, const char* format, va_list arguments) {
  Memory& memory = *static_cast<Memory*>(data);
  va_list again;
  va_copy(again, arguments);
  if (memory.complaint.empty()) memory.complaint = words(module, format, again);
  va_end(again);
  return on_warning(tiff, data, module, format, arguments);
}

class Tiff {
 public:
  Tiff(const std::string& bytes, const std::string& path) : memory_{bytes}, path_(path) {
    constexpr tmsize_t most_at_once = tmsize_t{1} << 30;
    const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(),
                                                                               TIFFOpenOptionsFree);
    TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), most_at_once);
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), on_error, &memory_);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), on_warning, &memory_);
    // m: the file is not mapped
    tiff_.reset(TIFFClientOpenExt(path.c_str(), "rm", &memory_, read, refuse_to_write, seek, itn::close, itn::size,
                                  nullptr, nullptr, options.get()));
    if (!tiff_) damaged();
  }

  // Value of a tag that has a default; 0: there is none.
  template <class Number>
  Number tag(std::uint32_t name) const {
    Number value = 0;
    TIFFGetFieldDefaulted(tiff_.get(), name, &value);
    return value;
  }
  TIFF* get() const { return tiff_.get(); }
  // From here on the library decodes pixels.
  void decode() { memory_.decoding = true; }
  std::uint64_t file_size() const { return memory_.bytes.size(); }
  bool doubtful() const { return !memory_.doubt.empty(); }
  [[noreturn]] void damaged(const std::string& what = "") const {
    const std::string& why = !what.empty() ? what : memory_.doubt.empty() ? memory_.complaint : memory_.doubt;
    throw InputError(path_ + ": TIFF file is damaged; " + why + ": copy or save it again");
  }
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

// Checks the checksums of deflate, which the library ignores where it reads row by row.
void check_deflated(const Tiff& tiff) {
  for (std::uint32_t strip = 0; strip < TIFFNumberOfStrips(tiff.get()); ++strip) {
    const std::uint64_t size = TIFFRawStripSize64(tiff.get(), strip);
    std::string compressed(std::min(size, tiff.file_size()), '\0');
    const tmsize_t there =
        TIFFReadRawStrip(tiff.get(), strip, compressed.data(), static_cast<tmsize_t>(compressed.size()));
    if (there < 0 || tiff.doubtful()) tiff.damaged();
    if (tiff.tag<std::uint16_t>(TIFFTAG_FILLORDER) == FILLORDER_LSB2MSB)
      TIFFReverseBits(reinterpret_cast<std::uint8_t*>(compressed.data()), there);
    constexpr std::uint64_t padding = 1 << 16;
    ZlibCheck check(TIFFStripSize64(tiff.get()) + padding);
    check.add({compressed.data(), static_cast<std::size_t>(there)});
    if (const std::string fault = check.fault(); !fault.empty())
      tiff.damaged(fmt::format("strip {}: {}", strip, fault));
  }
}

}  // namespace

Samples read_tiff(const std::string& bytes, const std::string& path) {
  Tiff tiff(bytes, path);
  Samples result = described(tiff, bytes, path);
  tiff.decode();
  const auto compression = tiff.tag<std::uint16_t>(TIFFTAG_COMPRESSION);
  if (compression == COMPRESSION_ADOBE_DEFLATE || compression == COMPRESSION_DEFLATE) check_deflated(tiff);
  const std::size_t row = static_cast<std::size_t>(result.width) * static_cast<std::size_t>(result.channels);
  const std::size_t row_bytes = row * static_cast<std::size_t>(result.bits) / 8;
  if (static_cast<std::uint64_t>(TIFFScanlineSize64(tiff.get())) != row_bytes) tiff.damaged();
  result.data.reserve(row * static_cast<std::size_t>(result.height));
  std::vector<unsigned char> line(row_bytes);
  for (int y = 0; y < result.height; ++y) {
    if (TIFFReadScanline(tiff.get(), line.data(), static_cast<std::uint32_t>(y), 0) != 1 || tiff.doubtful())
      tiff.damaged();
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
