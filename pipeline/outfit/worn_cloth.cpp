#include "pipeline/outfit/worn_cloth.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/mesh_statistics.h"
#include "pipeline/outfit/dressing.h"
#include "pipeline/outfit/held_cloth.h"
#include "registration/attach_to_body.h"
#include "registration/remove_slivers.h"
#include "simulation/contact/contact_distance.h"

namespace atelier {
namespace {

constexpr double kMinCorner = 3;  // deg, of rest shapes; simulation refuses half a degree

ClothOptions cloth_options(const WornClothOptions& options) {
  ClothOptions cloth;
  cloth.rest_angles = options.rest_angles;
  return cloth;
}

}  // namespace

OptionTable describe(WornClothOptions& options) {
  OptionTable table;
  table.add("rate", options.rate, 60, 1000, "1/s", "Simulated frames per second");
  table.add("contact", options.contact, 0, 0.05, "m",
            "Gap kept between cloth and body; 0: as the edge length requires");
  table.add("rest_angles", options.rest_angles, {"flat", "template"},
            "Rest angle of hinges: flat, or template, that of the registered cloth with its folds");
  table.add("relax", options.relax,
            "Removal of the stretch of the registered garment that is due to its weight");
  table.add("relaxing", describe(options.relaxing));
  return table.add(describe(options.solver, {"time_step", "thickness"}));
}

WornCloth worn_cloth(const std::vector<WornGarment>& garments, const WornClothOptions& options) {
  ATELIER_CHECK(!garments.empty(), "no garment is worn");
  WornCloth worn;
  std::vector<Cloth> cloths;
  double edge = 0;
  worn.first.push_back(0);
  for (const WornGarment& one : garments) {
    worn.names.push_back(one.name);
    Mesh mesh = one.garment.mesh;
    mesh.normals.resize(0, 3);
    edge = std::max(edge, mean_edge_length(mesh));
    worn.meshes.push_back(std::move(mesh));
    worn.first.push_back(worn.first.back() + one.start.rows());
    cloths.push_back(make_cloth(one.garment, {}, cloth_options(options)));
    add_held(one.holding, one.garment, worn.first[worn.first.size() - 2], worn.held);
  }
  worn.cloth = cloths.size() == 1 ? cloths.front() : join_cloths(cloths);
  if (!worn.held.bands.empty()) {
    worn.cloth.attachments.clear();  // their vertices go where `held` has them
  }
  worn.state = rest_state(worn.cloth);
  for (std::size_t g = 0; g < garments.size(); ++g) {
    const Index count = garments[g].start.rows();
    worn.state.positions.middleRows(worn.first[g], count) = garments[g].start;
    if (garments[g].velocity.rows() > 0) {
      worn.state.velocities.middleRows(worn.first[g], count) = garments[g].velocity;
    }
  }
  worn.solver = options.solver;
  worn.solver.time_step = 1 / options.rate;
  worn.solver.thickness = options.contact > 0 ? options.contact : contact_distance(edge);
  return worn;
}

Points registered_velocity(const RegisteredGarmentSequence& garment, const MovingBody& body) {
  constexpr double kMoment = 1.0 / 120;  // s
  const Triangles& faces = body.model.mesh.faces;
  const Points here = registered_mesh(garment, body.motion.frame_ids.front()).vertices;
  if (body.motion.frame_ids.size() < 2) {
    return Points::Zero(here.rows(), 3);
  }
  const Points next = registered_mesh(garment, body.motion.frame_ids[1]).vertices;
  const double lead = lead_seconds(body);
  const std::vector<Attachment> riding = attach_to_body(here, surface_at(body, lead), faces);
  const auto carried = [&](double seconds) {
    return body_driven(riding, surface_at(body, lead + seconds), faces);
  };
  return (carried(kMoment) - here) / kMoment +
         body.motion.fps * (next - carried(1 / body.motion.fps));
}

WornGarment worn_in_frame(const RegisteredGarmentSequence& garment, int frame_id,
                          const Points& body, const Triangles& body_faces,
                          const Material& material) {
  WornGarment worn;
  worn.name = garment.name;
  worn.garment = garment.garment;
  // Registration moves vertices along the cloth, here and there onto the opposite edge.
  worn.garment.mesh.vertices = remove_slivers(registered_mesh(garment, garment.template_frame),
                                              {.least = kMinCorner, .flips = false})
                                   .vertices;
  worn.garment.material = material;
  worn.start = registered_mesh(garment, frame_id).vertices;
  worn.holding = garment.holding;
  worn.garment.attachments.clear();  // the template's are those of all vertices
  attach_bands(worn.holding, worn.start, body, body_faces, worn.garment);
  return worn;
}

RelaxedGarment unloaded(const WornGarment& worn, const Points& body, const Triangles& body_faces,
                        const WornClothOptions& options, Device device) {
  SolverOptions solver = options.solver;
  solver.time_step = 1 / options.rate;
  // As it will be simulated: one distance for all that is worn.
  solver.thickness = options.contact > 0 ? options.contact : contact_distance(worn.garment);
  return relax_gravity({worn.garment, {}, body, body_faces}, cloth_options(options), solver,
                       options.relaxing, device);
}

}  // namespace atelier
