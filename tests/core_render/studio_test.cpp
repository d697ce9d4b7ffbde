#include "core/render/studio.h"

#include <gtest/gtest.h>

#include "core/io/mesh_file.h"
#include "core/render/contact_sheet.h"
#include "tests/core_render/shapes.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

TEST(Studio, SpherePicture_IsWellExposed) {
  const Image picture = picture_of(fixtures::sphere(), kThreeQuarter, {96, 96, 8, {}});
  fixtures::keep_picture("studio_sphere", picture);
  for (const float value : picture.data) {
    ASSERT_GE(value, 0.0f);
    ASSERT_LE(value, 1.0f);
  }
}

// MakeHuman's base mesh without its helper geometry: decimetres, the body's vertices come first.
Mesh makehuman_body(const std::filesystem::path& path) {
  Mesh mesh = read_mesh(path, {.metres_per_unit = 0.1, .up = 'y'});
  constexpr int kBodyVertices = 13'380;
  Index kept = 0;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    if (mesh.faces.row(f).maxCoeff() < kBodyVertices) {
      mesh.faces.row(kept) = mesh.faces.row(f);
      if (mesh.uv_faces.rows() > 0) {
        mesh.uv_faces.row(kept) = mesh.uv_faces.row(f);
      }
      ++kept;
    }
  }
  mesh.faces.conservativeResize(kept, 3);
  if (mesh.uv_faces.rows() > 0) {
    mesh.uv_faces.conservativeResize(kept, 3);
  }
  mesh.vertices.conservativeResize(kBodyVertices, 3);
  mesh.normals.resize(0, 3);
  return mesh;
}

TEST(Studio, BodyFromFourSides_IsDrawn) {
  ATELIER_TEST_FILE(path, "makehuman/base/base.obj");
  const Mesh body = makehuman_body(path);
  std::vector<CaptionedImage> views;
  const PictureOptions options{90, 150, 4, {}};
  for (const auto& [name, view] : {std::pair{"front", kFront},
                                   {"three-quarter", kThreeQuarter},
                                   {"side", kSide},
                                   {"back", kBack}}) {
    views.push_back({picture_of(body, view, options), name});
  }
  const Image sheet = contact_sheet(views, {.columns = 4, .title = "MakeHuman base"});
  fixtures::keep_picture("studio_body", sheet);
  EXPECT_GT(sheet.width, 4 * options.width);
}

}  // namespace
}  // namespace atelier
