#pragma once

#include <string>
#include <vector>

#include "bodymodel/underlying/body_certificate.h"
#include "bodymodel/underlying/body_cover.h"
#include "bodymodel/underlying/clothed_scan.h"
#include "core/finding.h"
#include "core/options.h"

namespace atelier {

/// The body under the clothes of one frame (Zhang et al., "Detailed, accurate, human shape
/// estimation from clothed 3D scan sequences", CVPR 2017; Xiang et al. 2021; the supplement of
/// "Dressing Avatars"): the posed personal body, deformed per vertex so that it
///  - fits visible skin, by point-to-plane correspondences in both directions;
///  - stays inside the clothes: quadratic where it lies outside, saturating where cloth is far;
///  - lies just inside tight cloth (body_cover.h), but not loose cloth;
///  - keeps the shape of the personal body, as rigidly as possible, so that unseen regions follow
///    the observed ones around them. That shape includes the offsets of the neighbouring frames.

struct UnderlyingBodyOptions {
  int iterations = 6;  ///< of ICP: correspondences, then a solve, 1..100
  CoverSign sign = CoverSign::Winding;
  bool coupling = true;           ///< as-rigid-as-possible term; off only for comparison
  bool temporal = true;           ///< keep the shape of the neighbouring frames
  double coupling_length = 0.05;  ///< m, length over which skin follows data, not its neighbours
  double anchor_weight = 0.02;    ///< of the personal body's own position, relative to data's 1
  double skin_weight = 1;         ///< of visible skin
  double skin_reach = 0.03;       ///< m, maximum distance of correspondences of skin
  double skin_scale = 0.01;       ///< m, scale of the robust loss of skin
  double cover_reach = 0.04;      ///< m, maximum depth outside of clothes that is corrected
  double outside_weight = 10;     ///< of skin outside of clothes
  double gap = 0;                 ///< m, distance of cloth from skin: half its thickness, and nap
  double tight_weight = 0.5;      ///< of skin under tight cloth
  double tight_scale = 0.006;     ///< m, much larger gaps no longer attract
  double temporal_weight = 1;     ///< share of `KnownOffsets::usual` in the shape that is kept
};
OptionTable describe(UnderlyingBodyOptions& options);

/// Prior knowledge of a frame's offsets from the personal body, in its surface frames
/// (surface_frames.h), metres. Each is [V,3] or has no rows.
struct KnownOffsets {
  Points usual;  ///< mean of the neighbouring frames: the shape to keep
  Points start;  ///< initial values: the frame's own from an earlier fit
};

struct UnderlyingBody {
  Points vertices;          ///< [V,3] metres
  Points offsets;           ///< [V,3] metres from the personal body, in its surface frames
  Eigen::VectorXd support;  ///< [V] in [0,1], support by the scan: 1 visible skin, 0 none
  BodyCertificate certificate;
  std::vector<Finding> findings;  ///< no scan, half of it missing, no skin, far from the body
  bool trusted = true;            ///< false: the result is mostly the personal body
};

/// Findings that follow from a certificate: "no-scan", "little-seen" (less than half of the body),
/// "no-skin" (nothing is labelled as skin).
std::vector<Finding> underlying_findings(const ScanSurface& scan,
                                         const BodyCertificate& certificate);

/// Fits one frame. Throws LogicError for sizes that do not agree. Results do not depend on the
/// number of threads.
/// @param faces    of the body, closed
/// @param posed    [V,3] the personal body in the frame's pose, metres
/// @param scan     of the frame; empty: returns the personal body with its usual offsets
/// @param cover    of all frames together, or of this one alone
UnderlyingBody underlying_body(const Triangles& faces, const Points& posed, const ScanSurface& scan,
                               const BodyCover& cover, const KnownOffsets& known = {},
                               const UnderlyingBodyOptions& options = {});

}  // namespace atelier
