// Safetensors files (huggingface.co/docs/safetensors): named arrays and text, which Python's `safetensors` reads too.
//
//   8 bytes: length of the header, little-endian; the header: JSON, filled up with spaces to a multiple of 8 bytes;
//   then the arrays, little-endian, row-major, one after the other without gaps.
//
// An array x of type I8 stands for its whole numbers times x.scale, an F32 array of one number for each row of x, that
// is for each index along its first side. Whoever reads such a file sees neither, but the product.
#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "itn/tensor.h"

namespace itn {

// F32; or I8, each row by a scale of its own, but for arrays of one row or one side, which are F32.
enum class Precision { single, byte };

struct Safetensors {
  std::vector<Tensor> tensors;  // as they follow each other in the file
  std::map<std::string, std::string> metadata;

  // Throws InputError where there is none of that name: `file` is for the message.
  const Tensor& tensor(const std::string& name, const std::string& file) const;
  const std::string& text(const std::string& name, const std::string& file) const;
};

// The bytes of a file. Throws ResultError: a number that is not finite.
std::string safetensors_bytes(const Safetensors& content, Precision precision);

// From the bytes of a file; all becomes float. Throws InputError that names the file and says what is wrong: truncated,
// too long, no JSON, arrays of other types, gaps, overlaps, sizes that do not fit their shape, I8 without scales,
// numbers that are not finite.
Safetensors parse_safetensors(std::string_view bytes, const std::string& file);

}  // namespace itn
