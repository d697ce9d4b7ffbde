#include "core/nearest_name.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/utf8.h"

namespace atelier {
namespace {

const std::vector<std::string> kNames = {"register", "simulate", "solver.substeps", "export"};

TEST(NearestName, OneLetterTypos_AreCorrected) {
  EXPECT_EQ(nearest_name("regiister", kNames), "register");
  EXPECT_EQ(nearest_name("registr", kNames), "register");
  EXPECT_EQ(nearest_name("simulote", kNames), "simulate");
  EXPECT_EQ(nearest_name("simluate", kNames), "simulate");
  EXPECT_EQ(nearest_name("exprot", kNames), "export");
}

TEST(NearestName, LastPartOfDottedName_IsFound) {
  EXPECT_EQ(nearest_name("substeps", kNames), "solver.substeps");
  EXPECT_EQ(nearest_name("cloth.substeps", kNames), "solver.substeps");
  EXPECT_EQ(nearest_name("--unit", {"--out", "--input.up", "--input.unit"}), "--input.unit");
  EXPECT_EQ(nearest_name("--", {"--input.unit"}), "");
}

TEST(NearestName, LeadingDashes_DoNotCountAsSimilar) {
  EXPECT_EQ(nearest_name("--keep", {"--help"}), "");
  EXPECT_EQ(nearest_name("--hlep", {"--help"}), "--help");
  EXPECT_EQ(nearest_name("-help", {"--help"}), "--help");
}

TEST(NearestName, Gpu_IsNotTakenForCpu) {
  EXPECT_EQ(nearest_name("gpu", {"cpu", "cuda"}), "cuda");
  EXPECT_EQ(nearest_name("GPU", {"cpu", "cuda"}), "cuda");
  EXPECT_EQ(nearest_name("gpu", {"cpu", "other"}), "cpu");
}

TEST(NearestName, LetterCase_IsIgnored) {
  EXPECT_EQ(nearest_name("--JSON", {"--help", "--json"}), "--json");
  EXPECT_EQ(nearest_name("CUDA", {"cpu", "cuda"}), "cuda");
  EXPECT_EQ(nearest_name("Gpu", {"cpu", "cuda"}), "cuda");
  EXPECT_EQ(nearest_name("MM", {"m", "dm", "mm"}), "mm");
  EXPECT_EQ(nearest_name("SUBSTEPS", kNames), "solver.substeps");
  EXPECT_EQ(nearest_name("expert", {"Export"}), "Export");
  EXPECT_EQ(nearest_name("\xC3\x84", {"\xC3\xA4"}), "") << "letters beyond ASCII stay";
}

TEST(NearestName, DistantNames_GiveNoSuggestion) {
  EXPECT_EQ(nearest_name("banana", kNames), "");
  EXPECT_EQ(nearest_name("", kNames), "");
  EXPECT_EQ(nearest_name("export", {}), "");
  EXPECT_EQ(nearest_name(std::string(100'000, 'e'), kNames), "");
}

TEST(NearestName, DidYouMean_GivesMessageSuffix) {
  EXPECT_EQ(did_you_mean("exprot", kNames), ", did you mean 'export'?");
  EXPECT_EQ(did_you_mean("banana", kNames), "");
}

TEST(PrintableUtf8, ValidText_IsAccepted) {
  for (const char* text : {"", "abc", "Zoë", "布", "👗", "\xc2\xa0", "\xf4\x8f\xbf\xbf"}) {
    EXPECT_TRUE(is_printable_utf8(text)) << text;
  }
}

TEST(PrintableUtf8, ControlCharactersAndBadUtf8_AreRefused) {
  for (const char* text : {"\n", "\t", "\x1b[31m", "\x7f", "\x80", "\xc1\x81", "\xe0\x80\x80",
                           "\xf0\x80\x80\x80", "\xed\xbf\xbf", "\xf5\x80\x80\x80", "\xc3",
                           "a\xe2\x82", "\xc2\x9f", "\xc3\x28", "\xe2\x80\xae", "\xe2\x81\xa9"}) {
    EXPECT_FALSE(is_printable_utf8(text)) << text;
  }
  EXPECT_FALSE(is_printable_utf8(std::string(1, '\0')));
}

}  // namespace
}  // namespace atelier
