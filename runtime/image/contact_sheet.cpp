#include "runtime/image/contact_sheet.h"

#include <algorithm>

#include "runtime/image/png.h"
#include "runtime/image/preview.h"

namespace itn {

ContactSheet::ContactSheet(int count, int columns, int tile, int enlarged)
    : columns_(columns),
      tile_(tile),
      enlarged_(enlarged),
      width_(std::min(count, columns) * tile * enlarged),
      height_((count + columns - 1) / columns * tile * enlarged),
      data_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 3, 0.0F) {}

void ContactSheet::add(const std::vector<float>& image, int channels) {
  const int side = tile_ * enlarged_, left = count_ % columns_ * side, top = count_ / columns_ * side;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      for (int c = 0; c < 3; ++c) {
        const int from = (y / enlarged_ * tile_ + x / enlarged_) * channels + std::min(c, channels - 1);
        const std::size_t to = (static_cast<std::size_t>(top + y) * static_cast<std::size_t>(width_) +
                                static_cast<std::size_t>(left + x)) *
                                   3 +
                               static_cast<std::size_t>(c);
        data_[to] = image[static_cast<std::size_t>(from)];
      }
  ++count_;
}

void ContactSheet::write(const std::string& file) const { write_png(file, width_, height_, tone_mapped(data_, 3)); }

}  // namespace itn
