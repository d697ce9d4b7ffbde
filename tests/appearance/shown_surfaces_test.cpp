#include "appearance/shown_surfaces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "appearance/surface_frame.h"
#include "appearance/texture_sampling.h"
#include "core/error.h"
#include "core/random.h"
#include "core/raster.h"
#ifdef ATELIER_HAS_CUDA
#include "core/cuda_buffer.cuh"
#endif
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

constexpr int kPictureSide = 64;
constexpr int kTexels = 8;

/// A waving sheet with a texture over a plain floor that it hides in part, from above.
struct Table {
  Mesh sheet = fixtures::grid(9, 9);
  Mesh floor = fixtures::grid(2, 2);
  Points all;
  Camera camera;
  std::vector<float> texture;  // [3,R,R]

  Table() {
    sheet.uvs.resize(sheet.vertices.rows(), 2);
    sheet.uvs.col(0) = 0.1 + 0.8 * sheet.vertices.col(0).array();
    sheet.uvs.col(1) = 0.9 - 0.8 * sheet.vertices.col(2).array();
    sheet.uv_faces = sheet.faces;
    sheet.vertices.leftCols(1) *= 0.6;
    sheet.vertices.col(1) =
        0.2 + 0.05 * (9 * sheet.vertices.col(0).array() + 5 * sheet.vertices.col(2).array()).sin();
    all.resize(sheet.vertices.rows() + floor.vertices.rows(), 3);
    all << sheet.vertices, floor.vertices;
    camera.id = "above";
    camera.width = camera.height = kPictureSide;
    camera.fx = camera.fy = 1.2 * kPictureSide;
    camera.cx = camera.cy = kPictureSide / 2.0;
    camera.camera_from_world_rotation << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    camera.camera_from_world_translation = {-0.5, -0.5, 2};
    Random random{3};
    for (int i = 0; i < 3 * kTexels * kTexels; ++i) {
      texture.push_back(static_cast<float>(uniform(random, 0.1, 0.9)));
    }
  }
  std::vector<ShownSurface> surfaces() const {
    return {{sheet.vertices.rows(), sheet.faces, sheet.uvs, sheet.uv_faces},
            {floor.vertices.rows(), floor.faces, {}, {}}};
  }
  std::vector<SurfaceLook> looks(const float* on_device) const {
    return {{on_device, kTexels, {}}, {nullptr, 0, {0.2F, 0.4F, 0.6F}}};
  }
};

TEST(ShownSurfaces, Pixels_ShowTextureColorAndBackground) {
  const Table table;
  PaintOptions options;
  options.samples = 1;
  options.background = {0.1, 0.2, 0.3};
  const auto shown = make_shown_surfaces(table.surfaces(), options, Device::Cpu);
  EXPECT_EQ(shown->look(table.all, table.camera), (std::vector<bool>{true, true}));
  shown->surface(0);
  const SurfaceArrays floor = shown->surface(1);
  const Image picture = shown->picture(table.looks(table.texture.data()));

  Triangles faces(table.sheet.faces.rows() + table.floor.faces.rows(), 3);
  faces << table.sheet.faces,
      table.floor.faces.array() + static_cast<int>(table.sheet.vertices.rows());
  const Raster raster = rasterize(table.all, faces, table.camera);
  Image texture(kTexels, kTexels, 3);
  for (std::size_t i = 0; i < texture.data.size(); ++i) {
    texture.data[i] = table.texture[i % 3 * kTexels * kTexels + i / 3];
  }
  int of_each[3] = {0, 0, 0};
  for (std::size_t i = 0; i < raster.face.data.size(); ++i) {
    const float* pixel = &picture.data[4 * i];
    const float* weight = &raster.barycentric.data[3 * i];
    const Index face = raster.face.data[i];
    EXPECT_EQ(pixel[3], 1.0F);
    if (face < 0) {
      ++of_each[2];
      EXPECT_EQ(pixel[1], 0.2F);
    } else if (face < table.sheet.faces.rows()) {
      ++of_each[0];
      Eigen::RowVector2d uv(0, 0);
      for (int k = 0; k < 3; ++k) {
        uv += weight[k] * table.sheet.uvs.row(table.sheet.uv_faces(face, k));
      }
      const auto expected =
          sample_texture(texture, {{static_cast<float>(uv.x())}, {static_cast<float>(uv.y())}, {}});
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(pixel[c], expected[c], 1e-5F);
      }
    } else {
      ++of_each[1];
      float open = 0;
      for (int k = 0; k < 3; ++k) {
        open += weight[k] * floor.transfer[2 * kTransferTerms *
                                           table.floor.faces(face - table.sheet.faces.rows(), k)];
      }
      EXPECT_NEAR(pixel[2], 0.6F * open, 1e-6F);
    }
  }
  EXPECT_GT(of_each[0], 300);
  EXPECT_GT(of_each[1], 100);
  EXPECT_GT(of_each[2], 300);
}

TEST(ShownSurfaces, PlainColors_AreLitOnTheVisibleSide) {
  // From below, where nothing hides the sky, the floor has all of its colour; from above the sheet
  // takes some of it.
  Table table;
  table.camera.camera_from_world_rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  table.camera.camera_from_world_translation = {-0.5, 0.5, 2};
  PaintOptions options;
  options.samples = 1;
  const auto shown = make_shown_surfaces(table.surfaces(), options, Device::Cpu);
  ASSERT_EQ(shown->look(table.all, table.camera), (std::vector<bool>{false, true}));
  const SurfaceArrays floor = shown->surface(1);
  for (Index v = 0; v < floor.vertices; ++v) {
    EXPECT_EQ(floor.transfer[2 * kTransferTerms * v + kTransferTerms], 1.0F);
  }
  EXPECT_LT(floor.transfer[2 * kTransferTerms * 4], 0.9F) << "the middle, from above";
  const Image picture = shown->picture(table.looks(table.texture.data()));
  const float* middle = &picture.at(kPictureSide / 2, kPictureSide / 2);
  EXPECT_NEAR(middle[0], 0.2F, 1e-6F);
  EXPECT_NEAR(middle[2], 0.6F, 1e-6F);
}

TEST(ShownSurfaces, SurfaceArrays_MatchASurfaceFrame) {
  const Table table;
  const auto shown = make_shown_surfaces(table.surfaces(), {}, Device::Cpu);
  shown->look(table.all, table.camera);
  const SurfaceArrays arrays = shown->surface(0);
  const SurfaceFrame frame =
      surface_frame(table.sheet.vertices, table.sheet.faces, table.sheet.uvs, table.sheet.uv_faces);
  ASSERT_EQ(arrays.vertices, table.sheet.vertices.rows());
  ASSERT_EQ(arrays.coordinates, table.sheet.uvs.rows());
  EXPECT_EQ(Eigen::Map<const FloatRows>(arrays.normal, arrays.vertices, 3), frame.normal);
  EXPECT_EQ(Eigen::Map<const FloatRows>(arrays.tangent, arrays.coordinates, 3), frame.tangent);
}

TEST(ShownSurfaces, HiddenSurface_IsNotSeenAndCoverageIsAlpha) {
  Table table;
  table.floor.vertices = 0.05 * table.floor.vertices;
  table.floor.vertices.col(0).array() += 0.2;
  table.floor.vertices.col(2).array() += 0.5;
  table.all.bottomRows(table.floor.vertices.rows()) = table.floor.vertices;
  PaintOptions options;
  options.alpha = true;
  options.samples = 4;
  const auto shown = make_shown_surfaces(table.surfaces(), options, Device::Cpu);
  Camera fine = table.camera;
  fine.width = fine.height = 4 * kPictureSide;
  for (double* number : {&fine.fx, &fine.fy, &fine.cx, &fine.cy}) {
    *number *= 4;
  }
  EXPECT_EQ(shown->look(table.all, fine), (std::vector<bool>{true, false}));
  shown->surface(0);
  const std::vector<float> half(3 * kTexels * kTexels, 0.5F);
  const Image picture = shown->picture(table.looks(half.data()));
  ASSERT_EQ(picture.width, kPictureSide);
  double covered = 0;
  for (std::size_t i = 0; i < picture.data.size(); i += 4) {
    EXPECT_NEAR(picture.data[i], 0.5F * picture.data[i + 3], 1e-6F);
    covered += picture.data[i + 3];
  }
  // 0.6 x 1 m, 1.8 m away, through 1.2 x 64 pixels a metre.
  EXPECT_NEAR(covered, 0.6 * std::pow(1.2 * kPictureSide / 1.8, 2), 0.04 * covered);
}

#ifdef ATELIER_HAS_CUDA
/// Numbers that lie on the device.
std::vector<float> fetched(const float* on_device, Index count) {
  std::vector<float> values(static_cast<std::size_t>(count));
  ATELIER_CUDA_CHECK(
      cudaMemcpy(values.data(), on_device, values.size() * sizeof(float), cudaMemcpyDeviceToHost));
  return values;
}

double largest_difference(const float* a, const std::vector<float>& b) {
  double most = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    most = std::max(most, static_cast<double>(std::abs(a[i] - b[i])));
  }
  return most;
}

TEST(ShownSurfaces, CudaAndCpu_Agree) {
  if (!cuda_available()) {
    GTEST_SKIP() << "no CUDA device";
  }
  Table table;
  PaintOptions options;
  options.samples = 2;
  const auto cpu = make_shown_surfaces(table.surfaces(), options, Device::Cpu);
  const auto cuda = make_shown_surfaces(table.surfaces(), options, Device::Cuda);
  const CudaBuffer<float> texture(table.texture);
  for (int frame = 0; frame < 3; ++frame) {  // a new tree, then one that follows
    table.all.col(1).array() += 0.02 * (7 * table.all.col(0).array() + frame).cos();
    EXPECT_EQ(cpu->look(table.all, table.camera), cuda->look(table.all, table.camera));
    for (const std::size_t s : {0, 1}) {
      const SurfaceArrays a = cpu->surface(s);
      const SurfaceArrays b = cuda->surface(s);
      ASSERT_EQ(a.vertices, b.vertices);
      ASSERT_EQ(a.coordinates, b.coordinates);
      EXPECT_EQ(largest_difference(a.position, fetched(b.position, 3 * b.vertices)), 0);
      EXPECT_LT(largest_difference(a.normal, fetched(b.normal, 3 * b.vertices)), 1e-6);
      EXPECT_LT(largest_difference(a.tangent, fetched(b.tangent, 3 * b.coordinates)), 1e-6);
      // A ray that grazes an edge may go either way.
      EXPECT_LT(
          largest_difference(a.transfer, fetched(b.transfer, 2 * kTransferTerms * b.vertices)),
          3.5 / 64);
    }
    const Image one = cpu->picture(table.looks(table.texture.data()));
    const Image other = cuda->picture(table.looks(texture.data()));
    EXPECT_EQ(one.width, other.width);
    EXPECT_LT(largest_difference(one.data.data(), other.data), 0.01);
  }
}
#endif

TEST(ShownSurfacesRefused, MismatchedSurfacesOrOptions_AreRefused) {
  const Table table;
  const auto refused = [&](const auto& damage, const char* words) {
    std::vector<ShownSurface> surfaces = table.surfaces();
    PaintOptions options;
    damage(surfaces, options);
    ATELIER_EXPECT_REFUSED(make_shown_surfaces(surfaces, options, Device::Cpu), LogicError, words);
  };
  refused([](auto& s, auto&) { s[0].vertices = 3; }, "vertex that is not there");
  refused([](auto& s, auto&) { s[0].uvs.conservativeResize(3, 2); }, "coordinate that is not");
  refused([](auto& s, auto&) { s[0].uv_faces.conservativeResize(3, 3); }, "differ in number");
  refused([](auto&, auto& o) { o.samples = 0; }, "out of range");
  refused([](auto&, auto& o) { o.occlusion.strata = 99; }, "out of range");
  const auto shown = make_shown_surfaces(table.surfaces(), {}, Device::Cpu);
  ATELIER_EXPECT_REFUSED(shown->look(table.all.topRows(5), table.camera), LogicError,
                         "all surfaces");
  shown->look(table.all, table.camera);
  ATELIER_EXPECT_REFUSED(shown->surface(2), LogicError, "not given");
  ATELIER_EXPECT_REFUSED(shown->picture({}), LogicError, "each surface");
  ATELIER_EXPECT_REFUSED(shown->picture({{table.texture.data(), 1, {}}, {nullptr, 0, {}}}),
                         LogicError, "2 or more");
}

}  // namespace
}  // namespace atelier
