// Checks an OpenEXR file's header before the library takes memory for what it promises.
#pragma once
#include <string>
#include <string_view>

namespace itn {

// Throws InputError that names the file: attributes longer than the file, more pixels, channels or chunks than its
// bytes can hold, more than is read at all.
void check_exr_header(std::string_view bytes, const std::string& file);

}  // namespace itn
