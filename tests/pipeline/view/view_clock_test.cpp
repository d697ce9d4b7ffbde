// When the frames of a page's layers are shown: rates, takes, sequences that begin together; and
// how two places are told apart.

#include "pipeline/view/view_clock.h"

#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/sequence_archive.h"
#include "pipeline/view/view_beside.h"
#include "pipeline/view/view_meshes.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<int> numbers(int first, int count) {
  std::vector<int> ids(static_cast<std::size_t>(count));
  std::iota(ids.begin(), ids.end(), first);
  return ids;
}

ViewLayer layer_of(const std::string& name, double fps, std::vector<int> frame_ids) {
  ViewLayer layer;
  layer.name = name;
  layer.sequence.fps = fps;
  layer.sequence.frame_ids = std::move(frame_ids);
  return layer;
}

/// "name fps first" of each take.
std::vector<std::string> takes_of(const ViewTimeline& timeline) {
  std::vector<std::string> takes;
  for (const ViewTake& take : timeline.takes) {
    takes.push_back(take.name + " " + std::to_string(take.fps).substr(0, 4) + " " +
                    std::to_string(take.first));
  }
  return takes;
}

TEST(ViewClock, LayersOfOneRate_ShareTheirNumbers) {
  ViewTimeline timeline;
  timeline.layers = {layer_of("body", 30, {3, 4, 5}), layer_of("dress", 30.000001, {4, 5, 6}),
                     layer_of("hat", 0, {7})};
  set_layer_frames(timeline);
  EXPECT_THAT(timeline.frame_ids, ElementsAre(3, 4, 5, 6, 7));
  EXPECT_THAT(takes_of(timeline), ElementsAre(" 30.0 0"));
  EXPECT_THAT(timeline.layers[1].begins, IsEmpty());
}

TEST(ViewClock, RatesWhoseNumbersLieBehindEachOther_AreTakes) {
  ViewTimeline timeline;
  timeline.layers = {layer_of("clothed", 12, numbers(10, 5)),
                     layer_of("minimal", 0.5, numbers(0, 3))};
  set_layer_frames(timeline);
  EXPECT_THAT(timeline.frame_ids, ElementsAre(0, 1, 2, 10, 11, 12, 13, 14));
  EXPECT_THAT(takes_of(timeline), ElementsAre("minimal 0.50 0", "clothed 12.0 3"));
  EXPECT_THAT(timeline.layers[0].begins, IsEmpty());
}

TEST(ViewClock, RatesWithTheSameNumbers_BeginTogetherAndShowWhatIsDue) {
  ViewTimeline timeline;
  timeline.layers = {layer_of("dress", 12, numbers(0, 4)), layer_of("body", 30, numbers(0, 6))};
  set_layer_frames(timeline);
  // A third of a second is 10 frames of 30; those of the body end after 6.
  EXPECT_THAT(timeline.frame_ids, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_THAT(takes_of(timeline), ElementsAre(" 30.0 0"));
  EXPECT_THAT(timeline.layers[0].begins, ElementsAre(0, 3, 5, 8, 10));
  EXPECT_THAT(timeline.layers[1].begins, IsEmpty());
}

TEST(ViewClock, SlowMotionOfOtherNumbers_IsCountedFromItsOwnBegin) {
  ViewTimeline timeline;
  timeline.layers = {layer_of("clothed", 12, numbers(100, 3)),
                     layer_of("minimal", 4, {99, 100, 102})};
  set_layer_frames(timeline);
  EXPECT_THAT(timeline.frame_ids, ElementsAre(100, 101, 102, 103, 104, 105, 106, 107, 108));
  EXPECT_THAT(timeline.layers[1].begins, ElementsAre(100, 103, 106, 109));
}

TEST(ViewClock, RatesTooFarApartToBeginTogether_AreShownByTheirNumbers) {
  ViewTimeline timeline;
  timeline.layers = {layer_of("body", 30, numbers(0, 3)), layer_of("sun", 1e-9, numbers(0, 4))};
  set_layer_frames(timeline);
  EXPECT_THAT(timeline.frame_ids, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(timeline.layers[1].begins, IsEmpty());
}

TEST(ViewClock, SequencesOfACapture_AreTakesOfTheirRates) {
  ViewTimeline timeline;
  timeline.layers = {layer_of("body", 12, {20, 21, 22, 30})};
  const std::vector<CaptureSequence> sequences = {{"clothed", "clothed", 12, {20, 21, 22}},
                                                  {"minimal", "minimal", 0.5, {1, 2}}};
  set_capture_frames(timeline, sequences, {1, 2, 20, 21});
  EXPECT_THAT(timeline.frame_ids, ElementsAre(1, 2, 20, 21, 22, 30));
  EXPECT_THAT(takes_of(timeline), ElementsAre("minimal 0.50 0", "clothed 12.0 2"));
}

TEST(ViewClock, OneFrameWithoutARate_HasATakeAllTheSame) {
  ViewTimeline timeline;
  timeline.layers = {layer_of("scan", 0, {5})};
  set_layer_frames(timeline);
  EXPECT_THAT(timeline.frame_ids, ElementsAre(5));
  EXPECT_THAT(takes_of(timeline), ElementsAre(" 1.00 0"));
}

TEST(ViewBeside, PlacesOfOneName_AreToldByTheFoldersAroundThem) {
  EXPECT_THAT(names_apart("/a/monday/walk", "/a/tuesday/walk/"),
              ElementsAre("monday/walk", "tuesday/walk"));
  EXPECT_THAT(names_apart("/a/x/body/current", "/a/y/body/current"),
              ElementsAre("x/body/current", "y/body/current"));
  EXPECT_THAT(names_apart("/walk", "/a/walk"), ElementsAre("walk", "a/walk"));
  EXPECT_THAT(names_apart("run", "walk"), ElementsAre("run", "walk"));
  EXPECT_THAT(names_apart("a/walk", "a/./walk/"), ElementsAre("walk (1)", "walk (2)"));
}

Mesh triangle(double size) {
  Mesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, 0, 0, size, 0, 0, 0, size, 0;
  mesh.faces.resize(1, 3);
  mesh.faces << 0, 1, 2;
  return mesh;
}

TEST(ViewMeshes, ScansNamedByAnyNumber_AreReadAndTwoOfOneFrameRefused) {
  const TemporaryDirectory root;
  write_mesh_archive(root.path() / "12.h5", triangle(1));
  write_mesh_archive(root.path() / "000003.h5", triangle(2));
  const Sequence scans = scans_in(root.path(), 24);
  EXPECT_THAT(scans.frame_ids, ElementsAre(3, 12));
  EXPECT_EQ(frame(scans, 0).vertices(1, 0), 2);
  EXPECT_EQ(frame(scans, 1).vertices(1, 0), 1);
  write_mesh_archive(root.path() / "000012.h5", triangle(3));
  EXPECT_THROW(scans_in(root.path(), 24), DataError);
}

}  // namespace
}  // namespace atelier::fixtures
