#include "bodymodel/body_pieces.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <vector>

namespace atelier {
namespace {

constexpr double kMainShare = 0.8;  // of the volume of all pieces

// Signed volume of the cones from a point to the faces.
double volume_about(const Eigen::RowVector3d& origin, const Points& vertices,
                    const Triangles& faces) {
  double volume = 0;
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d a = vertices.row(faces(f, 0)) - origin;
    const Eigen::Vector3d b = vertices.row(faces(f, 1)) - origin;
    const Eigen::Vector3d c = vertices.row(faces(f, 2)) - origin;
    volume += a.dot(b.cross(c)) / 6;
  }
  return volume;
}

// The faces with vertices of one place made one.
Triangles joined_faces(const Points& vertices, const Triangles& faces) {
  std::map<std::array<double, 3>, int> first;
  std::vector<int> index(static_cast<std::size_t>(vertices.rows()));
  for (Index v = 0; v < vertices.rows(); ++v) {
    index[static_cast<std::size_t>(v)] =
        first.try_emplace({vertices(v, 0), vertices(v, 1), vertices(v, 2)}, static_cast<int>(v))
            .first->second;
  }
  Triangles joined = faces;
  for (Index i = 0; i < joined.size(); ++i) {
    joined.data()[i] = index[static_cast<std::size_t>(faces.data()[i])];
  }
  return joined;
}

}  // namespace

MainPiece main_piece(const Points& vertices, const Triangles& split_faces) {
  const Triangles faces = joined_faces(vertices, split_faces);
  std::vector<int> piece(static_cast<std::size_t>(vertices.rows()));
  std::iota(piece.begin(), piece.end(), 0);
  const auto find = [&](int v) {
    while (piece[static_cast<std::size_t>(v)] != v) {
      int& above = piece[static_cast<std::size_t>(v)];
      above = piece[static_cast<std::size_t>(above)];
      v = above;
    }
    return v;
  };
  for (Index f = 0; f < faces.rows(); ++f) {
    piece[static_cast<std::size_t>(find(faces(f, 0)))] = find(faces(f, 1));
    piece[static_cast<std::size_t>(find(faces(f, 1)))] = find(faces(f, 2));
  }
  std::map<int, std::vector<Index>> faces_of;
  for (Index f = 0; f < faces.rows(); ++f) {
    faces_of[find(faces(f, 0))].push_back(f);
  }
  if (faces_of.size() < 2) {
    return {faces, 1};
  }
  double most = 0;
  double all = 0;
  Triangles largest;
  for (const auto& [id, rows] : faces_of) {
    Triangles part(static_cast<Index>(rows.size()), 3);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      part.row(static_cast<Index>(i)) = faces.row(rows[i]);
    }
    // About a vertex of its own, so that what is open counts by what it spans, wherever it is.
    const double volume = std::abs(volume_about(vertices.row(part(0, 0)), vertices, part));
    all += volume;
    if (volume > most) {
      most = volume;
      largest = std::move(part);
    }
  }
  return most >= kMainShare * all ? MainPiece{largest, 1}
                                  : MainPiece{faces, static_cast<int>(faces_of.size())};
}

}  // namespace atelier
