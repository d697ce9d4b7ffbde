#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "core/device.h"
#include "core/io/ground_truth_archive.h"
#include "core/options.h"
#include "simulation/cloth/cloth.h"
#include "simulation/solver.h"

namespace atelier {

/// Which clothes, of which cloth, and how they are simulated.
struct OutfitOptions {
  /// Garments joined by "+": dress, tee, skirt, trousers, or files of sewing
  /// patterns (.json); or "mhclo:FILE" for a MakeHuman garment on a MakeHuman body.
  std::string garment = "dress";
  double pattern_scale = 1;   ///< of pattern files: a larger or smaller size
  double edge_length = 0.02;  ///< m, of the cloth's triangles
  double density = 0.17;      ///< kg/m2
  double stretch = 1500;      ///< N/m
  double bending = 2e-5;      ///< N m
  double friction = 0.4;      ///< Coulomb coefficient
  double thickness = 0;       ///< m kept to the body; 0: what the edge length needs
  double rate = 60;           ///< simulated frames a second
  int substeps = 15;          ///< of each
};
OptionTable describe(OutfitOptions& options);

/// Clothes on a body in its rest pose.
struct Outfit {
  std::vector<GroundTruthGarment> garments;  ///< sewn; vertices of their meshes are draped
  Cloth cloth;                               ///< all of them together
  std::vector<Index> first;  ///< first vertex of each garment in the cloth, and the end
  ClothState state;          ///< draped
  SolverOptions solver;      ///< to go on with
};

/// Substeps that a search for pairs of cloth that may touch looks ahead (SolverOptions): a third of
/// a simulated frame. Cloth that leaves its flight sooner is searched for again, so that this is a
/// matter of speed alone.
int search_interval(int substeps);

/// Names of the garments of an outfit, with their labels. Throws DataError for an unknown one.
std::vector<std::pair<std::string, Label>> outfit_garments(const std::string& garment);

/// Sees every simulated frame of a garment that is being put on, and the body at that time.
using DressingWatch = std::function<void(const Mesh& cloth, const Points& body)>;

/// Cuts a garment (a name or a pattern file, see OutfitOptions) into panels of triangles. Throws
/// DataError for a pattern that is none.
Garment cut_panels(const std::string& name, const BodyModel& body, const OutfitOptions& options);

/// Sews, drapes and layers the clothes. Patterns of files are sewn round the body with its arms
/// out, which are then lowered into the rest pose; ours are drafted for the rest pose. Throws
/// DataError if a garment cannot be put on: the pattern is none, it is too tight for the body, it
/// stays open or torn, it falls off, or it ends inside the body. `body_file` is where the body
/// comes from: MakeHuman garments hang on it.
Outfit dress_body(const BodyModel& body, const OutfitOptions& options,
                  const std::string& body_file = "", Device device = Device::Cpu,
                  const DressingWatch& watch = {});

/// Reads what dress_body would read for its garments, without sewing any. Throws UnknownValue for a
/// name that is none, DataError for a file that cannot be used.
void require_garments(const BodyModel& body, const OutfitOptions& options,
                      const std::string& body_file = "");

/// Clothes that dress_body has put on the same body before, as it left them: nothing is draped.
Outfit dressed_before(std::vector<GroundTruthGarment> garments, const OutfitOptions& options);

/// How panels are sewn.
struct SewingOptions {
  SolverOptions solver;    ///< time step, substeps, thickness
  double gravity = 2;      ///< m/s2, keeps a skirt down while its sides are drawn together
  double waist_girth = 0;  ///< m; above 0 the highest opening is drawn in to it, as elastic does
  Device device = Device::Cpu;
  DressingWatch watch;
};

/// Sews one garment's panels round a body that stands still: threads are shortened evenly over a
/// second, then vertices that are sewn together become one. Returns the sewn garment. The body may
/// be larger than it is, so that there is room for what is worn below. Throws DataError where a
/// seam stays open because the body or tight cloth is in its way.
Garment sewn_on(const Garment& panels, const Mesh& body, const SewingOptions& options);

}  // namespace atelier
