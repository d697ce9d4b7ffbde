#include "registration/tracking/printed_code.h"

#include <Eigen/Geometry>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "registration/tracking/register_sequence.h"
#include "tests/registration/registered_shapes.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

using Color = Eigen::Vector3f;
using Print = std::function<Color(double u, double y)>;  // linear light at metres round and up

constexpr double kRadius = 0.15;

/// Cells of 12 mm in one of seven colours on a dark net, as capture/fabric.h prints them.
Print cells(std::uint32_t seed, double cell = 0.012) {
  return [=](double u, double y) -> Color {
    static const std::array<Color, 7> colors = {
        Color(0.80F, 0.80F, 0.78F), Color(0.62F, 0.06F, 0.05F), Color(0.06F, 0.32F, 0.08F),
        Color(0.05F, 0.10F, 0.52F), Color(0.75F, 0.55F, 0.04F), Color(0.36F, 0.05F, 0.40F),
        Color(0.04F, 0.40F, 0.45F)};
    const double i = std::floor(u / cell);
    const double j = std::floor(y / cell);
    if (std::max(std::abs(u / cell - i - 0.5), std::abs(y / cell - j - 0.5)) > 0.42) {
      return {0.03F, 0.03F, 0.035F};
    }
    std::uint32_t h = seed + 0x9E3779B9U * static_cast<std::uint32_t>(static_cast<int>(i)) +
                      0x85EBCA6BU * static_cast<std::uint32_t>(static_cast<int>(j));
    h = (h ^ (h >> 16)) * 0x7FEB352DU;
    h = (h ^ (h >> 15)) * 0x846CA68BU;
    return colors[(h ^ (h >> 16)) % 7];
  };
}

/// The print turned about a place and moved.
Print moved(const Print& print, double round, double up, double turn = 0) {
  return [=](double u, double y) {
    const double x = u - round;
    const double z = y - up - 1.05;
    return print(std::cos(turn) * x + std::sin(turn) * z,
                 1.05 - std::sin(turn) * x + std::cos(turn) * z);
  };
}

struct Seeing {
  double blur = 0;   // px, of a box
  double noise = 0;  // of linear light
  bool shade = false;
};

std::vector<ViewPyramid> views_of(const Print& print, const Seeing& seeing = {}, int size = 240) {
  std::vector<ViewPyramid> views;
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 4; ++i) {
    const double angle = std::numbers::pi / 2 * i + 0.3;
    PhotoView view;
    view.camera = fixtures::looking_at({1.2 * std::cos(angle), 1.2, -1.2 * std::sin(angle)},
                                       {0, 1.05, 0}, size);
    view.image = Image(size, size, 3);
    for (int c = 0; c < 3; ++c) {
      const Image one =
          fixtures::picture_of_cylinder(view.camera, kRadius, [&](double angle_there, double y) {
            const double light = seeing.shade ? 0.5 + 0.35 * std::sin(9 * angle_there + 40 * y) : 1;
            return light * print(kRadius * angle_there, y)[c];
          });
      for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
          float sum = 0;
          int count = 0;
          const int r = static_cast<int>(seeing.blur);
          for (int q = std::max(0, y - r); q <= std::min(size - 1, y + r); ++q) {
            for (int p = std::max(0, x - r); p <= std::min(size - 1, x + r); ++p) {
              sum += one.at(p, q);
              ++count;
            }
          }
          view.image.at(x, y, c) =
              sum / static_cast<float>(count) + static_cast<float>(seeing.noise) * normal(random);
        }
      }
    }
    views.push_back(view_pyramid(view, 3));
  }
  return views;
}

/// A tube with a print, its code, and what is read of it later at the same place.
struct Tube {
  Mesh mesh = fixtures::cloth_tube(48, 26);
  Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  PrintedCodebook code;

  explicit Tube(const Print& print) {
    const auto views = views_of(print);
    code = printed_codebook({topology, mesh.vertices, views, seen(views)});
  }
  std::vector<std::vector<float>> seen(const std::vector<ViewPyramid>& views) const {
    return vertex_views(mesh.vertices, mesh.faces, views, {&tree});
  }
  CodeMatches read(const std::vector<ViewPyramid>& views) const {
    return match_code(code, {topology, mesh.vertices, views, seen(views)});
  }
  /// Round and up, of a point of the tube.
  Eigen::Vector2d laid_out(int face, const Eigen::Vector3d& barycentric) const {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      p += barycentric[k] * mesh.vertices.row(mesh.faces(face, k)).transpose();
    }
    return {kRadius * std::atan2(-p.z(), p.x()), p.y()};
  }
  /// How far each reading is from the ground truth, m, of a print that was moved.
  std::vector<double> errors(const CodeMatches& matches, double round, double up,
                             double turn = 0) const {
    std::vector<double> all;
    for (const CodeMatch& match : matches.kept) {
      const Eigen::Vector2d at = laid_out(match.seen_face, match.seen_barycentric);
      const double x = at.x() - round;
      const double z = at.y() - up - 1.05;
      const Eigen::Vector2d truth(std::cos(turn) * x + std::sin(turn) * z,
                                  1.05 - std::sin(turn) * x + std::cos(turn) * z);
      Eigen::Vector2d off = laid_out(match.face, match.barycentric) - truth;
      off.x() = std::remainder(off.x(), 2 * std::numbers::pi * kRadius);
      all.push_back(off.norm());
    }
    return all;
  }
};

/// One tube for all tests that only read it.
const Print& print_one() {
  static const Print print = cells(1);
  return print;
}
const Tube& tube_one() {
  static const Tube tube(print_one());
  return tube;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) {
    sum += value;
  }
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

TEST(PrintedCodebook, SlidCloth_IsLocated) {
  const Print& print = print_one();
  const Tube& tube = tube_one();
  ASSERT_GT(tube.code.descriptors.cols(), 5000);
  const CodeMatches matches = tube.read(views_of(moved(print, 0.07, 0.03)));
  const std::vector<double> errors = tube.errors(matches, 0.07, 0.03);
  EXPECT_GT(errors.size(), tube.code.sites.size() / 3);
  EXPECT_LT(mean_of(errors), 0.004);
  EXPECT_LT(*std::max_element(errors.begin(), errors.end()), 0.01);
  EXPECT_LE(matches.contradicted, 3);
}

TEST(PrintedCodebook, RotatedPrint_IsRead) {
  const Print& print = print_one();
  const Tube& tube = tube_one();
  for (const double turn : {-0.45, 0.3}) {
    const CodeMatches matches = tube.read(views_of(moved(print, 0.02, 0, turn)));
    // Far round it the print has moved beyond reach.
    const std::vector<double> errors = tube.errors(matches, 0.02, 0, turn);
    EXPECT_GT(errors.size(), 20U) << turn;
    EXPECT_LT(mean_of(errors), 0.006) << turn;
    EXPECT_LT(*std::max_element(errors.begin(), errors.end()), 0.015) << turn;
  }
}

TEST(PrintedCodebook, BlurNoiseAndShading_AreTolerated) {
  const Print& print = print_one();
  const Tube& tube = tube_one();
  const std::size_t clean = tube.read(views_of(moved(print, -0.05, 0.02))).kept.size();
  for (const Seeing& seeing : {Seeing{.blur = 1}, Seeing{.noise = 0.02}, Seeing{.shade = true},
                               Seeing{.blur = 1, .noise = 0.01, .shade = true}}) {
    const CodeMatches matches = tube.read(views_of(moved(print, -0.05, 0.02), seeing));
    const std::vector<double> errors = tube.errors(matches, -0.05, 0.02);
    EXPECT_GT(2 * errors.size(), clean) << seeing.blur << seeing.noise;
    EXPECT_LT(*std::max_element(errors.begin(), errors.end()), 0.012);
  }
}

TEST(PrintedCodebook, PartlyHiddenPrint_IsRead) {
  const Print& print = print_one();
  const Tube& tube = tube_one();
  std::vector<ViewPyramid> views = views_of(moved(print, 0.04, 0));
  // A grey board before the upper half of every image, of which no mask knows.
  for (ViewPyramid& view : views) {
    Image& image = view.levels.front();
    std::fill(image.data.begin(), image.data.begin() + image.data.size() / 2, 0.6F);
  }
  const CodeMatches matches = tube.read(views);
  const std::vector<double> errors = tube.errors(matches, 0.04, 0);
  EXPECT_GT(errors.size(), tube.code.sites.size() / 8);
  EXPECT_LT(*std::max_element(errors.begin(), errors.end()), 0.012);
}

TEST(PrintedCodebook, AnyNumberOfThreads_GivesTheSameMatches) {
  const Print print = cells(5);
  const auto views = views_of(moved(print, 0.04, 0));
  const auto read = [&] {
    const Tube tube(print);
    return tube.read(views);
  };
  set_thread_count(1);
  const CodeMatches one = read();
  set_thread_count(3);
  const CodeMatches three = read();
  set_thread_count(0);
  ASSERT_EQ(one.kept.size(), three.kept.size());
  for (std::size_t i = 0; i < one.kept.size(); ++i) {
    EXPECT_EQ(one.kept[i].face, three.kept[i].face);
    EXPECT_EQ(one.kept[i].correlation, three.kept[i].correlation);
  }
}

TEST(PrintedCodebook, ClothOfOneHue_IsRefused) {
  const Tube grey([](double u, double y) -> Color {
    return Color::Constant(static_cast<float>(fixtures::blotches(u / kRadius, y)));
  });
  EXPECT_EQ(grey.code.descriptors.cols(), 0);
  const Tube blue([](double u, double y) -> Color {
    return static_cast<float>(fixtures::blotches(u / kRadius, y)) * Color(0.2F, 0.3F, 0.6F);
  });
  EXPECT_EQ(blue.code.descriptors.cols(), 0);
  EXPECT_TRUE(blue.read(views_of(cells(1))).kept.empty());
}

TEST(PrintedCodebook, AnotherPrint_IsRefused) {
  const Tube& tube = tube_one();
  const CodeMatches other = tube.read(views_of(cells(77)));
  EXPECT_TRUE(other.kept.empty());
  EXPECT_LE(other.contradicted, 1);
  EXPECT_TRUE(tube.read(views_of([](double, double) -> Color {
                    return {0.5F, 0.3F, 0.2F};
                  }))
                  .kept.empty());
}

TEST(PrintedCodebook, RepeatingPrint_IsRefused) {
  const Print print = cells(8);
  const Print repeated = [=](double u, double y) {
    const double width = 0.048;
    return print(u - width * std::floor(u / width), y - width * std::floor(y / width));
  };
  const Tube tube(repeated);
  EXPECT_GT(tube.code.descriptors.cols(), 0);
  EXPECT_TRUE(tube.read(views_of(repeated)).kept.empty());
}

TEST(PrintedCodebook, ImagesWithoutColor_AreRefused) {
  const Tube& tube = tube_one();
  const auto grey = fixtures::cylinder_views(2, fixtures::blotches);
  EXPECT_TRUE(tube.read(grey).kept.empty());
  EXPECT_EQ(printed_codebook({tube.topology, tube.mesh.vertices, grey, tube.seen(grey)})
                .descriptors.cols(),
            0);
  EXPECT_TRUE(tube.read({}).kept.empty());
}

TEST(PrintedCodebook, AnotherGarment_IsRefused) {
  const Tube& tube = tube_one();
  const Mesh other = fixtures::cloth_tube(12, 5);
  const auto views = views_of(print_one());
  ATELIER_EXPECT_REFUSED(
      match_code(tube.code,
                 {topology_of(other.faces, other.vertices.rows()), other.vertices, views, {}}),
      LogicError, "another garment");
}

/// Cloth that slides round a body that stands still, by 5 cm from frame to frame.
TEST(PrintedCodebook, SlidingSequence_IsTracked) {
  Garment garment;
  garment.name = "tube";
  garment.mesh = fixtures::cloth_tube(36, 20);
  Mesh body = fixtures::sphere(2);
  body.vertices.col(0) *= 0.12;
  body.vertices.col(2) *= 0.12;
  body.vertices.col(1) = 0.35 * body.vertices.col(1).array() + 1.05;
  const Print print = cells(11);
  constexpr double kSlide = 0.05;  // m
  Mesh fine = fixtures::cloth_tube(60, 33);
  fine.labels.assign(static_cast<std::size_t>(fine.vertices.rows()), 5);
  std::vector<std::vector<ViewPyramid>> views;
  for (int row = 0; row < 3; ++row) {
    views.push_back(views_of(moved(print, kSlide * row, 0)));
  }
  RegistrationSource source;
  source.rows = 3;
  source.template_row = 0;
  source.body_faces = body.faces;
  source.body = [&](Index) { return body.vertices; };
  source.load = [&](Index row) {
    RegistrationFrame frame;
    frame.scan = garment_scan(fine, {5});
    frame.body = body_obstacle(body.vertices, body.faces);
    frame.views = views[static_cast<std::size_t>(row)];
    return frame;
  };
  const auto error = [&](bool code) {
    RegisterSequenceOptions options;
    options.fit.photometric_levels = 3;
    options.fit.code = code;
    RegisteredSequence sequence(garment, source, options);
    const Points expected = fixtures::screwed(garment.mesh.vertices, 2 * kSlide / kRadius, 0);
    const RegisteredGarment& last = sequence.at(2);
    EXPECT_EQ(last.code_read > 50, code);
    return (last.vertices - expected).rowwise().norm().mean();
  };
  EXPECT_LT(error(true), 0.003);
  EXPECT_GT(error(false), 0.02);
}

}  // namespace
}  // namespace atelier
