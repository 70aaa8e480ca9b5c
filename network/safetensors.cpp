#include "network/safetensors.h"

#include <Imath/half.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>

#include "runtime/base/error.h"
#include "runtime/base/json_text.h"

namespace itn {
namespace {

using Json = nlohmann::ordered_json;
static_assert(std::endian::native == std::endian::little, "the bytes of numbers are copied as they are");

[[noreturn]] void fail(const std::string& file, const std::string& what) {
  throw InputError(file + ": " + what + "; write or download the file again");
}

std::uint64_t header_length(std::string_view bytes, const std::string& file) {
  std::uint64_t length = 0;
  if (bytes.size() < sizeof length)
    fail(file, "truncated safetensors file of " + std::to_string(bytes.size()) + " bytes");
  std::memcpy(&length, bytes.data(), sizeof length);
  if (length > bytes.size() - sizeof length)
    fail(file, "truncated or no safetensors file: its header should have " + std::to_string(length) + " bytes, and " +
                   std::to_string(bytes.size() - sizeof length) + " are there");
  return length;
}

// An array's place behind the header.
struct Entry {
  std::string name, type;
  std::vector<std::size_t> shape;
  std::size_t begin, end;
};

std::vector<std::size_t> whole_numbers(const std::string& name, const Json& json, const std::string& file) {
  std::vector<std::size_t> numbers;
  if (!json.is_array()) fail(file, "array '" + name + "': a list of whole numbers is expected for its shape and place");
  for (const Json& number : json) {
    if (!number.is_number_unsigned())
      fail(file, "array '" + name + "': " + number.dump() + " is no whole number, in its shape or place");
    numbers.push_back(number.get<std::size_t>());
  }
  return numbers;
}

Entry parse_entry(const std::string& name, const Json& json, const std::string& file) {
  const std::vector<std::size_t> shape = whole_numbers(name, json.at("shape"), file),
                                 offsets = whole_numbers(name, json.at("data_offsets"), file);
  if (offsets.size() != 2 || offsets[0] > offsets[1]) fail(file, "array '" + name + "' has no valid place in the file");
  Entry entry{name, json.at("dtype").get<std::string>(), shape, offsets[0], offsets[1]};
  if (entry.type != "F32" && entry.type != "F16")
    fail(file, "array '" + name + "' is of type " + entry.type + ", where F32 and F16 are known");
  // The product of the shape, step by step, so that it cannot overflow.
  const std::size_t bytes = entry.end - entry.begin, number_size = entry.type == "F32" ? 4 : 2;
  std::size_t count = 1;
  for (const std::size_t extent : shape) {
    if (extent != 0 && count > bytes / extent) fail(file, "array '" + name + "' is larger than its place in the file");
    count *= extent;
  }
  if (count > bytes / number_size) fail(file, "array '" + name + "' is larger than its place in the file");
  if (count * number_size != bytes) fail(file, "array '" + name + "' does not fill its place in the file");
  return entry;
}

Tensor read_entry(const Entry& entry, std::string_view data, const std::string& file) {
  Tensor tensor{entry.name, entry.shape, std::vector<float>(count_of(entry.shape))};
  if (entry.type == "F32") {
    if (!tensor.values.empty()) std::memcpy(tensor.values.data(), data.data() + entry.begin, entry.end - entry.begin);
  } else {
    for (std::size_t i = 0; i < tensor.values.size(); ++i) {
      std::uint16_t bits = 0;
      std::memcpy(&bits, data.data() + entry.begin + 2 * i, sizeof bits);
      tensor.values[i] = imath_half_to_float(bits);
    }
  }
  for (const float value : tensor.values)
    if (!std::isfinite(value)) fail(file, "array '" + entry.name + "' holds a number that is not finite");
  return tensor;
}

template <class Number>
void append(std::string& bytes, const Number& number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

}  // namespace

const Tensor& Safetensors::tensor(const std::string& name, const std::string& file) const {
  for (const Tensor& tensor : tensors)
    if (tensor.name == name) return tensor;
  throw InputError(file + ": has no array '" + name + "'; is it a file of another kind?");
}

const std::string& Safetensors::text(const std::string& name, const std::string& file) const {
  const auto found = metadata.find(name);
  if (found == metadata.end())
    throw InputError(file + ": has no metadata '" + name + "'; is it a file of another kind?");
  return found->second;
}

std::string safetensors_bytes(const Safetensors& content, Precision precision) {
  const std::size_t number_size = precision == Precision::single ? 4 : 2;
  Json header = Json::object();
  if (!content.metadata.empty()) header["__metadata__"] = content.metadata;
  std::size_t end = 0;
  for (const Tensor& tensor : content.tensors) {
    const std::size_t begin = end;
    end += tensor.values.size() * number_size;
    header[tensor.name] = {{"dtype", precision == Precision::single ? "F32" : "F16"},
                           {"shape", tensor.shape},
                           {"data_offsets", {begin, end}}};
  }
  std::string text = header.dump();
  text.resize((text.size() + 7) / 8 * 8, ' ');

  std::string bytes;
  bytes.reserve(8 + text.size() + end);
  append(bytes, static_cast<std::uint64_t>(text.size()));
  bytes += text;
  for (const Tensor& tensor : content.tensors)
    for (const float value : tensor.values) {
      const std::uint16_t half = imath_float_to_half(value);
      if (!std::isfinite(precision == Precision::single ? value : imath_half_to_float(half)))
        throw ResultError("array '" + tensor.name +
                          "' holds a number that is not finite, or too large for half precision");
      if (precision == Precision::single)
        append(bytes, value);
      else
        append(bytes, half);
    }
  return bytes;
}

Safetensors parse_safetensors(std::string_view bytes, const std::string& file) {
  const std::uint64_t length = header_length(bytes, file);
  const std::string_view data = bytes.substr(8 + length);
  Safetensors content;
  std::vector<Entry> entries;
  try {
    const auto header = parse_json<Json>(bytes.substr(8, length), file + ": no valid safetensors header");
    if (!header.is_object()) fail(file, "no valid safetensors header: no object");
    for (const auto& [name, json] : header.items()) {
      if (name == "__metadata__")
        content.metadata = json.get<std::map<std::string, std::string>>();
      else
        entries.push_back(parse_entry(name, json, file));
    }
  } catch (const Json::exception& error) {
    fail(file, std::string("no valid safetensors header: ") + error.what());
  }
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return std::pair(a.begin, a.end) < std::pair(b.begin, b.end); });
  std::size_t end = 0;
  for (const Entry& entry : entries) {
    if (entry.begin != end) fail(file, "array '" + entry.name + "' overlaps another or leaves a gap");
    end = entry.end;
  }
  if (end != data.size())
    fail(file,
         "its arrays should have " + std::to_string(end) + " bytes, and " + std::to_string(data.size()) + " are there");
  for (const Entry& entry : entries) content.tensors.push_back(read_entry(entry, data, file));
  return content;
}

}  // namespace itn
