#pragma once

#include <vector>

#include "bodymodel/underlying/clothed_scan.h"

namespace atelier {

/// Which parts of a body are under something, and where that is tight: what single frames cannot
/// tell (a palm beside a skirt is outside of it, a thigh is under it), all frames together can. Our
/// choice; ClothCap (Pons-Moll et al. 2017) and Xiang et al. 2021 segment by hand or network.

struct CoverOptions {
  double reach = 0.10;       ///< m, scans farther than this from the body say nothing
  double loose = 0.4;        ///< m, how far off a skirt may be to cover the leg that looks at it
  double tight_gap = 0.008;  ///< m, a gap that still counts as tight, to 1/e
  int smoothing = 3;         ///< rounds of averaging over neighbours
};

/// Gaps between skin and cloth are counted in cells of half a millimetre from -2 cm to 3 cm.
inline constexpr int kGapCells = 100;
inline constexpr double kGapCell = 0.0005;
inline constexpr double kFirstGap = -0.02;

/// Observations of every vertex; votes of several frames are added.
struct CoverVotes {
  Eigen::VectorXd bare;       ///< [V] for skin that is seen
  Eigen::VectorXd covered;    ///< [V] for being under something
  Eigen::VectorXd close;      ///< [V] of `covered`, of cloth near by
  Eigen::VectorXd tightness;  ///< [V] sum over `close` of how tight it was, each in [0,1]
  Eigen::VectorXd gaps;       ///< [kGapCells] area of skin with each gap to cloth, m2
};

/// Votes of one frame: skin or cloth, whichever is nearer and looks the same way; where neither is
/// near, cloth that the vertex looks at from inside. Throws LogicError unless faces fit vertices.
CoverVotes cover_votes(const Triangles& faces, const Points& posed, const ScanSurface& scan,
                       const CoverOptions& options = {});

/// Sum of two. Throws LogicError if they are of different bodies.
CoverVotes operator+(const CoverVotes& a, const CoverVotes& b);

/// The verdict.
struct BodyCover {
  Eigen::VectorXd covered;    ///< [V] in [0,1]; 0: bare, or never seen
  Eigen::VectorXd tightness;  ///< [V] in [0,1]; 1: cloth lies on it in all frames
  double gap = 0;  ///< m that cloth keeps from skin where it lies on it: the most frequent
};

BodyCover body_cover(const Triangles& faces, const CoverVotes& votes,
                     const CoverOptions& options = {});

}  // namespace atelier
