#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/random.h"
#include "registration/template/garment_template.h"

namespace atelier::fixtures {

/// A limb of a mannequin: a capsule from one point to another.
struct Capsule {
  Eigen::Vector3d from, to;
  double radius;
  int lump;
};

enum : int {
  Pelvis,
  Chest,
  Head,
  LeftUpperArm,
  LeftForearm,
  LeftHand,
  RightUpperArm,
  RightForearm,
  RightHand,
  LeftThigh,
  LeftShin,
  LeftFoot,
  RightThigh,
  RightShin,
  RightFoot
};

/// A person of capsules, arms `lift` radians up from hanging, legs a stride apart.
inline std::vector<Capsule> capsules(double lift = 0.8, double shift = 0) {
  std::vector<Capsule> all;
  const auto add = [&](Eigen::Vector3d from, Eigen::Vector3d to, double radius, int lump) {
    all.push_back({from + shift * Eigen::Vector3d::UnitX(), to + shift * Eigen::Vector3d::UnitX(),
                   radius, lump});
  };
  add({0, 0.95, 0}, {0, 1.10, 0}, 0.14, Pelvis);
  add({0, 1.15, 0}, {0, 1.35, 0}, 0.14, Chest);
  add({0, 1.50, 0}, {0, 1.68, 0}, 0.06, Head);
  for (const int side : {1, -1}) {
    const Eigen::Vector3d along(side * std::sin(lift), -std::cos(lift), 0);
    const Eigen::Vector3d shoulder(side * 0.16, 1.38, 0);
    const int arm = side > 0 ? LeftUpperArm : RightUpperArm;
    add(shoulder, shoulder + 0.24 * along, 0.045, arm);
    add(shoulder + 0.28 * along, shoulder + 0.48 * along, 0.04, arm + 1);
    add(shoulder + 0.52 * along, shoulder + 0.62 * along, 0.035, arm + 2);
    const Eigen::Vector3d hip(side * 0.09, 0.86, 0);
    const Eigen::Vector3d down(side * 0.12, -1, 0);
    const int leg = side > 0 ? LeftThigh : RightThigh;
    add(hip, hip + 0.38 * down, 0.075, leg);
    add(hip + 0.43 * down, hip + 0.72 * down, 0.055, leg + 1);
    add(hip + 0.76 * down, hip + 0.80 * down, 0.045, leg + 2);
  }
  return all;
}

inline double distance_to(const Capsule& capsule, const Eigen::Vector3d& point) {
  const Eigen::Vector3d axis = capsule.to - capsule.from;
  const double t = std::clamp((point - capsule.from).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  return (point - capsule.from - t * axis).norm() - capsule.radius;
}

/// Surface of capsules blown up by `gap`, without what lies inside of others: rows of quads from
/// pole to pole. `keep` picks faces by their middle.
inline Mesh capsule_surface(const std::vector<Capsule>& all, double gap, double step,
                            const std::function<bool(const Eigen::Vector3d&, int)>& keep) {
  std::vector<Eigen::RowVector3d> vertices;
  std::vector<std::array<int, 3>> faces;
  for (const Capsule& capsule : all) {
    const double radius = capsule.radius + gap;
    const Eigen::Vector3d axis = capsule.to - capsule.from;
    const Eigen::Vector3d d = axis.normalized();
    const Eigen::Vector3d u = d.unitOrthogonal();
    const Eigen::Vector3d w = d.cross(u);
    const int around = std::max(8, static_cast<int>(2 * M_PI * radius / step));
    const int cap = std::max(3, static_cast<int>(0.5 * M_PI * radius / step));
    const int along = std::max(1, static_cast<int>(std::lround(axis.norm() / step)));
    const int rows = 2 * cap + along;
    const int first = static_cast<int>(vertices.size());
    for (int i = 0; i <= rows; ++i) {
      const double angle = i <= cap ? 0.5 * M_PI * (i - cap + 0.02 * (i == 0)) / cap
                           : i >= cap + along
                               ? 0.5 * M_PI * (i - cap - along - 0.02 * (i == rows)) / cap
                               : 0;
      const Eigen::Vector3d center =
          capsule.from + std::clamp<double>(i - cap, 0, along) / along * axis;
      for (int k = 0; k < around; ++k) {
        const double turn = 2 * M_PI * k / around;
        vertices.emplace_back(
            (center + radius * (std::sin(angle) * d +
                                std::cos(angle) * (std::cos(turn) * u + std::sin(turn) * w)))
                .transpose());
      }
    }
    const auto face = [&](int a, int b, int c) {
      const Eigen::Vector3d middle = (vertices[a] + vertices[b] + vertices[c]).transpose() / 3;
      for (const Capsule& other : all) {
        if (&other != &capsule && distance_to(other, middle) < gap) {
          return;
        }
      }
      if (keep(middle, capsule.lump)) {
        faces.push_back({a, b, c});
      }
    };
    for (int i = 0; i < rows; ++i) {
      for (int k = 0; k < around; ++k) {
        const int a = first + i * around + k;
        const int b = first + i * around + (k + 1) % around;
        face(a, b, a + around);
        face(b, b + around, a + around);
      }
    }
  }
  Mesh mesh;
  mesh.vertices.resize(static_cast<Index>(vertices.size()), 3);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    mesh.vertices.row(static_cast<Index>(v)) = vertices[v];
  }
  mesh.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    mesh.faces.row(static_cast<Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  }
  return mesh;
}

inline bool everything(const Eigen::Vector3d& /*middle*/, int /*lump*/) {
  return true;
}

/// One closed surface for each capsule: windings are right but where they overlap.
inline Mesh body_surface(const std::vector<Capsule>& all) {
  Mesh body;
  for (const Capsule& capsule : all) {
    const Mesh one = capsule_surface({capsule}, 0, 0.02, everything);
    const Index vertices = body.vertices.rows();
    const Index faces = body.faces.rows();
    body.vertices.conservativeResize(vertices + one.vertices.rows(), 3);
    body.vertices.bottomRows(one.vertices.rows()) = one.vertices;
    body.faces.conservativeResize(faces + one.faces.rows(), 3);
    body.faces.bottomRows(one.faces.rows()) = one.faces.array() + static_cast<int>(vertices);
    body.labels.insert(body.labels.end(), static_cast<std::size_t>(one.vertices.rows()),
                       static_cast<std::uint8_t>(capsule.lump));
  }
  return body;
}

inline BodyAnatomy anatomy_of(const Mesh& body) {
  BodyAnatomy anatomy;
  anatomy.lumps.assign(body.labels.begin(), body.labels.end());
  anatomy.limbs = {{{Pelvis, Chest, Head},
                    {Pelvis, Chest, LeftUpperArm, LeftForearm, LeftHand},
                    {Pelvis, Chest, RightUpperArm, RightForearm, RightHand},
                    {Pelvis, LeftThigh, LeftShin, LeftFoot},
                    {Pelvis, RightThigh, RightShin, RightFoot}}};
  return anatomy;
}

inline constexpr std::uint8_t kSkinLabel = 1;
inline constexpr std::uint8_t kClothLabel = 3;
inline constexpr double kGap = 0.012;  // m between body and cloth

/// What a mannequin wears: faces of the blown-up capsules.
using Wears = std::function<bool(const Eigen::Vector3d& middle, int lump)>;

inline bool wears_tee(const Eigen::Vector3d& middle, int lump) {
  return (lump == Chest && middle.y() < 1.45) || (lump == Pelvis && middle.y() > 1.0) ||
         ((lump == LeftUpperArm || lump == RightUpperArm) && middle.y() > 1.28);
}
inline bool wears_trousers(const Eigen::Vector3d& middle, int lump) {
  return (lump == Pelvis && middle.y() < 1.05) ||
         (lump >= LeftThigh && lump != LeftFoot && lump != RightFoot && middle.y() > 0.2);
}

/// A cone round the y axis, open at both ends.
inline Mesh cone(double high, double high_radius, double low, double low_radius, double step) {
  const int around = static_cast<int>(2 * M_PI * low_radius / step);
  const int rows = static_cast<int>((high - low) / step);
  Mesh mesh;
  mesh.vertices.resize((rows + 1) * around, 3);
  mesh.faces.resize(2 * rows * around, 3);
  for (int i = 0; i <= rows; ++i) {
    const double t = static_cast<double>(i) / rows;
    const double radius = (1 - t) * low_radius + t * high_radius;
    for (int k = 0; k < around; ++k) {
      const double turn = 2 * M_PI * k / around;
      mesh.vertices.row(i * around + k) << radius * std::cos(turn), (1 - t) * low + t * high,
          radius * std::sin(turn);
      if (i < rows) {
        const int a = i * around + k;
        const int b = i * around + (k + 1) % around;
        mesh.faces.row(2 * a) << a, a + around, b;
        mesh.faces.row(2 * a + 1) << b, a + around, b + around;
      }
    }
  }
  return mesh;
}

/// Two meshes as one, the first labelled cloth, the second skin.
inline Mesh over_skin(const Mesh& cloth, const Mesh& skin) {
  Mesh scan;
  scan.vertices.resize(cloth.vertices.rows() + skin.vertices.rows(), 3);
  scan.vertices << cloth.vertices, skin.vertices;
  scan.faces.resize(cloth.faces.rows() + skin.faces.rows(), 3);
  scan.faces << cloth.faces,
      (skin.faces.array() + static_cast<int>(cloth.vertices.rows())).matrix();
  scan.labels.assign(static_cast<std::size_t>(cloth.vertices.rows()), kClothLabel);
  scan.labels.resize(static_cast<std::size_t>(scan.vertices.rows()), kSkinLabel);
  return scan;
}

/// Cloth of the given faces over skin, `noise` metres off, with `holes` (centre and radius).
inline Mesh clothed_scan(const std::vector<Capsule>& all, const Wears& wears, double noise = 0,
                         const std::vector<std::pair<Eigen::Vector3d, double>>& holes = {},
                         double step = 0.008) {
  const auto seen = [&](const Eigen::Vector3d& middle) {
    return std::all_of(holes.begin(), holes.end(), [&](const auto& hole) {
      return (middle - hole.first).norm() > hole.second;
    });
  };
  const Mesh cloth = capsule_surface(all, kGap, step, [&](const Eigen::Vector3d& m, int lump) {
    return wears(m, lump) && seen(m);
  });
  const Mesh skin = capsule_surface(
      all, 0, step, [&](const Eigen::Vector3d& m, int lump) { return !wears(m, lump) && seen(m); });
  Mesh scan = over_skin(cloth, skin);
  Random random{7};
  for (Index v = 0; v < scan.vertices.rows(); ++v) {
    for (int c = 0; c < 3; ++c) {
      scan.vertices(v, c) += noise * normal(random);
    }
  }
  return scan;
}

/// Frames over one mannequin's topology.
inline ClothedFrames frames_of(const std::vector<std::vector<Capsule>>& poses,
                               const std::function<Mesh(std::size_t pose)>& scan) {
  ClothedFrames frames;
  const Mesh body = body_surface(poses.front());
  frames.body_faces = body.faces;
  frames.anatomy = anatomy_of(body);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    frames.frame_ids.push_back(static_cast<int>(10 * i));
  }
  frames.load = [poses, scan](Index i) {
    const auto at = static_cast<std::size_t>(i);
    return ClothedFrame{scan(at), body_surface(poses[at]).vertices};
  };
  return frames;
}

}  // namespace atelier::fixtures
