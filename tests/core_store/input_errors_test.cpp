#include "core/store/input_errors.h"

#include <array>

#include <gtest/gtest.h>

namespace atelier {
namespace {

constexpr std::array kMetrics = {
    StageMetric{.name = "garments", .unit = ""},
    StageMetric{.name = "not_whole", .unit = "garments", .input_errors = true},
    StageMetric{.name = "errors", .unit = "", .input_errors = true},
};

TEST(InputErrors, MetricsThatCountThem_AreTold) {
  Stage stage;
  stage.metrics = kMetrics;
  Manifest manifest;
  manifest.metrics = {{"garments", 2}, {"not_whole", 0}};
  EXPECT_EQ(input_errors_text(stage, manifest), "");
  manifest.metrics["not_whole"] = 1;
  EXPECT_EQ(input_errors_text(stage, manifest), "1 not_whole (garments)");
  manifest.metrics["errors"] = 3;
  EXPECT_EQ(input_errors_text(stage, manifest), "1 not_whole (garments), 3 errors");
}

}  // namespace
}  // namespace atelier
