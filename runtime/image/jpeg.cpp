#include "runtime/image/jpeg.h"

#include <fmt/format.h>
#include <jpeglib.h>
// The codes of its messages; behind jpeglib.h.
#include <jerror.h>

#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string_view>

#include "itn/error.h"
#include "runtime/image/exif.h"
#include "runtime/image/image_size.h"

namespace itn {
namespace {

// The library's handle; its errors jump back, over nothing that has a destructor.
struct Decoder {
  jpeg_decompress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg_progress_mgr progress{};
  std::jmp_buf failed{};
  char complaint[JMSG_LENGTH_MAX] = "";

  Decoder();
  ~Decoder() { jpeg_destroy_decompress(&jpeg); }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
};

[[noreturn]] void fail(j_common_ptr jpeg) {
  auto* decoder = static_cast<Decoder*>(jpeg->client_data);
  jpeg->err->format_message(jpeg, decoder->complaint);
  std::longjmp(decoder->failed, 1);
}

// Warnings, below 0, are about the picture: bytes are missing or wrong, and what is returned is a guess. But for one,
// about the version in a JFIF marker, which says nothing of it. What is not below 0 is a remark.
void on_message(j_common_ptr jpeg, int level) {
  if (level < 0 && jpeg->err->msg_code != JWRN_JFIF_MAJOR) fail(jpeg);
}

void limit_scans(j_common_ptr jpeg) {
  constexpr int most_scans = 200;  // cameras and editors make about ten
  if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number <= most_scans) return;
  auto* decoder = static_cast<Decoder*>(jpeg->client_data);
  std::snprintf(decoder->complaint, sizeof decoder->complaint, "more than %d scans", most_scans);
  std::longjmp(decoder->failed, 1);
}

Decoder::Decoder() {
  jpeg.err = jpeg_std_error(&errors);
  jpeg.client_data = this;
  errors.error_exit = fail;
  errors.emit_message = on_message;
  errors.output_message = [](j_common_ptr) {};
  progress.progress_monitor = limit_scans;
}

constexpr int exif_marker = JPEG_APP0 + 1;

// False: decoder.complaint says why. The header's answers are in decoder.jpeg.
bool read_header(Decoder& decoder, const std::string& bytes) {
  if (setjmp(decoder.failed) != 0) return false;
  jpeg_create_decompress(&decoder.jpeg);
  decoder.jpeg.progress = &decoder.progress;
  jpeg_mem_src(&decoder.jpeg, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  constexpr unsigned longest = 0xffff;
  jpeg_save_markers(&decoder.jpeg, exif_marker, longest);
  jpeg_read_header(&decoder.jpeg, TRUE);
  return true;
}

// pixels: of the whole picture, as the header says.
bool read_pixels(Decoder& decoder, unsigned char* pixels) {
  if (setjmp(decoder.failed) != 0) return false;
  jpeg_decompress_struct& jpeg = decoder.jpeg;
  jpeg.out_color_space = jpeg.num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_start_decompress(&jpeg);
  while (jpeg.output_scanline < jpeg.output_height) {
    unsigned char* row = pixels + static_cast<std::size_t>(jpeg.output_scanline) * jpeg.output_width *
                                      static_cast<std::size_t>(jpeg.output_components);
    jpeg_read_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_decompress(&jpeg);
  return true;
}

// 1 where there is no EXIF block.
int orientation_of(const jpeg_decompress_struct& jpeg) {
  for (jpeg_saved_marker_ptr marker = jpeg.marker_list; marker; marker = marker->next) {
    const std::string_view bytes(reinterpret_cast<const char*>(marker->data), marker->data_length);
    if (marker->marker == exif_marker && bytes.starts_with(std::string_view("Exif\0\0", 6)))
      return exif_orientation(bytes);
  }
  return 1;
}

}  // namespace

Samples read_jpeg(const std::string& bytes, const std::string& path) {
  Decoder decoder;
  const auto damaged = [&] { return InputError(fmt::format("{}: JPEG file is damaged; {}", path, decoder.complaint)); };
  if (!read_header(decoder, bytes)) throw damaged();
  const jpeg_decompress_struct& jpeg = decoder.jpeg;
  constexpr std::uint64_t most_pixels_of_byte = 8 * 1100;  // as of other formats; blocks of 64 take 2 bits or more
  check_image_size(jpeg.image_width, jpeg.image_height, most_pixels_of_byte, bytes.size(), path);
  if (jpeg.num_components != 1 && jpeg.num_components != 3)
    throw InputError(
        fmt::format("{}: JPEG file has {} colours; need grey or RGB: convert it", path, jpeg.num_components));
  Samples result{static_cast<int>(jpeg.image_width),
                 static_cast<int>(jpeg.image_height),
                 jpeg.num_components,
                 8,
                 false,
                 orientation_of(jpeg),
                 {}};
  std::vector<unsigned char> pixels(std::size_t{jpeg.image_width} * jpeg.image_height *
                                    static_cast<std::size_t>(jpeg.num_components));
  if (!read_pixels(decoder, pixels.data())) throw damaged();
  result.data.reserve(pixels.size());
  for (const unsigned char sample : pixels) result.data.push_back(static_cast<std::uint16_t>(257 * sample));
  return result;
}

}  // namespace itn
