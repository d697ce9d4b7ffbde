#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "core/io/polygon_mesh.h"
#include "core/store/stage.h"
#include "registration/template/garment_template.h"

namespace atelier {

struct TemplateStageOptions {
  GarmentTemplateOptions fit;
  std::string labels = "auto";  ///< garments wanted: auto, or label names with commas
  std::string import = "";      ///< an artist's meshes: FILE, or label=FILE with commas
  MeshConvention imported{.metres_per_unit = 1, .up = 'y'};  ///< of files that do not say
  bool ground_truth_scans =
      false;  ///< surfaces of a synthetic capture's ground truth instead of the scans
};
OptionTable describe(TemplateStageOptions& options);

inline constexpr std::array kTemplateMetrics = {
    StageMetric{"garments", ""},
    StageMetric{"vertices", ""},
    StageMetric{"boundaries", ""},
    StageMetric{"holes_closed", ""},
    StageMetric{"area", "m2"},
    StageMetric{"unseen_share", "of the area"},
    StageMetric{"edge_length", "m"},
    StageMetric{"edge_deviation", "of the edge length"},
    StageMetric{"dynamic_share", ""},
    StageMetric{"self_intersections", ""},
    StageMetric{"atlas_stretch", ""},
    StageMetric{"ground_truth_scans", ""},
    StageMetric{"carried_share", "of the area"},
    StageMetric{"beyond_share", ""},
    StageMetric{.name = "not_whole", .unit = "garments", .input_errors = true},
};

/// Refuses lists of garments that name none, no clothing or one twice, and meshes that are not
/// there, as the stage would later. Throws DataError.
void require_named(const TemplateStageOptions& options);

/// Scans, person and bodies -> for each label of clothing garments/<label>.h5 (schema
/// "atelier.garment") and garments/<label>.obj; template.json: of each the frame in whose pose it
/// is, where the body looks in it, and the vertices that hang free; template.png.
void run_template(StageRun& run);

/// Refuses a frame that the capture does not have, naming those that it has: at once, not behind
/// the bodies of all frames. Throws DataError.
void require_template_frame(const TemplateStageOptions& options,
                            const std::filesystem::path& capture);

}  // namespace atelier
