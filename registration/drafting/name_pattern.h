#pragma once

#include "registration/drafting/draft_pattern.h"

namespace atelier {

/// Names openings, panels and seams in the words of the craft, by where they lie on a wearer who
/// stands upright and looks to `facing` (a horizontal unit vector).
///
/// Openings in the middle are the neck or the waist, the highest one, and the hem, the lowest;
/// those in pairs left and right are the hems of legs where nothing lies below, else cuffs. A panel
/// is a sleeve if it ends at a cuff and at no hem, a band (collar, waistband, cuff) if it is lower
/// than 9 cm and borders such an opening, else front, back or side as its mean normal looks, or
/// body where it goes round. Alike ones are told apart by left and right, upper and lower, or
/// numbers. Seams follow from the panels: shoulder, side, inseam, centre front, armhole, underarm,
/// waist, neck, dart. Names are unique. Our choice.
PatternNames name_pattern(const FlatPattern& pattern, const Mesh& mesh,
                          const Eigen::Vector3d& facing);

/// Panels in the order of the craft: front, back, side, sleeve, collar, waistband, cuff, others;
/// left before right.
SewingPattern in_craft_order(const SewingPattern& pattern);

}  // namespace atelier
