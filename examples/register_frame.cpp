// Registers the template of a tube of cloth to a labelled scan of it that has moved, and says how
// far each vertex is from where it went.
#include <Eigen/Geometry>
#include <cmath>
#include <iostream>
#include <numbers>

#include "core/garment.h"
#include "registration/tracking/register_garment.h"

using namespace atelier;

/// An open tube around the Y axis, radius 0.15 m, height 0.5 m: a sleeve, a skirt.
static Mesh tube(int around, int along) {
  Mesh mesh;
  mesh.vertices.resize(around * (along + 1), 3);
  mesh.faces.resize(2 * around * along, 3);
  for (int i = 0; i < mesh.vertices.rows(); ++i) {
    const double angle = 2 * std::numbers::pi * (i % around) / around;
    mesh.vertices.row(i) << 0.15 * std::cos(angle), 0.8 + 0.5 * (i / around) / along,
        -0.15 * std::sin(angle);
  }
  for (int i = 0; i < around * along; ++i) {
    const int next = i % around + 1 == around ? i + 1 - around : i + 1;
    mesh.faces.row(2 * i) << i, next, i + around;
    mesh.faces.row(2 * i + 1) << next, next + around, i + around;
  }
  return mesh;
}

/// Turned by 9 degrees and moved by 4 cm.
static Points moved(const Points& points) {
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(0.15, Eigen::Vector3d(1, 0, 0.3).normalized()));
  const Eigen::RowVector3d center(0, 1.05, 0);
  return ((points.rowwise() - center) * turn.transpose()).rowwise() +
         (center + Eigen::RowVector3d(0.03, 0.02, -0.02));
}

int main() {
  constexpr std::uint8_t kLabel = 5;
  Garment garment;
  garment.name = "tube";
  garment.mesh = tube(24, 14);

  Mesh scan = tube(60, 33);  // other triangles than the template
  scan.vertices = moved(scan.vertices);
  scan.labels.assign(static_cast<std::size_t>(scan.vertices.rows()), kLabel);

  RegisterOptions options;
  options.photometric = false;  // no images: the shape alone
  const RegistrationModel model = registration_model(garment, options);
  RegistrationFrame frame;
  frame.scan = garment_scan(scan, {kLabel});
  ShapeSolver solver(model.cloth);
  const RegisteredGarment found =
      register_garment(solver, model, model.vertices, frame, {}, options);

  const Points expected = moved(garment.mesh.vertices);
  std::cout << "mean distance before " << (model.vertices - expected).rowwise().norm().mean()
            << " m, after " << (found.vertices - expected).rowwise().norm().mean()
            << " m; the scan supports " << 100 * found.support << " % of the area\n";
}
