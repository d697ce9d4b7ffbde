#include "bodymodel/formats/tailor_measurements.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/measure.h"
#include "core/error.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Pair;
using ::testing::ThrowsMessage;
using ::testing::UnorderedElementsAre;

std::string vit_of(const std::string& measurements, const std::string& unit = "cm",
                   const std::string& root = "vit") {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<" + root +
         ">\n<!--Measure created with a program-->\n<version>0.5.3</version><unit>" + unit +
         "</unit>\n<personal><gender>female</gender></personal>\n<body-measurements>" +
         measurements + "</body-measurements>\n</" + root + ">\n";
}

std::string measurement(const std::string& name, const std::string& value) {
  return "<m name=\"" + name + "\" value=\"" + value + "\"/>\n";
}

double value_of(const std::string& formula) {
  const TailorMeasurements found = parse_tailor_measurements(
      vit_of(measurement("a", formula) + measurement("waist_circ", "80"), "mm"), "a.vit");
  const auto a = found.lengths.find("a");
  return a == found.lengths.end() ? 0 : 1000 * a->second;
}

TEST(TailorMeasurements, Units_AreThoseOfTheFile) {
  for (const auto& [unit, metres] :
       {std::pair("mm", 0.001), std::pair("cm", 0.01), std::pair("inch", 0.0254)}) {
    for (const char* root : {"vit", "smis"}) {
      const TailorMeasurements found =
          parse_tailor_measurements(vit_of(measurement("height", "65.5"), unit, root), "a.vit");
      EXPECT_THAT(found.lengths, UnorderedElementsAre(Pair("height", 65.5 * metres)));
      EXPECT_TRUE(found.findings.empty());
    }
  }
}

TEST(TailorMeasurements, Formulas_AreOfOtherMeasurements) {
  EXPECT_DOUBLE_EQ(value_of("2 + 3*4"), 14);
  EXPECT_DOUBLE_EQ(value_of("(2+3) * -4"), -20);
  EXPECT_DOUBLE_EQ(value_of("2^3^2/4"), 128);
  EXPECT_DOUBLE_EQ(value_of("10 - 4 - 3"), 3);
  EXPECT_DOUBLE_EQ(value_of("waist_circ/4 + 1.5"), 21.5);
}

TEST(TailorMeasurements, FormulasOfAnotherKind_AreLeftOutWithAFinding) {
  for (const char* formula :
       {"sin(1)", "nothing", "a", "1 +", "", "(1", "1 2", "1/0", "--", "1;2"}) {
    const TailorMeasurements found =
        parse_tailor_measurements(vit_of(measurement("a", formula)), "a.vit");
    EXPECT_TRUE(found.lengths.empty()) << formula;
    ASSERT_EQ(found.findings.size(), 1U) << formula;
    EXPECT_EQ(found.findings[0].code, "measurement-formula");
  }
  EXPECT_EQ(value_of(std::string(60000, '(')), 0) << "deep";
  EXPECT_EQ(value_of("0"), 0) << "not taken";
}

TEST(TailorMeasurements, Separators_AreNoMeasurements) {
  const TailorMeasurements found = parse_tailor_measurements(
      vit_of("<m name=\"\" type=\"separator\"/>" + measurement("height", "160")), "a.vit");
  EXPECT_THAT(found.lengths, UnorderedElementsAre(Pair("height", 1.6)));
}

TEST(TailorMeasurements, BodyOfTheFile_MeasuresAsItSays) {
  const std::string text =
      vit_of(measurement("height", "172") + measurement("bust_circ", "waist_circ + 16") +
             measurement("waist_circ", "80") + measurement("hip_circ", "104") +
             measurement("neck_circ", "44") + measurement("leg_crotch_to_floor", "0"));
  TailorMeasurements found = parse_tailor_measurements(text, "a.vit");
  const DefaultHumanOptions human = with_measurements(female_human(), found);
  EXPECT_EQ(human.neck_girth, 0) << "at the base of the neck there, half way up here";
  ASSERT_EQ(found.findings.size(), 1U);
  EXPECT_EQ(found.findings[0].code, "measurements-taken");
  EXPECT_THAT(found.findings[0].what, HasSubstr("height, bust_circ, waist_circ, hip_circ"));
  const BodyMeasurements body = measure_body(default_human(human));
  EXPECT_NEAR(body.stature, 1.72, 1.72 * kHumanMeasureError);
  EXPECT_NEAR(body.chest_girth, 0.96, 0.96 * kHumanMeasureError);
  EXPECT_NEAR(body.waist_girth, 0.80, 0.80 * kHumanMeasureError);
  EXPECT_NEAR(body.hip_girth, 1.04, 1.04 * kHumanMeasureError);
}

TEST(TailorMeasurements, FileWithoutAnyThatTheBodyKnows_IsSaid) {
  TailorMeasurements found =
      parse_tailor_measurements(vit_of(measurement("hand_length", "19")), "a.vit");
  EXPECT_EQ(with_measurements(male_human(), found).stature, 0);
  ASSERT_EQ(found.findings.size(), 1U);
  EXPECT_EQ(found.findings[0].severity, Severity::Warning);
}

TEST(TailorMeasurementsRefused, TablesOfSizes_AreNamed) {
  EXPECT_THAT([] { parse_tailor_measurements(vit_of("", "cm", "vst"), "a.vst"); },
              ThrowsMessage<DataError>(HasSubstr("a table of sizes")));
}

TEST(TailorMeasurementsRefused, FilesWithoutMeasurements_SaySo) {
  EXPECT_THAT([] { parse_tailor_measurements("", "a.vit"); },
              ThrowsMessage<DataError>(HasSubstr("an empty file; expected measurements")));
  EXPECT_THAT([] { parse_tailor_measurements(vit_of(""), "a.vit"); },
              ThrowsMessage<DataError>(HasSubstr("no measurement; expected <m name=")));
}

TEST(TailorMeasurementsRefused, UnitsOfNobody_AreNamed) {
  EXPECT_THAT(
      [] { parse_tailor_measurements(vit_of(measurement("height", "2"), "foot"), "a.vit"); },
      ThrowsMessage<DataError>(HasSubstr("the unit 'foot'; expected mm, cm or inch")));
  // Inches that say cm.
  TailorMeasurements found =
      parse_tailor_measurements(vit_of(measurement("height", "70.5")), "a.vit");
  EXPECT_THAT([&] { with_measurements(female_human(), found); },
              ThrowsMessage<DataError>(AllOf(HasSubstr("height is 0.705 m, in cm as the file says"),
                                             HasSubstr("expected <unit>"))));
  found = parse_tailor_measurements(vit_of(measurement("height", "70.5"), "inch"), "a.vit");
  EXPECT_EQ(unlikely_measurement(found), "");
}

}  // namespace
}  // namespace atelier
