#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/cloth/simulation_scene.h"

namespace atelier {

/// Refuses a body that cloth cannot meet. Throws DataError, with `file` in it, for one without
/// faces or without area.
void require_surface(const Points& body, const Triangles& faces, const std::filesystem::path& file);

/// Properties of a scene that are probably unintended, a sentence each, in the order of their
/// likely causes: a body of no person's size (below 0.05 m across, or above 5 m high: another
/// unit), a garment of another size than its body (another unit; without a body: below 2 cm or
/// above 20 m across), one that lies beside it, below it or higher above than it is high (1 m at
/// least), a closed body whose faces look inwards, vertices that the body pulls far from where they
/// begin, as they are attached to another one, and vertices that begin so deep inside the body,
/// deeper than `contact_reach` [m], that contact may not bring them out. The thresholds are our
/// choice.
std::vector<std::string> scene_diagnostics(const SimulationScene& scene, double contact_reach);

/// Throws UsageError where options of a solver do not work together on that device.
void require_solver(const SolverOptions& options, Device device);

/// Refuses, before anything is read, what is said and would do nothing with these files on this
/// device, or contradicts something else, by a table of rules (of options alone: cloth_rules.h):
/// frames a second of a body that is one mesh, a fall into no motion, a garment that is to hang as
/// captured on nobody, ways of a GPU on the CPU. Throws UsageError.
void require_scene_options(const ScenePaths& paths, const SimulateOptions& options, Device device);

/// The same of what only the garment tells, before the body is read: warp or weft said for itself
/// without a flat rest shape, by which alone they differ, seams to be left open of which there are
/// none. Throws UsageError.
void require_garment_options(const Garment& garment, const SimulateOptions& options);

/// Refuses a garment of which the body holds every vertex (UsageError), and one that was put on
/// another body: its attachments name triangles that `body_faces` does not have (DataError, with
/// `file` in it).
void require_held(const Garment& garment, const Triangles& body_faces,
                  const std::filesystem::path& file);

}  // namespace atelier
