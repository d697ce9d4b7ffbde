#include "registration/template/observed_rims.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/label.h"
#include "core/normals.h"
#include "core/topology.h"
#include "core/tree.h"
#include "registration/template/garment_boundaries.h"

namespace atelier {
namespace {

constexpr double kPast = 0.03;       // m past the rim
constexpr double kNear = 0.025;      // m from there
constexpr double kStandsOff = 0.04;  // m
constexpr double kArmReach = 0.10;   // m
constexpr double kEnough = 1.0 / 3;  // of the frames that say anything
constexpr std::ptrdiff_t kBareArmLumps = 2;

/// A place of a rim.
struct RimPlace {
  int vertex = 0;
  int before = 0;  // along the loop
  int after = 0;
  bool at_arm = false;  // of a cuff or an armhole
};

std::vector<RimPlace> rim_places(const GarmentBoundaries& boundaries) {
  std::vector<RimPlace> places;
  const auto add = [&](const std::vector<int>& loop, bool at_arm) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      places.push_back({loop[i], loop[(i + loop.size() - 1) % loop.size()],
                        loop[(i + 1) % loop.size()], at_arm});
    }
  };
  for (std::size_t b = 0; b < boundaries.loops.size(); ++b) {
    const std::string& name = boundaries.names[b];
    add(boundaries.loops[b], name.starts_with("cuff") || name.starts_with("armhole"));
  }
  for (const std::vector<int>& loop : boundaries.holes) {
    add(loop, false);
  }
  return places;
}

Points arms_of(const BodyAnatomy& anatomy, const Points& body) {
  std::vector<Index> rows;
  for (Index v = 0; v < body.rows(); ++v) {
    for (const Extremity hand : {Extremity::LeftHand, Extremity::RightHand}) {
      const std::vector<int>& limb = anatomy.limbs[static_cast<std::size_t>(hand)];
      if (std::find(limb.end() - kBareArmLumps, limb.end(),
                    anatomy.lumps[static_cast<std::size_t>(v)]) != limb.end()) {
        rows.push_back(v);
      }
    }
  }
  return body(rows, Eigen::all);
}

enum class Word : char { Nothing, Ends, GoesOn };

/// What one frame says of each place of the rims.
std::vector<Word> words_of(const std::vector<RimPlace>& places, const Mesh& placed,
                           const ClothedFrame& frame, const ClothedFrames& frames,
                           std::uint8_t label) {
  const Points normals = vertex_normals(placed.vertices, placed.faces);
  const TriangleTree scan = build_tree(frame.scan.vertices, frame.scan.faces);
  const TriangleTree body = build_tree(frame.body, frames.body_faces);
  const TriangleTree arms = build_point_tree(arms_of(frames.anatomy, frame.body));
  std::vector<Word> words;
  for (const RimPlace& place : places) {
    const Eigen::Vector3d along =
        (placed.vertices.row(place.after) - placed.vertices.row(place.before)).transpose();
    // The loop runs with the surface on its left.
    const Eigen::Vector3d out = along.cross(normals.row(place.vertex).transpose());
    Word word = Word::Nothing;
    if (!out.isZero()) {
      const Eigen::Vector3d past =
          placed.vertices.row(place.vertex).transpose() + kPast * out.normalized();
      const ClosestPoint hit = closest_point(scan, past, kNear);
      if (hit.face < 0) {
        word = closest_point(arms, past, kArmReach).face < 0 ? Word::Ends : Word::Nothing;
      } else {
        Index corner = 0;
        hit.barycentric.maxCoeff(&corner);
        const int vertex = frame.scan.faces(hit.face, corner);
        const std::uint8_t there = frame.scan.labels[static_cast<std::size_t>(vertex)];
        const bool seen = frame.scan.confidence.size() == 0 || frame.scan.confidence[vertex] > 0;
        const bool bare = there == static_cast<std::uint8_t>(Label::Skin) ||
                          there == static_cast<std::uint8_t>(Label::Background) ||
                          there == static_cast<std::uint8_t>(Label::Unknown);
        if (!seen || closest_point(arms, hit.point, kStandsOff).face >= 0) {
          word = Word::Nothing;
        } else if (there == label ||
                   (bare && closest_point(body, hit.point, kStandsOff).face < 0)) {
          word = Word::GoesOn;
        } else {
          word = Word::Ends;
        }
      }
    }
    words.push_back(word);
  }
  return words;
}

}  // namespace

double observed_rims(const FollowedSurface& followed, Index home, const ClothedFrames& frames,
                     std::uint8_t label) {
  const Mesh& mesh = followed.mesh;
  const std::vector<RimPlace> places = rim_places(garment_boundaries(
      mesh.vertices, mesh.faces, frames.anatomy, frames.load(home).body, frames.body_faces));
  if (places.empty()) {
    return 1;
  }
  std::vector<double> ends(places.size(), 0);
  std::vector<double> said(places.size(), 0);
  Mesh placed = followed.mesh;
  const auto ask = [&](const Points& vertices, Index row) {
    placed.vertices = vertices;
    const std::vector<Word> words = words_of(places, placed, frames.load(row), frames, label);
    for (std::size_t i = 0; i < words.size(); ++i) {
      ends[i] += words[i] == Word::Ends ? 1 : 0;
      said[i] += words[i] == Word::Nothing ? 0 : 1;
    }
  };
  ask(followed.mesh.vertices, home);
  for (const FollowedSurface::Frame& frame : followed.frames) {
    ask(frame.vertices, frame.row);
  }
  double told = 0;
  double sum = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double length =
        (followed.mesh.vertices.row(places[i].after) - followed.mesh.vertices.row(places[i].before))
            .norm() /
        2;
    sum += length;
    told += places[i].at_arm || (said[i] > 0 && ends[i] >= kEnough * said[i]) ? length : 0;
  }
  return told / std::max(sum, 1e-9);
}

}  // namespace atelier
