#include "pipeline/person/body_stage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bodymodel/formats/personal_body.h"
#include "bodymodel/formats/tracked_motion.h"
#include "bodymodel/skinning.h"
#include "bodymodel/tracking/track.h"
#include "capture/ground_truth_scan.h"
#include "capture/label_taxonomy.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/io/mesh_sequence_file.h"
#include "core/listed_frames.h"
#include "core/normals.h"
#include "core/quantity_text.h"
#include "core/sequence_archive.h"
#include "core/store/manifest.h"
#include "core/store/output_sequences.h"
#include "core/store/result.h"
#include "core/tree.h"
#include "pipeline/person/tracked_take.h"
#include "pipeline/pictures/person_pictures.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

ScanRole role_of(std::uint8_t label) {
  switch (static_cast<Label>(label)) {
    case Label::Skin:
      return ScanRole::Skin;
    case Label::Upper:
    case Label::Lower:
    case Label::Dress:
    case Label::Outer:
      return ScanRole::Cloth;
    case Label::Hair:
    case Label::Shoes:
    case Label::Other:
      return ScanRole::Cover;
    case Label::Background:
    case Label::Unknown:
      break;
  }
  return ScanRole::Ignored;
}

/// Labels as roles. A scan that nothing is known of is all cloth.
ClothedScan clothed_scan(Mesh mesh) {
  ClothedScan scan;
  const bool known = std::any_of(mesh.labels.begin(), mesh.labels.end(), [](std::uint8_t label) {
    return role_of(label) != ScanRole::Ignored;
  });
  if (known) {
    scan.roles.reserve(mesh.labels.size());
    for (const std::uint8_t label : mesh.labels) {
      scan.roles.push_back(role_of(label));
    }
  }
  scan.mesh = std::move(mesh);
  return scan;
}

/// Where a frame is.
struct Place {
  std::size_t take = 0;
  Index row = 0;
};

/// All that the stage reads, frame by frame.
struct BodySource {
  PersonalBody person;
  ShapedBody shaped;
  std::vector<TrackedTake> takes;
  std::map<int, Place> places;  // by frame id
  fs::path scans;               // folder
  fs::path capture;             // of ground_truth_scans
  std::unique_ptr<GroundTruth> truth;

  const Pose& pose(int id) const {
    const Place& place = places.at(id);
    return takes[place.take].tracked.motion.poses[static_cast<std::size_t>(place.row)];
  }
  bool tracked_well(int id) const {
    const Place& place = places.at(id);
    return takes[place.take].tracked.trusted[static_cast<std::size_t>(place.row)] != 0;
  }
  Points posed(int id) const { return skin_vertices(person.model, shaped, pose(id)); }

  /// The frame's scan; empty where there is none.
  ClothedScan scan(int id, const Points& body) const {
    ClothedScan scan;
    const fs::path file = scans / (frame_name(id) + ".h5");
    if (truth) {
      scan = clothed_scan(ground_truth_scan(*truth, read_ground_truth_frame(capture, *truth, id)));
    } else if (fs::exists(file)) {
      scan = clothed_scan(read_mesh_archive(file));
    }
    check_scan_of_body(scan, body, file.string());
    return scan;
  }
};

/// @param person, tracked, scans  results of `personalize`, `track` and `reconstruct`
BodySource body_source(const fs::path& person, const fs::path& tracked_result,
                       const fs::path& scans) {
  BodySource source;
  source.person = read_personal_body(person / "person.npz");
  source.shaped = shape_body(source.person.model);
  source.takes = tracked_takes(tracked_result);
  source.scans = scans / "scans";
  const Index joints = joint_count(source.person.model);
  for (std::size_t t = 0; t < source.takes.size(); ++t) {
    const TrackedMotion& tracked = source.takes[t].tracked;
    if (static_cast<Index>(tracked.skeleton.parents.size()) != joints) {
      throw DataError((tracked_result / source.takes[t].name).string(), "skeleton",
                      std::to_string(tracked.skeleton.parents.size()) + " joints",
                      std::to_string(joints) + ", as the person has; track the person again");
    }
    for (std::size_t row = 0; row < tracked.motion.frame_ids.size(); ++row) {
      source.places[tracked.motion.frame_ids[row]] = {t, static_cast<Index>(row)};
    }
  }
  if (source.places.empty()) {
    throw DataError(tracked_result.string(), "tracked", "no frame", "at least one");
  }
  return source;
}

BodySource body_source(const StageRun& run) {
  return body_source(run.input("person"), run.input("tracked"), run.input("scans"));
}

/// Poses fit the bones of the person that they were found with: another one is not where they say.
void warn_of_another_person(StageRun& run) {
  const Manifest tracked = read_manifest(run.input("tracked"), "track");
  const Digest person = outputs_digest(read_manifest(run.input("person"), "personalize"));
  const bool another =
      std::any_of(tracked.inputs.begin(), tracked.inputs.end(), [&](const ManifestInput& input) {
        return input.stage == "personalize" && input.digest != person;
      });
  if (another) {
    run.warn(
        "the result of 'track' is outdated: it was made with another person than that of "
        "'personalize' now; run 'atelier track' first");
  }
}

std::vector<int> frame_ids_of(const BodySource& source) {
  std::vector<int> ids;
  ids.reserve(source.places.size());
  for (const auto& [id, place] : source.places) {
    ids.push_back(id);
  }
  return ids;
}

SequenceHeader header_of(const BodySource& source) {
  SequenceHeader header;
  header.fps = source.takes[source.places.begin()->second.take].tracked.motion.fps;
  header.frame_ids = frame_ids_of(source);
  header.shared.faces = source.person.model.mesh.faces;
  header.shared.uvs = source.person.model.mesh.uvs;
  header.shared.uv_faces = source.person.model.mesh.uv_faces;
  return header;
}

/// Writes the body of every frame, which `body_in` makes. False as output_sequences.
bool write_bodies(StageRun& run, const BodySource& source,
                  const std::function<Points(int id)>& body_in) {
  return output_sequences(run, {{"frames", header_of(source)}}, frame_ids_of(source), [&](int id) {
    Mesh mesh;
    mesh.vertices = body_in(id);
    return std::vector<Archive>{archive_of(mesh)};
  });
}

/// A frame's certificate and whether it is trusted.
struct Certified {
  BodyCertificate certificate;
  std::vector<Finding> findings;
  double off_body = 0;  ///< share of the scan that is no part of the person
};

Certified certified(const Triangles& faces, const Points& body, const ScanSurface& scan,
                    const BodyCover& cover) {
  Certified frame;
  frame.certificate = body_certificate(faces, body, scan, cover);
  frame.findings = underlying_findings(scan, frame.certificate);
  frame.off_body = share_off_body(scan, faces, body);
  return frame;
}

nlohmann::json json_of(const Certified& frame, bool tracked_well) {
  const BodyCertificate& c = frame.certificate;
  nlohmann::json codes = nlohmann::json::array();
  for (const Finding& finding : frame.findings) {
    codes.push_back(finding.code);
  }
  if (!tracked_well) {
    codes.push_back("tracking");
  }
  const bool trusted = codes.empty();
  return {{"covered", c.covered},
          {"outside_rate", c.outside_rate},
          {"outside_depth", c.outside_depth},
          {"proximity", c.proximity},
          {"proximity_rate", c.proximity_rate},
          {"bare", c.bare},
          {"skin_distance", c.skin_distance},
          {"seen_rate", c.seen_rate},
          {"trusted", trusted},
          {"findings", std::move(codes)}};
}

bool is_no_scan(const Finding& finding) {
  return finding.code == "no-scan";
}

/// Findings of a frame; those without a scan are one line of all frames, which `certify` says.
void tell_of_frame(StageRun& run, std::vector<Finding> findings, int id) {
  std::erase_if(findings, is_no_scan);
  tell(run, findings, "frame " + std::to_string(id) + ": ");
}

/// certificates.json, its image and the metrics, from the bodies as they were written.
void certify(StageRun& run, const BodySource& source,
             const std::function<Certified(int id, const Points& body)>& of_frame) {
  nlohmann::json all = nlohmann::json::object();
  double untrusted = 0;
  double covered = 0;
  double outside = 0;
  double depth = 0;
  double near = 0;
  double proximity = 0;
  double bare = 0;
  double skin = 0;
  double seen = 0;
  std::vector<int> ids;
  std::vector<int> unscanned;
  std::vector<int> untracked;
  std::vector<int> far;
  double farthest = 0;
  std::vector<char> trusted;
  std::vector<FrameSeries> series = {{"covered skin outside of the clothes, %", {}},
                                     {"depth of it, mm", {}},
                                     {"mean gap under clothes within 1 cm, mm", {}},
                                     {"seen skin, mm off", {}},
                                     {"seen, % of the body", {}}};
  for (const auto& [id, place] : source.places) {
    const Certified frame = of_frame(id, read_mesh_archive(run.frame_file(id)).vertices);
    const nlohmann::json json = json_of(frame, source.tracked_well(id));
    untrusted += json["trusted"].get<bool>() ? 0 : 1;
    const BodyCertificate& c = frame.certificate;
    const auto count = static_cast<double>(c.covered);
    covered += count;
    outside += count * c.outside_rate;
    depth += count * c.outside_rate * c.outside_depth;
    near += count * c.proximity_rate;
    proximity += count * c.proximity_rate * c.proximity;
    bare += static_cast<double>(c.bare);
    skin += static_cast<double>(c.bare) * c.skin_distance;
    seen += c.seen_rate;
    ids.push_back(id);
    if (std::any_of(frame.findings.begin(), frame.findings.end(), is_no_scan)) {
      unscanned.push_back(id);
    }
    if (!source.tracked_well(id)) {
      untracked.push_back(id);
    }
    if (frame.off_body > kFarShare) {
      far.push_back(id);
      farthest = std::max(farthest, frame.off_body);
    }
    trusted.push_back(json["trusted"].get<bool>() ? 1 : 0);
    const std::array values = {100 * c.outside_rate, 1e3 * c.outside_depth, 1e3 * c.proximity,
                               1e3 * c.skin_distance, 100 * c.seen_rate};
    for (std::size_t s = 0; s < series.size(); ++s) {
      series[s].values.push_back(values[s]);
    }
    all[frame_name(id)] = json;
  }
  if (!unscanned.empty()) {
    run.warn("no-scan [frames " + listed_frames(unscanned) +
             "]: there is no scan: the body is the tracked one alone");
  }
  if (!untracked.empty()) {
    run.warn("tracking [frames " + listed_frames(untracked) +
             "]: tracking marked the pose as unreliable: the body is fitted, and marked as "
             "unreliable too");
  }
  if (!far.empty()) {
    run.warn("scan-far [frames " + listed_frames(far) + "]: up to " + percent(farthest) +
             " of the scan is not part of the person and is ignored; check for a second person or "
             "a wrong calibration");
  }
  const auto mean = [&](const char* name, double sum, double count) {
    if (count > 0) {  // nothing measured is no 0
      run.metric(name, sum / count);
    }
  };
  const auto frames = static_cast<double>(source.places.size());
  run.output_text("certificates.json", all.dump(1));
  run.output_text("certificates.png",
                  image_bytes(frames_picture(ids, trusted, series), ImageFormat::Png));
  run.metric("frames", frames);
  run.metric("untrusted", untrusted);
  run.metric("ground_truth_scans", source.truth ? 1 : 0);
  mean("outside_rate", outside, covered);
  if (covered > 0) {
    run.metric("outside_depth", outside > 0 ? depth / outside : 0);
  }
  mean("proximity", proximity, near);
  mean("skin_distance", skin, bare);
  mean("seen_rate", seen, frames);
}

/// The sequences of a run, each made when its first frame is asked for.
class Fits {
 public:
  Fits(const BodySource& source, const UnderlyingSequenceOptions& options)
      : source_(source), options_(options), fits_(source.takes.size()) {
    for (std::size_t t = 0; t < fits_.size(); ++t) {
      fits_[t] = std::make_unique<Lazy>();
    }
  }

  const UnderlyingSequence& of_take(std::size_t take) {
    Lazy& lazy = *fits_[take];
    std::call_once(lazy.once, [&] {
      const TrackedMotion& tracked = source_.takes[take].tracked;
      lazy.fit = std::make_unique<UnderlyingSequence>(
          source_.person.model.mesh.faces, static_cast<Index>(tracked.motion.frame_ids.size()),
          [this, &tracked](Index row) {
            const int id = tracked.motion.frame_ids[static_cast<std::size_t>(row)];
            PosedScan frame{source_.posed(id), {}};
            frame.scan = scan_surface(source_.scan(id, frame.posed), frame_name(id));
            return frame;
          },
          options_);
    });
    return *lazy.fit;
  }

 private:
  struct Lazy {
    std::once_flag once;
    std::unique_ptr<UnderlyingSequence> fit;
  };
  const BodySource& source_;
  UnderlyingSequenceOptions options_;
  std::vector<std::unique_ptr<Lazy>> fits_;
};

/// A registered garment, and which of its meshes is of which tracked frame.
struct FrameGarments {
  Sequence meshes;
  std::map<int, Index> rows;  // by frame id
};

FrameGarments frame_garments(const fs::path& input, const BodySource& source) {
  FrameGarments garment;
  const MeshSequenceFile file = read_mesh_sequence(input, SequenceOf::Cloth);
  if (equal_arrays(file.shared.faces, source.person.model.mesh.faces)) {
    throw DataError(input.string(), "faces", "those of the body itself",
                    "a sequence of the garment's meshes, as register makes them");
  }
  garment.meshes = file.sequence;
  for (std::size_t i = 0; i < garment.meshes.frame_ids.size(); ++i) {
    if (source.places.contains(garment.meshes.frame_ids[i])) {
      garment.rows[garment.meshes.frame_ids[i]] = static_cast<Index>(i);
    }
  }
  if (garment.rows.empty()) {
    throw DataError(input.string(), "frames", "none of the capture's",
                    "meshes whose numbers are those of the tracked frames, from " +
                        std::to_string(source.places.begin()->first));
  }
  return garment;
}

/// True if more of a garment looks towards the body than away from it.
bool looks_inwards(const Mesh& garment, const Triangles& faces, const Points& body) {
  const Points outward = vertex_normals(garment.vertices, garment.faces);
  const Eigen::VectorXd areas = vertex_areas(garment.vertices, garment.faces);
  const Points skin = face_normals(body, faces);
  const std::vector<ClosestPoint> nearest =
      closest_points(build_tree(body, faces), garment.vertices);
  double along = 0;
  for (Index v = 0; v < outward.rows(); ++v) {
    along += areas[v] * outward.row(v).dot(skin.row(nearest[static_cast<std::size_t>(v)].face));
  }
  return along < 0;
}

/// A registered garment over the skin of a scan.
ClothedScan with_garment(const ClothedScan& scan, const Mesh& garment) {
  ClothedScan joined;
  const Index first = garment.vertices.rows();
  joined.mesh.vertices.resize(first + scan.mesh.vertices.rows(), 3);
  joined.mesh.vertices << garment.vertices, scan.mesh.vertices;
  joined.roles.assign(static_cast<std::size_t>(first), ScanRole::Cloth);
  joined.roles.insert(joined.roles.end(), scan.roles.begin(), scan.roles.end());
  joined.roles.resize(static_cast<std::size_t>(joined.mesh.vertices.rows()), ScanRole::Ignored);
  std::vector<Index> kept;  // the garment takes the place of the scan's cloth
  for (Index f = 0; f < scan.mesh.faces.rows(); ++f) {
    int cloth = 0;
    for (int k = 0; k < 3; ++k) {
      const auto v = static_cast<std::size_t>(first + scan.mesh.faces(f, k));
      cloth += joined.roles[v] == ScanRole::Cloth ? 1 : 0;
    }
    if (cloth < 2) {
      kept.push_back(f);
    }
  }
  joined.mesh.faces.resize(garment.faces.rows() + static_cast<Index>(kept.size()), 3);
  joined.mesh.faces.topRows(garment.faces.rows()) = garment.faces;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    joined.mesh.faces.row(garment.faces.rows() + static_cast<Index>(i)) =
        scan.mesh.faces.row(kept[i]).array() + static_cast<int>(first);
  }
  return joined;
}

}  // namespace

OptionTable describe(BodyStageOptions& options) {
  OptionTable table;
  table.add(describe(options.fit));
  table.add("ground_truth_scans", options.ground_truth_scans,
            "Ground-truth surfaces of a synthetic capture instead of scans, for comparison");
  return table;
}

OptionTable describe(RefineStageOptions& options) {
  OptionTable table = describe(options.fit);
  std::erase_if(table.fields, [](const OptionField& field) {  // it knows no frames around
    return field.name == "temporal" || field.name == "temporal_weight";
  });
  return table;
}

void run_body(StageRun& run) {
  const auto& options = run.options<BodyStageOptions>();
  warn_of_another_person(run);
  BodySource source = body_source(run);
  if (options.ground_truth_scans) {
    source.capture = run.input("capture");
    source.truth = std::make_unique<GroundTruth>(read_ground_truth(source.capture));
  }
  Fits fits(source, options.fit);
  if (!write_bodies(run, source, [&](int id) {
        const Place& place = source.places.at(id);
        const UnderlyingBody body = fits.of_take(place.take).at(place.row);
        tell_of_frame(run, body.findings, id);
        return body.vertices;
      })) {
    return;
  }
  certify(run, source, [&](int id, const Points& body) {
    const BodyCover& cover = fits.of_take(source.places.at(id).take).cover();
    const ScanSurface scan = scan_surface(source.scan(id, body));
    return certified(source.person.model.mesh.faces, body, scan, cover);
  });
}

void check_refine_input(const fs::path& input, const OptionTable& /*options*/) {
  if (!fs::exists(input)) {
    throw DataError(input.string(), "", "no registered garment",
                    "a sequence of the garment's meshes over one topology");
  }
  const std::string stage = result_around(input).parent_path().filename().string();
  if (stage == "body" || stage == "refine") {
    throw DataError(input.string(), "", "the body itself, a result of " + stage,
                    "a sequence of the garment's meshes, as register makes them");
  }
}

void require_garment(const fs::path& input, const fs::path& workspace) {
  const auto current = [&](const char* stage) { return workspace / stage / "current"; };
  frame_garments(input,
                 body_source(current("personalize"), current("track"), current("reconstruct")));
}

void run_refine(StageRun& run) {
  const auto& options = run.options<RefineStageOptions>();
  warn_of_another_person(run);
  const BodySource source = body_source(run);
  const Sequence bodies = open_sequence(run.input("bodies"));
  const FrameGarments garment = frame_garments(run.input("registered_garment"), source);
  const Triangles& faces = source.person.model.mesh.faces;
  const auto body_of = [&](int id) {
    const auto at = std::lower_bound(bodies.frame_ids.begin(), bodies.frame_ids.end(), id);
    if (at == bodies.frame_ids.end() || *at != id) {
      throw DataError(run.input("bodies").string(), "frames", "no " + frame_name(id),
                      "every tracked frame; run body again");
    }
    return frame(bodies, at - bodies.frame_ids.begin()).vertices;
  };
  const auto& [shown, row] = *garment.rows.begin();
  const bool turned = looks_inwards(frame(garment.meshes, row), faces, body_of(shown));
  if (turned) {
    run.warn("garment-turned: the faces of " + run.input("registered_garment").string() +
             " are oriented inwards; their orientation is reversed");
  }
  const auto scan_of = [&](int id, const Points& body) {
    Mesh worn = frame(garment.meshes, garment.rows.at(id));
    if (turned) {
      worn.faces.col(1).swap(worn.faces.col(2));
    }
    return scan_surface(with_garment(source.scan(id, body), worn));
  };
  if (!write_bodies(run, source, [&](int id) -> Points {
        const Points first = body_of(id);
        if (!garment.rows.contains(id)) {
          return first;
        }
        // The body that is there is the shape to keep: it has been fitted to skin and neighbours.
        const ScanSurface scan = scan_of(id, first);
        const BodyCover cover = body_cover(faces, cover_votes(faces, first, scan));
        const UnderlyingBody body = underlying_body(faces, first, scan, cover, {}, options.fit);
        tell_of_frame(run, body.findings, id);
        return body.vertices;
      })) {
    return;
  }
  certify(run, source, [&](int id, const Points& body) {
    const ScanSurface scan =
        garment.rows.contains(id) ? scan_of(id, body) : scan_surface(source.scan(id, body));
    const BodyCover cover = body_cover(faces, cover_votes(faces, body, scan));
    return certified(faces, body, scan, cover);
  });
}

}  // namespace atelier
