#include "tests/simulation/foreign/foreign_skirt.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>

#include "core/io/npz.h"
#include "core/tensor.h"

namespace atelier::fixtures {
namespace {

Triangles triangles_of(const Npz& npz, const char* name) {
  const std::vector<std::int64_t> all = integers_of(npz.read(name));
  Triangles faces(static_cast<Index>(all.size() / 3), 3);
  for (Index i = 0; i < faces.size(); ++i) {
    faces(i / 3, i % 3) = static_cast<int>(all[static_cast<std::size_t>(i)]);
  }
  return faces;
}

std::vector<Points> frames_of(const Npz& npz, const char* name, const std::vector<int>& rows) {
  const Tensor tensor = npz.read(name);
  const std::vector<double> numbers = doubles_of(tensor);
  const Index vertices = static_cast<Index>(tensor.shape[1]);
  const Index count = rows.empty() ? vertices : static_cast<Index>(rows.size());
  std::vector<Points> frames(tensor.shape[0], Points(count, 3));
  for (std::size_t f = 0; f < frames.size(); ++f) {
    for (Index i = 0; i < 3 * count; ++i) {
      const Index vertex = rows.empty() ? i / 3 : rows[static_cast<std::size_t>(i / 3)];
      const std::size_t at =
          3 * (f * static_cast<std::size_t>(vertices) + static_cast<std::size_t>(vertex));
      frames[f](i / 3, i % 3) = numbers[at + static_cast<std::size_t>(i % 3)];
    }
  }
  return frames;
}

double shadow_along_z(const Points& x, const Triangles& faces) {
  constexpr double kCell = 2.5e-3;
  std::set<std::pair<int, int>> dark;
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector2d a = x.row(faces(f, 0)).head<2>().transpose();
    const Eigen::Vector2d b = x.row(faces(f, 1)).head<2>().transpose();
    const Eigen::Vector2d c = x.row(faces(f, 2)).head<2>().transpose();
    const Eigen::Vector2d low = a.cwiseMin(b).cwiseMin(c) / kCell;
    const Eigen::Vector2d high = a.cwiseMax(b).cwiseMax(c) / kCell;
    const auto side = [](const Eigen::Vector2d& p, const Eigen::Vector2d& q,
                         const Eigen::Vector2d& at) {
      return (q.x() - p.x()) * (at.y() - p.y()) - (q.y() - p.y()) * (at.x() - p.x());
    };
    for (int j = static_cast<int>(std::floor(low.y())); j <= static_cast<int>(high.y()); ++j) {
      for (int i = static_cast<int>(std::floor(low.x())); i <= static_cast<int>(high.x()); ++i) {
        const Eigen::Vector2d at(kCell * (i + 0.5), kCell * (j + 0.5));
        const double s[3] = {side(a, b, at), side(b, c, at), side(c, a, at)};
        if ((s[0] >= 0 && s[1] >= 0 && s[2] >= 0) || (s[0] <= 0 && s[1] <= 0 && s[2] <= 0)) {
          dark.emplace(i, j);
        }
      }
    }
  }
  return kCell * kCell * static_cast<double>(dark.size());
}

/// The tangent of half the angle at `at` between the ways to `a` and `b`.
double half_tangent(const Eigen::Vector2d& at, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d u = (a - at).normalized();
  const Eigen::Vector2d v = (b - at).normalized();
  return (1 - u.dot(v)) / std::abs(u.x() * v.y() - u.y() * v.x());
}

}  // namespace

std::vector<ClothCurvature> foreign_curvatures(const Garment& garment, double stiffness) {
  const Triangles& faces = garment.mesh.faces;
  std::map<int, std::map<int, double>> weights;
  std::map<std::pair<int, int>, int> sides;
  for (Index f = 0; f < faces.rows(); ++f) {
    Eigen::Vector2d at[3];
    for (int k = 0; k < 3; ++k) {
      at[k] = garment.rest.row(garment.rest_faces(f, k)).transpose();
    }
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const int last = (k + 2) % 3;
      std::map<int, double>& of = weights[faces(f, k)];
      of[faces(f, next)] += half_tangent(at[last], at[k], at[next]) / (at[next] - at[k]).norm();
      of[faces(f, last)] += half_tangent(at[k], at[next], at[last]) / (at[last] - at[k]).norm();
      ++sides[std::minmax(faces(f, k), faces(f, next))];
    }
  }
  std::set<int> border;
  for (const auto& [edge, count] : sides) {
    if (count == 1) {
      border.insert({edge.first, edge.second});
    }
  }
  std::vector<ClothCurvature> out;
  for (const auto& [vertex, around] : weights) {
    if (border.count(vertex) != 0) {
      continue;
    }
    ClothCurvature one{{vertex}, {0}, stiffness};
    for (const auto& [neighbour, weight] : around) {
      one.vertices.push_back(neighbour);
      one.weights.push_back(-weight);
      one.weights[0] += weight;
    }
    out.push_back(std::move(one));
  }
  return out;
}

ForeignSequence read_foreign(const std::string& file, double spring) {
  const Npz npz(file);
  ForeignSequence out;
  out.spring = spring;
  out.body_faces = triangles_of(npz, "body_faces");
  const Triangles faces = triangles_of(npz, "cloth_faces");
  const std::vector<double> uv = doubles_of(npz.read("cloth_uv"));
  std::vector<int> sewn(uv.size() / 2);
  for (std::size_t v = 0; v < sewn.size(); ++v) {
    sewn[v] = static_cast<int>(v);
  }
  const std::vector<std::int64_t> seams = integers_of(npz.read("cloth_seams"));
  for (std::size_t i = 0; i + 1 < seams.size(); i += 2) {
    sewn[static_cast<std::size_t>(seams[i + 1])] = static_cast<int>(seams[i]);
  }
  std::vector<int> rows;
  std::vector<int> number(sewn.size(), -1);
  for (std::size_t v = 0; v < sewn.size(); ++v) {
    if (sewn[v] == static_cast<int>(v)) {
      number[v] = static_cast<int>(rows.size());
      rows.push_back(static_cast<int>(v));
    }
  }
  out.body = frames_of(npz, "body_vertices", {});
  out.cloth = frames_of(npz, "cloth_vertices", rows);
  out.garment.name = "skirt";
  out.garment.mesh.vertices = out.cloth[0];
  out.garment.mesh.faces = faces;
  for (Index i = 0; i < faces.size(); ++i) {
    int& corner = out.garment.mesh.faces(i / 3, i % 3);
    corner = number[static_cast<std::size_t>(sewn[static_cast<std::size_t>(corner)])];
  }
  out.garment.rest.resize(static_cast<Index>(uv.size() / 2), 2);
  for (Index i = 0; i < out.garment.rest.size(); ++i) {
    out.garment.rest(i / 2, i % 2) = uv[static_cast<std::size_t>(i)];
  }
  out.garment.rest_faces = faces;
  std::set<int> attached;
  for (const std::int64_t v : integers_of(npz.read("cloth_attached"))) {
    attached.insert(number[static_cast<std::size_t>(sewn[static_cast<std::size_t>(v)])]);
  }
  out.attached.assign(attached.begin(), attached.end());
  out.fps = doubles_of(npz.read("fps")).at(0);
  return out;
}

Cloth foreign_cloth(const ForeignSequence& sequence, const ClothOptions& options) {
  Garment garment = sequence.garment;
  garment.material = {};
  garment.material.density = 0.2;
  garment.material.friction = 0.3;
  garment.material.thickness = kForeignDistance;
  garment.material.damping = 0;
  garment.material.bending = 2 * std::sqrt(3.0) * kForeignBend;
  garment.material.stretch_warp = garment.material.stretch_weft = sequence.spring;
  Cloth cloth = make_cloth(garment, sequence.attached, options);
  for (int i = 0; i < cloth.fibre_count; ++i) {
    cloth.springs[i].stiffness = sequence.spring;
  }
  return cloth;
}

Cloth published_cloth(const ForeignSequence& sequence) {
  Cloth cloth = foreign_cloth(sequence);
  cloth.hinges.clear();
  cloth.curvatures = foreign_curvatures(sequence.garment, kForeignBend);
  rebuild_schedule(cloth);
  return cloth;
}

SolverOptions foreign_options() {
  SolverOptions options;
  options.name = "projective-friction";
  options.time_step = 1.0 / 30;
  options.substeps = options.projective.substeps = 16;
  options.projective.iterations = 32;
  options.report = false;
  options.self_contact = true;
  options.self_thickness = 4e-3;
  options.velocity_damping = kForeignDamping;
  options.depenetration_speed = 0.01;  // its contacts stop cloth where it is
  options.xpbd.iterations = 4;
  options.xpbd.precision = "double";
  return options;
}

ClothState start_of(const ForeignSequence& sequence) {
  ClothState state;
  state.positions = sequence.cloth[0];
  // Of second order, as cloth gathers half a metre a second in a frame.
  const std::vector<Points>& x = sequence.cloth;
  state.velocities = sequence.fps * (2 * x[1] - 1.5 * x[0] - 0.5 * x[2]);
  return state;
}

ClothFigures figures_of(const Points& x, const Cloth& flat) {
  ClothFigures out;
  for (int i = 0; i < flat.fibre_count; ++i) {
    const ClothSpring& s = flat.springs[i];
    out.strain += std::abs((x.row(s.a) - x.row(s.b)).norm() / s.rest - 1) / flat.fibre_count;
  }
  for (Index f = 0; f < flat.faces.rows(); ++f) {
    const Eigen::Vector3d e1 = (x.row(flat.faces(f, 1)) - x.row(flat.faces(f, 0))).transpose();
    const Eigen::Vector3d e2 = (x.row(flat.faces(f, 2)) - x.row(flat.faces(f, 0))).transpose();
    out.area += 0.5 * e1.cross(e2).norm();
  }
  out.silhouette = shadow_along_z(x, flat.faces);
  std::vector<double> heights(x.col(1).data(), x.col(1).data() + x.rows());
  std::sort(heights.begin(), heights.end());
  const std::size_t lowest = std::max<std::size_t>(1, heights.size() / 20);
  for (std::size_t i = 0; i < lowest; ++i) {
    out.hem += heights[i] / static_cast<double>(lowest);
  }
  return out;
}

}  // namespace atelier::fixtures
