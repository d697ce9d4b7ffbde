// What a user says of a capture's cameras: what no capture can take is known without one.

#include "capture/layouts/corrections.h"

#include <gtest/gtest.h>

#include "capture/layouts/open_dataset.h"
#include "core/usage_error.h"
#include "tests/capture/small_capture.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

TEST(Corrections, AdvisedCorrections_AreAccepted) {
  const std::pair<const char*, const char*> good[] = {
      {"leave_out", "cam3,cam5"},
      {"sync", "cam3=-4,cam5=2"},
      {"sync", "all=0"},
      {"calibration_of", "cam3=cam5,cam5=cam3"},
      {"extrinsics", "all=inverse"},
      {"extrinsics", "cam3=inverse_opengl,cam4=position"},
      {"baseline", "cam3=0.001"},
      {"intrinsics", "all=0.5,cam3=swapped_centre"},
      {"distortion", "all=k3_third"},
      {"pixel_shift", "all=-0.5"},
      {"turned", "cam3=90,cam4=270"},
      {"keypoints", "cam3=shares"},
      {"keypoints", "cam3=0.5"},
      {"masks", "all=inverted"},
      {"sync", ""},
      {"up", "no correction"},
  };
  for (const auto& [option, text] : good) {
    EXPECT_EQ(correction_problem(option, text), "") << option << " " << text;
  }
}

TEST(Corrections, MalformedCorrections_AreRefused) {
  const std::pair<std::pair<const char*, const char*>, const char*> bad[] = {
      {{"sync", "x"}, "cannot be 'x': it takes CAMERA=VALUE,CAMERA=VALUE"},
      {{"sync", "00=abc"}, "cannot be 'abc': it takes a number of frames"},
      {{"sync", "00=1.5"}, "a number of frames"},
      {{"sync", "00=9999999"}, "a number of frames"},
      {{"sync", "00="}, "CAMERA=VALUE"},
      {{"sync", "=3"}, "CAMERA=VALUE"},
      {{"sync", "00=3,,"}, "CAMERA=VALUE"},
      {{"leave_out", "00,,01"}, "CAMERA,CAMERA"},
      {{"extrinsics", "00=foo"}, "cannot be 'foo': it takes inverse, transposed"},
      {{"distortion", "00=foo"}, "k3_third"},
      {{"sync", "all=1"}, "cannot be 'all=1': it takes shifts of some cameras against the others"},
      {{"intrinsics", "00=0"},
       "cannot be '0': it takes swapped_centre or a factor, above 0.000001 and below 1000000"},
      {{"intrinsics", "00=nan"}, "swapped_centre or a factor"},
      {{"baseline", "00=-1"}, "a factor on translations"},
      {{"pixel_shift", "00=left"}, "pixels"},
      {{"turned", "00=45"}, "90, 180 or 270"},
      {{"keypoints", "00=foo"}, "mirrored"},
      {{"masks", "all=foo"}, "cannot be 'foo': it takes inverted"},
      {{"calibration_of", "all=00"}, "one camera on each side"},
      {{"calibration_of", "00=all"}, "one camera on each side"},
  };
  for (const auto& [value, words] : bad) {
    EXPECT_THAT(correction_problem(value.first, value.second), HasSubstr(words))
        << value.first << " " << value.second;
  }
}

TEST(Corrections, ShiftOfAllCamerasAlike_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  const fixtures::SmallCapture small;
  fixtures::write_small_capture(folder / "capture", small);
  DatasetOptions options;
  options.corrections.sync = "00=1,01=1,02=1";
  ATELIER_EXPECT_REFUSED(open_dataset(folder / "capture", options), UsageError,
                         "capture.sync cannot be '00=1,01=1,02=1': it takes shifts of some");
  options.corrections.sync = "all=1,02=0";
  const Dataset dataset = open_dataset(folder / "capture", options);
  EXPECT_EQ(dataset.frames[0].images.frames().front(), small.frames[0] + 1);
  EXPECT_EQ(dataset.frames[2].images.frames().front(), small.frames[0]);
}

TEST(Corrections, UnknownCamera_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  fixtures::write_small_capture(folder / "capture");
  DatasetOptions options;
  options.corrections.sync = "09=1";
  EXPECT_EQ(correction_problem("sync", options.corrections.sync), "");
  ATELIER_EXPECT_REFUSED(open_dataset(folder / "capture", options), UsageError,
                         "'all', or one of 00, 01, 02");
}

}  // namespace
}  // namespace atelier
