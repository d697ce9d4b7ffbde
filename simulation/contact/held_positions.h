#pragma once

#include <vector>

#include "core/garment.h"

namespace atelier {

/// A band by which the body holds cloth.
struct ClothBand {
  std::vector<int> vertices;  ///< in order along the band, each with an attachment
  std::vector<double> rest;   ///< m, of the cloth from each of them to the next, the first again
  bool closed = true;         ///< the last is next to the first
  double rest_girth = 0;      ///< m, its length without tension; 0: it does not pull
  double stiffness = 0;       ///< N, tension per unit of strain
};

/// The part of a cloth of `vertices` vertices that a body holds: boundary values of each frame.
struct HeldCloth {
  Index vertices = 0;
  std::vector<Attachment> attachments;
  std::vector<ClothBand> bands;
  double thickness = 0;  ///< m, that cloth is thick
};

/// A band whose cloth is as long from vertex to vertex as at rest. Throws LogicError for fewer than
/// two vertices and one that there is not.
/// @param rest        [V,3] m, the rest shape in space
/// @param rest_girth  m, without tension; 0: it does not pull
/// @param stiffness   N, tension per unit of strain
ClothBand make_band(const Points& rest, std::vector<int> vertices, bool closed, double rest_girth,
                    double stiffness);

/// Where a body holds the attached vertices, [V,3] m, as Control::pin_targets takes them; rows of
/// other vertices are 0.
///
/// A vertex in no band is at its attachment. Those of a band are where three things balance, a
/// function of the body alone, so that a run goes on from any frame with the same bits:
///
/// - tension along the band where it is longer than its rest girth (a spring between neighbours, of
///   `stiffness` over its share of the girth), which draws it onto the skin;
/// - the hold of each vertex's place: 25 kN/m2 along the skin, as friction, and 1 kN/m2 off it, per
///   metre of band (our choice: a tenth of a newton moves a centimetre of band by less than half a
///   millimetre along the skin);
/// - the body: no vertex comes nearer to the plane of its triangle than the cloth has to keep
///   (contact_distance), or than its attachment is if that is less.
///
/// Places that part or close up by more than 15% of the cloth's length between them do not take the
/// cloth with them: it slides. Solved by block Gauss-Seidel. Throws LogicError for an attachment to
/// a triangle that the body does not have.
/// @param body  [N,3] m
Points held_positions(const HeldCloth& held, const Points& body, const Triangles& body_faces);

}  // namespace atelier
