#include "core/io/toml.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

std::string toml_refusal(const std::string& text, const Limits& limits = {}) {
  try {
    parse_toml(text, "capture.toml", limits);
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

std::string repeated(const std::string& text, int count) {
  std::string result;
  for (int i = 0; i < count; ++i) {
    result += text;
  }
  return result;
}

TEST(Toml, EveryValueKind_IsRead) {
  const nlohmann::json value = parse_toml(R"(
title = "tee" # a comment with [brackets] and "quotes
fps = 30
scale = 1_000.5
flag = true
hex = 0xFF
day = 2022-11-30
when = 2022-11-30T12:30:00Z
at = 07:32:00
literal = 'C:\no escapes'
long = """one
two"""
list = [1, 2, [3, 4]]
inline = { a = 1, b.c = 2 }
[table."quoted key"]
x = 1
[[camera]]
id = "a"
[[camera]]
id = "b"
)");
  EXPECT_EQ(value["title"], "tee");
  EXPECT_EQ(value["fps"], 30);
  EXPECT_EQ(value["scale"], 1000.5);
  EXPECT_EQ(value["flag"], true);
  EXPECT_EQ(value["hex"], 255);
  EXPECT_EQ(value["day"], "2022-11-30");
  EXPECT_EQ(value["when"], "2022-11-30T12:30:00Z");
  EXPECT_EQ(value["at"], "07:32:00");
  EXPECT_EQ(value["literal"], "C:\\no escapes");
  EXPECT_EQ(value["long"], "one\ntwo");
  EXPECT_EQ(value["list"], nlohmann::json::parse("[1, 2, [3, 4]]"));
  EXPECT_EQ(value["inline"]["b"]["c"], 2);
  EXPECT_EQ(value["table"]["quoted key"]["x"], 1);
  EXPECT_EQ(value["camera"][1]["id"], "b");
}

TEST(Toml, EmptyText_IsEmptyTable) {
  EXPECT_EQ(parse_toml("").size(), 0u);
}

TEST(Toml, Lines_AreKnownForEveryValue) {
  const auto lines = toml_lines("a = 1\n\n[b]\nc = [\n  1,\n  2]\n[[d]]\nid = 'x'\n");
  EXPECT_EQ(lines.at("a"), 1);
  EXPECT_EQ(lines.at("b.c.1"), 6);
  EXPECT_EQ(lines.at("d.0.id"), 8);
}

TEST(Toml, SyntaxError_NamesFileLineAndColumn) {
  EXPECT_THAT(toml_refusal("a = 1\nb = = 2\n"), HasSubstr("capture.toml: line 2, column"));
  EXPECT_THAT(toml_refusal("a = 1\na = 2\n"), HasSubstr("line 2"));
  EXPECT_THAT(toml_refusal("a = 1\nb = nan\n"),
              HasSubstr("line 2, column 5: a number that is not"));
}

TEST(Toml, DeepNesting_IsCappedInEveryForm) {
  const std::string deep = "nesting deeper than 64";
  EXPECT_EQ(toml_refusal("a = " + repeated("[", 60) + repeated("]", 60)), "");
  EXPECT_THAT(toml_refusal("a = " + repeated("[", 65) + repeated("]", 65)), HasSubstr(deep));
  EXPECT_THAT(toml_refusal("a" + repeated(".a", 100'000) + " = 1"), HasSubstr(deep));
  EXPECT_THAT(toml_refusal("[a" + repeated(".a", 100) + "]\nb = 1"), HasSubstr(deep));
  EXPECT_THAT(toml_refusal("[a" + repeated(".a", 40) + "]\nb" + repeated(".b", 40) + " = 1"),
              HasSubstr(deep));
  EXPECT_THAT(toml_refusal("x = " + repeated("{a = ", 65) + "1" + repeated("}", 65)),
              HasSubstr(deep));
  EXPECT_THAT(toml_refusal("x = " + repeated("{a.b.c = ", 30) + "1" + repeated("}", 30)),
              HasSubstr(deep));
  EXPECT_THAT(toml_refusal("x = " + repeated("[{a = ", 40) + "1" + repeated("}]", 40)),
              HasSubstr(deep));
  EXPECT_THAT(toml_refusal("\"a\"" + repeated(".'a'", 100) + " = 1"), HasSubstr(deep));
}

TEST(Toml, NulByte_IsNotText) {
  std::string binary = "ply\n" + repeated("[", 100);
  binary += '\0';
  EXPECT_THAT(toml_refusal(binary), HasSubstr("line 2: a NUL byte, which no text has"));
}

TEST(Toml, Strings_DoNotHideNesting) {
  // Four quotes close a string that ends in a quote; a naive scan would think that one is open.
  const std::string dots = "a" + repeated(".a", 100'000) + " = 1";
  EXPECT_THAT(toml_refusal("x = \"\"\"a\"\"\"\"\n" + dots), HasSubstr("nesting deeper"));
  EXPECT_THAT(toml_refusal("x = {s = \"\"\"a\"\"\"\", " + dots + "}"), HasSubstr("nesting deeper"));
  EXPECT_THAT(toml_refusal("x = {s = '''a''''', " + dots + "}"), HasSubstr("nesting deeper"));
  EXPECT_THAT(toml_refusal("x = {s = \"\\\"\", " + dots + "}"), HasSubstr("nesting deeper"));
  EXPECT_THAT(toml_refusal("x = {s = \"\", " + dots + "}"), HasSubstr("nesting deeper"));
  EXPECT_THAT(toml_refusal("# \"\n" + dots), HasSubstr("nesting deeper"));
}

TEST(Toml, DotsInStringsAndNumbers_AreNotNesting) {
  EXPECT_EQ(toml_refusal("a = \"" + repeated(".", 1000) + "\""), "");
  EXPECT_EQ(toml_refusal("a = [" + repeated("1.5, ", 1000) + "]"), "");
  EXPECT_EQ(toml_refusal("# " + repeated("[.", 1000)), "");
  EXPECT_EQ(toml_refusal("a = \"\"\"\n" + repeated("[[.\n", 1000) + "\"\"\""), "");
  EXPECT_EQ(toml_refusal(repeated("[[a]]\nb.c = 1\n", 1000)), "");
}

TEST(Toml, TextBeyondLimits_NamesTheLimit) {
  Limits limits;
  limits.text_string_bytes = 3;
  EXPECT_THAT(toml_refusal("a = \"1234\"", limits), HasSubstr("a string of 4 bytes"));
  limits = {};
  limits.text_values = 3;
  EXPECT_THAT(toml_refusal("a = [1, 2, 3]", limits), HasSubstr("more than 3 values"));
  limits = {};
  limits.text_file_bytes = 4;
  EXPECT_THAT(toml_refusal("a = 1", limits), HasSubstr("5 bytes of TOML"));
}

TEST(Toml, FilesOfOtherTools_AreRead) {
  ATELIER_TEST_FILE(caliscope, "caliscope_calib/4_cam_recording/config.toml");
  EXPECT_TRUE(read_toml(caliscope).is_object());
  ATELIER_TEST_FILE(pose2sim, "pose2sim_demo/single/Config.toml");
  EXPECT_TRUE(read_toml(pose2sim).contains("project"));
  EXPECT_TRUE(
      read_toml(fixtures::test_data_root() / "pose2sim_demo/single/calibration/Calib_qualisys.toml")
          .is_object());
}

TEST(Toml, MissingFile_IsDataError) {
  const fixtures::TemporaryDirectory folder;
  EXPECT_THROW(read_toml(folder / "missing.toml"), DataError);
}

}  // namespace
}  // namespace atelier
