#include "runtime/image/stb_reader.h"

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_NO_STDIO
#define STBI_ONLY_BMP
#define STBI_ONLY_HDR
#define STBI_ONLY_PNG
#define STBI_ONLY_PNM
#define STBI_ONLY_TGA
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>

#include "itn/error.h"

namespace itn {
namespace {

const stbi_uc* data_of(const std::string& bytes) { return reinterpret_cast<const stbi_uc*>(bytes.data()); }

int size_of(const std::string& bytes) {
  constexpr std::size_t most = std::numeric_limits<int>::max();
  return static_cast<int>(std::min(bytes.size(), most));
}

// Gives the library a file's bytes, and notes where it needs more than there are.
class Source {
 public:
  explicit Source(const std::string& bytes) : bytes_(bytes) {}

  static const stbi_io_callbacks* callbacks() {
    static const stbi_io_callbacks all{
        [](void* source, char* to, int size) { return static_cast<Source*>(source)->read(to, size); },
        [](void* source, int count) { static_cast<Source*>(source)->skip(count); },
        [](void* source) { return static_cast<int>(static_cast<Source*>(source)->left() == 0); }};
    return &all;
  }
  bool ended_early() const { return ended_early_; }

 private:
  std::size_t left() const { return bytes_.size() - at_; }
  void skip(int count) { at_ += std::min(left(), static_cast<std::size_t>(std::max(count, 0))); }
  int read(char* to, int size) {
    const std::size_t count = std::min(left(), static_cast<std::size_t>(size));
    std::memcpy(to, bytes_.data() + at_, count);
    at_ += count;
    // The first call fills the library's own buffer. Later ones that do come when it is empty and a byte is needed, and
    // take as many as there are; all others need every byte.
    if (!buffer_) buffer_ = to;
    if (to == buffer_ ? count == 0 : count < static_cast<std::size_t>(size)) ended_early_ = true;
    return static_cast<int>(count);
  }

  const std::string& bytes_;
  std::size_t at_ = 0;
  const char* buffer_ = nullptr;
  bool ended_early_ = false;
};

// load: of the library's functions, with the last argument.
template <class Number, class Load>
StbImage<Number> loaded(const std::string& bytes, const std::string& path, const Load& load, int wanted) {
  Source source(bytes);
  StbImage<Number> image;
  const std::unique_ptr<Number, void (*)(void*)> numbers(
      load(Source::callbacks(), &source, &image.width, &image.height, &image.channels, wanted), stbi_image_free);
  if (source.ended_early()) throw InputError(path + ": image is damaged; it ends early: copy or save it again");
  if (!numbers) throw InputError(path + ": image is damaged; " + stbi_failure_reason() + ": copy or save it again");
  if (wanted > 0) image.channels = wanted;
  image.data.assign(numbers.get(), numbers.get() + static_cast<std::size_t>(image.width) *
                                                       static_cast<std::size_t>(image.height) *
                                                       static_cast<std::size_t>(image.channels));
  return image;
}

}  // namespace

std::optional<StbImage<std::uint16_t>> stb_size(const std::string& bytes) {
  StbImage<std::uint16_t> image;
  if (!stbi_info_from_memory(data_of(bytes), size_of(bytes), &image.width, &image.height, &image.channels)) return {};
  return image;
}

std::string stb_failure() {
  const char* reason = stbi_failure_reason();
  return reason ? reason : "unknown";
}

bool stb_is_deep(const std::string& bytes) { return stbi_is_16_bit_from_memory(data_of(bytes), size_of(bytes)) != 0; }
bool stb_is_hdr(const std::string& bytes) { return stbi_is_hdr_from_memory(data_of(bytes), size_of(bytes)) != 0; }

StbImage<std::uint16_t> stb_samples(const std::string& bytes, const std::string& path) {
  return loaded<stbi_us>(bytes, path, stbi_load_16_from_callbacks, 0);
}

StbImage<float> stb_radiance(const std::string& bytes, const std::string& path) {
  constexpr int colours = 3;
  return loaded<float>(bytes, path, stbi_loadf_from_callbacks, colours);
}

}  // namespace itn
