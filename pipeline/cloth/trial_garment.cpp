#include "pipeline/cloth/trial_garment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/remesh/isotropic_remeshing.h"
#include "core/saturating_cast.h"
#include "core/tree.h"
#include "pipeline/outfit/held_cloth.h"
#include "simulation/cloth/median_rest.h"

namespace atelier {
namespace {

constexpr double kPatch = 0.25;  // m, cloth that is looked at as one

/// Places on a template's triangles, that go with it wherever it is registered.
struct Binding {
  std::vector<ClosestPoint> places;

  Points on(const Points& vertices, const Triangles& faces) const {
    Points points(static_cast<Index>(places.size()), 3);
    for (std::size_t i = 0; i < places.size(); ++i) {
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      for (int k = 0; k < 3; ++k) {
        sum += places[i].barycentric[k] * vertices.row(faces(places[i].face, k));
      }
      points.row(static_cast<Index>(i)) = sum;
    }
    return points;
  }
};

Mesh coarse_mesh(const Mesh& mesh, double edge_length) {
  Mesh surface;
  surface.vertices = mesh.vertices;
  surface.faces = mesh.faces;
  return isotropic_remeshing(surface, {.edge_length = edge_length, .holes = {}});
}

/// Speeds from five frames, where there are as many: the slope of the polynomial through them. The
/// difference of two neighbours is a tenth of a metre a second off where a skirt turns.
std::vector<Points> smooth_velocities(const std::vector<Points>& at, double fps) {
  std::vector<Points> velocities;
  const auto count = static_cast<int>(at.size());
  for (int i = 0; i < count; ++i) {
    const auto x = [&](int k) -> const Points& {
      return at[static_cast<std::size_t>(std::ptrdiff_t{i} + k)];
    };
    if (i >= 2 && i + 2 < count) {
      velocities.push_back(fps * (8 * (x(1) - x(-1)) - (x(2) - x(-2))) / 12);
    } else if (i >= 1 && i + 1 < count) {
      velocities.push_back(fps * (x(1) - x(-1)) / 2);
    } else {
      velocities.push_back(i == 0 ? Points(fps * (x(1) - x(0))) : Points(fps * (x(0) - x(-1))));
    }
  }
  return velocities;
}

/// Cells of a raster in space.
void cut_patches(TrialGarment& trial) {
  std::map<std::array<int, 3>, int> cells;
  const Points& at = trial.targets.front();
  for (Index v = 0; v < at.rows(); ++v) {
    std::array<int, 3> cell{};
    for (std::size_t c = 0; c < 3; ++c) {
      cell[c] = saturating_cast<int>(std::floor(at(v, static_cast<Index>(c)) / kPatch));
    }
    trial.patches.push_back(cells.try_emplace(cell, static_cast<int>(cells.size())).first->second);
  }
  trial.patch_count = static_cast<int>(cells.size());
}

/// Attaches the vertices of a coarser garment that lie on bands of the fine one.
/// @param fine  [V,3] m, where the fine one starts
void hold(Garment& coarse, const std::vector<HeldRing>& rings, const Points& fine,
          double edge_length, const Points& start, const Points& body,
          const Triangles& body_faces) {
  constexpr double kReach = 0.4;  // of an edge's length
  for (const HeldRing& ring : rings) {
    HeldRing near = ring;
    near.vertices.clear();
    for (Index v = 0; v < start.rows(); ++v) {
      const bool on_it = std::any_of(ring.vertices.begin(), ring.vertices.end(), [&](int held) {
        return (fine.row(held) - start.row(v)).norm() < kReach * edge_length;
      });
      if (on_it) {
        near.vertices.push_back(static_cast<int>(v));
      }
    }
    attach_bands({near}, start, body, body_faces, coarse);
  }
}

}  // namespace

TrialGarment trial_garment(const RegisteredGarmentSequence& garment, const MovingBody& moving,
                           const Points& body, const Material& material, double edge_length) {
  const std::vector<int>& frames = moving.motion.frame_ids;
  const Triangles& body_faces = moving.model.mesh.faces;
  TrialGarment trial;
  trial.name = garment.name;
  const WornGarment fine = worn_in_frame(garment, frames.front(), body, body_faces, material);
  const Triangles& faces = garment.garment.mesh.faces;
  trial.worn.name = garment.name;
  Garment& coarse = trial.worn.garment;
  coarse.name = garment.name;
  coarse.mesh = coarse_mesh(fine.garment.mesh, edge_length);
  coarse.material = material;
  const Binding binding{
      closest_points(build_tree(fine.garment.mesh.vertices, faces), coarse.mesh.vertices)};
  for (const int id : frames) {
    trial.targets.push_back(binding.on(registered_mesh(garment, id).vertices, faces));
  }
  trial.velocities = smooth_velocities(trial.targets, moving.motion.fps);
  trial.worn.start = trial.targets.front();
  trial.worn.velocity = trial.velocities.front();
  hold(coarse, garment.holding, registered_mesh(garment, frames.front()).vertices, edge_length,
       trial.worn.start, body, body_faces);
  rest_on_median_lengths(coarse, trial.targets);
  cut_patches(trial);
  return trial;
}

}  // namespace atelier
