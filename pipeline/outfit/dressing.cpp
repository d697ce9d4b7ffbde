#include "pipeline/outfit/dressing.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>

#include "bodymodel/formats/makehuman.h"
#include "bodymodel/formats/mhclo.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/joined_names.h"
#include "core/limits.h"
#include "core/nearest_name.h"
#include "core/normals.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"
#include "core/tree.h"
#include "core/unknown_value.h"
#include "pipeline/outfit/fitting.h"
#include "pipeline/outfit/tailor.h"
#include "registration/orient_faces.h"
#include "registration/sewing/garment_pattern_json.h"
#include "registration/sewing/pattern_garment.h"
#include "simulation/cloth/weld_seams.h"
#include "simulation/contact/contact_distance.h"

namespace atelier {
namespace {

constexpr std::string_view kMakeHumanGarment = "mhclo:";
constexpr int kSewingFrames = 60;
constexpr int kFramesPerStitch = 2;     // the threads are shortened evenly, this often
constexpr double kLittleGravity = 0.3;  // m/s2, of what slides down while it is still open
constexpr double kSewingDamping = 15;   // 1/s, so that sewing springs do not throw the cloth about
constexpr double kHangingDamping = 2;   // 1/s, to come to rest sooner
constexpr int kHangingFrames = 60;
constexpr double kOpenSeam = 0.10;         // m; what is more does not close by welding
constexpr double kCoarseEdge = 0.03;       // m; an upper arm has 0.3 round it
constexpr int kLoweringFrames = 60;        // of the arms, from straight out to the rest pose
constexpr double kWaistband = 0.90;        // of the body's girth
constexpr double kWaistbandStiffness = 3;  // times the cloth's
constexpr double kMakeHumanRoom = 0.006;   // m that a MakeHuman garment is lifted before it hangs
constexpr double kLayerRoom = 0.010;       // m between one garment's sewing and what is worn below

SewingPattern pattern_of(const std::string& name, const TailorMeasures& measures) {
  if (name == "tee") {
    return tee_pattern(measures);
  }
  if (name == "skirt") {
    return skirt_pattern(measures);
  }
  if (name == "dress") {
    return dress_pattern(measures);
  }
  if (name == "trousers") {
    return trousers_pattern(measures);
  }
  return garment_pattern_from_json(read_file_text(name, Limits{}.text_file_bytes), name);
}

std::string plain_name(std::string name) {
  for (char& c : name) {
    c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  }
  return name.empty() ? "garment" : name.substr(0, 60);
}

Mesh inflated(const Mesh& body, double by) {
  Mesh result = body;
  result.vertices += by * vertex_normals(body.vertices, body.faces);
  return result;
}

/// The label of a garment from a file, by where it hangs.
Label label_of_pattern(const Mesh& garment, const TailorMeasures& measures) {
  const double low = garment.vertices.col(1).minCoeff();
  const double high = garment.vertices.col(1).maxCoeff();
  if (low > measures.hip.y() - 0.25) {
    return Label::Upper;
  }
  return high > measures.waist.y() + 0.12 ? Label::Dress : Label::Lower;
}

/// The opening that is highest: the waist of a skirt or trousers. Empty if there is none.
std::vector<int> highest_opening(const Garment& garment) {
  std::vector<int> waist;
  double highest = -1e9;
  for (const std::vector<int>& loop : garment.boundaries) {
    double y = 0;
    for (const int v : loop) {
      y += garment.mesh.vertices(v, 1) / static_cast<double>(loop.size());
    }
    if (loop.size() > 2 && y > highest) {
      highest = y;
      waist = loop;
    }
  }
  return waist;
}

/// A belt: the waist moves with the body where it is, so that skirts and trousers stay up whatever
/// the hips and the motion are.
void put_on_belt(Garment& garment, const Mesh& body, double thickness) {
  const TriangleTree tree = build_tree(body.vertices, body.faces);
  for (const int v : highest_opening(garment)) {
    const ClosestPoint nearest = closest_point(tree, garment.mesh.vertices.row(v).transpose());
    garment.attachments.push_back({v, nearest.face, nearest.barycentric,
                                   std::max(thickness, std::sqrt(nearest.squared_distance))});
  }
}

/// Draws the waist in to a little less than the body's girth there, while it is sewn.
void draw_in_waist(Cloth& cloth, const Garment& garment, double girth) {
  const std::vector<int> waist = highest_opening(garment);
  std::set<std::pair<int, int>> edges;
  for (std::size_t i = 0; i < waist.size(); ++i) {
    edges.insert(std::minmax(waist[i], waist[(i + 1) % waist.size()]));
  }
  const auto fibres = static_cast<std::ptrdiff_t>(cloth.fibre_count);
  double length = 0;
  const auto in_band = [&](const ClothSpring& spring) {
    return edges.contains(std::minmax(spring.a, spring.b));
  };
  for (auto spring = cloth.springs.begin(); spring != cloth.springs.begin() + fibres; ++spring) {
    length += in_band(*spring) ? spring->rest : 0;
  }
  if (length <= 0) {
    return;
  }
  const double factor = std::clamp(kWaistband * girth / length, 0.6, 1.0);
  for (auto spring = cloth.springs.begin(); spring != cloth.springs.begin() + fibres; ++spring) {
    if (in_band(*spring)) {
      spring->rest *= factor;
      spring->stiffness *= kWaistbandStiffness;
    }
  }
}

double mean_edge(const Mesh& mesh) {
  double sum = 0;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      sum += (mesh.vertices.row(mesh.faces(f, corner)) -
              mesh.vertices.row(mesh.faces(f, (corner + 1) % 3)))
                 .norm();
    }
  }
  return sum / static_cast<double>(std::max<Index>(1, 3 * mesh.faces.rows()));
}

std::string millimetres(double metres) {
  return std::to_string(saturating_cast<int>(std::round(1000 * metres))) + " mm";
}

/// Threads that the body, tight or coarse cloth keeps from closing: welding them would tear the
/// cloth through the body. @param edge  m, mean of the cloth's triangles before it is sewn
void check_closed(const Garment& sewn, double edge) {
  for (const Seam& seam : sewn.seams) {
    double gap = 0;
    for (std::size_t i = 0; i < seam.a.size(); ++i) {
      gap = std::max(
          gap, (sewn.mesh.vertices.row(seam.a[i]) - sewn.mesh.vertices.row(seam.b[i])).norm());
    }
    if (gap > kOpenSeam) {
      // Long edges stand off an arm or a neck, whatever the size: the size is blamed only where the
      // cloth is fine.
      throw DataError(
          sewn.name, seam.name,
          "stays " + millimetres(gap) + " open when it is sewn on the body, with edges of " +
              millimetres(edge),
          edge > kCoarseEdge
              ? "cloth that bends round it: a smaller --edge-length (0.02) first; what stays open "
                "then needs a larger size"
              : "a pattern that fits this body: a larger size, or panels that lie nearer");
    }
  }
}

void check_worn(const std::string& name, const Garment& garment, const TailorMeasures& measures,
                const FrameReport& report, Label label) {
  const double edge = mean_edge(garment.mesh);
  const auto refuse = [&](const std::string& found) {
    if (edge > kCoarseEdge) {  // which no size makes up for
      throw DataError(name, "", found + ", with edges of " + millimetres(edge),
                      "cloth that bends round the body: a smaller --edge-length (0.02) first; then "
                      "other measures, another pattern or body");
    }
    throw DataError(name, "", found,
                    "a garment that fits this body: other measures, another pattern or body");
  };
  const double low = garment.mesh.vertices.col(1).minCoeff();
  const double high = garment.mesh.vertices.col(1).maxCoeff();
  if (low < -0.1) {
    refuse("it falls off while it is draped (from " + short_number(high) + " m down to " +
           short_number(low) + " m)");
  }
  const double hold = label == Label::Lower ? measures.hip.y() - 0.12 : measures.waist.y();
  if (high < hold) {
    refuse("it slid off the body while draped");
  }
  if (report.strain_p95 > 0.4) {
    refuse("it is stretched by " + std::to_string(static_cast<int>(100 * report.strain_p95)) +
           "% where it is tight");
  }
  if (report.penetrating > static_cast<int>(garment.mesh.vertices.rows()) / 50) {
    refuse(std::to_string(report.penetrating) + " of its vertices end inside the body");
  }
}

}  // namespace

OptionTable describe(OutfitOptions& options) {
  OptionTable table;
  table
      .add(
          "garment", options.garment, std::vector<std::string>{},
          "Garments joined by +: dress, tee, skirt, trousers, pattern files (.json); or mhclo:FILE")
      .add("pattern_scale", options.pattern_scale, 0.2, 5, "",
           "Scale factor of pattern files, for a larger or smaller size")
      .add("edge_length", options.edge_length, 0.006, 0.1, "m",
           "Edge length of the cloth's triangles; shorter for finer folds, which takes longer")
      .add("density", options.density, 0.02, 2, "kg/m2", "Area density of the cloth")
      .add("stretch", options.stretch, 50, 1e5, "N/m", "Stretching stiffness of the cloth")
      .add("bending", options.bending, 0, 1e-2, "N m", "Bending stiffness of the cloth")
      .add("friction", options.friction, 0, 2, "", "Coulomb friction coefficient of the cloth")
      .add("thickness", options.thickness, 0, 0.05, "m",
           "Gap kept between cloth and body; 0: as the edge length requires")
      .add("rate", options.rate, 60, 1000, "1/s", "Simulated frames per second")
      .add("substeps", options.substeps, 1, 1000, "",
           "Substeps of a simulated frame; more for stiff cloth");
  return table;
}

int search_interval(int substeps) {
  return std::max(2, substeps / 3);
}

std::vector<std::pair<std::string, Label>> outfit_garments(const std::string& garment) {
  std::vector<std::pair<std::string, Label>> result;
  for (const std::string& name : joined_names(garment)) {
    Label label = Label::Unknown;  // of a file: known once it is on the body
    if (name == "tee") {
      label = Label::Upper;
    } else if (name == "skirt" || name == "trousers") {
      label = Label::Lower;
    } else if (name == "dress") {
      label = Label::Dress;
    } else if (!name.ends_with(".json") && !name.starts_with(kMakeHumanGarment)) {
      throw UnknownValue("", "garment", name,
                         "dress, tee, skirt, trousers, a pattern file (.json) or mhclo:FILE" +
                             did_you_mean(name, {"dress", "tee", "skirt", "trousers"}));
    }
    result.emplace_back(name, label);
  }
  // Trousers and skirts are worn under what hangs over them, in whatever order they are named.
  std::stable_sort(result.begin(), result.end(), [](const auto& a, const auto& b) {
    return (a.second == Label::Lower) > (b.second == Label::Lower);
  });
  return result;
}

Garment sewn_on(const Garment& panels, const Mesh& body, const SewingOptions& options) {
  Control control;
  control.body_start = control.body_end = body.vertices;
  control.gravity = {0, -options.gravity, 0};
  SolverOptions solver_options = options.solver;
  solver_options.velocity_damping = kSewingDamping;
  solver_options.self_contact = false;
  Cloth cloth = make_cloth(panels);
  if (options.waist_girth > 0) {
    draw_in_waist(cloth, panels, options.waist_girth);
  }
  ClothState state = rest_state(cloth);
  std::vector<double> gaps;
  const auto sewing_begin = static_cast<std::size_t>(cloth.sewing_begin);
  for (std::size_t i = sewing_begin; i < cloth.springs.size(); ++i) {
    const ClothSpring& thread = cloth.springs[i];
    gaps.push_back((state.positions.row(thread.a) - state.positions.row(thread.b)).norm());
  }
  Mesh seen = panels.mesh;
  const int steps = kSewingFrames / kFramesPerStitch;
  for (int step = 1; step <= steps; ++step) {
    for (std::size_t i = 0; i < gaps.size(); ++i) {
      cloth.springs[sewing_begin + i].rest = gaps[i] * (steps - step) / steps;
    }
    const std::unique_ptr<Solver> solver =
        create_solver({cloth, body.faces}, solver_options, options.device);
    solver->set_state(state);
    for (int i = 0; i < kFramesPerStitch; ++i) {
      solver->step(control);
      if (options.watch) {
        seen.vertices = solver->state().positions;
        options.watch(seen, body.vertices);
      }
    }
    state = solver->state();
  }
  Garment sewn = panels;
  sewn.mesh.vertices = state.positions;
  check_closed(sewn, mean_edge(panels.mesh));
  return weld_seams(sewn);
}

namespace {

/// A MakeHuman garment on a MakeHuman body: its mesh is the rest shape, there is no pattern.
/// `body` has left the body that the file describes by its own displacement; simulation brings the
/// cloth out of it.
GroundTruthGarment makehuman_garment(const std::string& file, const std::string& body_file,
                                     const BodyModel& body) {
  namespace fs = std::filesystem;
  const fs::path given = body_file;
  const fs::path base = fs::is_directory(given) ? given / "base.obj" : given;
  if (base.extension() != ".obj") {
    throw DataError(file, "", "a body that is not MakeHuman's ('" + body_file + "')",
                    "--body with the folder of MakeHuman's base.obj");
  }
  MakeHumanFiles files;
  files.base = base;
  files.rig = base.parent_path() / "default.mhskel";
  files.weights = base.parent_path() / "default_weights.mhw";
  const fs::path macros = base.parent_path() / ".." / "targets" / "macrodetails";
  if (fs::is_directory(macros)) {
    files.macros = macros;
  }
  const BodyModel worn = read_makehuman_garment(file, read_makehuman(files));
  GroundTruthGarment truth;
  truth.garment.name = plain_name(worn.name.empty() ? "garment" : worn.name);
  truth.garment.mesh = worn.mesh;
  // Some of MakeHuman's suits have parts that are inside out.
  Mesh& mesh = truth.garment.mesh;
  const Triangles given_faces = mesh.faces;
  mesh.faces = consistently_oriented(mesh.faces, mesh.vertices.rows());
  for (Index f = 0; f < mesh.uv_faces.rows(); ++f) {
    if (mesh.faces.row(f) != given_faces.row(f)) {
      std::swap(mesh.uv_faces(f, 1), mesh.uv_faces(f, 2));
    }
  }
  mesh.normals.resize(0, 3);
  truth.garment.mesh.vertices += kMakeHumanRoom * vertex_normals(worn.mesh.vertices, mesh.faces);
  truth.label = label_of_pattern(truth.garment.mesh, tailor_measures(body));
  return truth;
}

void set_material(Material& material, const OutfitOptions& options) {
  material.name = "cloth";
  material.density = options.density;
  material.stretch_warp = material.stretch_weft = options.stretch;
  material.shear = options.stretch / 10;
  material.bending = options.bending;
  material.friction = options.friction;
  material.thickness = 0.002;
}

/// Where a garment is put on, and with what.
struct Fitting {
  const BodyModel& body;
  const TailorMeasures& measures;
  const OutfitOptions& options;
  SolverOptions sewing;
  double room = 0;  ///< m off the body, for what is worn below
  Device device = Device::Cpu;
  const DressingWatch& watch;
};

/// A sewn garment while the arms come down from straight out to the rest pose.
Garment with_arms_lowered(Garment garment, const Pose& arms_out, const Fitting& fitting) {
  const ShapedBody shaped = shape_body(fitting.body);
  const auto posed = [&](int frame) {
    const double t = static_cast<double>(frame) / kLoweringFrames;
    Pose pose = arms_out;
    pose.rotations *= 1 - t * t * (3 - 2 * t);
    return Points(skin_vertices(fitting.body, shaped, pose));
  };
  SolverOptions options = fitting.sewing;
  options.velocity_damping = kHangingDamping;
  options.self_contact = true;
  const std::unique_ptr<Solver> solver =
      create_solver({make_cloth(garment), fitting.body.mesh.faces}, options, fitting.device);
  Control control;
  control.body_end = posed(0);
  for (int frame = 1; frame <= kLoweringFrames; ++frame) {
    control.body_start = control.body_end;
    control.body_end = posed(frame);
    solver->step(control);
    if (fitting.watch) {
      Mesh seen = garment.mesh;
      seen.vertices = solver->state().positions;
      fitting.watch(seen, control.body_end);
    }
  }
  garment.mesh.vertices = solver->state().positions;
  return garment;
}

/// How clothes are sewn; worn ones also touch each other.
SolverOptions solver_of(const OutfitOptions& options) {
  SolverOptions solver;
  solver.time_step = 1 / options.rate;
  solver.substeps = options.substeps;
  solver.self_interval = search_interval(options.substeps);
  solver.thickness =
      options.thickness > 0 ? options.thickness : contact_distance(options.edge_length);
  return solver;
}

/// Sews and drapes one garment of a pattern.
GroundTruthGarment sewn_garment(const std::pair<std::string, Label>& garment,
                                const Fitting& fitting) {
  const auto& [name, drafted_label] = garment;
  Garment panels = cut_panels(name, fitting.body, fitting.options);
  Label label = drafted_label;
  Mesh wearer = fitting.body.mesh;
  Pose arms_out;
  const bool from_file = label == Label::Unknown;
  const bool lower_arms = from_file && reaches_shoulders(panels);
  if (from_file) {
    label = lower_arms ? label : Label::Lower;
    if (lower_arms) {
      arms_out = arms_out_pose(fitting.body);
      wearer.vertices = skin_vertices(fitting.body, arms_out);
    }
    place_round_body(panels, fitting.body, wearer.vertices);
    const std::vector<GirthFit> fits = girth_fits(panels, fitting.body);
    const std::string tight = what_is_tight(fits);
    if (!tight.empty()) {
      double worst = 1;
      for (const GirthFit& fit : fits) {
        worst = std::max(worst, fit.body / fit.garment);
      }
      char scale[16];
      std::snprintf(scale, sizeof scale, "%.2f", std::ceil(100 * worst) / 100);
      throw DataError(
          name, "", "too tight: " + tight,
          "a slimmer body, or a larger size (pattern_scale " + std::string(scale) + ")");
    }
  }
  SewingOptions sewing{.solver = fitting.sewing, .device = fitting.device, .watch = fitting.watch};
  sewing.waist_girth = label == Label::Lower ? fitting.measures.waist_girth : 0;
  sewing.gravity = lower_arms || label == Label::Lower ? kLittleGravity : sewing.gravity;
  GroundTruthGarment truth;
  truth.seams = panels.seams;
  truth.garment = sewn_on(panels, inflated(wearer, fitting.room), sewing);
  if (lower_arms) {
    truth.garment = with_arms_lowered(std::move(truth.garment), arms_out, fitting);
  }
  truth.label =
      label == Label::Unknown ? label_of_pattern(truth.garment.mesh, fitting.measures) : label;
  return truth;
}

}  // namespace

Garment cut_panels(const std::string& name, const BodyModel& body, const OutfitOptions& options) {
  SewingPattern pattern = pattern_of(name, tailor_measures(body));
  if (name.ends_with(".json")) {
    move_off_ground(pattern);
    for (Panel& panel : pattern.panels) {
      panel.corners *= options.pattern_scale;
      panel.placement.origin *= options.pattern_scale;
      for (PanelEdge& edge : panel.edges) {
        for (Eigen::Vector2d& control : edge.controls) {
          control *= options.pattern_scale;
        }
      }
    }
  }
  Garment panels = garment_from_pattern(pattern, {.edge_length = options.edge_length});
  panels.name = plain_name(std::filesystem::path(pattern.name).stem().string());
  set_material(panels.material, options);
  return panels;
}

void require_garments(const BodyModel& body, const OutfitOptions& options,
                      const std::string& body_file) {
  for (const auto& [name, label] : outfit_garments(options.garment)) {
    if (name.starts_with(kMakeHumanGarment)) {
      makehuman_garment(name.substr(kMakeHumanGarment.size()), body_file, body);
    } else if (label == Label::Unknown) {
      cut_panels(name, body, options);
    }
  }
}

Outfit dress_body(const BodyModel& body, const OutfitOptions& options, const std::string& body_file,
                  Device device, const DressingWatch& watch) {
  const TailorMeasures measures = tailor_measures(body);
  Outfit outfit;
  outfit.solver = solver_of(options);
  SolverOptions& solver = outfit.solver;
  const auto names = outfit_garments(options.garment);
  std::vector<Cloth> cloths;
  for (std::size_t g = 0; g < names.size(); ++g) {
    SolverOptions sewing = solver;
    sewing.substeps = 10;
    sewing.time_step = 1.0 / 60;
    GroundTruthGarment truth =
        names[g].first.starts_with(kMakeHumanGarment)
            ? makehuman_garment(names[g].first.substr(kMakeHumanGarment.size()), body_file, body)
            : sewn_garment(names[g], {body, measures, options, sewing,
                                      kLayerRoom * static_cast<double>(g), device, watch});
    set_material(truth.garment.material, options);
    for (const GroundTruthGarment& other : outfit.garments) {
      if (other.garment.name == truth.garment.name) {
        truth.garment.name += "_" + std::to_string(g);
      }
    }
    outfit.first.push_back(
        g == 0 ? 0 : outfit.first.back() + outfit.garments.back().garment.mesh.vertices.rows());
    if (truth.label == Label::Lower && !truth.seams.empty()) {
      put_on_belt(truth.garment, body.mesh, solver.thickness);
    }
    outfit.garments.push_back(truth);
    cloths.push_back(make_cloth(truth.garment));
  }
  outfit.first.push_back(outfit.first.back() + outfit.garments.back().garment.mesh.vertices.rows());
  outfit.cloth = cloths.size() == 1 ? cloths.front() : join_cloths(cloths);

  solver.self_contact = true;
  SolverOptions hanging = solver;
  hanging.time_step = 1.0 / 60;
  hanging.substeps = 10;
  hanging.velocity_damping = kHangingDamping;
  const std::unique_ptr<Solver> hang =
      create_solver({outfit.cloth, body.mesh.faces}, hanging, device);
  Control control;
  control.body_start = control.body_end = body.mesh.vertices;
  FrameReport report;
  for (int i = 0; i < kHangingFrames; ++i) {
    report = hang->step(control);
    if (watch) {
      Mesh seen;
      seen.faces = outfit.cloth.faces;
      seen.vertices = hang->state().positions;
      watch(seen, body.mesh.vertices);
    }
  }
  outfit.state = hang->state();
  outfit.state.frame = 0;
  for (std::size_t g = 0; g < outfit.garments.size(); ++g) {
    Garment& garment = outfit.garments[g].garment;
    garment.mesh.vertices =
        outfit.state.positions.middleRows(outfit.first[g], garment.mesh.vertices.rows());
    check_worn(names[g].first, garment, measures, report, outfit.garments[g].label);
  }
  return outfit;
}

Outfit dressed_before(std::vector<GroundTruthGarment> garments, const OutfitOptions& options) {
  ATELIER_CHECK(!garments.empty(), "somebody wears something");
  Outfit outfit;
  outfit.solver = solver_of(options);
  outfit.solver.self_contact = true;
  std::vector<Cloth> cloths;
  Index vertices = 0;
  for (const GroundTruthGarment& garment : garments) {
    cloths.push_back(make_cloth(garment.garment));
    outfit.first.push_back(vertices);
    vertices += garment.garment.mesh.vertices.rows();
  }
  outfit.first.push_back(vertices);
  outfit.cloth = cloths.size() == 1 ? cloths.front() : join_cloths(cloths);
  outfit.state = rest_state(outfit.cloth);
  for (std::size_t g = 0; g < garments.size(); ++g) {
    const Points& draped = garments[g].garment.mesh.vertices;
    outfit.state.positions.middleRows(outfit.first[g], draped.rows()) = draped;
  }
  outfit.garments = std::move(garments);
  return outfit;
}

}  // namespace atelier
