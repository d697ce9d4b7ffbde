#include "core/io/json.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

std::string json_refusal(const std::string& text, const Limits& limits = {}) {
  try {
    parse_json(text, "a.json", limits);
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

TEST(Json, EveryValueKind_IsRead) {
  const nlohmann::json value =
      parse_json(R"( {"a": [1, -2, 2.5, 1e-3, true, false, null], "b": {"c": "d\n\u00e9"}} )");
  EXPECT_EQ(value["a"][0], 1);
  EXPECT_EQ(value["a"][1], -2);
  EXPECT_EQ(value["a"][2], 2.5);
  EXPECT_EQ(value["a"][3], 1e-3);
  EXPECT_EQ(value["a"][4], true);
  EXPECT_EQ(value["a"][6], nullptr);
  EXPECT_EQ(value["b"]["c"], "d\n\xC3\xA9");
}

TEST(Json, ScalarsAndEmptyContainers_AreRead) {
  EXPECT_EQ(parse_json("3"), 3);
  EXPECT_EQ(parse_json("\"x\""), "x");
  EXPECT_EQ(parse_json("[]").size(), 0u);
  EXPECT_EQ(parse_json("{}").size(), 0u);
}

TEST(Json, ExtremeIntegers_AreExact) {
  EXPECT_EQ(parse_json("18446744073709551615").get<std::uint64_t>(), 18446744073709551615u);
  EXPECT_EQ(parse_json("-9223372036854775808").get<std::int64_t>(),
            std::numeric_limits<std::int64_t>::min());
}

TEST(Json, NestingUpToLimit_IsRead) {
  const std::string deep = std::string(64, '[') + std::string(64, ']');
  EXPECT_NO_THROW(parse_json(deep));
  EXPECT_THAT(json_refusal("[" + deep + "]"), HasSubstr("nesting deeper than 64"));
}

TEST(Json, MillionNestingLevels_AreRefusedAtOnce) {
  EXPECT_THAT(json_refusal(std::string(1'000'000, '[')), HasSubstr("nesting deeper than 64"));
}

TEST(Json, OverlongString_IsRefused) {
  Limits limits;
  limits.text_string_bytes = 10;
  EXPECT_EQ(json_refusal("[\"0123456789\"]", limits), "");
  EXPECT_THAT(json_refusal("[\"0123456789a\"]", limits), HasSubstr("a string of 11 bytes"));
  EXPECT_THAT(json_refusal("{\"0123456789a\": 1}", limits), HasSubstr("a string of 11 bytes"));
}

TEST(Json, TooManyValues_AreRefused) {
  Limits limits;
  limits.text_values = 3;
  EXPECT_EQ(json_refusal("[1, 2]", limits), "");
  EXPECT_THAT(json_refusal("[1, 2, 3]", limits), HasSubstr("more than 3 values"));
}

TEST(Json, OversizedText_IsRefused) {
  Limits limits;
  limits.text_file_bytes = 4;
  EXPECT_THAT(json_refusal("[1,2]", limits), HasSubstr("5 bytes of JSON"));
}

TEST(Json, SyntaxError_NamesFileLineAndColumn) {
  EXPECT_THAT(json_refusal("{\n  \"a\": 1,\n  \"b\": x\n}"), HasSubstr("a.json: line 3, column 8"));
  EXPECT_THAT(json_refusal("{\n  \"a\": 1,\n  \"a\": 2\n}"), HasSubstr("a.json: line 3, column 5"));
}

TEST(Json, File_IsRead) {
  const fixtures::TemporaryDirectory folder;
  std::ofstream(folder / "x.json") << "{\"fps\": 30}";
  EXPECT_EQ(read_json(folder / "x.json")["fps"], 30);
}

TEST(Json, MissingFileOrFolder_IsDataError) {
  const fixtures::TemporaryDirectory folder;
  EXPECT_THROW(read_json(folder / "missing.json"), DataError);
  EXPECT_THROW(read_json(folder.path()), DataError);
}

}  // namespace
}  // namespace atelier
