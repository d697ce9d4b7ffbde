#include "appearance/surface_frame.h"

#include <Eigen/Geometry>

#include "appearance/surface_math.h"
#include "core/error.h"
#include "core/normals.h"

namespace atelier {
namespace {

/// [T,3] the world's direction of growing u at each texture coordinate.
Points tangents_of(const Points& vertices, const Triangles& faces, const Points2& uvs,
                   const Triangles& uv_faces) {
  Points tangents = Points::Zero(uvs.rows(), 3);
  const auto vertex = [&](int i) { return Vec3d{vertices(i, 0), vertices(i, 1), vertices(i, 2)}; };
  const auto uv = [&](int i) { return uvs.data() + 2 * static_cast<Index>(i); };
  for (Index f = 0; f < faces.rows(); ++f) {
    const Vec3d along = area_along_u(vertex(faces(f, 0)), vertex(faces(f, 1)), vertex(faces(f, 2)),
                                     uv(uv_faces(f, 0)), uv(uv_faces(f, 1)), uv(uv_faces(f, 2)));
    for (int k = 0; k < 3; ++k) {
      tangents.row(uv_faces(f, k)) += Eigen::RowVector3d(along.x, along.y, along.z);
    }
  }
  return tangents.rowwise().normalized();
}

}  // namespace

SurfaceFrame surface_frame(const Points& vertices, const Triangles& faces, const Points2& uvs,
                           const Triangles& uv_faces, int frame_id) {
  ATELIER_CHECK(faces.rows() == uv_faces.rows(), "faces and texture faces differ in number");
  ATELIER_CHECK(faces.rows() == 0 || (faces.minCoeff() >= 0 && faces.maxCoeff() < vertices.rows()),
                "a face names a vertex that is not there");
  ATELIER_CHECK(
      uv_faces.rows() == 0 || (uv_faces.minCoeff() >= 0 && uv_faces.maxCoeff() < uvs.rows()),
      "a texture face names a coordinate that is not there");
  SurfaceFrame frame;
  frame.frame_id = frame_id;
  frame.position = vertices.cast<float>();
  frame.normal = vertex_normals(vertices, faces).cast<float>();
  frame.tangent = tangents_of(vertices, faces, uvs, uv_faces).cast<float>();
  return frame;
}

Eigen::MatrixXf texel_values(const TexelMap& map, const Triangles& corners,
                             const Eigen::Ref<const Eigen::MatrixXf>& values) {
  ATELIER_CHECK(corners.rows() == 0 || corners.maxCoeff() < values.rows(),
                "a face names a row that is not there");
  Eigen::MatrixXf rows =
      Eigen::MatrixXf::Zero(static_cast<Index>(map.covered.size()), values.cols());
  for (std::size_t i = 0; i < map.covered.size(); ++i) {
    const auto texel = static_cast<std::size_t>(map.covered[i]);
    const Index f = map.face.data[texel];
    ATELIER_CHECK(f < corners.rows(), "the texel map is of other faces");
    for (std::size_t k = 0; k < 3; ++k) {
      rows.row(static_cast<Index>(i)) +=
          map.barycentric.data[3 * texel + k] * values.row(corners(f, static_cast<Index>(k)));
    }
  }
  return rows;
}

Image texture_of(const TexelMap& map, const Eigen::Ref<const Eigen::MatrixXf>& rows) {
  ATELIER_CHECK(rows.rows() == static_cast<Index>(map.covered.size()),
                "a texture needs a row for each covered texel");
  const auto channels = static_cast<std::size_t>(rows.cols());
  Image image(map.resolution, map.resolution, static_cast<int>(channels));
  for (std::size_t i = 0; i < map.covered.size(); ++i) {
    for (std::size_t c = 0; c < channels; ++c) {
      image.data[static_cast<std::size_t>(map.covered[i]) * channels + c] =
          rows(static_cast<Index>(i), static_cast<Index>(c));
    }
  }
  for (std::size_t i = 0; i < map.source.size(); ++i) {
    if (const auto from = static_cast<std::size_t>(map.source[i]); from != i) {
      for (std::size_t c = 0; c < channels; ++c) {
        image.data[i * channels + c] = image.data[from * channels + c];
      }
    }
  }
  return image;
}

}  // namespace atelier
