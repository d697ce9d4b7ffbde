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

/// How the clothes of a capture are solved unless something else is said.
inline SolverOptions worn_solver_options() {
  SolverOptions solver;
  solver.substeps = 30;
  solver.projective.substeps = 20;  // fewer lose cloth that arm and trunk pinch
  solver.self_contact = true;
  solver.self_interval = 30;
  return solver;
}

/// How the clothes of a capture are simulated.
struct WornClothOptions {
  double rate = 60;                  ///< simulated frames a second, 60 to 1000
  double contact = 0;                ///< m kept to the body; 0: what the edge length needs
  std::string rest_angles = "flat";  ///< see ClothOptions
  bool relax = false;                ///< take out what the garment's weight has stretched
  RelaxGravityOptions relaxing{.rounds = 3, .seconds = 0.5};
  SolverOptions solver = worn_solver_options();
};
OptionTable describe(WornClothOptions& options);

/// Clothes on a body, ready to be simulated: all garments in one cloth, one behind the other.
struct WornCloth {
  std::vector<std::string> names;
  std::vector<Mesh> meshes;  ///< faces and texture coordinates of each
  std::vector<Index> first;  ///< first vertex of each in the cloth, and the end
  Cloth cloth;               ///< without attachments where `held` has bands
  HeldCloth held;            ///< what the body holds of it
  ClothState state;
  SolverOptions solver;
};

/// A garment as it is simulated.
struct WornGarment {
  std::string name;
  Garment garment;                ///< rest shape, material, attachments of what is held
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

/// The speed of a registered garment in the first frame of a body's motion, [V,3] m/s: that of the
/// body which it rides on, and what it does against it on the way to the next frame. At rest where
/// there is no next frame.
Points registered_velocity(const RegisteredGarmentSequence& garment, const MovingBody& body);

/// The same garment as it hangs without its own weight, which has stretched it where it was
/// captured (relax_gravity); `body` is the surface in its template's frame.
RelaxedGarment unloaded(const WornGarment& worn, const Points& body, const Triangles& body_faces,
                        const WornClothOptions& options, Device device);

}  // namespace atelier
