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
/// "Dressing Avatars"): the posed personal body, vertex by vertex moved so that it
///  - lies on skin that is seen, both ways, point to plane;
///  - stays inside of clothes: steep where it pokes out, saturating where cloth is far;
///  - lies just inside of cloth where that is tight (body_cover.h), and nowhere else;
///  - keeps the shape of the personal body, as rigid as possible, so that where nothing is seen
///  what
///    is known around it is carried inwards;
///  - that shape being the personal body's with the offsets which it has in the frames around.

struct UnderlyingBodyOptions {
  int iterations = 6;  ///< rounds of looking for ICP correspondences and solving, 1..100
  CoverSign sign = CoverSign::Winding;
  bool coupling = true;           ///< keep the personal body's edges; off only for comparison
  bool temporal = true;           ///< keep the shape that the frames around have
  double coupling_length = 0.05;  ///< m, over which skin follows data rather than its neighbours
  double anchor_weight = 0.02;    ///< of the personal body's own place against data's 1
  double skin_weight = 1;         ///< of skin that is seen
  double skin_reach = 0.03;       ///< m, farther points are not the same skin
  double skin_scale = 0.01;       ///< m, at which skin points are taken for outliers
  double cover_reach = 0.04;      ///< m, deepest poke through clothes that is mended
  double outside_weight = 10;     ///< of skin outside of clothes
  double gap = 0;                 ///< m that cloth keeps from skin: half its thickness and its nap
  double tight_weight = 0.5;      ///< of skin under tight cloth
  double tight_scale = 0.006;     ///< m, gaps much larger no longer attract
  double temporal_weight = 1;     ///< share of the frames' usual offsets in the shape that is kept
};
OptionTable describe(UnderlyingBodyOptions& options);

/// What is known of a frame's offsets from the personal body before it is fitted, in its surface
/// frames (surface_frames.h), metres. Each is [V,3] or has no rows.
struct KnownOffsets {
  Points usual;  ///< those of the frames around: the shape to keep
  Points start;  ///< where to begin: the frame's own from an earlier fit
};

struct UnderlyingBody {
  Points vertices;  ///< [V,3] metres
  Points offsets;   ///< [V,3] metres from the personal body, in its surface frames
  Eigen::VectorXd
      support;  ///< [V] in [0,1], how much the scan says of each: 1 seen skin, 0 nothing
  BodyCertificate certificate;
  std::vector<Finding> findings;  ///< no scan, half of it missing, no skin, far from the body
  bool trusted = true;            ///< false: the frame is mostly what the personal body says
};

/// What a certificate leaves to be said: "no-scan", "little-seen" (less than half of the body),
/// "no-skin" (nothing is labelled so).
std::vector<Finding> underlying_findings(const ScanSurface& scan,
                                         const BodyCertificate& certificate);

/// @param faces    of the body, closed
/// @param posed    [V,3] the personal body in the frame's pose, metres
/// @param scan     of the frame; empty: the personal body comes back, with its usual offsets
/// @param cover    of all frames together, or of this one alone
/// Throws LogicError for sizes that do not agree. Same bits on any number of threads.
UnderlyingBody underlying_body(const Triangles& faces, const Points& posed, const ScanSurface& scan,
                               const BodyCover& cover, const KnownOffsets& known = {},
                               const UnderlyingBodyOptions& options = {});

}  // namespace atelier
