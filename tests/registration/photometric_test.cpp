#include "registration/tracking/photometric.h"

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "registration/tracking/register_garment.h"
#include "tests/registration/registered_shapes.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

using fixtures::blotches;

constexpr int kLevels = 3;

/// A tube, its texture where it is, and what is seen after it has slid along itself.
struct Slid {
  Mesh mesh = fixtures::cloth_tube(30, 16);
  ClothModel model = cloth_model(mesh.vertices, mesh.faces);
  ClothSamples samples = cloth_samples(mesh.vertices, mesh.faces, 0.008);
  GarmentTexture texture;
  std::vector<ViewPyramid> views;
  std::vector<std::vector<float>> seen;

  explicit Slid(double angle, double lift) {
    const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
    const auto before = fixtures::cylinder_views(kLevels, blotches);
    seen = vertex_views(mesh.vertices, mesh.faces, before, {&tree});
    add_texture(texture, samples, {model.topology, mesh.vertices, before, seen});
    // Half as bright, darker to one side: neither is a motion.
    views = fixtures::cylinder_views(kLevels, [=](double u, double y) {
      return (0.4 + 0.2 * std::cos(u)) * blotches(u - angle, y - lift);
    });
  }

  PhotometricTerm term(const Points& x, int level) const {
    return photometric_term({model.topology, x, views, seen}, samples, {&texture}, level);
  }
};

TEST(Photometric, CorrectPosition_StaysUnchanged) {
  const Slid slid(0, 0);
  const PhotometricTerm term = slid.term(slid.mesh.vertices, 0);
  int compared = 0;
  double sum = 0;
  for (Index v = 0; v < slid.mesh.vertices.rows(); ++v) {
    if (term.views[v] > 0) {
      EXPECT_GT(term.correlation[v], 0.7);  // a patch's shade is no factor
      sum += term.correlation[v];
      ++compared;
    }
  }
  EXPECT_GT(compared, slid.mesh.vertices.rows() / 2);
  EXPECT_GT(sum / compared, 0.9);
}

TEST(Photometric, LaterTextureThatMatchesBetter_IsComparedInstead) {
  const Slid slid(0.06, 0.007);
  GarmentTexture later;  // as the slid pictures show the cloth where it is: nothing has moved
  add_texture(later, slid.samples,
              {slid.model.topology, slid.mesh.vertices, slid.views, slid.seen});
  const auto pull = [&](const std::vector<const GarmentTexture*>& textures) {
    double sum = 0;
    for (const FaceQuadratic& face :
         photometric_term({slid.model.topology, slid.mesh.vertices, slid.views, slid.seen},
                          slid.samples, textures, 0)
             .quadratics) {
      sum += face.g.norm();
    }
    return sum;
  };
  EXPECT_LT(pull({&slid.texture, &later}), 0.6 * pull({&slid.texture}));
  // One that matches no better changes nothing, and an empty one is none.
  const GarmentTexture none;
  EXPECT_EQ(pull({&slid.texture, &slid.texture}), pull({&slid.texture}));
  EXPECT_EQ(pull({&slid.texture, &none}), pull({&slid.texture}));
}

TEST(Photometric, KnownSlideOnACylinder_IsRecovered) {
  const double angle = 0.06;  // 9 mm
  const double lift = 0.007;  // m
  const Slid slid(angle, lift);
  const Points expected = fixtures::screwed(slid.mesh.vertices, angle, lift);
  ShapeSolver solver(slid.model);
  Points x = slid.mesh.vertices;
  for (int level = kLevels - 1; level >= 0; --level) {
    for (int step = 0; step < 4; ++step) {
      ClothTerms terms;
      terms.stretch = terms.compress = 0.04;
      terms.quadratics = slid.term(x, level).quadratics;
      terms.origin = x;
      const Points normals = vertex_normals(x, slid.mesh.faces);
      for (int v = 0; v < static_cast<int>(x.rows()); ++v) {  // the shape is known
        SurfaceRow row;
        row.vertices = {v, v, v};
        row.normal = Eigen::Vector3d(x(v, 0), 0, x(v, 2)).normalized();
        row.offset = 0.15;
        row.weight = slid.model.areas[v];
        terms.rows.push_back(row);
      }
      x = solver.lower(terms, x);
    }
  }
  const Eigen::VectorXd before = (slid.mesh.vertices - expected).rowwise().norm();
  const Eigen::VectorXd after = (x - expected).rowwise().norm();
  EXPECT_GT(before.mean(), 0.011);
  EXPECT_LT(after.mean(), 0.0006);
  EXPECT_LT(after.maxCoeff(), 0.004);
}

TEST(Photometric, AnyThreadCount_GivesTheSameTerm) {
  const Slid slid(0.03, 0);
  const auto at = [&] { return slid.term(slid.mesh.vertices, 1); };
  set_thread_count(1);
  const PhotometricTerm one = at();
  set_thread_count(3);
  const PhotometricTerm three = at();
  set_thread_count(0);
  ASSERT_EQ(one.quadratics.size(), three.quadratics.size());
  EXPECT_EQ(one.energy, three.energy);
  for (std::size_t i = 0; i < one.quadratics.size(); ++i) {
    EXPECT_EQ(one.quadratics[i].H, three.quadratics[i].H);
    EXPECT_EQ(one.quadratics[i].g, three.quadratics[i].g);
  }
}

TEST(Photometric, PhotometricGradient_LeadsDownhill) {
  const Slid slid(0.02, 0);
  const auto energy = [&](const Points& x) { return slid.term(x, 1).energy; };
  const Points at = slid.mesh.vertices;
  EXPECT_LT(energy(fixtures::screwed(at, 0.01, 0)), energy(at));
  EXPECT_GT(energy(fixtures::screwed(at, -0.01, 0)), energy(at));
}

TEST(Photometric, PlainCloth_GivesNoTerm) {
  Slid slid(0, 0);
  slid.views = fixtures::cylinder_views(kLevels, [](double, double) { return 0.4; });
  slid.texture = {};
  add_texture(slid.texture, slid.samples,
              {slid.model.topology, slid.mesh.vertices, slid.views, slid.seen});
  const PhotometricTerm term = slid.term(fixtures::screwed(slid.mesh.vertices, 0.03, 0), 0);
  double most = 0;
  for (const FaceQuadratic& q : term.quadratics) {
    most = std::max(most, q.g.norm());
  }
  EXPECT_LT(most, 1e-9);
}

TEST(Photometric, OccludedCloth_IsNotVisible) {
  const Mesh mesh = fixtures::cloth_tube(24, 8);
  const TriangleTree own = build_tree(mesh.vertices, mesh.faces);
  const auto views = fixtures::cylinder_views(1, blotches);
  const auto open = vertex_views(mesh.vertices, mesh.faces, views, {&own});
  Mesh coat = fixtures::cloth_tube(24, 8);
  coat.vertices.col(0) *= 1.5;
  coat.vertices.col(2) *= 1.5;
  const TriangleTree around = build_tree(coat.vertices, coat.faces);
  const auto hidden = vertex_views(mesh.vertices, mesh.faces, views, {&own, &around});
  for (std::size_t c = 0; c < views.size(); ++c) {
    const Eigen::Vector3d centre = camera_center(views[c].camera);
    for (Index v = 0; v < mesh.vertices.rows(); ++v) {
      const Eigen::Vector3d out(mesh.vertices(v, 0), 0, mesh.vertices(v, 2));
      const bool faces_it = out.dot(centre - mesh.vertices.row(v).transpose()) > 0;
      if (!faces_it) {
        EXPECT_EQ(open[c][static_cast<std::size_t>(v)], 0);
      }
      if (mesh.vertices(v, 1) > 0.95 && mesh.vertices(v, 1) < 1.15) {
        EXPECT_EQ(hidden[c][static_cast<std::size_t>(v)], 0);
      }
    }
  }
}

TEST(Photometric, GarmentOutsideTheImage_IsNotVisible) {
  const Mesh mesh = fixtures::cloth_tube(12, 4);
  const auto views = fixtures::cylinder_views(1, blotches);
  const Points away = mesh.vertices.rowwise() + Eigen::RowVector3d(0, 5, 0);
  for (const auto& of_view : vertex_views(away, mesh.faces, views, {})) {
    for (const float cosine : of_view) {
      EXPECT_EQ(cosine, 0);
    }
  }
}

TEST(Photometric, PixelsOutsideTheMask_AreNotVisible) {
  const Mesh mesh = fixtures::cloth_tube(12, 4);
  auto views = fixtures::cylinder_views(1, blotches);
  views[0].mask = ByteImage(160, 160, 1, 0);
  const auto seen = vertex_views(mesh.vertices, mesh.faces, views, {});
  EXPECT_EQ(std::count_if(seen[0].begin(), seen[0].end(), [](float c) { return c > 0; }), 0);
  EXPECT_GT(std::count_if(seen[1].begin(), seen[1].end(), [](float c) { return c > 0; }), 0);
}

TEST(Photometric, ImagesOfOtherSize_AreRefused) {
  PhotoView view;
  view.camera = fixtures::looking_at({1, 1, 0}, {0, 1, 0}, 16);
  view.image = Image(8, 16, 3);
  ATELIER_EXPECT_REFUSED(view_pyramid(view, 2), LogicError, "another size");
  view.image = Image(16, 16, 3);
  view.mask = ByteImage(4, 4, 1);
  ATELIER_EXPECT_REFUSED(view_pyramid(view, 2), LogicError, "mask");
  view.mask = {};
  view.image = Image(16, 16, 2);
  ATELIER_EXPECT_REFUSED(view_pyramid(view, 2), LogicError, "channels");
}

TEST(DetailView, SlowChange_IsTakenOutWithinTheMaskAlone) {
  constexpr int kSize = 40;
  constexpr int kEdge = 10;  // where the garment begins
  constexpr int kRadius = 3;
  ViewPyramid view;
  view.camera = fixtures::looking_at({1, 1, 0}, {0, 1, 0}, kSize);
  view.mask = ByteImage(kSize, kSize, 1);
  Image level(kSize, kSize, 1);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      view.mask.at(x, y) = x >= kEdge ? 1 : 0;
      level.at(x, y) = x >= kEdge ? 0.3F + 0.01F * static_cast<float>(y) : 1.0F;
    }
  }
  level.at(25, 20) += 0.5F;
  view.levels = {level};
  const ViewPyramid detail = detail_view(view, kRadius);
  ASSERT_EQ(detail.levels.size(), 1U);
  constexpr int kReach = 2 * kRadius;
  for (int y = kReach; y < kSize - kReach; ++y) {
    for (int x = kEdge; x < kSize; ++x) {
      const bool near = std::abs(x - 25) <= kReach && std::abs(y - 20) <= kReach;
      if (!near) {
        EXPECT_NEAR(detail.levels[0].at(x, y), 0, 1e-4) << x << ' ' << y;
      }
    }
  }
  // A tent over 13 pixels each way has its top, a seventh squared, taken away.
  EXPECT_NEAR(detail.levels[0].at(25, 20), 0.5 * (1 - 1.0 / 49), 1e-4);
  ATELIER_EXPECT_REFUSED(detail_view(view, 0), LogicError, "finer");
}

/// How far a tube comes out from where it is, m on average, that has turned by 3 mm while folds
/// went 5 mm the other way over it. Their shading is stronger than its yarn.
double error_among_folds(int radius) {
  constexpr double kTurn = 0.02;    // rad
  constexpr double kFolds = 0.005;  // m
  const auto cloth = [](double angle, double y) {
    return 0.4 + 0.4 * (blotches(2.3 * angle, 2.3 * y) - 0.4);
  };
  const auto shading = [](double angle, double y) {
    return 1 + 0.4 * std::sin(45 * 0.15 * angle + 4 * y);
  };
  RegisterOptions options;
  options.photometric_levels = kLevels;
  options.sample_spacing = 0.005;
  Garment garment;
  garment.mesh = fixtures::cloth_tube(30, 16);
  const RegistrationModel model = registration_model(garment, options);
  const auto frame_of = [&](const std::function<double(double, double)>& shade) {
    RegistrationFrame frame;
    frame.views = fixtures::cylinder_views(kLevels, shade);
    for (std::size_t c = 0; c < frame.views.size() && radius > 0; ++c) {
      frame.details.push_back(detail_view(frame.views[c], radius));
    }
    return frame;
  };
  const RegistrationFrame first =
      frame_of([&](double u, double y) { return shading(u, y) * cloth(u, y); });
  GarmentTexture texture;
  add_texture(texture, model.samples,
              {model.cloth.topology, model.vertices, compared_views(first),
               garment_views(model, model.vertices, first)});
  RegistrationFrame frame = frame_of(
      [&](double u, double y) { return shading(u + kFolds / 0.15, y) * cloth(u - kTurn, y); });
  frame.scan = garment_scan(fixtures::cloth_tube(60, 33), {});
  ShapeSolver solver(model.cloth);
  const Points found =
      register_garment(solver, model, model.vertices, frame, {&texture}, options).vertices;
  return (found - fixtures::screwed(model.vertices, kTurn, 0)).rowwise().norm().mean();
}

TEST(DetailView, FoldsThatMoveOverWovenCloth_DoNotDragIt) {
  const double detail = error_among_folds(RegisterOptions().photometric_detail);
  EXPECT_LT(detail, 0.001);
  EXPECT_GT(error_among_folds(0), 3 * detail);
}

TEST(ClothSamples, SampleAreas_AddUpAndPointsLieInside) {
  const Mesh mesh = fixtures::cloth_tube(12, 5);
  const ClothSamples samples = cloth_samples(mesh.vertices, mesh.faces, 0.006);
  double area = 0;
  for (std::size_t s = 0; s < samples.areas.size(); ++s) {
    area += samples.areas[s];
    EXPECT_NEAR(samples.barycentric[s].sum(), 1, 1e-6);
    EXPECT_GT(samples.barycentric[s].minCoeff(), 0);
  }
  EXPECT_NEAR(area, face_areas(mesh.vertices, mesh.faces).sum(), 1e-6);
  ATELIER_EXPECT_REFUSED(cloth_samples(mesh.vertices, mesh.faces, 0), LogicError, "spacing");
}

}  // namespace
}  // namespace atelier
