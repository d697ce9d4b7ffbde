#include "capture/surface/reconstruct_scan.h"

#include <algorithm>
#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/mesh_statistics.h"
#include "tests/capture_stereo/textured_ball.h"
#include "tests/support/refusals.h"

namespace atelier::fixtures {
namespace {

std::vector<InstantView> pictured_ball() {
  const TexturedBall ball;
  std::vector<InstantView> views;
  for (const StereoView& stereo : ball.views(14, 0.448798951, 120, 120)) {
    InstantView view;
    view.camera = stereo.camera;
    view.image = Image(120, 120, 3);
    view.mask = ByteImage(120, 120, 1);
    view.labels = ByteImage(120, 120, 1);
    for (int y = 0; y < 120; ++y) {
      for (int x = 0; x < 120; ++x) {
        const float value = std::pow(std::max(stereo.image.at(x, y), 0.0f), 2.2f);
        for (int c = 0; c < 3; ++c) {
          view.image.at(x, y, c) = value;
        }
        const auto depth = ball.depth(stereo.camera, x + 0.5, y + 0.5);
        if (depth) {
          view.mask.at(x, y) = 255;
          view.labels.at(x, y) =
              TexturedBall::place(stereo.camera, x + 0.5, y + 0.5, *depth).y() > 0 ? 3 : 4;
        }
      }
    }
    views.push_back(std::move(view));
  }
  return views;
}

/// Fourteen narrow views all around a textured ball, label 3 above and 4 below.
std::vector<InstantView> views_of_ball() {
  static const std::vector<InstantView> views = pictured_ball();
  return views;
}

ReconstructOptions small_options() {
  ReconstructOptions options;
  options.stereo.iterations = 3;
  options.stereo.refinements = 1;
  options.surface.octree_depth = 6;
  options.surface.edge_length = 0.02;
  return options;
}

/// What they give where nothing is wrong.
const ReconstructedScan& scan_of_ball() {
  static const ReconstructedScan result = reconstruct_scan(views_of_ball(), small_options());
  return result;
}

double median_error(const Mesh& scan) {
  std::vector<double> errors;
  for (Index i = 0; i < scan.vertices.rows(); ++i) {
    errors.push_back(std::abs(scan.vertices.row(i).norm() - TexturedBall().radius));
  }
  std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
  return errors[errors.size() / 2];
}

TEST(ReconstructScan, LabelledBall_IsReconstructed) {
  const ReconstructedScan& result = scan_of_ball();
  EXPECT_THAT(result.findings, ::testing::IsEmpty());
  EXPECT_LT(median_error(result.scan), 0.003);
  EXPECT_GT(mesh_statistics(result.scan).area, 0.7 * 4 * 3.14159265 * 0.09);
  int right = 0;
  for (Index i = 0; i < result.scan.vertices.rows(); ++i) {
    right +=
        result.scan.labels[static_cast<std::size_t>(i)] == (result.scan.vertices(i, 1) > 0 ? 3 : 4)
            ? 1
            : 0;
  }
  EXPECT_GT(right, 0.95 * static_cast<double>(result.scan.vertices.rows()));
}

TEST(ReconstructScan, KnownGains_AreRemovedFromColors) {
  auto views = views_of_ball();
  for (std::size_t i = 0; i < views.size(); i += 2) {
    views[i].camera.gain = {0.8, 0.9, 1.1};
    for (std::size_t p = 0; p < views[i].image.data.size(); ++p) {
      views[i].image.data[p] *= static_cast<float>(views[i].camera.gain(static_cast<Index>(p % 3)));
    }
  }
  const ReconstructedScan result = reconstruct_scan(views, small_options());
  EXPECT_LT((result.points.colors.col(0) - result.points.colors.col(2)).cwiseAbs().maxCoeff(),
            1e-4);
}

TEST(ReconstructScan, UnknownGains_AreEstimated) {
  auto views = views_of_ball();
  for (std::size_t i = 0; i < views.size(); i += 2) {
    for (std::size_t p = 0; p < views[i].image.data.size(); ++p) {
      views[i].image.data[p] *= std::array{0.8f, 0.9f, 1.1f}[p % 3];
    }
  }
  // The ball is of one colour. Which, no image tells: gains are known up to a factor on all.
  const auto tints = [](const ReconstructedScan& result) {
    const Eigen::ArrayXf tint =
        result.points.colors.col(0).array() / result.points.colors.col(2).array();
    return tint.maxCoeff() / tint.minCoeff() - 1;
  };
  EXPECT_LT(tints(reconstruct_scan(views, small_options())), 0.02);
  ReconstructOptions as_told = small_options();
  as_told.exposure_compensation = false;
  EXPECT_GT(tints(reconstruct_scan(views, as_told)), 0.2);
}

TEST(ReconstructScan, ViewsSharedAmongMachines_GiveTheSurface) {
  const ReconstructOptions options = small_options();
  const StraightInstant instant = straight_instant(views_of_ball(), options);
  std::vector<DepthMap> maps(instant.cameras.size());
  for (const std::vector<std::size_t>& share :
       {std::vector<std::size_t>{0, 3, 6, 9, 12}, {1, 4, 7, 10, 13}, {2, 5, 8, 11}}) {
    std::vector<DepthMap> made = instant_depths(instant, options, Device::Cpu, share);
    for (const std::size_t view : share) {
      maps[view] = std::move(made[view]);
    }
  }
  const ReconstructedScan shared = surface_of(instant, std::move(maps), options);
  EXPECT_LT(median_error(shared.scan), 0.003);
  EXPECT_GT(mesh_statistics(shared.scan).area, 0.7 * 4 * 3.14159265 * 0.09);
}

TEST(ReconstructScan, BlackViewAndEmptyMask_AreLeftOutAndNamed) {
  auto views = views_of_ball();
  std::fill(views[3].image.data.begin(), views[3].image.data.end(), 0.0f);
  std::fill(views[7].mask.data.begin(), views[7].mask.data.end(), std::uint8_t{0});
  const ReconstructedScan result = reconstruct_scan(views, small_options());
  ASSERT_EQ(result.findings.size(), 2u);
  EXPECT_EQ(result.findings[0].code, "view-black");
  EXPECT_EQ(result.findings[0].place, "cam3");
  EXPECT_EQ(result.findings[1].code, "view-mask-empty");
  EXPECT_EQ(result.findings[1].place, "cam7");
  EXPECT_EQ(result.maps.size(), 12u);
  EXPECT_LT(median_error(result.scan), 0.003);
}

TEST(ReconstructScan, InvertedMask_IsCorrected) {
  auto views = views_of_ball();
  for (std::uint8_t& pixel : views[5].mask.data) {
    pixel = pixel != 0 ? 0 : 255;
  }
  const ReconstructedScan result = reconstruct_scan(views, small_options());
  ASSERT_EQ(result.findings.size(), 1u);
  EXPECT_EQ(result.findings[0].code, "view-mask-inverted");
  EXPECT_EQ(result.findings[0].place, "cam5");
  // As if nothing had been: the same surface.
  EXPECT_EQ(result.scan.vertices, scan_of_ball().scan.vertices);
}

TEST(ReconstructScan, AllMasksInverted_AreCorrected) {
  auto views = views_of_ball();
  for (InstantView& view : views) {
    for (std::uint8_t& pixel : view.mask.data) {
      pixel = pixel != 0 ? 0 : 255;
    }
  }
  const ReconstructedScan result = reconstruct_scan(views, small_options());
  EXPECT_EQ(result.findings.size(), views.size());
  EXPECT_EQ(result.findings.front().code, "view-mask-inverted");
  EXPECT_LT(median_error(result.scan), 0.003);
}

TEST(ReconstructScan, ViewsWithoutOverlap_AreRefused) {
  auto views = views_of_ball();
  views = {views[0], views[7]};
  ATELIER_EXPECT_REFUSED(reconstruct_scan(views, small_options()), DataError, "no two that look");
}

TEST(ReconstructScan, MaskOfOtherPlace_IsNotUsed) {
  auto views = views_of_ball();
  ByteImage& mask = views[5].mask;  // of what stands in the corner
  std::fill(mask.data.begin(), mask.data.end(), std::uint8_t{0});
  for (int y = 0; y < 25; ++y) {
    for (int x = 0; x < 25; ++x) {
      mask.at(x, y) = 255;
    }
  }
  const ReconstructedScan result = reconstruct_scan(views, small_options());
  ASSERT_EQ(result.findings.size(), 1u);
  EXPECT_EQ(result.findings[0].code, "view-mask-off");
  EXPECT_LT(median_error(result.scan), 0.003);
}

TEST(ReconstructScan, ViewFivePixelsOff_IsNamedAndHarmless) {
  for (const auto& [dx, dy] : {std::pair{5.0, 0.0}, std::pair{0.0, 5.0}}) {
    auto views = views_of_ball();
    views[5].camera.cx += dx;
    views[5].camera.cy += dy;
    const ReconstructedScan result = reconstruct_scan(views, small_options());
    ASSERT_EQ(result.findings.size(), 1u) << dx << " " << dy;
    EXPECT_EQ(result.findings[0].code, "view-disagrees");
    EXPECT_EQ(result.findings[0].place, "cam5");
    EXPECT_LT(median_error(result.scan), 0.003);
  }
}

TEST(ReconstructScan, CamerasOnePixelOff_AreAligned) {
  auto views = views_of_ball();
  for (std::size_t i = 0; i < views.size(); ++i) {  // every way, nothing on average
    views[i].camera.cx += 1.2 * std::cos(2.4 * static_cast<double>(i));
    views[i].camera.cy += 1.2 * std::sin(2.4 * static_cast<double>(i));
  }
  ReconstructOptions as_told = small_options();
  as_told.align = false;
  const ReconstructedScan aligned = reconstruct_scan(views, small_options());
  const ReconstructedScan crooked = reconstruct_scan(views, as_told);
  EXPECT_THAT(aligned.findings, ::testing::IsEmpty());
  EXPECT_LT(median_error(aligned.scan), 0.5 * median_error(crooked.scan));
}

TEST(ReconstructScan, MiscalibratedViewAmongFive_IsNamedAlone) {
  for (const std::size_t off : {1, 2}) {  // at the rim its neighbour has few others
    auto views = views_of_ball();
    views.resize(5);
    views[off].camera.cx += 5;
    const ReconstructedScan result = reconstruct_scan(views, small_options());
    ASSERT_EQ(result.findings.size(), 1U) << off;
    EXPECT_EQ(result.findings[0].code, "view-disagrees");
    EXPECT_EQ(result.findings[0].place, "cam" + std::to_string(off));
    EXPECT_THAT(result.findings[0].advice, ::testing::HasSubstr("of so few views it is a guess"));
  }
}

TEST(ReconstructScan, ViewOfOtherSide_IsNotBlamed) {
  auto views = views_of_ball();
  views = {views[0], views[1], views[2], views[3], views[9]};
  EXPECT_THAT(reconstruct_scan(views, small_options()).findings, ::testing::IsEmpty());
}

TEST(ReconstructScan, TooFewViewsOrOtherSizes_AreRefused) {
  auto views = views_of_ball();
  EXPECT_THROW(reconstruct_scan({}, small_options()), DataError);
  EXPECT_THROW(reconstruct_scan({views[0]}, small_options()), DataError);
  EXPECT_THROW(reconstruct_scan({views[0], views[7]}, small_options()), DataError);
  views[2].image = Image(80, 120, 3);
  EXPECT_THROW(reconstruct_scan(views, small_options()), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
