// A shadow that is cast on printed cloth and moves over it between the template's frame and the one
// that is registered: its edge is no part of the print, and must not be taken for one that slid.
#include <algorithm>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "registration/tracking/register_garment.h"
#include "tests/registration/registered_shapes.h"

namespace atelier {
namespace {

constexpr double kTwist = 0.06;  // rad: 9 mm along the surface, which the shape does not show

using Light = std::function<double(double angle, double y)>;

/// Light that falls to a third below a slanting line, within a centimetre, as behind an arm.
Light shadow_below(double height) {
  return [=](double angle, double y) {
    const double above = y - height - 0.04 * std::sin(angle);
    return 0.33 + 0.67 * std::clamp(0.5 + above / 0.01, 0.0, 1.0);
  };
}

double no_shadow(double, double) {
  return 1;
}

/// How far vertices come out from where they are, m, in the mean over those within 3 cm of the
/// shadow's edge in the registered frame.
/// @param contrast  of the print, against the blotches' own
double error_at_edge(const Light& before, const Light& now, double contrast = 1) {
  constexpr double kEdge = 1.0;  // m
  constexpr double kNear = 0.03;
  Garment garment;
  garment.name = "tube";
  garment.mesh = fixtures::cloth_tube(30, 16);
  RegisterOptions options;
  options.photometric_levels = 3;
  options.sample_spacing = 0.008;
  const RegistrationModel model = registration_model(garment, options);
  const auto print = [=](double angle, double y) {
    return 0.4 + contrast * (fixtures::blotches(angle, y) - 0.4);
  };
  RegistrationFrame first;
  first.views =
      fixtures::cylinder_views(3, [&](double u, double y) { return before(u, y) * print(u, y); });
  GarmentTexture texture;
  add_texture(texture, model.samples,
              {model.cloth.topology, model.vertices, first.views,
               garment_views(model, model.vertices, first)});
  RegistrationFrame frame;
  frame.scan = garment_scan(fixtures::cloth_tube(60, 33), {});
  frame.views = fixtures::cylinder_views(
      3, [&](double u, double y) { return now(u, y) * print(u - kTwist, y); });
  const Points expected = fixtures::screwed(model.vertices, kTwist, 0);
  ShapeSolver solver(model.cloth);
  const Points found =
      register_garment(solver, model, model.vertices, frame, {&texture}, options).vertices;
  double sum = 0;
  double count = 0;
  for (Index v = 0; v < found.rows(); ++v) {
    const double angle = std::atan2(-expected(v, 2), expected(v, 0));
    if (std::abs(expected(v, 1) - kEdge - 0.04 * std::sin(angle)) < kNear) {
      sum += (found.row(v) - expected.row(v)).norm();
      count += 1;
    }
  }
  return sum / count;
}

TEST(CastShadow, ShadowEdge_DoesNotDragThePrint) {
  constexpr double kMost = 0.0004;  // m more than in even light
  for (const double contrast : {1.0, 0.3}) {
    const double lit = error_at_edge(no_shadow, no_shadow, contrast);
    EXPECT_LT(lit, 0.0006) << contrast;
    EXPECT_LT(error_at_edge(no_shadow, shadow_below(1.0), contrast), lit + kMost) << contrast;
    EXPECT_LT(error_at_edge(shadow_below(1.0), no_shadow, contrast), lit + kMost) << contrast;
    EXPECT_LT(error_at_edge(shadow_below(0.97), shadow_below(1.0), contrast), lit + kMost)
        << contrast;
  }
}

}  // namespace
}  // namespace atelier
