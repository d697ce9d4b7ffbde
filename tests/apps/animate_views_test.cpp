// From where images of a motion are taken.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL)

#include <numbers>

#include "core/io/image_file.h"
#include "tests/apps/animate_fixture.h"

namespace atelier::fixtures {
namespace {

class AnimateViews : public Animate {
 protected:
  void SetUp() override {
    Animate::SetUp();
    if (!IsSkipped()) {
      write_dressed_workspace(capture(), workspace());
      // Broader than deep and stouter on the left, so that every side looks another.
      BodyModel stout = trunk_body();
      for (Index v = 0; v < stout.mesh.vertices.rows(); ++v) {
        double& x = stout.mesh.vertices(v, 0);
        x *= x > 0 ? 1.6 : 1;
      }
      write_body(root_ / "stout.npz", stout);
    }
  }
  /// The first image of somebody who stands turned to the left by `yaw`, radians.
  ByteImage picture(double yaw, const std::string& camera) const {
    MotionClip clip = person_clip();
    for (Pose& pose : clip.motion.poses) {
      pose.rotations.row(0) << 0, yaw, 0;
      pose.root_translation.setZero();
    }
    const ChildResult done = stage(
        "animate", {"--motion", motion(clip).string(), "--garment", "none", "--body",
                    (root_ / "stout.npz").string(), "--camera", camera, "--background", "black",
                    "--width", "48", "--height", "64", "--samples", "4", "--seconds", "0.01"});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return read_byte_image(result() / "pictures" / "000000.png");
  }
  /// Share of values that clearly differ.
  static double difference(const ByteImage& a, const ByteImage& b) {
    EXPECT_EQ(a.data.size(), b.data.size());
    double count = 0;
    for (std::size_t i = 0; i < std::min(a.data.size(), b.data.size()); ++i) {
      count += std::abs(int{a.data[i]} - int{b.data[i]}) > 12 ? 1 : 0;
    }
    return count / static_cast<double>(a.data.size());
  }
};

TEST_F(AnimateViews, NamedViews_FollowTheFacingOfTheFirstFrame) {
  constexpr double kPi = std::numbers::pi;
  for (const char* camera : {"front", "three-quarter", "orbit"}) {
    const ByteImage straight = picture(0, camera);
    EXPECT_GT(difference(straight, picture(0, "back")), 0.1);
    for (const double yaw : {kPi, kPi / 2, -kPi / 2}) {
      EXPECT_LT(difference(straight, picture(yaw, camera)), 0.01) << camera << " of " << yaw;
    }
  }
}

}  // namespace
}  // namespace atelier::fixtures

#endif
