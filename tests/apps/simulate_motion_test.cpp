#if defined(ATELIER_HAS_SIMULATION) && defined(ATELIER_HAS_CAPTURE_SURFACE) && \
    defined(ATELIER_HAS_BODYMODEL)

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/motion_bvh.h"
#include "core/io/mesh_file.h"
#include "core/sequence_archive.h"
#include "tests/apps/dressed_workspace.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

/// The trunk walks out of a skirt that is held at its waist: the waist goes along.
TEST(SimulateMotion, GarmentOnAMovingBody_MovesAlong) {
  const TemporaryDirectory root;
  write_body(root / "trunk.npz", trunk_body());
  const Garment skirt = tube_skirt();
  write_mesh(root / "skirt.ply", skirt.mesh);
  MotionClip clip;
  clip.name = "walk";
  clip.skeleton = short_walk().skeleton;
  clip.motion = short_walk().motion;
  write_bvh(root / "walk.bvh", clip);
  const ChildResult done =
      run_child({program_path(), "simulate", "--garment", (root / "skirt.ply").string(), "--body",
                 (root / "trunk.npz").string(), "--motion", (root / "walk.bvh").string(), "--out",
                 (root / "out").string(), "--fps", "24", "--settle", "3", "--fall_in", "0.25",
                 "--pin_top", "0.01", "--no-pictures"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const Sequence worn = open_sequence(root / "out" / "garment");
  ASSERT_EQ(frame_count(worn), 3 + 6 + 4) << "settles, falls in, walks two frames of 1/12 s";
  const Points first = frame(worn, 2).vertices;
  const Points last = frame(worn, 12).vertices;
  double moved = 0;
  for (const int v : skirt.boundaries[0]) {
    EXPECT_LT((first.row(v) - skirt.mesh.vertices.row(v)).norm(), 1e-3) << "still on the rest pose";
    moved += (last(v, 2) - first(v, 2)) / static_cast<double>(skirt.boundaries[0].size());
  }
  EXPECT_NEAR(moved, 0.04, 0.01);
}

/// What the motion's reader has found is said, not kept.
TEST(SimulateMotion, MotionOfADoubtfulRate_IsTold) {
  const TemporaryDirectory root;
  write_body(root / "trunk.npz", trunk_body());
  write_mesh(root / "skirt.ply", tube_skirt().mesh);
  MotionClip clip;
  clip.name = "walk";
  clip.skeleton = short_walk().skeleton;
  clip.motion = short_walk().motion;
  clip.motion.fps = 0.4;  // a file of another unit of time, but soon simulated
  write_bvh(root / "walk.bvh", clip);
  const ChildResult done =
      run_child({program_path(), "simulate", "--garment", (root / "skirt.ply").string(), "--body",
                 (root / "trunk.npz").string(), "--motion", (root / "walk.bvh").string(), "--out",
                 (root / "out").string(), "--fps", "4", "--settle", "1", "--fall_in", "0.25",
                 "--pin_top", "0.01", "--no-pictures"});
  EXPECT_THAT(done.out + done.err, ::testing::HasSubstr("0.4 frames a second, 2.5 s each"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
