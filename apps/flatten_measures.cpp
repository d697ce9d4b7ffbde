#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_REGISTRATION)

#include "apps/flatten_measures.h"

#include <cmath>
#include <limits>

#include "apps/seam_input.h"
#include "capture/truth_archive.h"
#include "core/error.h"
#include "core/io/mesh_file.h"
#include "core/normals.h"
#include "core/topology.h"
#include "registration/flat_pattern.h"
#include "registration/flat_seams.h"

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

double seam_length(const TruthGarment& truth) {
  double length = 0;
  for (const Seam& seam : truth.seams) {
    for (std::size_t i = 1; i < seam.a.size(); ++i) {
      length += (truth.garment.rest.row(seam.a[i]) - truth.garment.rest.row(seam.a[i - 1])).norm();
    }
  }
  return length;
}

}  // namespace

std::vector<Measure> measure_flatten(const std::filesystem::path& workspace,
                                     const std::filesystem::path& capture) {
  const std::filesystem::path file = workspace / "flatten" / "current" / "garment.obj";
  if (!std::filesystem::exists(file)) {
    return {};
  }
  const Mesh mesh = read_mesh(file);
  const FlatPattern pattern = pattern_of(mesh, file);
  const FlatMeasures flat = measure_flat(mesh, pattern);
  using Side = Measure::Side;
  std::vector<Measure> measures{
      {"flatten.stretch_p99", flat.strain_p99, "", 0.03, Side::AtMost,
       "principal stretch, by area"},
      {"flatten.seam_mismatch", flat.seam_mismatch, "", 0.003, Side::AtMost,
       "largest difference of the two sides of a seam"},
      {"flatten.inverted", static_cast<double>(flat.inverted + flat.overlaps), "", 0, Side::AtMost,
       "triangles turned over and panels over themselves"}};
  const CaptureTruth truth = read_capture_truth(capture);
  const double area = face_areas(mesh.vertices, mesh.faces).sum();
  const TruthGarment* nearest = nullptr;
  double difference = std::numeric_limits<double>::infinity();
  for (const TruthGarment& garment : truth.garments) {
    const Mesh& other = garment.garment.mesh;
    const double apart = std::abs(face_areas(other.vertices, other.faces).sum() - area);
    if (!garment.seams.empty() && apart < difference) {
      difference = apart;
      nearest = &garment;
    }
  }
  if (nearest != nullptr) {
    const auto panels = static_cast<double>(nearest->garment.panel_names.size());
    measures.push_back({"flatten.panels", static_cast<double>(pattern.cut.panel_count), "",
                        panels + 2, Side::AtMost, "the truth's and two more"});
    measures.push_back({"flatten.seam_ratio", flat.seam_length / seam_length(*nearest), "", 1.3,
                        Side::AtMost, "length of all seams over the truth's"});
  }
  return measures;
}

}  // namespace atelier

#endif
