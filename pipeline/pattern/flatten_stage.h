#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "core/io/polygon_mesh.h"
#include "core/store/stage.h"
#include "pipeline/pattern/sew_check.h"
#include "registration/flattening/find_seams.h"
#include "registration/flattening/flat_pattern.h"
#include "registration/flattening/pattern_pieces.h"
#include "simulation/relax_gravity.h"

namespace atelier {

/// The weight that has stretched a captured garment, to be taken out before it is flattened.
struct FlattenRelaxOptions {
  /// Mesh of the body that the garment hangs on, or folder of a sequence of bodies, of which the
  /// one of its frame is taken; empty: not relaxed.
  std::string body;
  std::string fabric;  ///< of the garment; empty: the default material
  /// Folder of the garment's registered sequence (registered/LABEL of `register`), or of those of
  /// all garments (registered), which says whether it hung still; empty: nobody says.
  std::string registered;
  double gap = 0;     ///< m kept from the body, 0 to 0.02; 0: as where the garment rests on it
  int substeps = 30;  ///< per simulated frame, 1 to 1000
  RelaxGravityOptions relaxing;
};
OptionTable describe(FlattenRelaxOptions& options);

struct FlattenStageOptions {
  std::string seams = "auto";        ///< auto, uvs, labels, or a file
  std::string layout = "isotropic";  ///< isotropic, or woven (FindSeamsOptions::woven)
  double smooth = 0.01;  ///< m: reach over which noise and creases are smoothed before, 0 to 0.1
  double tolerance = 0.005;  ///< m: how far surfaces move where seams are found, 0 to 0.02
  FindSeamsOptions find;
  FlattenOptions flatten;
  PatternPieceOptions pattern;
  FlattenRelaxOptions relax;
  SewCheckOptions sew_check;
  MeshConvention input{.metres_per_unit = 1, .up = 'y'};  ///< of files that do not say
};
OptionTable describe(FlattenStageOptions& options);

inline constexpr std::array kFlattenMetrics = {
    StageMetric{"panels", ""},
    StageMetric{"stretch_p50", ""},
    StageMetric{"stretch_p95", ""},
    StageMetric{"stretch_p99", ""},
    StageMetric{"thread_p99", ""},
    StageMetric{"seam_mismatch", ""},
    StageMetric{"seam_length", "m"},
    StageMetric{"area_ratio", ""},
    StageMetric{"inverted", ""},
    StageMetric{"overlaps", ""},
    StageMetric{"deviation_mean", "m"},
    StageMetric{"deviation_max", "m"},
    // What an eye sees.
    StageMetric{"panels_a_part", ""},
    StageMetric{"corners_mean", ""},
    StageMetric{"corners_max", ""},
    StageMetric{"jaggedness", "m"},
    StageMetric{"raggedness", "m"},
    StageMetric{"turns_per_metre", ""},
    StageMetric{"asymmetry", "m"},
    StageMetric{"narrowest_neck", "m"},
    // Of the pattern sewn anew.
    StageMetric{"sewn_mean", "m"},
    StageMetric{"sewn_p95", "m"},
    StageMetric{"sewn_motion", "m/s2"},
    StageMetric{"not_sewn", ""},
};

/// Refuses files and words that options name and that are not there, or are not of the garments of
/// the INPUT, as the stage would later. Throws DataError.
void require_named(const FlattenStageOptions& options, const std::filesystem::path& input);

/// Throws DataError for a folder without a mesh.
void check_flatten_input(const std::filesystem::path& input, const OptionTable& options);

/// A garment's surface -> pattern.svg, pattern.pdf, pattern.dxf, pattern_astm.dxf,
/// pattern_aama.dxf, pattern.val, pattern.json (GarmentCode), garment.obj (the surface as it was
/// laid flat, its texture coordinates the pattern, metres) and stretch.png, and where the garment's
/// body is known sewn.obj and sewn.png, the pattern sewn anew (sew_check.h); of a folder of meshes,
/// as `template` leaves them, a folder of these for each. Metrics are sums of panels, seams and
/// what is turned over, else the worst garment's.
void run_flatten(StageRun& run);

}  // namespace atelier
