#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bodymodel/retarget/moving_body.h"
#include "core/device.h"
#include "core/options.h"
#include "pipeline/outfit/held_cloth.h"
#include "registration/tracking/registered_outfit.h"
#include "simulation/relax_gravity.h"
#include "simulation/solver.h"

namespace atelier {

/// Solver options for the clothes of a capture, by default.
inline SolverOptions worn_solver_options() {
  SolverOptions solver;
  solver.substeps = 30;
  solver.projective.substeps = 20;  // fewer lose cloth that arm and trunk pinch
  solver.self_contact = true;
  solver.self_interval = 30;
  return solver;
}

/// Simulation of the clothes of a capture.
struct WornClothOptions {
  double rate = 60;                  ///< simulated frames a second, 60 to 1000
  double contact = 0;                ///< m, gap to the body; 0: as the edge length requires
  std::string rest_angles = "flat";  ///< see ClothOptions
  bool relax = false;                ///< removes the stretch due to the garment's weight
  RelaxGravityOptions relaxing{.rounds = 3, .seconds = 0.5};
  SolverOptions solver = worn_solver_options();
};
OptionTable describe(WornClothOptions& options);

/// Clothes on a body, ready to be simulated: all garments joined into one cloth.
struct WornCloth {
  std::vector<std::string> names;
  std::vector<Mesh> meshes;  ///< faces and texture coordinates of each
  std::vector<Index> first;  ///< first vertex of each in the cloth, and the end
  Cloth cloth;               ///< without attachments where `held` has bands
  HeldCloth held;            ///< rings of it that the body holds
  ClothState state;
  SolverOptions solver;
};

/// A garment with its initial state.
struct WornGarment {
  std::string name;
  Garment garment;                ///< rest shape, material, attachments of its bands
  std::vector<HeldRing> holding;  ///< its bands have attachments
  Points start;                   ///< [V,3] m
  Points velocity;                ///< [V,3] m/s, or no rows: at rest
};

/// One cloth of all garments, from the inside out. Throws as make_cloth.
WornCloth worn_cloth(const std::vector<WornGarment>& garments, const WornClothOptions& options);

/// A registered garment in a frame: its rest shape is how it was registered in its template's own
/// frame, its start where it is in frame `frame_id`, at rest, attached to the body by its bands.
/// `body` is the body's surface in that frame. Throws as registered_mesh.
WornGarment worn_in_frame(const RegisteredGarmentSequence& garment, int frame_id,
                          const Points& body, const Triangles& body_faces,
                          const Material& material);

/// Velocities of a registered garment in the first frame of a body's motion, [V,3] m/s: that of the
/// body-driven prediction plus its motion relative to it towards the next frame; zero without a
/// next frame.
Points registered_velocity(const RegisteredGarmentSequence& garment, const MovingBody& body);

/// The garment without the stretch that its weight has caused where it was captured
/// (relax_gravity); `body` is the body's surface in its template's frame.
RelaxedGarment unloaded(const WornGarment& worn, const Points& body, const Triangles& body_faces,
                        const WornClothOptions& options, Device device);

}  // namespace atelier
