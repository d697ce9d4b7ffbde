// A good capture stays one in every layout that is written: validate finds no error in it.

#include <gtest/gtest.h>

#include "capture/layouts/write_layout.h"
#include "tests/capture/seeded_defects.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

class WrittenLayout : public ::testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Layouts, WrittenLayout, ::testing::ValuesIn(layout_names()),
                         [](const auto& layout) { return layout.param; });

TEST_P(WrittenLayout, LayoutOfGoodCapture_HasNoError) {
  static const SeededCapture good = [] {
    SeededRig rig = seeded_rigs().front();
    rig.frames = 3;
    return seeded_capture(rig);
  }();
  const TemporaryDirectory folder;
  write_seeded(good, folder / "capture");
  const LayoutReport report = write_layout(folder / "capture", GetParam(), folder / "out");
  EXPECT_FALSE(report.lost.empty());  // of the native one, which classes of LIP are joined
  ASSERT_FALSE(report.folders.empty());
  for (const Finding& finding : findings_of(report.folders.front())) {
    EXPECT_NE(finding.severity, Severity::Error) << to_string(finding);
  }
}

}  // namespace
}  // namespace atelier::fixtures
