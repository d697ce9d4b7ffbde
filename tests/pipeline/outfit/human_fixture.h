#pragma once

#include "bodymodel/human/default_human.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "simulation/contact/crossings.h"
#include "simulation/xpbd/xpbd.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/contact_guard.h"

namespace atelier::fixtures {

/// The default woman, made once.
inline const BodyModel& woman() {
  static const BodyModel model = [] {
    DefaultHumanOptions options = female_human();
    options.shape_basis = false;
    return default_human(options);
  }();
  return model;
}

/// She with some joints turned, by name.
inline Points posed_woman(const std::vector<std::pair<std::string, Eigen::Vector3d>>& turns) {
  static const ShapedBody shaped = shape_body(woman());
  Pose pose = rest_pose(woman().skeleton);
  for (const auto& [name, rotation] : turns) {
    const int joint = find_joint(woman().skeleton, name);
    EXPECT_GE(joint, 0) << name;
    pose.rotations.row(joint) = rotation.transpose();
  }
  return skin_vertices(woman(), shaped, pose);
}

inline Eigen::Vector3d rest_joint(const std::string& name) {
  return rest_positions(woman().skeleton).row(find_joint(woman().skeleton, name)).transpose();
}

/// A level square of cloth, its middle at `centre`.
inline Garment square(int cells, double size, const Eigen::RowVector3d& centre) {
  Garment garment = garment_of(sheet(cells, cells, size / cells, 'a'), 0.2, 400, 2e-6);
  garment.mesh.vertices.rowwise() += centre - Eigen::RowVector3d(size / 2, 0, size / 2);
  garment.material.thickness = 3e-3;
  garment.material.friction = 0.3;
  return garment;
}

constexpr double kDeepest = 1e-4;  // m, what the guard on contact with a body allows

/// What happened to cloth on a body.
struct Course {
  double deepest = 0;     ///< m, by the guard
  double max_strain = 0;  ///< of 95 edges in 100
  int excused = 0;        ///< at the end, where the body overlaps itself
  int max_excused = 0;    ///< in all frames that the guard looks at
  int max_crossings = 0;  ///< of the cloth with itself, where its faces are given
  ClothState end;
};

/// Frames of a body that is `at(frame)`; the guard every `every` frames and after the last.
template <class At>
Course run_on(ClothSolver& solver, const Triangles& faces, int frames, int every, const At& at,
              const Triangles& cloth = {}) {
  Course course;
  Points now = at(0);
  for (int i = 0; i < frames; ++i) {
    Control control;
    control.body_start = now;
    control.body_end = now = at(i + 1);
    course.max_strain = std::max(course.max_strain, solver.advance(control).strain_p95);
    if (i % every == every - 1 || i + 1 == frames) {
      course.end = solver.state();
      const Guard guard = contact_guard(course.end.positions, now, faces, 3e-3);
      course.deepest = std::max(course.deepest, guard.deepest);
      course.excused = guard.excused;
      course.max_excused = std::max(course.max_excused, guard.excused);
      if (cloth.rows() > 0) {
        course.max_crossings =
            std::max(course.max_crossings, count_crossings(course.end.positions, cloth));
      }
    }
  }
  return course;
}

}  // namespace atelier::fixtures
