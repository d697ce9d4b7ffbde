#pragma once

#include <vector>

#include "simulation/cloth/cloth.h"

namespace atelier {

/// A band of a cloth's vertices, with the lengths that the cloth has along it at rest.
/// Throws LogicError for fewer than two vertices and one that the cloth does not have.
/// @param rest_girth  m, without tension; 0: it does not pull
/// @param stiffness   N, tension per unit of strain
ClothBand make_band(const Cloth& cloth, std::vector<int> vertices, bool closed, double rest_girth,
                    double stiffness);

/// Where a body holds the attached vertices, [A,3] m in the order of the attachments.
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
Points held_positions(const Cloth& cloth, const Points& body, const Triangles& body_faces);

}  // namespace atelier
