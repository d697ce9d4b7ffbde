#include "registration/template/garment_template.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

#include "core/error.h"
#include "core/intersection.h"
#include "core/median.h"
#include "core/normals.h"
#include "core/remesh/isotropic_remeshing.h"
#include "core/topology.h"
#include "core/tree.h"
#include "core/winding_number.h"
#include "registration/attach_to_body.h"
#include "registration/part_crossings.h"
#include "registration/remove_handles.h"
#include "registration/remove_slivers.h"
#include "registration/template/followed_surface.h"
#include "registration/template/garment_boundaries.h"
#include "registration/template/garment_cover.h"
#include "registration/template/observed_rims.h"
#include "registration/template/surface_through_points.h"
#include "registration/template/template_points.h"
#include "registration/template/trim_surface.h"
#include "registration/tracking/cut_rim_folds.h"
#include "registration/tracking/register_garment.h"

namespace atelier {
namespace {

constexpr double kMinArea = 0.01;     // m2
constexpr double kMaxUnseen = 0.6;    // of the surface
constexpr double kMuchUnseen = 0.2;   // from here on it is said
constexpr double kMuchBeyond = 0.04;  // of what frames show
constexpr double kFewTold = 0.75;     // of the length of rims
constexpr double kFollowEdge = 0.03;  // m, of the mesh that is followed
constexpr int kFollowed = 9;          // frames that are followed, at most
constexpr int kMoreHandles = 6;       // than the surface of one frame: sheets that do not fit
constexpr int kTakeRounds = 2;        // of taking from other frames what one lacks
constexpr double kGain = 0.01;        // of the area: less is no reason to go on
constexpr int kPushRounds = 3;
constexpr double kCoarsest = 0.03;  // m: coarser edges are made of a surface as fine as for these
constexpr double kBridge = 0.15;  // m round it: longer ones carry isotropic triangles, or are none
constexpr double kEdgesRound = 12;  // edges that an opening needs: remeshing draws rims in

std::string of_area(const char* format, double value) {
  char text[120];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

/// Which of n frames are looked at: `most` of them, evenly.
std::vector<Index> chosen_rows(Index count, int most) {
  std::vector<Index> rows;
  const Index taken = std::min<Index>(count, most);
  rows.reserve(static_cast<std::size_t>(taken));
  for (Index i = 0; i < taken; ++i) {
    rows.push_back(taken == 1 ? 0 : i * (count - 1) / (taken - 1));
  }
  return rows;
}

/// Evidence of all frames, before one is chosen, and that one.
struct Overview {
  std::vector<Index> rows;
  TakeOverview take;
  Index best = -1;
};

Overview overview_of(const ClothedFrames& frames, std::uint8_t label,
                     const GarmentTemplateOptions& options) {
  Overview all;
  all.rows = chosen_rows(static_cast<Index>(frames.frame_ids.size()), options.frames);
  if (options.frame >= 0) {
    const auto at = std::find(frames.frame_ids.begin(), frames.frame_ids.end(), options.frame);
    if (at == frames.frame_ids.end()) {
      throw DataError("", "frame", std::to_string(options.frame), "one that has a scan and a body");
    }
    all.best = at - frames.frame_ids.begin();
    if (std::find(all.rows.begin(), all.rows.end(), all.best) == all.rows.end()) {
      all.rows.push_back(all.best);
    }
  }
  all.take = take_overview(frames, all.rows, label);
  if (all.best < 0) {
    all.best = best_of(all.take.scores).row;
  }
  return all;
}

/// Throws DataError where no frame shows enough of the label: nothing could follow the garment.
void require_seen(const Overview& all, const std::string& name) {
  if (all.take.area < kMinArea) {
    throw DataError("", name,
                    of_area("%.0f cm2 of its label at most in a frame", 1e4 * all.take.area),
                    "100 cm2: labels that cover the garment, or leave it out");
  }
}

/// Moves what is inside of the body, or nearer than `clearance`, out along the body's normal.
int push_out(Mesh& mesh, const Points& body, const Triangles& body_faces, double clearance) {
  const TriangleTree tree = build_tree(body, body_faces);
  const WindingTree winding = build_winding_tree(body, body_faces);
  const Points normals = face_normals(body, body_faces);
  std::vector<char> pushed(static_cast<std::size_t>(mesh.vertices.rows()), 0);
  for (int round = 0; round < kPushRounds; ++round) {
    const std::vector<ClosestPoint> nearest = closest_points(tree, mesh.vertices);
    const std::vector<double> inside = winding_numbers(winding, mesh.vertices);
    for (Index v = 0; v < mesh.vertices.rows(); ++v) {
      const auto at = static_cast<std::size_t>(v);
      const bool in = inside[at] > 0.5;
      if (!in && nearest[at].squared_distance >= clearance * clearance) {
        continue;
      }
      const Eigen::Vector3d away = mesh.vertices.row(v).transpose() - nearest[at].point;
      const double distance = away.norm();
      const Eigen::Vector3d outwards =
          distance > 1e-6 ? Eigen::Vector3d((in ? -1 : 1) * away / distance)
                          : Eigen::Vector3d(normals.row(nearest[at].face).transpose());
      mesh.vertices.row(v) = (nearest[at].point + 1.01 * clearance * outwards).transpose();
      pushed[at] = 1;
    }
  }
  return static_cast<int>(std::count(pushed.begin(), pushed.end(), 1));
}

/// 1 where moving with the body misses what the frames show, or the body is far away.
std::vector<char> dynamic_region(const GarmentTemplate& made, const ClothedFrames& frames,
                                 const std::vector<Index>& rows, const Points& body,
                                 std::uint8_t label, double dynamic) {
  const Mesh& mesh = made.garment.mesh;
  std::vector<std::vector<double>> misses(static_cast<std::size_t>(mesh.vertices.rows()));
  for (const Index row : rows) {
    const ClothedFrame frame = frames.load(row);
    std::vector<Index> seen;
    for (Index v = 0; v < frame.scan.vertices.rows(); ++v) {
      if (frame.scan.labels[static_cast<std::size_t>(v)] == label) {
        seen.push_back(v);
      }
    }
    if (seen.empty()) {
      continue;
    }
    Points points(static_cast<Index>(seen.size()), 3);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      points.row(static_cast<Index>(i)) = frame.scan.vertices.row(seen[i]);
    }
    const std::vector<ClosestPoint> nearest =
        closest_points(build_point_tree(points),
                       body_driven(made.garment.attachments, frame.body, frames.body_faces));
    for (std::size_t v = 0; v < misses.size(); ++v) {
      misses[v].push_back(std::sqrt(nearest[v].squared_distance));
    }
  }
  const std::vector<ClosestPoint> flesh =
      closest_points(build_tree(body, frames.body_faces), mesh.vertices);
  const Adjacency neighbors = vertex_neighbors(topology_of(mesh.faces, mesh.vertices.rows()));
  std::vector<char> region(misses.size(), 0);
  for (std::size_t v = 0; v < region.size(); ++v) {
    region[v] =
        median(misses[v]) > dynamic || std::sqrt(flesh[v].squared_distance) > 2 * dynamic ? 1 : 0;
  }
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {  // as most of the neighbours
    std::vector<char> next = region;
    for (std::size_t v = 0; v < region.size(); ++v) {
      int balance = region[v] != 0 ? 1 : -1;
      for (const int other : neighbors[static_cast<Index>(v)]) {
        balance += region[static_cast<std::size_t>(other)] != 0 ? 1 : -1;
      }
      next[v] = balance > 0 ? 1 : 0;
    }
    region = next;
  }
  return region;
}

/// Steps that made and imported templates share once the mesh stands.
void dress(GarmentTemplate& made, const GarmentBoundaries& boundaries, const ClothedFrames& frames,
           const std::vector<Index>& rows, const Points& body, std::uint8_t label,
           const GarmentTemplateOptions& options) {
  Garment& garment = made.garment;
  made.facing = body_facing(frames.anatomy, body);
  garment.boundaries = boundaries.loops;
  garment.boundary_names = boundaries.names;
  garment.attachments = attach_to_body(garment.mesh.vertices, body, frames.body_faces);
  made.dynamic = dynamic_region(made, frames, rows, body, label, options.dynamic);
  garment.mesh.normals = vertex_normals(garment.mesh.vertices, garment.mesh.faces);
  if (garment.mesh.uvs.rows() == 0) {
    garment.mesh = with_texture_atlas(garment.mesh, options.atlas);
  }
  for (const std::string& opening : garment.boundary_names) {
    if (opening.starts_with("opening")) {
      made.findings.push_back(
          {Severity::Warning, "opening-unnamed", garment.name,
           "an opening that is no neck, cuff, waist, hem or ankle: part of the "
           "garment may never be seen, or it leaves the images",
           "look at the template in the report; another --frame may show more of it"});
    }
  }
  check_garment(garment, garment.name);
}

/// Whether a garment's faces look inwards, to the body: it winds round what it is worn by the other
/// way, however open it is.
bool looks_inwards(const Mesh& mesh, const Points& body) {
  double sum = 0;
  for (const double winding :
       winding_numbers(build_winding_tree(mesh.vertices, mesh.faces), body)) {
    sum += winding;
  }
  return sum < 0;
}

/// Faces and texture the other way round.
void turn_round(Mesh& mesh) {
  mesh.faces.col(1).swap(mesh.faces.col(2));
  if (mesh.uv_faces.rows() > 0) {
    mesh.uv_faces.col(1).swap(mesh.uv_faces.col(2));
  }
}

/// A garment's part of a scan: the faces whose first corner has the label, and their size.
struct ShownGarment {
  Triangles faces;
  Points corners;     ///< the first of each face
  double extent = 0;  ///< m, diagonal
};

ShownGarment shown_of(const Mesh& scan, std::uint8_t label) {
  std::vector<Index> rows;
  for (Index f = 0; f < (scan.labels.empty() ? 0 : scan.faces.rows()); ++f) {
    if (scan.labels[static_cast<std::size_t>(scan.faces(f, 0))] == label) {
      rows.push_back(f);
    }
  }
  ShownGarment shown;
  if (!rows.empty()) {
    shown.faces = scan.faces(rows, Eigen::all);
    shown.corners = scan.vertices(Eigen::VectorXi(shown.faces.col(0)), Eigen::all);
    shown.extent = (shown.corners.colwise().maxCoeff() - shown.corners.colwise().minCoeff()).norm();
  }
  return shown;
}

double median_distance(const TriangleTree& surface, const Points& points) {
  std::vector<double> distances;
  for (const ClosestPoint& nearest : closest_points(surface, points)) {
    distances.push_back(std::sqrt(nearest.squared_distance));
  }
  return median(distances);
}

/// Refuses an artist's mesh of something else: half of it farther from what the scan shows of the
/// garment than a twentieth of that one's size, our choice, is not how a garment is worn. A warning
/// where what the scan shows lies elsewhere: another garment, or another pose.
std::optional<Finding> far_from_scan(const Mesh& mesh, const Mesh& scan, std::uint8_t label,
                                     int frame_id, const std::string& file) {
  constexpr double kFar = 0.1;        // m
  constexpr double kFarthest = 0.05;  // of the garment's size
  const ShownGarment shown = shown_of(scan, label);
  if (shown.faces.rows() == 0) {
    return std::nullopt;
  }
  const double most = kFarthest * shown.extent;
  if (const double off = median_distance(build_tree(scan.vertices, shown.faces), mesh.vertices);
      off > most) {
    throw DataError(
        file, "place",
        of_area("half its vertices farther than %.2f m from what the scan shows of this garment",
                off),
        "a mesh of this garment, placed on the body of frame " + std::to_string(frame_id) +
            of_area(" (--frame): within %.2f m, a twentieth of the garment's size", most));
  }
  const double middle = median_distance(build_tree(mesh.vertices, mesh.faces), shown.corners);
  if (middle < kFar) {
    return std::nullopt;
  }
  return Finding{Severity::Warning, "import-far", file,
                 of_area("half of what the scan shows of this garment is farther than %.2f m from "
                         "the imported mesh",
                         middle),
                 "place the mesh on the body of its frame; --frame says which frame that is"};
}

/// A warning where the surface had openings that the mesh has not, or the mesh closes over a limb:
/// triangles are then about as large as openings.
std::optional<Finding> lost_openings(const std::string& name, const Points& vertices,
                                     const GarmentBoundaries& before,
                                     const GarmentBoundaries& after,
                                     const std::vector<std::string>& limbs, double edge_length) {
  std::string lost;
  double safe = std::min(edge_length / 1.5, kCoarsest);
  for (std::size_t b = 0; b < before.loops.size(); ++b) {
    if (std::find(after.names.begin(), after.names.end(), before.names[b]) == after.names.end()) {
      const Points loop = vertices(before.loops[b], Eigen::all);
      double round = 0;
      for (Index i = 0; i < loop.rows(); ++i) {
        round += (loop.row((i + 1) % loop.rows()) - loop.row(i)).norm();
      }
      safe = std::min(safe, round / kEdgesRound);
      lost += (lost.empty() ? "" : ", ") + before.names[b];
    }
  }
  std::string over;
  for (const std::string& limb : limbs) {
    over += (over.empty() ? "" : ", ") + limb;
  }
  if (lost.empty() && over.empty()) {
    return std::nullopt;
  }
  return Finding{Severity::Warning, "opening-lost", name,
                 (lost.empty() ? "it is closed over the " + over : "lost: " + lost) +
                     of_area("; triangles with edges of %.3g m are about as large as its openings",
                             edge_length),
                 of_area("--edge-length %.3f or less", std::floor(1000 * safe) / 1000)};
}

/// Handles of all pieces together.
int handles_of(const Mesh& mesh) {
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  return connected_components(topology).count -
         (euler_characteristic(topology) + static_cast<int>(boundary_loops(topology).size())) / 2;
}

/// A surface of the points of a frame, and of the others where that one shows nothing.
struct TakenSurface {
  TrimmedSurface trimmed;
  FollowedSurface followed;  ///< through the other frames; none where one frame is all
};

TakenSurface taken_surface(const ClothedFrames& frames, const ClothedFrame& frame,
                           const Overview& all, std::uint8_t label,
                           const GarmentTemplateOptions& options) {
  // Where the garment ends is a matter of its openings, not of the mesh that is made of it.
  const double fine = std::min(options.edge_length, kCoarsest);
  const double spacing = fine / 4;
  const GarmentPoints own =
      garment_points(frame.scan, label, frame.body, frames.body_faces, spacing);
  const auto trimmed_through = [&](GarmentPoints points) {
    add_covered(points, frame.body, frames.body_faces, all.take.cover, spacing);
    const Mesh through = surface_through_points(
        points.points, points.normals, points.weights,
        {.cell = fine / 2, .reach = options.reach, .stiffness = options.stiffness});
    // A step of points and half a diagonal of their cubes lie between neighbours.
    return trim_surface(through, points, 1.9 * spacing, frame.body, frames.body_faces,
                        all.take.cover);
  };
  // What the cut leaves open is closed with the holes.
  const auto without_handles = [](TrimmedSurface trimmed) {
    trimmed.mesh = remove_handles(std::move(trimmed.mesh), kBridge).mesh;
    return trimmed;
  };
  TrimmedSurface first = trimmed_through(own);
  const int handles = handles_of(first.mesh);
  TakenSurface taken{without_handles(std::move(first)), {}};
  if (options.source == TemplateSource::Frame || all.rows.size() < 2 ||
      taken.trimmed.mesh.faces.rows() == 0) {
    return taken;
  }
  std::vector<Index> followed_rows;
  for (const Index at : chosen_rows(static_cast<Index>(all.rows.size()), kFollowed)) {
    followed_rows.push_back(all.rows[static_cast<std::size_t>(at)]);
  }
  for (int round = 0;; ++round) {
    const GarmentBoundaries rims =
        garment_boundaries(taken.trimmed.mesh.vertices, taken.trimmed.mesh.faces, frames.anatomy,
                           frame.body, frames.body_faces);
    Mesh coarse = isotropic_remeshing(
        taken.trimmed.mesh,
        {.edge_length = std::max(kFollowEdge, options.edge_length), .holes = rims.holes});
    push_out(coarse, frame.body, frames.body_faces, options.clearance);
    taken.followed = followed_surface(coarse, all.best, frames, followed_rows, label);
    if (round == kTakeRounds) {
      return taken;
    }
    GarmentPoints points = own;
    const double added =
        add_carried(points, frame, all.take.cover, taken.followed, frames, spacing);
    const double area = face_areas(coarse.vertices, coarse.faces).sum();
    if (added < taken.trimmed.area_carried + kGain * area) {
      return taken;
    }
    TrimmedSurface more = trimmed_through(std::move(points));
    if (handles_of(more.mesh) > handles + kMoreHandles) {  // frames that do not fit
      return taken;
    }
    taken.trimmed = without_handles(std::move(more));
  }
}

/// A mesh in the pose of a followed surface, in all its poses, its own first.
std::vector<WornPose> worn_poses(const Mesh& mesh, const Points& body,
                                 const FollowedSurface& followed) {
  std::vector<WornPose> poses = {{mesh.vertices, body}};
  const Points normals = vertex_normals(mesh.vertices, mesh.faces);
  for (const FollowedSurface::Frame& frame : followed.frames) {
    poses.push_back({carried({mesh.vertices, normals}, followed.mesh.faces, followed.mesh.vertices,
                             frame.vertices)
                         .points,
                     frame.body});
  }
  return poses;
}

/// Limbs that a garment closes over in more than half of its poses: a hand in a fold is in one.
std::vector<std::string> closed_in_most(const Triangles& faces, const ClothedFrames& frames,
                                        const std::vector<WornPose>& poses) {
  std::map<std::string, std::size_t> count;
  for (const WornPose& pose : poses) {
    for (const std::string& limb :
         limbs_closed_over(pose.vertices, faces, frames.anatomy, pose.body, frames.body_faces)) {
      ++count[limb];
    }
  }
  std::vector<std::string> closed;
  for (const auto& [limb, times] : count) {
    if (2 * times > poses.size()) {
      closed.push_back(limb);
    }
  }
  return closed;
}

/// Whether a template is all of its garment, with a warning where it is not.
void tell_whole(GarmentTemplate& made) {
  std::string lacks;
  const auto say = [&](const std::string& sentence) {
    lacks += (lacks.empty() ? "" : "; ") + sentence;
  };
  if (made.beyond > kMuchBeyond) {
    say(of_area("%.0f%% of what frames show of it lies past its rims", 100 * made.beyond));
  }
  if (made.observed_rims < kFewTold) {
    say(of_area("%.0f%% of its rims lie where no frame shows that cloth ends",
                100 * (1 - made.observed_rims)));
  }
  const double area = face_areas(made.garment.mesh.vertices, made.garment.mesh.faces).sum();
  if (made.area_unseen > kMuchUnseen * area) {
    say(of_area("%.0f%% of it is seen in no frame", 100 * made.area_unseen / area));
  }
  if (std::any_of(made.findings.begin(), made.findings.end(),
                  [](const Finding& finding) { return finding.code == "opening-lost"; })) {
    say("an opening is lost");
  }
  if (std::any_of(made.garment.boundary_names.begin(), made.garment.boundary_names.end(),
                  [](const std::string& opening) { return opening.starts_with("opening"); })) {
    say("an opening has no name");
  }
  made.whole = lacks.empty();
  if (!made.whole) {
    made.findings.push_back({Severity::Warning, "not-whole", made.garment.name,
                             "the template is not the whole garment: " + lacks,
                             "look at template.png; another --frame, cameras and labels "
                             "that show all of it, or an imported template"});
  }
}

}  // namespace

OptionTable describe(GarmentTemplateOptions& options) {
  OptionTable table;
  table.add("edge_length", options.edge_length, 0.003, 0.1, "m",
            "Edge length of the triangles, at most a twelfth of the length of an opening");
  table.add(
      "frame", options.frame, -1, 1'000'000'000, "",
      "Frame in whose pose the template is made; -1: the one that shows most of the garments");
  table.add("frames", options.frames, 1, 10000, "",
            "Number of frames examined, evenly spread over the sequence");
  table.add("source", options.source,
            {{"frame", TemplateSource::Frame}, {"take", TemplateSource::Take}},
            "Scans that the surface is made of: take (what its frame hides is taken from the other "
            "frames) or frame (one frame alone)");
  table.add("reach", options.reach, 0.01, 0.5, "m",
            "Half the width of the largest unseen patch that is closed");
  table.add("stiffness", options.stiffness, 1e-6, 1e3, "",
            "Stiffness of the surface relative to its points; more for noisier scans");
  table.add("clearance", options.clearance, 0, 0.1, "m", "Gap kept from the body");
  table.add("dynamic", options.dynamic, 0.001, 1, "m",
            "Distance from the body-driven prediction beyond which cloth counts as hanging freely");
  table.add("atlas", describe(options.atlas));
  return table;
}

GarmentTemplate garment_template(const ClothedFrames& frames, std::uint8_t label,
                                 const std::string& name, const GarmentTemplateOptions& options) {
  if (frames.frame_ids.empty()) {
    throw DataError("", name, "no frame", "one that has a scan and a body");
  }
  const Overview all = overview_of(frames, label, options);
  require_seen(all, name);
  GarmentTemplate made;
  made.garment.name = name;
  made.frame_id = frames.frame_ids[static_cast<std::size_t>(all.best)];
  made.scores = all.take.scores;
  const ClothedFrame frame = frames.load(all.best);
  const TakenSurface taken = taken_surface(frames, frame, all, label, options);
  const TrimmedSurface& trimmed = taken.trimmed;
  if (trimmed.mesh.faces.rows() == 0) {
    throw DataError("", name,
                    "no surface through its label in frame " + std::to_string(made.frame_id),
                    "a frame that shows it; --template.frame takes another");
  }
  const GarmentBoundaries seen =
      garment_boundaries(trimmed.mesh.faces, frames.anatomy, frames.body_faces,
                         worn_poses(trimmed.mesh, frame.body, taken.followed));
  made.holes_closed = trimmed.holes_closed + static_cast<int>(seen.holes.size());
  made.garment.mesh =
      isotropic_remeshing(trimmed.mesh, {.edge_length = options.edge_length, .holes = seen.holes});
  made.pushed_out = push_out(made.garment.mesh, frame.body, frames.body_faces, options.clearance);
  // Parting may bring a vertex back to the body, pushing it out may cross again: the last counts.
  // Corners are widened before: what that crosses is parted too.
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    made.garment.mesh = cut_rim_folds(part_crossings(remove_slivers(made.garment.mesh)).mesh);
    Mesh& mesh = made.garment.mesh;
    mesh.vertices = turned_back(topology_of(mesh.faces, mesh.vertices.rows()), mesh.vertices);
    push_out(made.garment.mesh, frame.body, frames.body_faces, options.clearance);
  }
  const double area = face_areas(made.garment.mesh.vertices, made.garment.mesh.faces).sum();
  const double seen_area = face_areas(trimmed.mesh.vertices, trimmed.mesh.faces).sum() -
                           trimmed.area_closed - trimmed.area_made_up;
  made.area_carried = trimmed.area_carried;
  made.area_unseen = std::max(0.0, area - seen_area);
  if (made.area_unseen > kMaxUnseen * area) {
    throw DataError(
        "", name,
        of_area("%.0f%% of the surface unseen in all frames", 100 * made.area_unseen / area),
        "60% at most: cameras all round, or an imported template");
  }
  if (made.area_unseen > kMuchUnseen * area) {
    made.findings.push_back(
        {Severity::Warning, "much-unseen", name,
         of_area("%.0f%% of the surface is not seen in any frame and is a smooth guess",
                 100 * made.area_unseen / area),
         "look at the template in the report; more cameras, or a mesh of the garment with "
         "--import"});
  }
  const Mesh& mesh = made.garment.mesh;
  const std::vector<WornPose> poses = worn_poses(mesh, frame.body, taken.followed);
  const GarmentBoundaries boundaries =
      garment_boundaries(mesh.faces, frames.anatomy, frames.body_faces, poses);
  if (auto lost = lost_openings(name, trimmed.mesh.vertices, seen, boundaries,
                                closed_in_most(mesh.faces, frames, poses), options.edge_length)) {
    made.findings.push_back(std::move(*lost));
  }
  dress(made, boundaries, frames, all.rows, frame.body, label, options);
  made.beyond = median_beyond(taken.followed);
  if (!taken.followed.frames.empty()) {
    made.observed_rims = observed_rims(taken.followed, all.best, frames, label);
  }
  tell_whole(made);
  return made;
}

GarmentTemplate imported_template(const Mesh& mesh, const ClothedFrames& frames, std::uint8_t label,
                                  const std::string& name, const GarmentTemplateOptions& options,
                                  const std::string& file) {
  check_mesh(mesh, file);
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  const ManifoldDefects defects = manifold_defects(topology);
  const auto place = [&](int vertex) {
    char text[120];
    std::snprintf(text, sizeof text, "vertex %d at (%.3f, %.3f, %.3f)", vertex,
                  mesh.vertices(vertex, 0), mesh.vertices(vertex, 1), mesh.vertices(vertex, 2));
    return std::string(text);
  };
  if (mesh.faces.rows() == 0) {
    throw DataError(file, "faces", "none", "a surface");
  }
  if (!defects.non_manifold_edges.empty()) {
    throw DataError(
        file, place(topology.edges(defects.non_manifold_edges.front(), 0)),
        std::to_string(defects.non_manifold_edges.size()) + " edges with three faces or more",
        "a single layer: at most two faces at an edge");
  }
  if (!defects.non_manifold_vertices.empty()) {
    throw DataError(
        file, place(defects.non_manifold_vertices.front()),
        std::to_string(defects.non_manifold_vertices.size()) + " vertices where parts only touch",
        "parts that are joined along edges, or apart");
  }
  if (!defects.inconsistent_edges.empty()) {
    throw DataError(file, place(topology.edges(defects.inconsistent_edges.front(), 0)),
                    std::to_string(defects.inconsistent_edges.size()) +
                        " edges between faces of opposite orientation",
                    "faces that are all counter-clockwise from outside");
  }
  if (is_closed(topology)) {
    throw DataError(file, "boundary", "a closed surface", "openings that the body passes through");
  }
  if (const Components pieces = connected_components(topology); pieces.count > 1) {
    throw DataError(file, "pieces", std::to_string(pieces.count),
                    "one, sewn together, without loose vertices");
  }
  const Overview all = overview_of(frames, label, options);
  require_seen(all, name);
  const ClothedFrame frame = frames.load(all.best);
  const auto extent = [](const Points& points) {
    return (points.colwise().maxCoeff() - points.colwise().minCoeff()).norm();
  };
  const double ratio = extent(mesh.vertices) / extent(frame.body);
  if (ratio < 0.1 || ratio > 2) {
    throw DataError(file, "size", of_area("%.3g times the body's", ratio),
                    "a garment in metres (--imported.unit says another unit)");
  }
  if (const double middle =
          median_distance(build_tree(frame.body, frames.body_faces), mesh.vertices);
      middle > 0.3) {
    throw DataError(file, "place",
                    of_area("half its vertices farther than %.2f m from the body", middle),
                    "a garment placed on the body of frame " +
                        std::to_string(frames.frame_ids[static_cast<std::size_t>(all.best)]));
  }
  GarmentTemplate made;
  made.frame_id = frames.frame_ids[static_cast<std::size_t>(all.best)];
  made.scores = all.take.scores;
  if (auto far = far_from_scan(mesh, frame.scan, label, made.frame_id, file)) {
    made.findings.push_back(std::move(*far));
  }
  made.garment.name = name;
  made.garment.mesh = mesh;
  made.garment.mesh.colors.resize(0, 3);
  made.garment.mesh.labels.clear();
  made.garment.mesh.confidence.resize(0);
  if (looks_inwards(mesh, frame.body)) {
    turn_round(made.garment.mesh);
    made.findings.push_back({Severity::Note, "import-turned", file,
                             "its faces looked inwards, to the body: they were turned round",
                             "a mesh whose faces are counter-clockwise from outside"});
  }
  const GarmentBoundaries boundaries = garment_boundaries(
      mesh.vertices, made.garment.mesh.faces, frames.anatomy, frame.body, frames.body_faces, 0);
  dress(made, boundaries, frames, all.rows, frame.body, label, options);
  return made;
}

}  // namespace atelier
