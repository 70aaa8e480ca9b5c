// Output files for their owner alone.
#pragma once
#include <string>
#include <string_view>

namespace itn {

// As write_file() (file.h), but a new file is one that only its owner may read, whatever the umask: it holds a secret.
void write_private_file(const std::string& path, std::string_view bytes);

}  // namespace itn
