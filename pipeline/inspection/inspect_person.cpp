#include <algorithm>
#include <limits>

#include "bodymodel/formats/body_archive.h"
#include "bodymodel/formats/body_file.h"
#include "bodymodel/formats/makehuman_target.h"
#include "bodymodel/formats/marker_fit.h"
#include "bodymodel/formats/mhclo.h"
#include "bodymodel/formats/motion_c3d.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/formats/motion_trc.h"
#include "bodymodel/formats/personal_body.h"
#include "bodymodel/formats/tailor_measurements.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/odd_frame_rate.h"
#include "core/io/lower_extension.h"
#include "core/io/npz.h"
#include "core/limits.h"
#include "pipeline/inspection/inspection.h"

namespace atelier {
namespace {

void add_findings(const std::vector<Finding>& findings, Inspection& inspection) {
  inspection.findings.insert(inspection.findings.end(), findings.begin(), findings.end());
}

// A wrong unit or up axis shows in where things are.
class SeenBox {
 public:
  void add(const Eigen::Vector3d& place) {
    lowest_ = lowest_.cwiseMin(place);
    highest_ = highest_.cwiseMax(place);
  }

  void tell(Inspection& inspection) const {
    if ((lowest_.array() <= highest_.array()).all()) {
      inspection.add("lowest", std::vector(lowest_.begin(), lowest_.end()), "m");
      inspection.add("highest", std::vector(highest_.begin(), highest_.end()), "m");
    }
  }

 private:
  static constexpr double kNowhere = std::numeric_limits<double>::infinity();
  Eigen::Vector3d lowest_ = Eigen::Vector3d::Constant(kNowhere);
  Eigen::Vector3d highest_ = Eigen::Vector3d::Constant(-kNowhere);
};

void add_motion(const MotionClip& clip, Inspection& inspection) {
  const auto frames = clip.motion.poses.size();
  inspection.add("joints", clip.skeleton.names.size());
  inspection.add("frames", frames);
  inspection.add("fps", clip.motion.fps, "1/s");
  inspection.add("duration", static_cast<double>(frames) / clip.motion.fps, "s");
  SeenBox box;
  for (const Pose& pose : clip.motion.poses) {
    const Points joints = forward_kinematics(clip.skeleton, pose).positions;
    for (Index j = 0; j < joints.rows(); ++j) {
      box.add(joints.row(j).transpose());
    }
  }
  box.tell(inspection);
  add_findings(clip.findings, inspection);
}

void add_body(const BodyFile& body, Inspection& inspection) {
  inspection.add("body", body.model.name);
  inspection.add("vertices", body.model.mesh.vertices.rows());
  inspection.add("joints", body.model.skeleton.names.size());
  inspection.add("shape parameters", body.model.shape.size());
  inspection.add("pose correctives", body.model.correctives.size());
  inspection.add("vertex groups", body.model.groups.size());
  for (const VertexGroup& group : body.model.groups) {
    inspection.add_member("group " + group.name, {{"vertices", group.vertices.size()}});
  }
  add_findings(body.findings, inspection);
}

}  // namespace

void inspect_motion(const std::filesystem::path& path, Inspection& inspection) {
  const MotionClip clip = read_motion_file(path);
  inspection.add("kind", "motion");
  add_motion(clip, inspection);
}

void inspect_markers(const std::filesystem::path& path, Inspection& inspection) {
  const MarkerClip clip = lower_extension(path) == ".c3d" ? read_c3d(path) : read_trc(path);
  inspection.add("kind", "markers");
  inspection.add("markers", clip.markers.size());
  inspection.add("frames", clip.positions.size());
  inspection.add("fps", clip.fps, "1/s");
  inspection.add("metres per unit", clip.metres_per_unit, "m");
  SeenBox box;
  for (std::size_t frame = 0; frame < clip.positions.size(); ++frame) {
    for (std::size_t m = 0; m < clip.markers.size(); ++m) {
      if (clip.seen[frame][m]) {
        box.add(clip.positions[frame].row(static_cast<Index>(m)).transpose());
      }
    }
  }
  box.tell(inspection);
  add_findings(clip.findings, inspection);
  if (const std::optional<Finding> odd =
          odd_frame_rate(clip.fps, RateStated::Rate, path.string())) {
    inspection.findings.push_back(*odd);
  }
  if (const std::optional<Finding> subjects = subjects_finding(clip)) {
    inspection.findings.push_back(*subjects);
  }
  if (const std::optional<Finding> far = reach_finding(clip)) {
    inspection.findings.push_back(*far);
  }
  for (std::size_t m = 0; m < clip.markers.size(); ++m) {
    inspection.add_member(clip.markers[m],
                          {{"seen", std::count_if(clip.seen.begin(), clip.seen.end(),
                                                  [m](const auto& row) { return row[m]; })}});
  }
}

// The base mesh is not at hand, which would say how many vertices there are to name.
void inspect_target(const std::filesystem::path& path, Inspection& inspection) {
  const Blendshape target = read_target(path, static_cast<Index>(Limits{}.mesh_vertices));
  inspection.add("kind", "MakeHuman target");
  inspection.add("vertices moved", target.vertices.size());
  inspection.add("farthest",
                 target.offsets.rows() > 0 ? target.offsets.rowwise().norm().maxCoeff() : 0.0, "m");
}

void inspect_measurements(const std::filesystem::path& path, Inspection& inspection) {
  const TailorMeasurements found = read_tailor_measurements(path);
  inspection.add("kind", "measurements of one person, by Valentina or Seamly2D");
  inspection.add("unit", found.unit);
  inspection.add("measurements", found.lengths.size());
  for (const auto& [name, length] : found.lengths) {
    inspection.add_member(name, length, "m");
  }
  add_findings(found.findings, inspection);
  if (const std::string unlikely = unlikely_measurement(found); !unlikely.empty()) {
    inspection.findings.push_back({Severity::Warning, "measurement-range", path.string(), unlikely,
                                   "<unit> as the numbers were taken"});
  }
}

void inspect_mhclo(const std::filesystem::path& path, Inspection& inspection) {
  const Mhclo garment = read_mhclo(path, static_cast<Index>(Limits{}.mesh_vertices));
  inspection.add("kind", "MakeHuman garment");
  inspection.add("name", garment.name);
  inspection.add("mesh", garment.obj_file);
  inspection.add("vertices", garment.vertices.size());
  inspection.add("body vertices hidden", garment.deleted.size());
}

void inspect_person(const std::filesystem::path& path, Inspection& inspection) {
  const Npz npz(path);
  const std::string schema = archive_schema(npz);
  const auto has = [&](const char* name) {
    const auto& names = npz.names();
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const bool amass = !has("v_template") && (has("poses") || has("root_orient"));
  if (schema.starts_with("atelier-motion") || (schema.empty() && amass)) {
    inspection.add("holds", schema.empty() ? "motion (AMASS)" : "motion");
    add_motion(read_motion_file(path), inspection);
  } else if (schema.starts_with("atelier-body") || has("v_template")) {
    inspection.add("holds", schema.empty() ? "body (SMPL family)" : "body");
    add_body(read_body_file(path), inspection);
    if (has("person_shape_names")) {
      read_personal_body(path);  // what personalize adds to a body
    }
  }
}

}  // namespace atelier
