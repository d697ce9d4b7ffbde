#include "pipeline/pattern/flatten_measures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>

#include "capture/label_taxonomy.h"
#include "core/error.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/mesh_file.h"
#include "core/normals.h"
#include "core/store/result.h"
#include "core/topology.h"
#include "registration/flattening/flat_overlaps.h"
#include "registration/flattening/flat_pattern.h"
#include "registration/flattening/flat_seams.h"
#include "registration/flattening/seam_input.h"
#include "simulation/material/hanging_acceleration.h"

namespace atelier {
namespace {

/// The flat pattern that a mesh has as texture coordinates in metres.
FlatPattern pattern_of(const Mesh& mesh, const std::filesystem::path& file) {
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  const std::vector<char> flags = seam_input("uvs", mesh, topology, file);
  FlatPattern pattern;
  pattern.cut = cut_surface(topology, flags);
  pattern.seams = flat_seams(topology, flags, pattern.cut);
  pattern.vertices.resize(static_cast<Index>(pattern.cut.source.size()), 2);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      pattern.vertices.row(pattern.cut.faces(f, k)) = mesh.uvs.row(mesh.uv_faces(f, k));
    }
  }
  const Topology open =
      topology_of(pattern.cut.faces, static_cast<Index>(pattern.cut.source.size()));
  for (const std::vector<int>& loop : boundary_loops(open)) {
    Points2 outline(static_cast<Index>(loop.size()), 2);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      outline.row(static_cast<Index>(i)) = pattern.vertices.row(loop[i]);
    }
    if (crosses_itself(outline)) {
      pattern.overlapping.push_back(static_cast<int>(pattern.overlapping.size()));
    }
  }
  return pattern;
}

double seam_length(const GroundTruthGarment& truth) {
  double length = 0;
  for (const Seam& seam : truth.seams) {
    for (std::size_t i = 1; i < seam.a.size(); ++i) {
      length += (truth.garment.rest.row(seam.a[i]) - truth.garment.rest.row(seam.a[i - 1])).norm();
    }
  }
  return length;
}

double flat_area(const Points2& vertices, const Triangles& faces) {
  double area = 0;
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector2d a = vertices.row(faces(f, 1)) - vertices.row(faces(f, 0));
    const Eigen::RowVector2d b = vertices.row(faces(f, 2)) - vertices.row(faces(f, 0));
    area += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return area;
}

/// Which true garment with seams each file is of, null where there is none: that of its folder's
/// label, else the one of nearest area; each true one once.
std::vector<const GroundTruthGarment*> true_garments(
    const GroundTruth& truth, const std::vector<std::filesystem::path>& files,
    const std::vector<double>& areas) {
  std::vector<const GroundTruthGarment*> of(files.size(), nullptr);
  const auto is_left = [&](const GroundTruthGarment& garment) {
    return !garment.seams.empty() && std::find(of.begin(), of.end(), &garment) == of.end();
  };
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::optional<Label> label = label_of(files[i].parent_path().filename().string());
    for (const GroundTruthGarment& garment : truth.garments) {
      if (of[i] == nullptr && label && garment.label == *label && is_left(garment)) {
        of[i] = &garment;
      }
    }
  }
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (of[i] != nullptr) {
      continue;
    }
    double difference = std::numeric_limits<double>::infinity();
    const GroundTruthGarment* nearest = nullptr;
    for (const GroundTruthGarment& garment : truth.garments) {
      const Mesh& other = garment.garment.mesh;
      const double apart = std::abs(face_areas(other.vertices, other.faces).sum() - areas[i]);
      if (apart < difference && is_left(garment)) {
        difference = apart;
        nearest = &garment;
      }
    }
    of[i] = nearest;
  }
  return of;
}

/// garment.obj of the result, or of each folder in it.
std::vector<std::filesystem::path> flat_garments(const std::filesystem::path& result) {
  std::vector<std::filesystem::path> files;
  if (!std::filesystem::exists(result)) {
    return files;
  }
  if (std::filesystem::exists(result / "garment.obj")) {
    return {result / "garment.obj"};
  }
  for (const auto& entry : std::filesystem::directory_iterator(result)) {
    if (std::filesystem::exists(entry.path() / "garment.obj")) {
      files.push_back(entry.path() / "garment.obj");
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// What an eye sees, as the stage recorded it; nothing of a result that has none of it.
void add_seen(std::vector<Measure>& measures, const std::map<std::string, double>& metrics) {
  struct Seen {
    const char* metric;
    const char* key;
    double scale;
    const char* unit;
    const char* note;
  };
  constexpr std::array<Seen, 8> kSeen = {{
      {"panels_a_part", "flatten.panels_a_part", 1, "", "panels of each part of a garment"},
      {"corners_mean", "flatten.corners_mean", 1, "", "corners of a panel"},
      {"corners_max", "flatten.corners_max", 1, "", "corners of the panel with most"},
      {"jaggedness", "flatten.jaggedness_mm", 1000, "mm", "drawn outlines off smoothed ones, rms"},
      {"raggedness", "flatten.raggedness_mm", 1000, "mm", "flat outlines off drawn ones, rms"},
      {"turns_per_metre", "flatten.turns_per_metre", 1, "1/m", "left to right and back"},
      {"asymmetry", "flatten.asymmetry_mm", 1000, "mm",
       "panels mirrored off those that they match, rms"},
      {"narrowest_neck", "flatten.narrowest_neck_mm", 1000, "mm", "shortest cut through a panel"},
  }};
  for (const Seen& seen : kSeen) {
    if (const auto metric = metrics.find(seen.metric); metric != metrics.end()) {
      measures.push_back(
          {seen.key, seen.scale * metric->second, seen.unit, 0, Measure::Side::None, seen.note});
    }
  }
}

/// How far the written pattern, sewn anew, is from the captured garment. Not judged where that was
/// in motion: it is not how the cloth hangs.
void add_sewn(std::vector<Measure>& measures, const std::map<std::string, double>& metrics) {
  const auto mean = metrics.find("sewn_mean");
  const auto p95 = metrics.find("sewn_p95");
  if (mean == metrics.end() || p95 == metrics.end()) {
    return;
  }
  const auto motion = metrics.find("sewn_motion");
  const bool moved = motion != metrics.end() && motion->second > kInMotion;
  const Measure::Side side = moved ? Measure::Side::None : Measure::Side::AtMost;
  char note[160] = "draped on the body of its frame";
  if (moved) {
    std::snprintf(note, sizeof note,
                  "the captured cloth was in motion (%.1f m/s2), and this one hangs at rest",
                  motion->second);
  }
  measures.push_back({"flatten.sewn_mean_mm", 1000 * mean->second, "mm", 5, side, note});
  measures.push_back({"flatten.sewn_p95_mm", 1000 * p95->second, "mm", 12, side, note});
}

}  // namespace

std::vector<Measure> measure_flatten(const std::filesystem::path& workspace,
                                     const std::filesystem::path& capture) {
  const std::vector<std::filesystem::path> files = flat_garments(workspace / "flatten" / "current");
  if (files.empty()) {
    return {};
  }
  const GroundTruth truth = read_ground_truth(capture);
  FlatMeasures worst;
  const std::map<std::string, double> metrics =
      read_manifest(std::filesystem::canonical(workspace / "flatten" / "current"), "flatten")
          .metrics;
  if (const auto drawn = metrics.find("seam_mismatch"); drawn != metrics.end()) {
    worst.seam_mismatch = drawn->second;  // of outlines that are smoothed
  }
  double panels = 0;
  double true_panels = 0;
  double of_known = 0;  // garments that the ground truth has a pattern of
  double seams = 0;
  double true_seams = 0;
  double area_ratio = 1;
  std::vector<Mesh> meshes;
  std::vector<double> areas;
  for (const std::filesystem::path& file : files) {
    meshes.push_back(read_mesh(file));
    areas.push_back(face_areas(meshes.back().vertices, meshes.back().faces).sum());
  }
  const std::vector<const GroundTruthGarment*> of_truth = true_garments(truth, files, areas);
  for (std::size_t i = 0; i < files.size(); ++i) {
    const Mesh& mesh = meshes[i];
    const FlatPattern pattern = pattern_of(mesh, files[i]);
    const FlatMeasures flat = measure_flat(mesh, pattern);
    worst.strain_p99 = std::max(worst.strain_p99, flat.strain_p99);
    worst.seam_mismatch = std::max(worst.seam_mismatch, flat.seam_mismatch);
    worst.inverted += flat.inverted + flat.overlaps;
    if (const GroundTruthGarment* truly = of_truth[i]) {
      panels += static_cast<double>(pattern.cut.panel_count);
      true_panels += static_cast<double>(truly->garment.panel_names.size());
      of_known += 1;
      seams += flat.seam_length;
      true_seams += seam_length(*truly);
      const double ratio = flat_area(mesh.uvs, mesh.uv_faces) /
                           flat_area(truly->garment.rest, truly->garment.rest_faces);
      if (std::abs(ratio - 1) > std::abs(area_ratio - 1)) {
        area_ratio = ratio;
      }
    }
  }
  using Side = Measure::Side;
  const std::string of =
      files.size() > 1 ? ", the worst of " + std::to_string(files.size()) + " garments" : "";
  std::vector<Measure> measures{
      {"flatten.stretch_p99", worst.strain_p99, "", 0.03, Side::AtMost,
       "principal stretch, by area" + of},
      {"flatten.seam_mismatch", worst.seam_mismatch, "", 0.003, Side::AtMost,
       "largest difference of the two sides of a seam, also as drawn" + of},
      {"flatten.inverted", static_cast<double>(worst.inverted), "", 0, Side::AtMost,
       "inverted triangles and panels that overlap themselves"}};
  if (true_seams > 0) {
    measures.push_back({"flatten.panels", panels, "", true_panels + 2 * of_known, Side::AtMost,
                        "the ground truth's and two more for each garment"});
    measures.push_back({"flatten.seam_ratio", seams / true_seams, "", 1.3, Side::AtMost,
                        "length of all seams over the ground truth's"});
    measures.push_back({"flatten.area_ratio", area_ratio, "", 0, Side::None,
                        "area of the pattern over the ground truth's" + of});
    measures.push_back({"flatten.area_error", std::abs(area_ratio - 1), "", 0.03, Side::AtMost,
                        "how far that is from 1"});
  }
  add_sewn(measures, metrics);
  add_seen(measures, metrics);
  return measures;
}

}  // namespace atelier
