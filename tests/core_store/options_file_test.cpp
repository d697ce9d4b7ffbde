#include "core/store/options_file.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/store/consent_file.h"
#include "core/store/toml_entries.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Fields {
  bool on = false;
  int count = 1;
  double gain = 1;
  std::string word = "a";
  std::vector<double> list;
};

OptionTable describe(Fields& fields) {
  OptionTable table;
  table.add("part.on", fields.on, "help");
  table.add("part.count", fields.count, 0, 10, "", "help");
  table.add("part.gain", fields.gain, 0, 1e9, "", "help");
  table.add("word", fields.word, {}, "help");
  table.add("part.deep.list", fields.list, -5, 5, "m", "help");
  return table;
}

struct OptionsFile : ::testing::Test {
  Fields fields;
  OptionTable table = describe(fields);
  std::vector<std::string> set(const std::string& text) {
    return set_options_from_toml(table, text, "outfit.toml");
  }
};

TEST_F(OptionsFile, EveryKind_IsSetWithItsLine) {
  EXPECT_THAT(set("word = 'cloth'\n[part]\non = true\ncount = 7\ngain = 2.5e3\n[part.deep]\nlist = "
                  "[1, -2.5]\n"),
              IsEmpty());
  EXPECT_TRUE(fields.on);
  EXPECT_EQ(fields.count, 7);
  EXPECT_EQ(fields.gain, 2500);
  EXPECT_EQ(fields.word, "cloth");
  EXPECT_THAT(fields.list, ElementsAre(1, -2.5));
  EXPECT_EQ(table.fields[0].source, "outfit.toml:3");
  EXPECT_EQ(table.fields[3].source, "outfit.toml:1");
  EXPECT_EQ(table.fields[4].source, "outfit.toml:7");
}

TEST_F(OptionsFile, DottedKeysAndInlineTables_AreRead) {
  EXPECT_THAT(set("part.count = 3\npart.deep = { list = [] }\n"), IsEmpty());
  EXPECT_EQ(fields.count, 3);
}

TEST_F(OptionsFile, Flags_OverrideFiles) {
  EXPECT_THAT(set("word = 'file'"), IsEmpty());
  EXPECT_EQ(set_option(table, "word", "flag"), "");
  EXPECT_EQ(fields.word, "flag");
  EXPECT_EQ(table.fields[3].source, "flag");
}

TEST_F(OptionsFile, EveryProblem_IsReportedAndTheRestIsSet) {
  const auto problems = set("wrod = 'x'\nword = 'good'\n[part]\ncount = 11\ngain = 'much'\n");
  ASSERT_EQ(problems.size(), 3u);
  EXPECT_THAT(problems,
              ::testing::UnorderedElementsAre(
                  HasSubstr("outfit.toml:1: there is no option 'wrod', did you mean 'word'?"),
                  HasSubstr("outfit.toml:4: part.count cannot be '11'"),
                  HasSubstr("outfit.toml:5: part.gain cannot be 'much'")));
  EXPECT_EQ(fields.word, "good");
}

class WrongValue : public OptionsFile, public ::testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(
    All, WrongValue,
    ::testing::Values("part.on = 1", "part.on = 'yes'", "part.count = 1.5", "part.count = true",
                      "part.count = -1", "part.count = 9223372036854775807", "part.count = 1.0",
                      "part.gain = -1e300", "part.gain = true", "part.gain = 2030-01-01",
                      "part.gain = 12:00:00", "part.gain = 2030-01-01T00:00:00Z", "part.gain = [1]",
                      "part.deep.list = 'a'", "part.deep.list = ['a']", "part.deep.list = [[1]]",
                      "part.deep.list = [1, true]", "part.deep.list = [6]",
                      "part.deep.list = [1e300]", "part = 5", "part.unknown = 1",
                      "word = \"a\\u0000b\"", "word = \"a\\nb\"", "word = { a = 1 }",
                      "[[word]]\na = 1", "'' = 1", "'part.count.x' = 1", "[prt]", "[[part]]",
                      "[[part]]\ncount = 1", "[part.count]", "word = {}", "[part.deep.no]"));
TEST_P(WrongValue, WrongValue_IsRefusedWithItsPlace) {
  const std::string before = canonical_json(table);
  const auto problems = set(GetParam());
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_THAT(problems[0], HasSubstr("outfit.toml:"));
  EXPECT_EQ(canonical_json(table), before);
}

TEST_F(OptionsFile, EmptyTable_SetsNothing) {
  const std::string before = canonical_json(table);
  EXPECT_TRUE(set("[part]\n[part.deep]\n").empty());
  EXPECT_THAT(set("[parts]\n"), ElementsAre(HasSubstr("did you mean 'part'?")));
  EXPECT_THAT(set("[part.deeep]\n"), ElementsAre(HasSubstr("did you mean 'part.deep'?")));
  EXPECT_EQ(canonical_json(table), before);
}

class NoToml : public OptionsFile, public ::testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(All, NoToml,
                         ::testing::Values("word", "word =", "= 1", "word = 'a", "[part",
                                           "word = a", "word = 'a'\nword = 'b'", "[part]\n[part]",
                                           "a = 01", "a = 1__0", "a = \"\\x\"", "\xff = 1",
                                           "a = 1 b = 2", "part = 1\n[part]\na = 1", "a = [1, ",
                                           "a = {b = 1", "a = 9223372036854775808", "{}"));
TEST_P(NoToml, SyntaxError_IsRefusedWithLineAndColumn) {
  try {
    set(GetParam());
    FAIL() << "it was read";
  } catch (const DataError& error) {
    EXPECT_EQ(error.file, "outfit.toml");
    EXPECT_THAT(error.where, HasSubstr("line "));
    EXPECT_FALSE(error.expected.empty());
  }
}

TEST_F(OptionsFile, DeepNesting_IsRefused) {
  std::string tables;
  for (int i = 0; i < 100; ++i) {
    tables += (i > 0 ? ".a" : "a");
  }
  EXPECT_THROW(set(tables + " = 1"), DataError);
  EXPECT_THROW(set("a = " + std::string(100, '[') + std::string(100, ']')), DataError);
  EXPECT_THROW(set("a = " + std::string(100'000, '[')), DataError);
}

TEST_F(OptionsFile, OverlongString_IsRefused) {
  EXPECT_THROW(set("word = '" + std::string(70'000, 'a') + "'"), DataError);
}

TEST(TomlEntries, ArraysOfTables_AreNumbered) {
  const auto entries = read_toml_entries("[[p]]\na = 1\n[[p]]\na = 2\n", "f");
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].name, "p.0.a");
  EXPECT_EQ(entries[1].name, "p.1.a");
  EXPECT_EQ(entries[1].line, 4);
}

TEST_F(OptionsFile, NonFiniteNumber_IsRefused) {
  for (const char* text : {"part.gain = nan", "part.gain = inf", "part.gain = -inf",
                           "part.deep.list = [nan]", "part.gain = 1e999"}) {
    EXPECT_THROW(set(text), DataError) << text;
  }
}

TEST_F(OptionsFile, OverlongDottedKey_IsRefused) {
  std::string key = "a";
  for (int i = 0; i < 100'000; ++i) {
    key += ".a";
  }
  EXPECT_THROW(set(key + " = 1"), DataError);
}

TEST(TomlEntries, Dates_AreText) {
  const auto entries = read_toml_entries("d = 2030-01-02", "f");
  EXPECT_EQ(entries[0].kind, TomlEntry::Kind::Text);
  EXPECT_EQ(entries[0].text, "2030-01-02");
}

class ConsentFile : public ::testing::Test {
 protected:
  std::vector<Consent> read(const std::string& text) {
    std::ofstream(root_ / "capture.toml") << text;
    return read_consent(root_.path());
  }
  TemporaryDirectory root_;
};

TEST_F(ConsentFile, SingleTable_IsRead) {
  const std::vector<Consent> expected = {{"P. Doe", "research", "2030-12-31"}};
  EXPECT_EQ(read("[consent]\nwho='P. Doe'\nscope='research'\nuntil='2030-12-31'"), expected);
  EXPECT_EQ(read("[consent]\nwho='P. Doe'\nscope='research'\nuntil=2030-12-31"), expected);
}

TEST_F(ConsentFile, SeveralTablesWithoutEndDate_AreRead) {
  const std::vector<Consent> expected = {{"A", "x", ""}, {"B", "y", ""}};
  EXPECT_EQ(read("[[consent]]\nwho='A'\nscope='x'\n[[consent]]\nwho='B'\nscope='y'"), expected);
}

TEST_F(ConsentFile, NoConsent_IsEmpty) {
  EXPECT_THAT(read("units = 'm'"), IsEmpty());
  std::filesystem::remove(root_ / "capture.toml");
  EXPECT_THAT(read_consent(root_.path()), IsEmpty());
}

TEST_F(ConsentFile, PathInsideCapture_FindsTheConsent) {
  read("[consent]\nwho='A'\nscope='x'");
  std::filesystem::create_directories(root_ / "sequences/clothed");
  EXPECT_EQ(read_consent(root_ / "sequences/clothed").size(), 1u);
  std::ofstream(root_ / "sequences/mesh_0.obj") << "v 0 0 0";
  EXPECT_EQ(read_consent(root_ / "sequences/mesh_0.obj").size(), 1u);
}

class WrongConsent : public ConsentFile, public ::testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(All, WrongConsent,
                         ::testing::Values("consent = 'yes'", "consent = 1", "consent = []",
                                           "[consent]\nwho='A'", "[consent]\nscope='x'",
                                           "[consent]\nwho=1\nscope='x'",
                                           "[consent]\nwho='A'\nscope='x'\nuntil='soon'",
                                           "[consent]\nwho='A'\nscope='x'\nuntil='2030-02-30'",
                                           "[consent]\nwho='A'\nscope='x'\nuntil=2030",
                                           "[consent]\nwho='A'\nscope='x'\nuntill='2030-01-01'",
                                           "[consent]\nwho=\"A\\n\"\nscope='x'",
                                           "[consent]\nwho=''\nscope='x'", "[consent",
                                           "[[consent]]\nwho='A'\nscope='x'\n[[consent]]\nwho='B'",
                                           "[consent]\nwho=[2030-01-01]\nscope='x'"));
TEST_P(WrongConsent, WrongConsent_IsRefused) {
  try {
    read(GetParam());
    FAIL() << "it was read";
  } catch (const DataError& error) {
    EXPECT_THAT(error.file, HasSubstr("capture.toml"));
    EXPECT_FALSE(error.expected.empty());
  }
}

}  // namespace
}  // namespace atelier::fixtures
