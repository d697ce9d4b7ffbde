#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "core/archive.h"
#include "simulation/cloth/cloth_state.h"
#include "simulation/cloth/frame_report.h"

namespace atelier {

/// One number of a frame's report, under the name that tables and archives have for it.
struct FrameColumn {
  const char* name;  ///< with its unit, "" for counts and shares: "penetration_depth_m"
  std::variant<int FrameReport::*, double FrameReport::*> member;
  bool later = false;  ///< not in the first archives: -1 where one lacks it
};

inline constexpr std::array<FrameColumn, 18> kFrameColumns = {{
    {"strain_p50", &FrameReport::strain_p50},
    {"strain_p95", &FrameReport::strain_p95},
    {"strain_max", &FrameReport::strain_max},
    {"spring_residual_m", &FrameReport::spring_residual},
    {"hinge_residual_rad", &FrameReport::hinge_residual},
    {"strain_residual", &FrameReport::strain_residual, true},
    {"kinetic_energy_j", &FrameReport::kinetic_energy},
    {"elastic_energy_j", &FrameReport::elastic_energy},
    {"body_contacts", &FrameReport::body_contacts},
    {"penetrating", &FrameReport::penetrating},
    {"penetration_depth_m", &FrameReport::penetration_depth},
    {"inside", &FrameReport::inside},
    {"inside_depth_m", &FrameReport::inside_depth},
    {"body_crossings", &FrameReport::body_crossings},
    {"body_gap", &FrameReport::body_gap, true},
    {"self_contacts", &FrameReport::self_contacts},
    {"crossings", &FrameReport::crossings},
    {"self_gap", &FrameReport::self_gap, true},
}};

double frame_number(const FrameReport& report, const FrameColumn& column);

/// Reports as comma-separated values: "frame", "seconds" (from the start, at `fps`), then the
/// columns, a line a frame; what was not counted in a frame (-1) is empty there.
std::string frames_csv(const std::vector<FrameReport>& reports, double fps);

/// A frame of a simulation, as files keep it: schema "atelier.simulated_frame", version 1. A
/// simulation goes on from it with the same bits, and its report stays as it was.
struct SimulatedFrame {
  ClothState state;
  FrameReport report;
};

/// As an archive, and back. Throws DataError for what cloth_state_at refuses, such as another
/// cloth, and for a report with numbers missing, or counts below -1.
Archive archive_of(const SimulatedFrame& frame);
SimulatedFrame simulated_frame_of(const Archive& archive, Index vertices,
                                  const std::string& file = "");

/// `frame`: what the file is named by. Throws DataError for the state of another frame.
SimulatedFrame read_simulated_frame(const std::filesystem::path& file, int frame, Index vertices);

}  // namespace atelier
