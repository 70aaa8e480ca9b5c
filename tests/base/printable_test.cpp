#include "runtime/base/printable.h"

#include <catch2/catch.hpp>

using namespace itn;

TEST_CASE("what could act on a terminal is written out, other characters stay") {
  CHECK(printable("a\x1b[31mb\nc") == "a\\x1b[31mb\nc");
  CHECK(printable("\xc2\x9b"
                  "2J") == "\\xc2\\x9b2J");
  CHECK(printable("Größe \xe2\x82\xac \xf0\x9f\x98\x80") == "Größe \xe2\x82\xac \xf0\x9f\x98\x80");
  CHECK(printable("\xff\xc3") == "\\xff\\xc3");
}

TEST_CASE("a long text loses its middle, between characters") {
  std::string text;
  for (int i = 0; i < 1000000; ++i) text += "\xe2\x82\xac";
  const std::string cut = printable(text);
  CHECK(cut.size() < 4100);
  CHECK(is_utf8(cut));
  CHECK_THAT(cut, Catch::Contains("bytes left out") && !Catch::Contains("\\x"));
}

TEST_CASE("UTF-8 is told from what is not") {
  for (const char* text : {"", "a", "\xc3\xa4", "\xef\xbf\xbf", "\xf4\x8f\xbf\xbf"}) CHECK(is_utf8(text));
  // cut off, a stray continuation, longer than needed, half of a pair, beyond the last character
  for (const char* text : {"\xc3", "\xa4", "\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "a\xff"})
    CHECK_FALSE(is_utf8(text));
}
