#include "registration/template/frame_scores.h"

#include <algorithm>
#include <cstdio>

#include "core/error.h"
#include "core/normals.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr double kFacingLimb = 0.05;      // m
constexpr double kAtHands = 0.08;         // m
constexpr double kFoldGap = 0.025;        // m across a fold that is open, which scans do not fill
constexpr double kOffSurface = 0.004;     // m: less is the curvature of the surface itself
constexpr double kHandsWeight = 1.0 / 3;  // what they hide other frames show
constexpr double kSlideWeight = 0.02;     // of a frame that follows: what slides adds up
constexpr Index kMaxFollow = 24;          // frames, as in a window
constexpr std::ptrdiff_t kBareArm = 2;    // last lumps of an arm: forearm, hand

/// Faces all of whose corners have the label and were seen.
Triangles faces_of(const Mesh& scan, std::uint8_t label) {
  std::vector<Index> rows;
  for (Index f = 0; f < scan.faces.rows(); ++f) {
    bool all = true;
    for (int k = 0; k < 3; ++k) {
      const int v = scan.faces(f, k);
      all = all && scan.labels[static_cast<std::size_t>(v)] == label &&
            (scan.confidence.size() == 0 || scan.confidence[v] > 0);
    }
    if (all) {
      rows.push_back(f);
    }
  }
  return scan.faces(rows, Eigen::all);
}

/// Share of the covered vertices of a body before which there is another limb.
double facing_share(const Points& body, const Triangles& faces, const Eigen::VectorXd& covered) {
  const Points normals = vertex_normals(body, faces);
  std::vector<Ray> rays;
  for (Index v = 0; v < body.rows(); ++v) {
    if (covered[v] > 0 && normals.row(v).squaredNorm() > 0.5) {
      rays.push_back({body.row(v).transpose(), normals.row(v).transpose(), 0.005, kFacingLimb});
    }
  }
  if (rays.empty()) {
    return 1;
  }
  double count = 0;
  for (const char hit : any_hits(build_tree(body, faces), rays)) {
    count += hit;
  }
  return count / static_cast<double>(rays.size());
}

/// Hands, and forearms but where the garment is seen to cover them.
Points bare_arms(const BodyAnatomy& anatomy, const Points& body, const GarmentVotes& votes) {
  std::vector<Index> rows;
  for (Index v = 0; v < body.rows(); ++v) {
    for (const Extremity hand : {Extremity::LeftHand, Extremity::RightHand}) {
      const std::vector<int>& limb = anatomy.limbs[static_cast<std::size_t>(hand)];
      const int lump = anatomy.lumps[static_cast<std::size_t>(v)];
      const auto arm = std::find(limb.end() - kBareArm, limb.end(), lump);
      if (arm != limb.end() && (arm + 1 == limb.end() || votes.covered[v] == 0)) {
        rows.push_back(v);
      }
    }
  }
  return body(rows, Eigen::all);
}

FrameScore looked_at(const ClothedFrame& frame, const ClothedFrames& frames, std::uint8_t label,
                     const GarmentVotes& votes) {
  FrameScore score;
  const Triangles faces = faces_of(frame.scan, label);
  const Eigen::VectorXd areas = face_areas(frame.scan.vertices, faces);
  score.shown = areas.sum();
  score.facing = facing_share(frame.body, frames.body_faces, votes.covered);
  if (faces.rows() == 0) {
    return score;
  }
  Points middles(faces.rows(), 3);
  for (Index f = 0; f < faces.rows(); ++f) {
    middles.row(f) = (frame.scan.vertices.row(faces(f, 0)) + frame.scan.vertices.row(faces(f, 1)) +
                      frame.scan.vertices.row(faces(f, 2))) /
                     3;
  }
  const Points normals = face_normals(frame.scan.vertices, faces);
  std::vector<Ray> outwards;
  std::vector<double> weights;
  for (Index f = 0; f < faces.rows(); ++f) {
    if (normals.row(f).squaredNorm() > 0.5) {
      outwards.push_back(
          {middles.row(f).transpose(), normals.row(f).transpose(), kOffSurface, kFoldGap});
      weights.push_back(areas[f]);
    }
  }
  const std::vector<char> folded = any_hits(build_tree(frame.scan.vertices, faces), outwards);
  for (std::size_t i = 0; i < folded.size(); ++i) {
    score.folded += folded[i] != 0 ? weights[i] : 0;
  }
  const Points arms = bare_arms(frames.anatomy, frame.body, votes);
  const std::vector<ClosestPoint> hands = closest_points(build_point_tree(arms), middles, kAtHands);
  for (Index f = 0; f < faces.rows(); ++f) {
    score.at_hands += hands[static_cast<std::size_t>(f)].face >= 0 ? areas[f] : 0;
  }
  score.folded /= score.shown;
  score.at_hands /= score.shown;
  return score;
}

}  // namespace

TakeOverview take_overview(const ClothedFrames& frames, const std::vector<Index>& rows,
                           std::uint8_t label) {
  TakeOverview take;
  GarmentVotes votes;
  for (const Index row : rows) {
    const ClothedFrame frame = frames.load(row);
    check_anatomy(frames.anatomy, frame.body.rows());
    const GarmentVotes own = garment_votes(frame.scan, label, frame.body, frames.body_faces);
    add_votes(votes, own);
    FrameScore score = looked_at(frame, frames, label, own);
    score.row = row;
    take.area = std::max(take.area, score.shown);
    take.scores.push_back(score);
    if (row == rows.back()) {
      take.cover = garment_cover(votes, frame.body, frames.body_faces);
    }
  }
  const Index last = static_cast<Index>(frames.frame_ids.size()) - 1;
  for (FrameScore& score : take.scores) {
    score.shown /= std::max(take.area, 1e-9);
    score.follow = static_cast<double>(std::min(kMaxFollow, std::max(score.row, last - score.row)));
    score.score = score.shown - kHandsWeight * score.at_hands - score.folded - score.facing -
                  kSlideWeight * score.follow;
  }
  return take;
}

const FrameScore& best_of(const std::vector<FrameScore>& scores) {
  ATELIER_CHECK(!scores.empty(), "a frame");
  return *std::max_element(
      scores.begin(), scores.end(),
      [](const FrameScore& a, const FrameScore& b) { return a.score < b.score; });
}

std::string score_text(const FrameScore& score, const std::vector<FrameScore>& all) {
  const auto [low, high] = std::minmax_element(
      all.begin(), all.end(),
      [](const FrameScore& a, const FrameScore& b) { return a.score < b.score; });
  char text[200];
  std::snprintf(text, sizeof text,
                "%.0f%% of the most that a frame shows, %.0f%% at hands, %.0f%% in folds; score "
                "%.2f, of all frames %.2f to %.2f",
                100 * score.shown, 100 * score.at_hands, 100 * score.folded, score.score,
                low->score, high->score);
  return text;
}

}  // namespace atelier
