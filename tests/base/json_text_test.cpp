#include "runtime/base/json_text.h"

#include <catch2/catch.hpp>

using namespace itn;

TEST_CASE("JSON of 50,000 levels is refused before it is built") {
  const std::string deep = std::string(50000, '[') + std::string(50000, ']');
  CHECK_THROWS_WITH(parse_json<nlohmann::json>(deep, "a.json"),
                    Catch::Contains("a.json: byte 100") && Catch::Contains("deep"));
  CHECK_THROWS_AS(parse_json<nlohmann::json>(std::string(50000, '['), "a.json"), InputError);
  CHECK(parse_json<nlohmann::json>(std::string(100, '[') + std::string(100, ']'), "a.json").is_array());
}

TEST_CASE("brackets in texts do not nest") {
  const std::string brackets = "\"\\\"" + std::string(500, '[') + "\"";
  CHECK(parse_json<nlohmann::json>(brackets, "a.json").is_string());
}

TEST_CASE("whole numbers are taken as they stand or refused") {
  const auto read = [](const char* text) { return whole<int>(nlohmann::json::parse(text)); };
  CHECK(read("-2147483648") == -2147483648);
  CHECK(read("2147483647") == 2147483647);
  for (const char* text :
       {"2147483648", "-2147483649", "1.0", "1e300", "\"1\"", "null", "true", "18446744073709551615"})
    CHECK_THROWS_AS(read(text), nlohmann::json::exception);
  CHECK(whole<std::uint64_t>(nlohmann::json::parse("18446744073709551615")) == ~std::uint64_t{0});
  CHECK_THROWS_AS(whole<std::uint64_t>(nlohmann::json::parse("-1")), nlohmann::json::exception);
}

TEST_CASE("what is no JSON is an input error that names the file") {
  CHECK_THROWS_WITH(parse_json<nlohmann::json>("{", "a.json"), Catch::Contains("a.json: is no JSON"));
}

TEST_CASE("a member that an object has twice is refused by its name, however it is written") {
  const auto parse = [](const char* text) { return parse_json<nlohmann::ordered_json>(text, "a.json"); };
  for (const char* text :
       {R"({"size": 8, "size": 16})", R"([{"b": {"size": 1}}, {"b": [{"a": 0, "size": 1, "size": 1}]}])",
        R"({"size": 8, "s\u0069ze": null})"})
    CHECK_THROWS_WITH(parse(text), Catch::Contains("a.json") && Catch::Contains("\"size\" twice"));
  CHECK(parse(R"([{"size": 8}, {"size": {"size": 8}, "Size": 1}])").size() == 2);
}
