// Is a zlib stream (RFC 1950) whole? For readers that stop at the last number they need, and never see its checksum.
#pragma once
#include <zlib.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace itn {

class ZlibCheck {
 public:
  // most: bytes that the stream may expand to; more are an error, too. Throws std::bad_alloc.
  explicit ZlibCheck(std::uint64_t most);
  ~ZlibCheck();
  ZlibCheck(const ZlibCheck&) = delete;
  ZlibCheck& operator=(const ZlibCheck&) = delete;

  // The stream's next bytes. Bytes behind its end are ignored.
  void add(std::string_view bytes);
  // The error in what has been added, as if nothing followed; empty: the stream is whole.
  std::string fault() const;

 private:
  z_stream stream_{};
  std::uint64_t most_;
  int state_ = Z_OK;
};

}  // namespace itn
