#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/simulation_scene.h"

namespace atelier {

/// Refuses a body that cloth cannot meet. Throws DataError, with `file` in it, for one without
/// faces or without area.
void require_surface(const Points& body, const Triangles& faces, const std::filesystem::path& file);

/// What of a scene will run and hardly be meant, a sentence each, in the order of their likely
/// causes: a garment of another size than its body (another unit), one that lies beside it, a
/// closed body whose faces look inwards, and vertices that begin so deep inside the body, deeper
/// than `contact_reach` [m], that contact may not bring them out. The thresholds are our choice.
std::vector<std::string> scene_doubts(const SimulationScene& scene, double contact_reach);

/// Throws UsageError where options of a solver do not work together on that device.
void require_solver(const XpbdOptions& options, Device device);

}  // namespace atelier
