#include "itn/safetensors.h"

#include <Imath/half.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <deque>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "itn/error.h"
#include "runtime/base/json_text.h"

namespace itn {
namespace {

using Json = nlohmann::ordered_json;
static_assert(std::endian::native == std::endian::little, "the bytes of numbers are copied as they are");

constexpr const char* scale_suffix = ".scale";
constexpr float largest_byte = 127;

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

// Size of a number [bytes]; 0: unknown type.
std::size_t size_of(const std::string& type) {
  if (type == "F32") return 4;
  if (type == "F16") return 2;
  return type == "I8" ? 1 : 0;
}

Entry parse_entry(const std::string& name, const Json& json, const std::string& file) {
  const std::vector<std::size_t> shape = whole_numbers(name, json.at("shape"), file),
                                 offsets = whole_numbers(name, json.at("data_offsets"), file);
  if (offsets.size() != 2 || offsets[0] > offsets[1]) fail(file, "array '" + name + "' has no valid place in the file");
  Entry entry{name, json.at("dtype").get<std::string>(), shape, offsets[0], offsets[1]};
  const std::size_t number_size = size_of(entry.type);
  if (number_size == 0)
    fail(file, "array '" + name + "' is of type " + entry.type + ", where F32, F16 and I8 are known");
  // The product of the shape, step by step, so that it cannot overflow.
  const std::size_t bytes = entry.end - entry.begin;
  std::size_t count = 1;
  for (const std::size_t extent : shape) {
    if (extent != 0 && count > bytes / extent) fail(file, "array '" + name + "' is larger than its place in the file");
    count *= extent;
  }
  if (count > bytes / number_size) fail(file, "array '" + name + "' is larger than its place in the file");
  if (count * number_size != bytes) fail(file, "array '" + name + "' does not fill its place in the file");
  return entry;
}

void require_finite(const Tensor& tensor, const std::string& file) {
  for (const float value : tensor.values)
    if (!std::isfinite(value)) fail(file, "array '" + tensor.name + "' holds a number that is not finite");
}

Tensor read_entry(const Entry& entry, std::string_view data, const std::string& file) {
  Tensor tensor{entry.name, entry.shape, std::vector<float>(count_of(entry.shape))};
  if (entry.type == "F32") {
    if (!tensor.values.empty()) std::memcpy(tensor.values.data(), data.data() + entry.begin, entry.end - entry.begin);
  } else if (entry.type == "I8") {
    for (std::size_t i = 0; i < tensor.values.size(); ++i)
      tensor.values[i] = static_cast<float>(static_cast<signed char>(data[entry.begin + i]));
  } else {
    for (std::size_t i = 0; i < tensor.values.size(); ++i) {
      std::uint16_t bits = 0;
      std::memcpy(&bits, data.data() + entry.begin + 2 * i, sizeof bits);
      tensor.values[i] = imath_half_to_float(bits);
    }
  }
  require_finite(tensor, file);
  return tensor;
}

// Whole numbers times their scale.
void scale(Tensor& whole, const Tensor& scales, const std::string& file) {
  if (whole.shape.empty() || scales.shape != std::vector<std::size_t>{whole.shape.front()})
    fail(file, "array '" + scales.name + "' does not have one number for each row of '" + whole.name + "'");
  for (std::size_t i = 0; i < whole.values.size(); ++i)
    whole.values[i] *= scales.values[i * scales.values.size() / whole.values.size()];
  require_finite(whole, file);
}

void apply_scales(std::vector<Tensor>& tensors, const std::string& name, const std::string& file) {
  const auto called = [&](const std::string& wanted) {
    return std::find_if(tensors.begin(), tensors.end(), [&](const Tensor& tensor) { return tensor.name == wanted; });
  };
  const auto whole = called(name), scales = called(name + scale_suffix);
  if (whole == tensors.end() || scales == tensors.end())
    fail(file, "array '" + name + "' is of type I8, which needs an array '" + name + scale_suffix + "' of type F32");
  scale(*whole, *scales, file);
  tensors.erase(scales);
}

// An array as a file of bytes has it: whole numbers, and what their rows are to be multiplied by.
struct Scaled {
  Tensor whole, scales;
};
Scaled scaled(const Tensor& tensor) {
  const std::size_t rows = tensor.shape.front(), columns = tensor.values.size() / rows;
  Scaled result{tensor, {tensor.name + scale_suffix, {rows}, std::vector<float>(rows)}};
  for (std::size_t row = 0; row < rows; ++row) {
    const std::span<float> values = std::span(result.whole.values).subspan(row * columns, columns);
    float largest = 0;
    for (const float value : values) largest = std::max(largest, std::fabs(value));
    const float unit = result.scales.values[row] = largest / largest_byte;
    // The unit of a row that is nearly 0 may be rounded to one of the few smallest floats, and too small.
    for (float& value : values)
      value = unit > 0 ? std::clamp(std::round(value / unit), -largest_byte, largest_byte) : 0;
  }
  return result;
}

template <class Number>
void append(std::string& bytes, const Number& number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

template <class Number>
void append_as(std::string& bytes, const Tensor& tensor) {
  for (const float value : tensor.values) append(bytes, static_cast<Number>(value));
}

struct Stored {
  const Tensor* tensor;
  const char* type;
  void (*append_to)(std::string& bytes, const Tensor& tensor);
};

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
  std::vector<Stored> arrays;
  std::deque<Scaled> scaled_arrays;  // which does not move what it holds
  for (const Tensor& tensor : content.tensors) {
    if (!std::all_of(tensor.values.begin(), tensor.values.end(), [](float value) { return std::isfinite(value); }))
      throw ResultError("array '" + tensor.name + "' holds a number that is not finite");
    if (precision == Precision::byte && tensor.shape.size() > 1 && tensor.shape.front() > 1) {
      const Scaled& both = scaled_arrays.emplace_back(scaled(tensor));
      arrays.push_back({&both.whole, "I8", append_as<signed char>});
      arrays.push_back({&both.scales, "F32", append_as<float>});
    } else {
      arrays.push_back({&tensor, "F32", append_as<float>});
    }
  }
  // Larger numbers first, so that none stands askew: some readers cannot take that.
  std::stable_sort(arrays.begin(), arrays.end(),
                   [](const Stored& a, const Stored& b) { return size_of(a.type) > size_of(b.type); });
  Json header = Json::object();
  if (!content.metadata.empty()) header["__metadata__"] = content.metadata;
  std::string data;
  for (const auto& [tensor, type, append_to] : arrays) {
    const std::size_t begin = data.size();
    append_to(data, *tensor);
    header[tensor->name] = {{"dtype", type}, {"shape", tensor->shape}, {"data_offsets", {begin, data.size()}}};
  }
  std::string text = header.dump();
  text.resize((text.size() + 7) / 8 * 8, ' ');
  std::string start;
  append(start, static_cast<std::uint64_t>(text.size()));
  return data.insert(0, start + text);
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
  std::vector<std::string> whole;
  for (const Entry& entry : entries) {
    content.tensors.push_back(read_entry(entry, data, file));
    if (entry.type == "I8") whole.push_back(entry.name);
  }
  for (const std::string& name : whole) apply_scales(content.tensors, name, file);
  return content;
}

}  // namespace itn
