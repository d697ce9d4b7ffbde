#pragma once

#include <cmath>

#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/test_bodies.h"

namespace atelier::fixtures {

/// A sheet that falls into folds over a moving ball, with every contact.
class FallingSheet {
 public:
  static constexpr int kFrames = 16;

  explicit FallingSheet(Device device)
      : ball_(sphere(0.1, 16, 24)), cloth_(falling()), solver_(solver(device)) {}

  void set_state(const ClothState& state) { solver_.set_state(state); }
  ClothState state() const { return solver_.state(); }
  void advance() {
    const auto at = [&](std::int64_t frame) -> Points {
      return ball_.vertices.rowwise() +
             Eigen::RowVector3d(0.03 * std::sin(0.3 * static_cast<double>(frame)), -0.103, 0);
    };
    const std::int64_t frame = solver_.state().frame;
    Control control;
    control.body_start = at(frame);
    control.body_end = at(frame + 1);
    solver_.advance(control);
  }

 private:
  static Cloth falling() {
    Garment garment = garment_of(sheet(20, 20, 0.02, 'a'), 0.2, 300, 1e-6);
    garment.mesh.vertices.col(0).array() -= 0.2;
    garment.mesh.vertices.col(2).array() -= 0.2;
    return make_cloth(garment);
  }
  ClothSolver solver(Device device) const {
    XpbdOptions options;
    options.self_contact = true;
    return ClothSolver(cloth_, ball_.faces, options, device);
  }

  Mesh ball_;
  Cloth cloth_;
  ClothSolver solver_;
};

}  // namespace atelier::fixtures
