#include "appearance/geometry_maps.h"

#include <Eigen/Geometry>

#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr Index kGrain = 4096;

/// [T,3] the world's direction of growing u at each texture coordinate, not normalised.
Points tangents_of(const Points& vertices, const Triangles& faces, const Points2& uvs,
                   const Triangles& uv_faces) {
  Points tangents = Points::Zero(uvs.rows(), 3);
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d p0 = vertices.row(faces(f, 0));
    const Eigen::Vector3d p1 = vertices.row(faces(f, 1)).transpose() - p0;
    const Eigen::Vector3d p2 = vertices.row(faces(f, 2)).transpose() - p0;
    const Eigen::Vector2d t0 = uvs.row(uv_faces(f, 0));
    const Eigen::Vector2d t1 = uvs.row(uv_faces(f, 1)).transpose() - t0;
    const Eigen::Vector2d t2 = uvs.row(uv_faces(f, 2)).transpose() - t0;
    const double turn = t1.x() * t2.y() - t1.y() * t2.x();
    const Eigen::Vector3d direction =
        (t2.y() * p1 - t1.y() * p2) * (turn < 0 ? -1.0 : 1.0);  // dP/du times the flat area
    const double length = direction.norm();
    if (length > 0) {
      const double area = p1.cross(p2).norm();
      for (int k = 0; k < 3; ++k) {
        tangents.row(uv_faces(f, k)) += direction.transpose() * (area / length);
      }
    }
  }
  return tangents;
}

/// The direction within the plane of a unit normal; any one where there is none.
Eigen::Vector3d within_plane(const Eigen::Vector3d& direction, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d flat = direction - normal.dot(direction) * normal;
  constexpr double kLeast = 1e-12;
  return flat.norm() > kLeast ? flat.normalized() : normal.unitOrthogonal();
}

}  // namespace

GeometryMaps geometry_maps(const Points& vertices, const Triangles& faces, const Points2& uvs,
                           const Triangles& uv_faces, const TexelMap& map) {
  ATELIER_CHECK(faces.rows() == uv_faces.rows(), "faces and texture faces differ in number");
  ATELIER_CHECK(faces.rows() == 0 || faces.maxCoeff() < vertices.rows(),
                "a face names a vertex that is not there");
  const Points normals = vertex_normals(vertices, faces);
  const Points tangents = tangents_of(vertices, faces, uvs, uv_faces);
  const auto count = static_cast<Index>(map.covered.size());
  GeometryMaps maps;
  maps.position.resize(count, 3);
  maps.normal.resize(count, 3);
  maps.tangent.resize(count, 3);
  parallel_for(count, kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const auto texel = static_cast<std::size_t>(map.covered[static_cast<std::size_t>(i)]);
      const Index f = map.face.data[texel];
      ATELIER_CHECK(f < faces.rows(), "the texel map is of other faces");
      Eigen::Vector3d position = Eigen::Vector3d::Zero();
      Eigen::Vector3d normal = Eigen::Vector3d::Zero();
      Eigen::Vector3d tangent = Eigen::Vector3d::Zero();
      for (int k = 0; k < 3; ++k) {
        const double weight = map.barycentric.data[3 * texel + static_cast<std::size_t>(k)];
        position += weight * vertices.row(faces(f, k)).transpose();
        normal += weight * normals.row(faces(f, k)).transpose();
        tangent += weight * tangents.row(uv_faces(f, k)).transpose();
      }
      normal = normal.norm() > 0 ? normal.normalized() : Eigen::Vector3d::UnitY();
      maps.position.row(i) = position.cast<float>();
      maps.normal.row(i) = normal.cast<float>();
      maps.tangent.row(i) = within_plane(tangent, normal).cast<float>();
    }
  });
  return maps;
}

Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> view_directions(
    const GeometryMaps& maps, const Eigen::Vector3d& center) {
  const Eigen::Vector3f camera = center.cast<float>();
  Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> directions(maps.position.rows(), 3);
  parallel_for(maps.position.rows(), kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const Eigen::Vector3f normal = maps.normal.row(i);
      const Eigen::Vector3f tangent = maps.tangent.row(i);
      const Eigen::Vector3f to = (camera - maps.position.row(i).transpose()).normalized();
      directions.row(i) << to.dot(tangent), to.dot(normal.cross(tangent)), to.dot(normal);
    }
  });
  return directions;
}

Image texture_of(
    const TexelMap& map,
    const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>& rows) {
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
