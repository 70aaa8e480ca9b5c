#include "runtime/base/json_text.h"

#include <fmt/format.h>

#include <set>
#include <vector>

namespace itn {
namespace {

// Hears all names of members: a parser keeps the last of those that are the same.
class NamesOnce : public nlohmann::json_sax<nlohmann::json> {
 public:
  explicit NamesOnce(const std::string& file) : file_(file) {}

  bool start_object(std::size_t /*elements*/) override {
    names_.emplace_back();
    return true;
  }
  bool key(std::string& name) override {
    if (!names_.back().insert(name).second)
      throw InputError(fmt::format("{}: an object has the member \"{}\" twice; need each name once", file_, name));
    return true;
  }
  bool end_object() override {
    names_.pop_back();
    return true;
  }

  bool null() override { return true; }
  bool boolean(bool /*value*/) override { return true; }
  bool number_integer(std::int64_t /*value*/) override { return true; }
  bool number_unsigned(std::uint64_t /*value*/) override { return true; }
  bool number_float(double /*value*/, const std::string& /*text*/) override { return true; }
  bool string(std::string& /*value*/) override { return true; }
  bool binary(nlohmann::json::binary_t& /*value*/) override { return true; }
  bool start_array(std::size_t /*elements*/) override { return true; }
  bool end_array() override { return true; }
  // Is said by who parses the text.
  bool parse_error(std::size_t /*position*/, const std::string& /*token*/,
                   const nlohmann::json::exception& /*error*/) override {
    return false;
  }

 private:
  const std::string& file_;
  std::vector<std::set<std::string>> names_;  // of the objects that are open
};

void check_nesting(std::string_view json, const std::string& file) {
  constexpr int deepest = 100;
  int depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_text) {
      if (c == '\\') ++i;
      if (c == '"') in_text = false;
    } else if (c == '"') {
      in_text = true;
    } else if (c == '[' || c == '{') {
      if (++depth > deepest)
        throw InputError(fmt::format("{}: byte {}: its lists and objects nest more than {} deep; need at most that",
                                     file, i, deepest));
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
}

}  // namespace

void check_structure(std::string_view json, const std::string& file) {
  check_nesting(json, file);
  NamesOnce names(file);
  nlohmann::json::sax_parse(json, &names);
}

}  // namespace itn
