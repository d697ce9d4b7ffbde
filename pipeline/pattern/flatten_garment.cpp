#include "pipeline/pattern/flatten_garment.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/io/mesh_file.h"
#include "core/normals.h"
#include "core/usage_error.h"
#include "pipeline/pattern/flatten_relax.h"
#include "registration/drafting/draft_pattern.h"
#include "registration/drafting/garment_pattern_text.h"
#include "registration/drafting/name_pattern.h"
#include "registration/edge_paths.h"
#include "registration/flattening/cut_to_disks.h"
#include "registration/flattening/find_pattern.h"
#include "registration/flattening/flatten_diagnostics.h"
#include "registration/flattening/front_and_back.h"
#include "registration/flattening/part_overlaps.h"
#include "registration/flattening/smooth_surface.h"
#include "registration/remove_slivers.h"
#include "simulation/material/hanging_acceleration.h"

namespace atelier {
namespace {

/// Smooths away detail of the surface that is finer than panels can be.
void smooth_mesh(Mesh& mesh, double reach, const FlattenWatcher& watcher) {
  const double area = face_areas(mesh.vertices, mesh.faces).sum();
  const Points smooth = smoothed_surface(mesh, reach);
  char text[120];
  std::snprintf(text, sizeof text, "smoothed: moved by %.2f mm in the mean, area %+.2f%%",
                1000 * (smooth - mesh.vertices).rowwise().norm().mean(),
                100 * (face_areas(smooth, mesh.faces).sum() / area - 1));
  watcher.say(text);
  mesh.vertices = smooth;
}

/// Slivers, which no simulation takes, are taken out; where seams are given, triangles stay and
/// only what is near to being refused is changed.
void mesh_without_slivers(Mesh& mesh, bool seams_given, const FlattenWatcher& watcher) {
  constexpr double kNearlyRefused = 2;  // deg
  RemoveSliversOptions how;
  if (seams_given) {
    how.least = kNearlyRefused;
    how.flips = false;
  }
  const double before = min_corners(mesh.vertices, mesh.faces).minCoeff();
  mesh = remove_slivers(mesh, how);
  const double after = min_corners(mesh.vertices, mesh.faces).minCoeff();
  if (after > before) {
    char text[120];
    std::snprintf(text, sizeof text, "slivers removed: smallest corner %.1f deg, was %.1f", after,
                  before);
    watcher.say(text);
  }
}

/// The pattern of a cut; panels that lie over themselves are parted.
void lay_out(FlattenedGarment& flat, const std::vector<char>& cut,
             const FlattenStageOptions& options, const FlattenWatcher& watcher) {
  flat.pattern = flatten_apart(flat.mesh, cut, options.flatten, [&](std::size_t panels) {
    watcher.say(std::to_string(panels) + (panels == 1
                                              ? " panel that overlaps itself is divided"
                                              : " panels that overlap themselves are divided"));
  });
  flat.measures = measure_flat(flat.mesh, flat.pattern);
}

/// Seams and their pattern. Where none keeps the bound, what was found is laid out as it is.
void lay_out_found(FlattenedGarment& flat, const FlattenStageOptions& options,
                   const FlattenWatcher& watcher) {
  FindPatternOptions how;
  how.find = options.find;
  how.find.facing = nearly_ahead(flat.facing);
  how.flatten = options.flatten;
  how.tolerance = options.tolerance;
  FoundPattern found = find_pattern(flat.mesh, how, watcher.say);
  char text[120];
  std::snprintf(text, sizeof text, "the surface deviates by %.2f mm in the mean, %.1f mm at most",
                1000 * found.deviation_mean, 1000 * found.deviation_max);
  watcher.say(text);
  flat.deviation_mean = found.deviation_mean;
  flat.deviation_max = found.deviation_max;
  flat.mesh = std::move(found.mesh);
  flat.reached = found.reached;
  if (found.reached) {
    flat.pattern = std::move(found.pattern);
    flat.measures = std::move(found.measures);
  } else {
    FlattenStageOptions as_found = options;  // panels stiffen where the search's do
    as_found.flatten.panel.even = stiffening_of(stretch_bound(options.find));
    lay_out(flat, found.seams.cut, as_found, watcher);
    flat.reached = found.seams.reached &&
                   bounded_strain(flat.measures, options.find) <= stretch_bound(options.find);
  }
}

/// Names, draws, measures and lays out the flat panels.
void draw_pattern(FlattenedGarment& flat, const PatternPieceOptions& options) {
  const Eigen::Vector3d facing = nearly_ahead(flat.facing);
  const PatternNames names =
      name_pattern(flat.pattern, flat.mesh, facing.isZero() ? facing_of(flat.mesh) : facing);
  flat.panel_names = names.panels;
  const FlatPattern even = symmetric_pattern(flat.pattern, options.symmetry);
  flat.draft = draft_pattern(even, names, {options.smoothing, options.curve_tolerance});
  place_on_surface(flat.draft, flat.mesh, flat.pattern);
  flat.draft = in_craft_order(flat.draft);
  std::vector<Points2> outlines;
  for (const Panel& panel : flat.draft.panels) {
    outlines.push_back(panel_outline(panel));
  }
  flat.outlines = measure_outlines(outlines);
  flat.drawing = measure_drawing(flat.draft, flat.panel_names, even);
  flat.layout = lay_out_pieces(flat.draft, options);
}

/// The smallest corner of the flat panels, deg: a simulation refuses those below half a degree.
double flat_corner(const FlattenedGarment& flat) {
  return min_corners(flat.pattern.vertices, flat.pattern.cut.faces).minCoeff();
}

/// The garment as it was captured, on its body; none where nobody knows it.
std::optional<WornGarment> worn_garment(const FlattenGarment& garment,
                                        const FlattenStageOptions& options) {
  const std::string& body = options.sew_check.body;
  if (body == kNoSewCheck || (body.empty() && garment.captured.empty())) {
    return std::nullopt;
  }
  if (body.empty()) {
    return read_worn(garment.captured);
  }
  return WornGarment{read_mesh(garment.file, options.input),
                     body_of(body, options.input, garment.note.frame)};
}

/// Sews the pattern as it is written anew, and warns `not-sewn` where it cannot be.
void check_by_sewing(FlattenedGarment& flat, const FlattenGarment& garment,
                     const FlattenStageOptions& options, const FlattenWatcher& watcher) {
  const std::optional<WornGarment> worn = worn_garment(garment, options);
  if (!worn) {
    return;
  }
  try {
    flat.sewn = sew_anew({garment_pattern_text(flat.draft), flat.panel_names, flat.pattern,
                          flat.mesh, read_mesh(garment.file, options.input)},
                         *worn, options.sew_check, watcher.stopped);
  } catch (const DataError& error) {
    flat.sewable = false;
    watcher.warn({Severity::Warning, "not-sewn", garment.file.string(),
                  std::string("the written pattern could not be sewn anew: ") + error.what(),
                  "its panels are written all the same"});
    return;
  }
  if (flat.sewn && flat.sewn->acceleration > kInMotion) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "the captured garment was in motion (its freely hanging parts accelerate by %.1f "
                  "m/s2), and the one sewn anew hangs at rest: their distance says little",
                  flat.sewn->acceleration);
    watcher.say(text);
  }
}

}  // namespace

void require_sewable(const FlattenStageOptions& options,
                     const std::vector<FlattenGarment>& garments) {
  const std::string& body = options.sew_check.body;
  const bool known = !body.empty() || std::any_of(garments.begin(), garments.end(),
                                                  [](const FlattenGarment& garment) {
                                                    return !garment.captured.empty();
                                                  });
  if (!known) {
    SewCheckOptions said = options.sew_check;
    SewCheckOptions usual;
    const OptionTable texts = describe(said);
    const OptionTable defaults = describe(usual);
    for (std::size_t i = 0; i < texts.fields.size(); ++i) {
      if (option_text(texts.fields[i]) != option_text(defaults.fields[i])) {
        throw UsageError("--sew-check." + texts.fields[i].name +
                         " does nothing without a body; give --sew-check.body, or leave it out");
      }
    }
  }
  if (body.empty() || body == kNoSewCheck) {
    return;
  }
  const bool one_mesh = !std::filesystem::is_directory(body);
  if (one_mesh) {
    read_mesh(body, options.input);  // says what it would have read
  }
  for (const FlattenGarment& garment : garments) {
    if (is_rest(garment)) {
      throw DataError(garment.file.string(), "", "a rest surface, which no body wore",
                      "the template as it was captured, WORKSPACE/template/current, or "
                      "WORKSPACE/surfaces without --sew-check.body");
    }
    if (!one_mesh) {
      if (!garment.note.frame) {
        throw DataError(body, "",
                        "bodies in motion, but the frame of " + garment.file.filename().string() +
                            " is not known",
                        "WORKSPACE/template/current, which states the frame, or a mesh of the "
                        "body in that frame");
      }
      body_of(body, options.input, garment.note.frame);
    }
  }
}

double mismatch_of(const FlattenedGarment& flat) {
  return std::max(flat.measures.seam_mismatch, flat.layout.seam_mismatch);
}

FlattenedGarment flatten_garment(const FlattenGarment& garment, const FlattenStageOptions& said,
                                 const FlattenWatcher& watcher) {
  FlattenStageOptions options = said;
  options.find.woven = options.layout == "woven";
  options.flatten.panel.woven = options.find.woven;
  FlattenedGarment flat;
  auto [surface, given] = read_flatten_surface(garment.file, options.seams, options.input, watcher);
  flat.mesh = std::move(surface);
  flat.facing = garment.note.facing;
  if (!options.relax.body.empty()) {
    flat.relaxed = relax_mesh(flat.mesh, garment, options, watcher);
    if (watcher.stopped()) {
      return flat;
    }
  }
  if (options.smooth > 0) {
    smooth_mesh(flat.mesh, options.smooth, watcher);
  }
  mesh_without_slivers(flat.mesh, options.seams != "auto", watcher);
  const Topology topology = topology_of(flat.mesh.faces, flat.mesh.vertices.rows());
  try {
    if (options.seams == "auto") {
      lay_out_found(flat, options, watcher);
    } else {
      const std::vector<char> open =
          cut_to_disks(topology, given, edge_lengths(topology, flat.mesh.vertices));
      if (open != given) {
        watcher.say("panels with holes were cut open");
      }
      lay_out(flat, open, options, watcher);
    }
  } catch (const DataError& error) {
    throw DataError(garment.file.string(), error.where, error.found, error.expected);
  }
  draw_pattern(flat, options.pattern);
  if (const auto doubt =
          fabric_finding(flat.layout, options.pattern.fabric_width, garment.file.string())) {
    watcher.warn(*doubt);
  }
  if (options.flatten.equal_seams) {
    const auto doubt = seam_finding(mismatch_of(flat), garment.file.string());
    flat.equal = !doubt;
    if (doubt) {
      watcher.warn(*doubt);
    }
  }
  check_by_sewing(flat, garment, options, watcher);
  return flat;
}

std::string summary_of(const FlattenedGarment& flat) {
  const FlatMeasures& m = flat.measures;
  const OutlineMeasures& o = flat.outlines;
  char text[900];
  int length = std::snprintf(
      text, sizeof text,
      "%d panels, %zu seams of %.2f m; stretch p50 %.2f%%, p95 %.2f%%, p99 %.2f%%, most %.1f%%, "
      "along threads p99 %.2f%%; "
      "area %.2f%% of the surface's; seams differ by %.2f%% at most; %d inverted triangles, %d "
      "panels that overlap themselves; smallest corner %.1f deg; fabric %.2f x %.2f m; outlines: "
      "%.2f panels a part, %.1f corners a panel, %d at most, jagged by %.2f mm, ragged by %.2f mm, "
      "%.1f turns a metre, asymmetric by %.1f mm, narrowest neck %.1f cm",
      flat.pattern.cut.panel_count, flat.pattern.seams.size(), m.seam_length, 100 * m.strain_p50,
      100 * m.strain_p95, 100 * m.strain_p99, 100 * m.strain_max, 100 * m.thread_p99,
      100 * m.area_ratio, 100 * mismatch_of(flat), m.inverted, m.overlaps, flat_corner(flat),
      flat.layout.width, flat.layout.length, flat.drawing.panels_a_part, o.corners_mean,
      o.corners_max, 1000 * o.jaggedness, 1000 * flat.drawing.raggedness, o.turns_per_metre,
      1000 * o.asymmetry, 100 * o.narrowest_neck);
  if (flat.sewn) {
    std::snprintf(text + length, sizeof text - static_cast<std::size_t>(length),
                  "; sewn anew: %.1f mm from the captured garment, p95 %.1f mm",
                  1000 * flat.sewn->mean, 1000 * flat.sewn->p95);
  }
  return text;
}

nlohmann::ordered_json json_of(const FlattenedGarment& flat) {
  const FlatMeasures& m = flat.measures;
  nlohmann::ordered_json json{{"panels", flat.pattern.cut.panel_count},
                              {"seams", flat.pattern.seams.size()},
                              {"stretch_p50", m.strain_p50},
                              {"stretch_p95", m.strain_p95},
                              {"stretch_p99", m.strain_p99},
                              {"stretch_max", m.strain_max},
                              {"thread_p99", m.thread_p99},
                              {"area_ratio", m.area_ratio},
                              {"seam_mismatch", mismatch_of(flat)},
                              {"seam_length", m.seam_length},
                              {"inverted", m.inverted},
                              {"overlaps", m.overlaps},
                              {"deviation_mean", flat.deviation_mean},
                              {"deviation_max", flat.deviation_max},
                              {"smallest_corner", flat_corner(flat)},
                              {"panels_a_part", flat.drawing.panels_a_part},
                              {"corners_mean", flat.outlines.corners_mean},
                              {"corners_max", flat.outlines.corners_max},
                              {"jaggedness", flat.outlines.jaggedness},
                              {"raggedness", flat.drawing.raggedness},
                              {"turns_per_metre", flat.outlines.turns_per_metre},
                              {"asymmetry", flat.outlines.asymmetry},
                              {"narrowest_neck", flat.outlines.narrowest_neck},
                              {"fabric_width", flat.layout.width},
                              {"fabric_length", flat.layout.length}};
  if (flat.sewn) {
    json["sewn_mean"] = flat.sewn->mean;
    json["sewn_p95"] = flat.sewn->p95;
  }
  return json;
}

Mesh with_flat_uvs(const FlattenedGarment& flat) {
  const Garment garment = garment_of(flat.mesh, flat.pattern);
  Mesh mesh = flat.mesh;
  mesh.uvs = garment.rest;
  mesh.uv_faces = garment.rest_faces;
  mesh.normals.resize(0, 3);
  return mesh;
}

}  // namespace atelier
