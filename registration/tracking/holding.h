#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/types.h"

namespace atelier {

/// How the body holds a ring of a garment.
enum class HoldingKind {
  Band,  ///< goes round the body and carries the garment: waistband, elastic
  Rest,  ///< stays on its place by contact and friction: neckline, straps, tight cuffs
};

/// A ring of a garment's vertices by which the body holds it.
struct HeldRing {
  std::string garment = {};  ///< name of the garment
  std::string opening = {};  ///< name of the opening that the ring is at: "waist"
  HoldingKind kind = HoldingKind::Band;
  double rest_girth = 0;           ///< m, length of a band without tension; 0: no tension
  double stiffness = 0;            ///< N, tension of a band per unit of strain
  std::vector<int> vertices = {};  ///< of the garment, in order round the ring
  bool closed = true;              ///< false: the upper part of a longer edge, such as a robe's
  double girth = 0;                ///< m, length of the ring, median of the frames
  double body_girth = 0;           ///< m, of the body under it
  double gap = 0;                  ///< m from the skin, median of ring and frames
  double deviation = 0;            ///< m, of its position on the body (find_holding)
};

/// A garment registered over a take, and the body under it, each of one topology.
struct FollowedGarment {
  std::string name;
  const Triangles& faces;
  const std::vector<std::vector<int>>& boundaries;  ///< loops of boundary vertices
  const std::vector<std::string>& boundary_names;   ///< of each loop, or empty
  const Triangles& body_faces;
  Index frames = 0;
  std::function<Points(Index frame)> cloth;  ///< [V,3] m
  std::function<Points(Index frame)> body;   ///< [B,3] m
};

/// Thresholds of find_holding (our choice).
struct HoldingOptions {
  int frames = 40;           ///< at most, spread over the take
  double steady = 0.010;     ///< m, deviation of a ring that stays on its place
  double moving = 0.015;     ///< m, 90th percentile of the deviation in a take with enough motion
  double near = 0.030;       ///< m from the skin, of a steady ring
  double far = 0.080;        ///< m, of the highest ring where nothing else holds a garment
  double tight = 1.15;       ///< girth over the body's, of cuffs and elastics below the first
  double band_below = 0.08;  ///< m below an opening's edge where an elastic is looked for
  double pull = 0.95;        ///< rest girth of a band over the least girth of the body under it
  double areal_density = 0.25;  ///< kg/m2, of a garment whose weight its band has to hold
};

/// Finds the rings that hold a garment up, from its registered positions in every frame.
///
/// The position of a vertex on the body is given in the frame of a body triangle (foot point and
/// height above it); its deviation is the 80th percentile over frames of the distance from its
/// median position. Triangles are chosen in several frames, and the choice with the least
/// deviation counts, so that a hand at the hip in one of them does no harm. A ring is an opening's
/// loop, or one up to `band_below` beneath it where the loop itself is a frill. It encloses the
/// body if its centre is inside the body, which excludes a hem around both legs. Of a loop that is
/// 25 cm high or more, such as the edge of a robe or of a wrap skirt, the upper 8 cm count.
///
/// - If the 90th percentile of the vertices' deviations is `moving` or more, rings with deviations
///   below `steady` that stay within `near` of the skin are held. The highest of a garment that
///   does not hang from the shoulders is its band; others that are `tight`, such as cuffs, rest.
/// - A garment hangs from the shoulders if the skin under its upper 15 cm faces up. Its highest
///   opening then rests on the body, wherever it is, and is no band.
/// - Otherwise, if no ring was found, the highest ring that encloses the body within `far` of it is
///   the band, since without it the garment would have fallen. So a take without motion has one.
///
/// A band's rest girth is below the body's girth under it in all frames, so that it is always under
/// tension; at the girth that was seen its tension is three times what friction needs to carry the
/// garment's weight (2 pi mu T = m g, mu = 0.4), which determines its stiffness. All of this is our
/// choice; no capture shows the force of an elastic.
///
/// Returns nothing for a garment without openings. Deterministic. Throws LogicError without frames,
/// and where a frame is of another mesh.
std::vector<HeldRing> find_holding(const FollowedGarment& garment,
                                   const HoldingOptions& options = {});

}  // namespace atelier
