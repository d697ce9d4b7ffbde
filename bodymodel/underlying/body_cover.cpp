#include "bodymodel/underlying/body_cover.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"
#include "core/topology.h"

namespace atelier {
namespace {

constexpr double kSameWay = 0.5;     // cosine between skin and scan
constexpr double kVoteReach = 0.02;  // m, at which a vote counts 1/e
constexpr double kFarVote = 0.2;     // of cloth that is looked at from afar

/// Mean of each vertex and its neighbours, so often.
Eigen::VectorXd smoothed(const Adjacency& neighbors, Eigen::VectorXd values, int rounds) {
  for (int round = 0; round < rounds; ++round) {
    Eigen::VectorXd next = values;
    for (Index v = 0; v < values.size(); ++v) {
      for (const int n : neighbors[v]) {
        next[v] += values[n];
      }
      next[v] /= static_cast<double>(neighbors[v].size() + 1);
    }
    values = std::move(next);
  }
  return values;
}

double faded(double distance, double reach) {
  return std::exp(-distance * distance / (reach * reach));
}

}  // namespace

CoverVotes cover_votes(const Triangles& faces, const Points& posed, const ScanSurface& scan,
                       const CoverOptions& options) {
  const Index count = posed.rows();
  CoverVotes votes{Eigen::VectorXd::Zero(count), Eigen::VectorXd::Zero(count),
                   Eigen::VectorXd::Zero(count), Eigen::VectorXd::Zero(count),
                   Eigen::VectorXd::Zero(kGapCells)};
  Eigen::VectorXi cells = Eigen::VectorXi::Constant(count, -1);
  const Points normals = vertex_normals(posed, faces);
  parallel_for(count, 256, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) {
      const Eigen::Vector3d x = posed.row(v).transpose();
      const Eigen::Vector3d n = normals.row(v).transpose();
      auto skin = nearest_point(scan, scan.skin, x, options.reach);
      const auto cover = cover_gap(scan, x, n, options.reach, CoverSign::Winding);
      if (skin && (skin->border || skin->normal.dot(n) < kSameWay)) {
        skin.reset();
      }
      if (skin && (!cover || skin->distance < std::abs(cover->gap))) {
        votes.bare[v] = faded(skin->distance, kVoteReach);
      } else if (cover) {
        votes.covered[v] = std::max(faded(cover->gap, kVoteReach), kFarVote);
        if (cover->role == ScanRole::Cloth) {
          votes.close[v] = votes.covered[v];
          votes.tightness[v] = votes.close[v] * faded(cover->gap, options.tight_gap);
          cells[v] = saturating_cast<int>(std::floor((cover->gap - kFirstGap) / kGapCell));
        }
      } else if (looks_at_cover(scan, x, n, options.loose)) {
        votes.covered[v] = kFarVote;
      }
    }
  });
  const Eigen::VectorXd areas = vertex_areas(posed, faces);
  for (Index v = 0; v < count; ++v) {
    if (cells[v] >= 0 && cells[v] < kGapCells) {
      votes.gaps[cells[v]] += areas[v];
    }
  }
  return votes;
}

/// The middle of the cell with most skin about it; 0 where there is no cloth.
double most_frequent_gap(const Eigen::VectorXd& gaps) {
  constexpr double kSpread = 0.002;  // m, about the noise of poses and scans
  double best = 0;
  double most = 0;
  for (int i = 0; i < kGapCells; ++i) {
    double sum = 0;
    for (int j = 0; j < kGapCells; ++j) {
      sum += gaps[j] * faded((i - j) * kGapCell, kSpread);
    }
    if (sum > most) {
      most = sum;
      best = kFirstGap + (i + 0.5) * kGapCell;
    }
  }
  return std::clamp(best, 0.0005, 0.01);
}

CoverVotes operator+(const CoverVotes& a, const CoverVotes& b) {
  ATELIER_CHECK(a.bare.size() == b.bare.size(), "votes of two different bodies");
  return {a.bare + b.bare, a.covered + b.covered, a.close + b.close, a.tightness + b.tightness,
          a.gaps + b.gaps};
}

BodyCover body_cover(const Triangles& faces, const CoverVotes& votes, const CoverOptions& options) {
  const Index count = votes.bare.size();
  const Adjacency neighbors = vertex_neighbors(topology_of(faces, count));
  const Eigen::VectorXd bare = smoothed(neighbors, votes.bare, options.smoothing);
  const Eigen::VectorXd covered = smoothed(neighbors, votes.covered, options.smoothing);
  const Eigen::VectorXd close = smoothed(neighbors, votes.close, options.smoothing);
  const Eigen::VectorXd tightness = smoothed(neighbors, votes.tightness, options.smoothing);
  BodyCover cover{Eigen::VectorXd::Zero(count), Eigen::VectorXd::Zero(count),
                  most_frequent_gap(votes.gaps)};
  for (Index v = 0; v < count; ++v) {
    const double all = bare[v] + covered[v];
    if (all > 0) {
      // Sharper than the share of votes: a border is one ring wide, not as wide as the smoothing.
      cover.covered[v] = std::clamp((covered[v] / all - 0.3) / 0.4, 0.0, 1.0);
    }
    if (close[v] > 0) {
      cover.tightness[v] = std::clamp(tightness[v] / close[v], 0.0, 1.0);
    }
  }
  return cover;
}

}  // namespace atelier
