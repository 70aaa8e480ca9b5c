#include "runtime/base/printable.h"

#include <catch2/catch.hpp>

using namespace itn;

TEST_CASE("what could act on a terminal is written out, other characters stay") {
  CHECK(printable("a\x1b[31mb\nc") == "a\\x1b[31mb\\nc");
  CHECK(printable_lines("a\x1b[31mb\nc") == "a\\x1b[31mb\nc");
  CHECK(printable("\xc2\x9b"
                  "2J") == "\\xc2\\x9b2J");
  CHECK(printable("Größe \xe2\x82\xac \xf0\x9f\x98\x80") == "Größe \xe2\x82\xac \xf0\x9f\x98\x80");
  CHECK(printable("\xff\xc3") == "\\xff\\xc3");
}

TEST_CASE("what turns the direction of writing is written out, its neighbours stay") {
  CHECK(printable("a\u202egpj.b") == "a\\xe2\\x80\\xaegpj.b");
  for (const char* text : {"\u061c", "\u200e", "\u200f", "\u202a", "\u202e", "\u2066", "\u2069"})
    CHECK_THAT(printable(text), Catch::StartsWith("\\x"));
  for (const char* text : {"\u061b", "\u200d", "\u2010", "\u2029", "\u202f", "\u2065", "\u206a"})
    CHECK(printable(text) == text);
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
