#include "tests/simulation/cusick_drape.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "simulation/solver.h"

namespace atelier {
namespace {

/// The ring between `inner` and `outer` rings of radius `step` each, of which ring r has 6 r
/// vertices: the part of a disk of triangles that hangs.
Mesh ring_mesh(int inner, int outer, double step) {
  Mesh mesh;
  std::vector<int> first(static_cast<std::size_t>(outer) + 2, 0);
  for (int r = inner; r <= outer; ++r) {
    first[r + 1] = first[r] + 6 * r;
  }
  mesh.vertices.resize(first[outer + 1], 3);
  for (int r = inner; r <= outer; ++r) {
    for (int i = 0; i < 6 * r; ++i) {
      const double angle = 2 * std::numbers::pi * i / (6 * r);
      mesh.vertices.row(first[r] + i) << r * step * std::cos(angle), 0, -r * step * std::sin(angle);
    }
  }
  std::vector<Eigen::RowVector3i> faces;
  for (int r = inner; r < outer; ++r) {
    for (int sector = 0; sector < 6; ++sector) {
      const auto in = [&](int i) { return first[r] + (sector * r + i) % (6 * r); };
      const auto out = [&](int i) { return first[r + 1] + (sector * (r + 1) + i) % (6 * (r + 1)); };
      for (int i = 0; i <= r; ++i) {
        faces.emplace_back(in(i), out(i), out(i + 1));
        if (i < r) {
          faces.emplace_back(in(i), out(i + 1), in(i + 1));
        }
      }
    }
  }
  mesh.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    mesh.faces.row(static_cast<Index>(i)) = faces[i];
  }
  return mesh;
}

/// Area of the shadow on the ground of a disk of radius `disk` and a mesh within `reach` of the
/// origin, in cells.
double shadow_area(const Mesh& mesh, double disc, double reach) {
  constexpr int kCells = 640;
  const double cell = 2 * reach / kCells;
  std::vector<char> dark(static_cast<std::size_t>(kCells) * kCells, 0);
  const auto centre = [&](int i) { return (i + 0.5) * cell - reach; };
  for (int y = 0; y < kCells; ++y) {
    for (int x = 0; x < kCells; ++x) {
      dark[static_cast<std::size_t>(y) * kCells + x] =
          std::hypot(centre(x), centre(y)) <= disc ? 1 : 0;
    }
  }
  const auto clamped = [&](double v) {
    return std::clamp(static_cast<int>((v + reach) / cell), 0, kCells - 1);
  };
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    Eigen::Vector2d p[3];
    for (int c = 0; c < 3; ++c) {
      p[c] = {mesh.vertices(mesh.faces(f, c), 0), mesh.vertices(mesh.faces(f, c), 2)};
    }
    const auto side = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b, double x, double y) {
      return (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
    };
    const Eigen::Vector2d low = p[0].cwiseMin(p[1]).cwiseMin(p[2]);
    const Eigen::Vector2d high = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
    for (int y = clamped(low.y()); y <= clamped(high.y()); ++y) {
      for (int x = clamped(low.x()); x <= clamped(high.x()); ++x) {
        const double a = side(p[0], p[1], centre(x), centre(y));
        const double b = side(p[1], p[2], centre(x), centre(y));
        const double c = side(p[2], p[0], centre(x), centre(y));
        if ((a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0)) {
          dark[static_cast<std::size_t>(y) * kCells + x] = 1;
        }
      }
    }
  }
  return cell * cell * static_cast<double>(std::count(dark.begin(), dark.end(), 1));
}

}  // namespace

CusickDrape cusick_drape(const Material& material, const CusickOptions& options, Device device) {
  const double specimen = options.specimen_diameter / 2;
  const double disc = options.disc_diameter / 2;
  ATELIER_CHECK(specimen > 0.005 && specimen < 5 && disc > 0.1 * specimen && disc < 0.9 * specimen,
                "the disk is smaller than the specimen");
  ATELIER_CHECK(options.rings >= 6 && options.rings <= 200, "rings in [6, 200]");
  ATELIER_CHECK(options.seconds >= 0.1 && options.seconds <= 60, "seconds in [0.1, 60]");
  const double step = specimen / options.rings;
  const int held = std::clamp(static_cast<int>(std::lround(disc / step)), 2, options.rings - 2);

  Garment garment;
  garment.name = "specimen";
  garment.material = material;
  garment.mesh = ring_mesh(held - 1, options.rings, step);
  // So that the clamp is at the rim of the disk also where a ring is not.
  for (Index v = 0; v < garment.mesh.vertices.rows(); ++v) {
    const double r = std::hypot(garment.mesh.vertices(v, 0), garment.mesh.vertices(v, 2));
    const double share = (r - held * step) / (specimen - held * step);
    const double moved = share > 0 ? disc + share * (specimen - disc) : r + disc - held * step;
    garment.mesh.vertices.row(v) *= moved / r;
  }
  garment.rest.resize(garment.mesh.vertices.rows(), 2);
  garment.rest.col(0) = garment.mesh.vertices.col(0);
  garment.rest.col(1) = -garment.mesh.vertices.col(2);
  garment.rest_faces = garment.mesh.faces;
  std::vector<int> clamp;
  for (Index v = 0; v < garment.mesh.vertices.rows(); ++v) {
    if (std::hypot(garment.rest(v, 0), garment.rest(v, 1)) < disc + 0.3 * step) {
      clamp.push_back(static_cast<int>(v));
    }
  }
  ClothOptions cloth_options;
  cloth_options.membrane = "strain";
  const SimulationModel model{make_cloth(garment, clamp, cloth_options), {}};
  const Cloth& cloth = model.cloth;

  SolverOptions how;
  how.name = options.solver;
  how.substeps = how.projective.substeps = options.substeps;
  how.xpbd.iterations = how.projective.iterations = options.iterations;
  how.velocity_damping = 4;
  how.report = false;
  const std::unique_ptr<Solver> solver = create_solver(model, how, device);
  ClothState state = rest_state(cloth);
  for (Index v = 0; v < state.positions.rows(); ++v) {
    const double angle = std::atan2(garment.rest(v, 1), garment.rest(v, 0));
    const double uneven = std::cos(5 * angle + 0.3) + std::cos(7 * angle + 1.1) +
                          std::cos(3 * angle + 2) + std::cos(4 * angle);
    state.velocities(v, 1) = cloth.fixed[v] ? 0 : 0.01 * uneven;
  }
  solver->set_state(state);
  const int frames = static_cast<int>(std::lround(options.seconds / how.time_step));
  for (int i = 0; i < frames; ++i) {
    solver->step({});
  }
  state = solver->state();
  CusickDrape out;
  out.mesh = garment.mesh;
  out.mesh.vertices = state.positions;
  out.rest_speed = state.velocities.rowwise().norm().maxCoeff();
  const double disc_area = std::numbers::pi * disc * disc;
  const double area = shadow_area(out.mesh, disc, 1.05 * specimen);
  out.coefficient = 100 * (area - disc_area) / (std::numbers::pi * specimen * specimen - disc_area);
  return out;
}

}  // namespace atelier
