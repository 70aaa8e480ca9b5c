// Many small pictures side by side, row by row, in one PNG.
#pragma once
#include <string>
#include <vector>

namespace itn {

class ContactSheet {
 public:
  // For `count` square images of `tile` pixels a side; each pixel is drawn `enlarged` times as wide and high.
  ContactSheet(int count, int columns, int tile, int enlarged = 1);

  // The next image: row-major, 1 or 3 linear channels.
  void add(const std::vector<float>& image, int channels);

  // Tone-mapped together: brighter images are brighter. Throws ResultError.
  void write(const std::string& file) const;

 private:
  int columns_, tile_, enlarged_, width_, height_, count_ = 0;
  std::vector<float> data_;  // rgb
};

}  // namespace itn
