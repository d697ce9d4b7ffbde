#include "pipeline/pattern/flatten_stage.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/mesh_file.h"
#include "pipeline/pattern/flatten_files.h"
#include "pipeline/pattern/flatten_garment.h"
#include "pipeline/pattern/flatten_relax.h"
#include "registration/flattening/flatten_surface.h"
#include "registration/flattening/seam_input.h"
#include "simulation/material/fabric.h"
#include "simulation/material/hanging_acceleration.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// The meshes of a folder, by name.
std::vector<fs::path> meshes_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".obj" || entry.path().extension() == ".ply") {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// The mesh itself, or every mesh of a folder or of a result of `template`, with what that says of
/// it there; none of any other folder. What lies beside the INPUT is no part of it, nor of the
/// result's key.
std::vector<FlattenGarment> garments_in(const fs::path& input) {
  if (!fs::is_directory(input)) {
    return {{input, {}}};
  }
  std::vector<fs::path> files = meshes_in(input);
  if (files.empty() && fs::exists(input / kTemplateFile) &&
      fs::is_directory(input / kTemplateGarments)) {
    files = meshes_in(input / kTemplateGarments);
  }
  std::vector<FlattenGarment> garments;
  garments.reserve(files.size());
  for (const fs::path& file : files) {
    garments.push_back({file, template_note(input / kTemplateFile, file.stem().string()),
                        worn_folder(input, file)});
  }
  return garments;
}

/// The warning "template-unread" of a garment beside whose INPUT lies where its wearer looks.
std::optional<Finding> unread_finding(const FlattenGarment& garment) {
  const fs::path file = template_file(garment.file);
  try {
    if (!garment.note.facing.isZero() ||
        template_note(file, garment.file.stem().string()).facing.isZero()) {
      return std::nullopt;
    }
  } catch (const DataError&) {  // nothing that this run reads
    return std::nullopt;
  }
  return Finding{Severity::Warning, "template-unread", garment.file.string(),
                 "front and back of the wearer are known from " + file.string() +
                     ", which is not part of this INPUT",
                 "seams are placed by the shape alone; give the folder " +
                     file.parent_path().string() + " as INPUT to use it"};
}

/// The stage's metrics: sums, else the worst garment's.
class FlattenFigures {
 public:
  void add(const FlattenedGarment& flat) {
    const FlatMeasures& m = flat.measures;
    sum("panels", flat.pattern.cut.panel_count);
    sum("seam_length", m.seam_length);
    sum("inverted", m.inverted);
    sum("overlaps", m.overlaps);
    most("stretch_p50", m.strain_p50);
    most("stretch_p95", m.strain_p95);
    most("stretch_p99", m.strain_p99);
    most("thread_p99", m.thread_p99);
    most("seam_mismatch", mismatch_of(flat));
    most("deviation_mean", flat.deviation_mean);
    most("deviation_max", flat.deviation_max);
    const double area = figures_.emplace("area_ratio", m.area_ratio).first->second;
    if (std::abs(m.area_ratio - 1) > std::abs(area - 1)) {
      figures_["area_ratio"] = m.area_ratio;
    }
    most("panels_a_part", flat.drawing.panels_a_part);
    most("raggedness", flat.drawing.raggedness);
    most("corners_mean", flat.outlines.corners_mean);
    most("corners_max", flat.outlines.corners_max);
    most("jaggedness", flat.outlines.jaggedness);
    most("turns_per_metre", flat.outlines.turns_per_metre);
    most("asymmetry", flat.outlines.asymmetry);
    const double neck = flat.outlines.narrowest_neck;
    figures_["narrowest_neck"] =
        std::min(neck, figures_.emplace("narrowest_neck", neck).first->second);
    add_sewn(flat);
  }

  void record(StageRun& run) const {
    for (const auto& [name, value] : figures_) {
      run.metric(name, value);
    }
  }

 private:
  void sum(const std::string& name, double value) { figures_[name] += value; }
  void most(const std::string& name, double value) {
    double& figure = figures_.emplace(name, value).first->second;
    figure = std::max(figure, value);
  }

  /// Of garments that hung still, where there is one: motion holds a garment where no pattern does.
  void add_sewn(const FlattenedGarment& flat) {
    if (!flat.sewable) {
      sum("not_sewn", 1);
    }
    if (!flat.sewn) {
      return;
    }
    sum("not_sewn", 0);
    const bool still = flat.sewn->acceleration <= kInMotion;
    if (!still && still_sewn_) {
      return;
    }
    if (still && !still_sewn_) {
      still_sewn_ = true;
      for (const char* name : {"sewn_mean", "sewn_p95", "sewn_motion"}) {
        figures_.erase(name);
      }
    }
    most("sewn_mean", flat.sewn->mean);
    most("sewn_p95", flat.sewn->p95);
    if (flat.sewn->acceleration >= 0) {
      most("sewn_motion", flat.sewn->acceleration);
    }
  }

  std::map<std::string, double> figures_;
  bool still_sewn_ = false;
};

}  // namespace

OptionTable describe(FlattenRelaxOptions& options) {
  OptionTable table;
  table.add("body", options.body, std::vector<std::string>{},
            "Mesh of the body that a captured garment hangs on, in the unit of the garment, or the "
            "bodies of its capture (WORKSPACE/body/current), of which the one of the garment's "
            "frame is used: the stretch due to its weight is removed before flattening");
  std::vector<std::string> fabrics = fabric_names();
  fabrics.insert(fabrics.begin(), "");
  table.add("fabric", options.fabric, fabrics, "Fabric of the garment, for its weight");
  table.add("registered", options.registered, std::vector<std::string>{},
            "Folder of the garment's registered sequence (registered/LABEL of register) or of "
            "those of all garments (registered): a garment captured in motion is not relaxed");
  table.add("gap", options.gap, 0, 0.02, "m",
            "Gap kept from the body; 0: the one that the garment keeps where it rests on the body");
  table.add("substeps", options.substeps, 1, 1000, "",
            "Substeps of a simulated frame; more for stiff cloth with small triangles");
  table.add("relaxing", describe(options.relaxing));
  return table;
}

OptionTable describe(FlattenStageOptions& options) {
  OptionTable table;
  table.add("seams", options.seams, std::vector<std::string>{},
            "Seams: auto (found), uvs (where texture coordinates part), labels (where vertex "
            "labels part), none (opened only), or a file (.json)");
  table.add("layout", options.layout, std::vector<std::string>{"isotropic", "woven"},
            "Cloth of the pattern: isotropic (stretch bounded in every direction), or woven "
            "(stretch bounded along warp and weft, free to shear; cut along a field of directions, "
            "sleeves set in)");
  table.add("smooth", options.smooth, 0, 0.1, "m",
            "Smoothing length: noise and creases finer than six times this are smoothed away "
            "first; 0: no smoothing");
  table.add("tolerance", options.tolerance, 0, 0.02, "m",
            "Developability tolerance where seams are found: distance by which most of the surface "
            "may move to lie flat without stretch, about the error of the surface; 0: none");
  table.add("find", describe(options.find));
  table.add("flatten", describe(options.flatten));
  table.add("pattern", describe(options.pattern));
  table.add("relax", describe(options.relax));
  table.add("sew_check", describe(options.sew_check));
  table.add("input", describe(options.input));
  return table;
}

void require_named(const FlattenStageOptions& options, [[maybe_unused]] const fs::path& input) {
  require_seams_named(options.seams);
  if (const std::string& body = options.relax.body;
      !body.empty() && file_kind(body) == fs::file_type::not_found) {
    read_mesh(body);  // says what it would have read
  }
  require_relaxable(options, garments_in(input));
  require_sewable(options, garments_in(input));
}

void check_flatten_input(const fs::path& input, const OptionTable& /*options*/) {
  if (garments_in(input).empty()) {
    throw DataError(input.string(), "", "no .obj or .ply",
                    "a mesh for each garment, as 'atelier run' leaves them in WORKSPACE/surfaces");
  }
}

void run_flatten(StageRun& run) {
  const auto& options = run.options<FlattenStageOptions>();
  FlattenFigures figures;
  const std::vector<FlattenGarment> garments = garments_in(run.input("surface"));
  require_relaxable(options, garments);
  require_sewable(options, garments);
  if (options.seams == "auto") {
    for (const FlattenGarment& garment : garments) {
      if (const auto doubt = unread_finding(garment)) {
        tell(run, {*doubt});
        break;  // of one INPUT
      }
    }
  }
  run.progress(0, std::ssize(garments), "garments");
  for (const FlattenGarment& garment : garments) {
    if (run.stop_requested()) {
      return;
    }
    const std::string title = garment.file.stem().string();
    const std::string folder = fs::is_directory(run.input("surface")) ? title + "/" : "";
    const std::string whose = folder.empty() ? "" : title + ": ";
    FlattenWatcher watcher;
    watcher.say = [&](const std::string& line) { run.say(whose + line); };
    watcher.warn = [&](const Finding& finding) { tell(run, {finding}, whose); };
    watcher.relaxed = [&](int round, int rounds, double error) {
      run.progress(round, rounds, "rounds of relaxing", {{"off_mm", 1000 * error}});
    };
    watcher.stopped = [&] { return run.stop_requested(); };
    if (!options.relax.body.empty()) {
      run.progress(0, options.relax.relaxing.rounds, "rounds of relaxing");
    }
    const FlattenedGarment flat = flatten_garment(garment, options, watcher);
    if (run.stop_requested()) {
      return;
    }
    for (const FlattenFile& file : flatten_files(flat, title, options, true)) {
      run.output_text(folder + file.name, file.bytes);
    }
    figures.add(flat);
    run.say(whose + summary_of(flat));
    run.progress(&garment - garments.data() + 1, std::ssize(garments), "garments");
  }
  figures.record(run);
}

}  // namespace atelier
