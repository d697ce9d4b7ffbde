#pragma once

#include <string>
#include <vector>

#include "core/mesh.h"
#include "registration/template/body_anatomy.h"

namespace atelier {

/// Closed loops of boundary vertices and what they are.
struct GarmentBoundaries {
  std::vector<std::vector<int>> loops;  ///< openings, in the order of `names`
  std::vector<std::string> names;       ///< neck, cuff left, armhole right, waist, hem, ankle left
  std::vector<std::vector<int>> holes;  ///< the body does not pass through these
};

/// A garment and its body at one instant.
struct WornPose {
  Points vertices;  ///< [V,3] m, of the garment
  Points body;      ///< [B,3] m
};

/// Tells openings from holes and names them: an opening is a loop that a limb's axis (limb_axis)
/// passes through, from the pelvis to head, hands and feet. The body part beyond the opening names
/// it:
///
///   a hand             "cuff left" ("armhole left" where the loop is not on the arm itself)
///   a foot             "ankle left"
///   both feet          "hem", whether hands hang through it or not
///   the head           "neck", or "waist" where the trunk passes before the arms branch off, or
///                      both hands lie beyond
///   head and feet      "free edge": neck, front and hem in one, as of an open robe
///
/// Where the pelvis lies beyond, as for a short top, head and hands behind the loop make it the
/// hem, feet the waist. Any other combination is "opening". Names that come twice are numbered,
/// "ankle left 2", the longest loop first. Of loops that no axis passes through, those up to
/// `max_hole` metres round are holes; longer ones are "opening".
///
/// Each loop is what most of `poses` say that it is, the first of equals: an arm that hangs in
/// front of a torn rim passes through it in some of them, not in most.
///
/// Throws LogicError as check_anatomy, and for no pose.
GarmentBoundaries garment_boundaries(const Triangles& faces, const BodyAnatomy& anatomy,
                                     const Triangles& body_faces,
                                     const std::vector<WornPose>& poses, double largest_hole = 1.0);

/// The same of one pose.
GarmentBoundaries garment_boundaries(const Points& vertices, const Triangles& faces,
                                     const BodyAnatomy& anatomy, const Points& body,
                                     const Triangles& body_faces, double largest_hole = 1.0);

/// Limbs that a garment closes over, as "left hand": the line through them (limb_axis) leaves it
/// through cloth where it should through an opening. Nothing where it comes back in.
///
/// Throws LogicError as check_anatomy.
std::vector<std::string> limbs_closed_over(const Points& vertices, const Triangles& faces,
                                           const BodyAnatomy& anatomy, const Points& body,
                                           const Triangles& body_faces);

}  // namespace atelier
