#include "runtime/base/zlib_check.h"

#include <algorithm>
#include <array>
#include <limits>
#include <new>

namespace itn {

ZlibCheck::ZlibCheck(std::uint64_t most) : most_(most) {
  if (inflateInit(&stream_) != Z_OK) throw std::bad_alloc();
}

ZlibCheck::~ZlibCheck() { inflateEnd(&stream_); }

void ZlibCheck::add(std::string_view bytes) {
  std::array<Bytef, 1 << 16> nowhere;
  while (!bytes.empty() && state_ == Z_OK && stream_.total_out <= most_) {
    const std::size_t part = std::min<std::size_t>(bytes.size(), std::numeric_limits<uInt>::max());
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream_.avail_in = static_cast<uInt>(part);
    bool full = true;
    while (state_ == Z_OK && full && stream_.total_out <= most_) {
      stream_.next_out = nowhere.data();
      stream_.avail_out = static_cast<uInt>(nowhere.size());
      state_ = inflate(&stream_, Z_NO_FLUSH);
      if (state_ == Z_BUF_ERROR) state_ = Z_OK;  // it wants more
      full = stream_.avail_out == 0;
    }
    bytes.remove_prefix(part);
  }
}

std::string ZlibCheck::fault() const {
  if (stream_.total_out > most_) return "the compressed data hold more than they should";
  if (state_ == Z_STREAM_END) return "";
  if (state_ == Z_OK) return "the compressed data end early";
  return std::string("the compressed data are damaged: ") + (stream_.msg ? stream_.msg : "no zlib stream");
}

}  // namespace itn
