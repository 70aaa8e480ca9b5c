// The text of the kernels, embedded at build time (or read from ITN_KERNEL_DIR while developing).
#pragma once
#include <map>
#include <string>

namespace itn {

// Path below kernels/ -> text.
using KernelFiles = std::map<std::string, std::string>;

// kernels/<path> with every #include "..." (relative to kernels/) replaced by the file's text, each file once (so never
// inside an #if), with #line directives so that build logs name the right file. Files made at run time, such as printed
// derivatives, come in `generated` and go before the others. Throws std::logic_error for an unknown path.
std::string kernel_source(const std::string& path, const KernelFiles& generated = {});

// A compiler's log about such a text, with the file and its line wherever the log counts the lines of the whole text:
// NVIDIA's compiler writes "<kernel>:3" and pays no heed to #line.
std::string with_kernel_files(const std::string& log, const std::string& source);

}  // namespace itn
