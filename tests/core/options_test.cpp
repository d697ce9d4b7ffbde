#include "core/options.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"

namespace atelier {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

enum class Solver { Direct, Iterative };

struct SolverOptions {
  int substeps = 8;
  double tolerance = 1e-6;
};

OptionTable describe(SolverOptions& options) {
  OptionTable table;
  table.add("substeps", options.substeps, 1, 100, "", "Steps per frame; more for stiff cloth");
  table.add("tolerance", options.tolerance, 0, 1, "m", "Where to stop");
  return table;
}

struct DrapeOptions {
  bool gravity = true;
  std::int64_t seed = 7;
  std::string name = "dress";
  std::string fabric = "wool";
  std::vector<double> wind = {0, 1.5, -2};
  Solver method = Solver::Direct;
  int jobs = 1;
  SolverOptions solver;
};

OptionTable describe(DrapeOptions& options) {
  OptionTable table;
  table.add("gravity", options.gravity, "Whether things fall");
  table.add("seed", options.seed, 0, 9e15, "", "Seed of the noise");
  table.add("name", options.name, {}, "What to call the result");
  table.add("fabric", options.fabric, {"wool", "cotton", "silk"}, "What the cloth is made of");
  table.add("wind", options.wind, -50, 50, "m/s", "Speed of the air");
  table.add("method", options.method,
            {{"direct", Solver::Direct}, {"iterative", Solver::Iterative}}, "Linear solver");
  table.add("jobs", options.jobs, 0, 64, "", "Threads").not_keyed();
  table.add("solver", describe(options.solver));
  return table;
}

struct OptionsTest : testing::Test {
  DrapeOptions options;
  OptionTable table = describe(options);

  std::string set(const std::string& name, const std::string& text) {
    return set_option(table, name, text);
  }
  const OptionField& field(const std::string& name) const {
    for (const OptionField& f : table.fields) {
      if (f.name == name) {
        return f;
      }
    }
    throw LogicError("no field " + name);
  }
};

TEST_F(OptionsTest, ValuesOfEveryKind_AreSet) {
  EXPECT_EQ(set("gravity", "false"), "");
  EXPECT_EQ(set("seed", "123456789012345"), "");
  EXPECT_EQ(set("name", "Brautkleid für Zoë"), "");
  EXPECT_EQ(set("fabric", "silk"), "");
  EXPECT_EQ(set("wind", "[1, 2.5, -3e0]"), "");
  EXPECT_EQ(set("method", "iterative"), "");
  EXPECT_EQ(set("solver.substeps", "20"), "");
  EXPECT_EQ(set("solver.tolerance", "2.5e-7"), "");
  EXPECT_FALSE(options.gravity);
  EXPECT_EQ(options.seed, 123456789012345);
  EXPECT_EQ(options.name, "Brautkleid für Zoë");
  EXPECT_EQ(options.fabric, "silk");
  EXPECT_THAT(options.wind, ElementsAre(1, 2.5, -3));
  EXPECT_EQ(options.method, Solver::Iterative);
  EXPECT_EQ(options.solver.substeps, 20);
  EXPECT_EQ(options.solver.tolerance, 2.5e-7);
}

TEST_F(OptionsTest, SpacesAndPlusSign_AreRead) {
  EXPECT_EQ(set("seed", " +5 "), "");
  EXPECT_EQ(options.seed, 5);
  EXPECT_EQ(set("wind", " 1 , 2 "), "");
  EXPECT_THAT(options.wind, ElementsAre(1, 2));
  EXPECT_EQ(set("wind", "[]"), "");
  EXPECT_THAT(options.wind, IsEmpty());
}

TEST_F(OptionsTest, SetValue_RecordsItsSource) {
  EXPECT_EQ(field("fabric").source, "default");
  EXPECT_EQ(set_option(table, "fabric", "silk", "outfit.toml:3"), "");
  EXPECT_EQ(field("fabric").source, "outfit.toml:3");
  EXPECT_EQ(set("fabric", "wool"), "");
  EXPECT_EQ(field("fabric").source, "flag");
}

TEST_F(OptionsTest, RefusedText_ChangesNeitherValueNorSource) {
  EXPECT_NE(set("solver.substeps", "0"), "");
  EXPECT_EQ(options.solver.substeps, 8);
  EXPECT_EQ(field("solver.substeps").source, "default");
}

TEST(OptionChoices, EmptyChoice_IsSettableButNotListed) {
  std::string fabric;
  OptionTable table;
  table.add("fabric", fabric, {"", "wool", "silk"}, "What the cloth is made of");
  EXPECT_EQ(option_range(table.fields[0]), "wool|silk");
  EXPECT_EQ(set_option(table, "fabric", "", "flag"), "");
  EXPECT_THAT(set_option(table, "fabric", "tweed", "flag"), HasSubstr("it takes wool, silk"));
}

TEST_F(OptionsTest, UnknownName_IsRefusedWithSuggestion) {
  EXPECT_EQ(set("solver.substep", "3"),
            "there is no option 'solver.substep', did you mean 'solver.substeps'?");
  EXPECT_THAT(set("substeps", "3"), HasSubstr("did you mean 'solver.substeps'?"));
  EXPECT_THAT(set("garvity", "true"), HasSubstr("did you mean 'gravity'?"));
  EXPECT_EQ(set("zzzzzzzzzzzz", "1"),
            "there is no option 'zzzzzzzzzzzz'; 'atelier options' lists them");
  EXPECT_EQ(set("", "1"), "there is no option ''; 'atelier options' lists them");
}

TEST_F(OptionsTest, UnknownChoice_IsRefusedWithSuggestion) {
  EXPECT_EQ(set("fabric", "woll"),
            "fabric cannot be 'woll': it takes wool, cotton, silk, did you mean 'wool'?");
  EXPECT_THAT(set("method", "Direct"), HasSubstr("did you mean 'direct'?"));
  EXPECT_THAT(set("method", ""), HasSubstr("direct, iterative"));
}

TEST_F(OptionsTest, WrongTextInMessage_IsPrintableAndCutAtCharacters) {
  EXPECT_THAT(set("fabric", "gr\u00f6\u00dfe"), HasSubstr("cannot be 'gr\u00f6\u00dfe':"));
  EXPECT_THAT(set("fabric", std::string(59, 'a') + "\u00f6\u00f6"),
              HasSubstr("'" + std::string(59, 'a') + "...'"));
  EXPECT_THAT(set("fabric", "a\033[2J"), HasSubstr("'a?[2J'"));
  EXPECT_THAT(set("fabric", "\xff"), HasSubstr("'?'"));
}

TEST_F(OptionsTest, OutOfRangeValue_MessageNamesRangeAndUnit) {
  EXPECT_EQ(set("solver.tolerance", "-1"),
            "solver.tolerance cannot be '-1': it takes a number in [0, 1] (m)");
  EXPECT_EQ(set("solver.substeps", "many"),
            "solver.substeps cannot be 'many': it takes an integer in [1, 100]");
}

struct BadValue {
  const char* name;
  const char* text;
};

class RefusedValues : public OptionsTest, public testing::WithParamInterface<BadValue> {};

INSTANTIATE_TEST_SUITE_P(
    All, RefusedValues,
    testing::Values(
        BadValue{"gravity", "yes"}, BadValue{"gravity", "1"}, BadValue{"gravity", ""},
        BadValue{"gravity", "TRUE"}, BadValue{"gravity", "true false"}, BadValue{"seed", ""},
        BadValue{"seed", "-1"}, BadValue{"seed", "1.5"}, BadValue{"seed", "1e3"},
        BadValue{"seed", "0x10"}, BadValue{"seed", "9223372036854775808"},
        BadValue{"seed", "99999999999999999999999"}, BadValue{"seed", "1 2"},
        BadValue{"seed", "+-1"}, BadValue{"seed", "++1"}, BadValue{"solver.substeps", "101"},
        BadValue{"solver.substeps", "2147483648"}, BadValue{"solver.substeps", "8,"},
        BadValue{"solver.tolerance", "nan"}, BadValue{"solver.tolerance", "NaN"},
        BadValue{"solver.tolerance", "inf"}, BadValue{"solver.tolerance", "-inf"},
        BadValue{"solver.tolerance", "1e999"}, BadValue{"solver.tolerance", "0,5"},
        BadValue{"solver.tolerance", "1.0m"}, BadValue{"solver.tolerance", "1.0000001"},
        BadValue{"solver.tolerance", "-1e-300"}, BadValue{"solver.tolerance", ""},
        BadValue{"solver.tolerance", "."}, BadValue{"wind", "[1, 2"}, BadValue{"wind", "1, 2]"},
        BadValue{"wind", "[1, nan]"}, BadValue{"wind", "[1,,2]"}, BadValue{"wind", "[1, 2,]"},
        BadValue{"wind", "[51]"}, BadValue{"wind", "[[1]]"}, BadValue{"wind", "a"},
        BadValue{"wind", ","}, BadValue{"fabric", ""}, BadValue{"fabric", "wool "},
        BadValue{"name", "a\nb"}, BadValue{"name", "\x7f"}, BadValue{"name", "\xff"},
        BadValue{"name", "\xc0\xaf"}, BadValue{"name", "\xed\xa0\x80"},
        BadValue{"name", "\xf4\x90\x80\x80"}, BadValue{"name", "\xe2\x82"},
        BadValue{"name", "\xc2\x85"}, BadValue{"method", "0"}));

TEST_P(RefusedValues, WrongText_IsRefusedWithOptionName) {
  const std::string before = canonical_json(table);
  EXPECT_THAT(set(GetParam().name, GetParam().text),
              HasSubstr(std::string(GetParam().name) + " cannot be '"));
  EXPECT_EQ(canonical_json(table), before);
}

TEST_F(OptionsTest, OverlongText_IsRefused) {
  EXPECT_THAT(set("name", std::string(70'000, 'a')), HasSubstr("name is 70000 bytes long"));
}

TEST_F(OptionsTest, LongWrongText_IsShortenedInMessage) {
  EXPECT_LT(set("solver.substeps", std::string(10'000, '9')).size(), 200u);
}

TEST_F(OptionsTest, RandomDoubles_RoundTripThroughText) {
  Random random{3, 0, 0};
  for (int i = 0; i < 2000; ++i) {
    const std::uint64_t bits = uniform_index(random, ~std::uint64_t{0});
    double value = 0;
    std::memcpy(&value, &bits, sizeof value);
    if (!std::isfinite(value)) {
      continue;
    }
    double target = value;
    OptionTable wide;
    wide.add("x", target, -std::numeric_limits<double>::max(), std::numeric_limits<double>::max(),
             "", "Anything");
    const std::string text = option_text(wide.fields[0]);
    target = 0;
    ASSERT_EQ(set_option(wide, "x", text), "");
    ASSERT_EQ(std::bit_cast<std::uint64_t>(target), std::bit_cast<std::uint64_t>(value)) << text;
  }
}

TEST_F(OptionsTest, CanonicalJson_IsSortedAndOmitsUnkeyedOptions) {
  EXPECT_EQ(canonical_json(table),
            R"({"fabric":"wool","gravity":true,"method":"direct","name":"dress","seed":7,)"
            R"("solver.substeps":8,"solver.tolerance":1e-06,"wind":[0,1.5,-2]})");
}

TEST_F(OptionsTest, CanonicalJson_DependsOnValuesOnly) {
  DrapeOptions other;
  OptionTable reversed;
  OptionTable forward = describe(other);
  for (auto it = forward.fields.rbegin(); it != forward.fields.rend(); ++it) {
    reversed.fields.push_back(*it);
  }
  EXPECT_EQ(set_option(reversed, "jobs", "4"), "");
  EXPECT_EQ(canonical_json(reversed), canonical_json(table));
  EXPECT_EQ(set_option(reversed, "seed", "8"), "");
  EXPECT_NE(canonical_json(reversed), canonical_json(table));
}

TEST_F(OptionsTest, CanonicalJson_EscapesText) {
  options.name = "a\"b\\c\td";
  EXPECT_THAT(canonical_json(table), HasSubstr(R"("name":"a\"b\\c\u0009d")"));
}

TEST_F(OptionsTest, NanInCanonicalJson_IsRefused) {
  options.solver.tolerance = std::nan("");
  EXPECT_THROW(canonical_json(table), LogicError);
  options.solver.tolerance = 0;
  options.wind = {std::numeric_limits<double>::infinity()};
  EXPECT_THROW(canonical_json(table), LogicError);
}

TEST_F(OptionsTest, Defaults_PassTheCheck) {
  EXPECT_THAT(check_options(table), IsEmpty());
}

TEST_F(OptionsTest, WrongValues_AreAllNamed) {
  options.seed = -1;
  options.fabric = "paper";
  options.wind = {0, std::nan("")};
  options.method = static_cast<Solver>(17);
  options.solver.substeps = 1000;
  options.solver.tolerance = std::numeric_limits<double>::infinity();
  const std::vector<std::string> problems = check_options(table);
  ASSERT_EQ(problems.size(), 6u);
  EXPECT_THAT(problems[0], HasSubstr("seed"));
  EXPECT_THAT(problems[1], HasSubstr("fabric"));
  EXPECT_THAT(problems[2], HasSubstr("wind"));
  EXPECT_THAT(problems[3], HasSubstr("method"));
  EXPECT_THAT(problems[4], HasSubstr("solver.substeps"));
  EXPECT_THAT(problems[5], HasSubstr("solver.tolerance"));
}

TEST_F(OptionsTest, NonFiniteValue_IsFoundInEveryField) {
  const double wrong[] = {std::nan(""), std::numeric_limits<double>::infinity(),
                          -std::numeric_limits<double>::infinity()};
  for (const double value : wrong) {
    DrapeOptions bad;
    bad.solver.tolerance = value;
    EXPECT_EQ(check_options(describe(bad)).size(), 1u);
    bad.solver.tolerance = 0;
    bad.wind = {value};
    EXPECT_EQ(check_options(describe(bad)).size(), 1u);
  }
}

TEST_F(OptionsTest, Markdown_HasOneRowPerField) {
  const std::string text = options_markdown(table);
  EXPECT_THAT(text, HasSubstr("| `solver.tolerance` | `1e-06` | number in [0, 1] | m | Where to "
                              "stop |\n"));
  EXPECT_THAT(text, HasSubstr("| `fabric` | `wool` | wool\\|cotton\\|silk |"));
  EXPECT_THAT(text, HasSubstr("Threads (not part of the key)"));
}

TEST_F(OptionsTest, Help_ShowsTheDefault) {
  EXPECT_THAT(
      options_help(table),
      HasSubstr("  --solver.tolerance <number in [0, 1]> m\n      Where to stop [1e-06]\n"));
}

TEST(OptionTable, BadOptionName_IsRefused) {
  double value = 0;
  for (const char* name :
       {"", ".", "a.", ".a", "a..b", "A", "a-b", "1a", "_a", "a b", "a.1", "ä"}) {
    OptionTable table;
    EXPECT_THROW(table.add(name, value, 0, 1, "", "help"), LogicError) << name;
  }
}

TEST(OptionTable, DuplicateName_IsRefused) {
  double value = 0;
  OptionTable table;
  table.add("a", value, 0, 1, "", "help");
  EXPECT_THROW(table.add("a", value, 0, 1, "", "help"), LogicError);
}

TEST(OptionTable, MissingHelp_IsRefused) {
  bool value = false;
  OptionTable table;
  EXPECT_THROW(table.add("a", value, ""), LogicError);
}

TEST(OptionTable, EmptyRange_IsRefused) {
  int value = 0;
  OptionTable table;
  EXPECT_THROW(table.add("a", value, 1, 0, "", "help"), LogicError);
  EXPECT_THROW(table.add("b", value, std::nan(""), 0, "", "help"), LogicError);
}

TEST(OptionTable, NotKeyedWithoutField_IsRefused) {
  OptionTable table;
  EXPECT_THROW(table.not_keyed(), LogicError);
}

TEST(OptionTable, NestedTable_AddsItsFields) {
  SolverOptions solver;
  bool gravity = true;
  OptionTable table;
  table.add("gravity", gravity, "Whether things fall").add(describe(solver));
  EXPECT_EQ(set_option(table, "substeps", "20"), "");
  EXPECT_EQ(solver.substeps, 20);
  EXPECT_THROW(table.add(describe(solver)), LogicError);  // there twice
}

TEST(OptionTable, HelpText_IsNormalized) {
  bool value = false;
  OptionTable table;
  table.add("a", value, "whether things fall.").add("b", value, "0 is none");
  EXPECT_EQ(table.fields[0].help, "Whether things fall");
  EXPECT_EQ(table.fields[1].help, "0 is none");
}

TEST(OptionTable, Refusals_AreFullSentences) {
  DrapeOptions options;
  OptionTable table = describe(options);
  EXPECT_EQ(set_option(table, "wind", "strong"),
            "wind cannot be 'strong': it takes a list of numbers in [-50, 50] (m/s)");
  EXPECT_EQ(set_option(table, "jobs", "1.5"),
            "jobs cannot be '1.5': it takes an integer in [0, 64]");
  EXPECT_EQ(set_option(table, "gravity", "yes"), "gravity cannot be 'yes': it takes true or false");
  EXPECT_EQ(set_option(table, "solver.tolerance", "inf"),
            "solver.tolerance cannot be 'inf': it takes a number in [0, 1] (m)");
}

TEST(OptionTable, LargeBounds_AreWrittenOut) {
  int frames = 1;
  double force = 1;
  OptionTable table;
  table.add("frames", frames, 0, 1e6, "", "help").add("force", force, 1e-6, 1e12, "N", "help");
  EXPECT_EQ(option_range(table.fields[0]), "integer in [0, 1000000]");
  EXPECT_EQ(option_range(table.fields[1]), "number in [1e-06, 1e+12]");
}

TEST(OptionSet, SetValue_ReachesTheHeldStruct) {
  OptionSet set = option_set<SolverOptions>();
  EXPECT_EQ(set_option(set.table, "substeps", "30"), "");
  EXPECT_EQ(options_of<SolverOptions>(set).substeps, 30);
  EXPECT_EQ(options_of<SolverOptions>(option_set<SolverOptions>()).substeps, 8);
}

TEST(OptionTable, OpenRange_ShowsOneBound) {
  double low = 1;
  double high = 1;
  double any = 1;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  OptionTable table;
  table.add("low", low, 0, kInfinity, "", "help");
  table.add("high", high, -kInfinity, 5, "", "help");
  table.add("any", any, -kInfinity, kInfinity, "", "help");
  EXPECT_EQ(option_range(table.fields[0]), "number >= 0");
  EXPECT_EQ(option_range(table.fields[1]), "number <= 5");
  EXPECT_EQ(option_range(table.fields[2]), "number");
}

}  // namespace
}  // namespace atelier
