#pragma once

#include <optional>
#include <vector>

#include "bodymodel/formats/marker_clip.h"
#include "core/finding.h"

namespace atelier {

/// Names whose subject stands before another sign than a colon ("Ada_LASI", "Ben.LASI", "Ada LASI")
/// with a colon, as marker_subject reads them, and a finding ("motion-markers-names"): where six
/// and more names of a subject mean a place on a person behind it, and hardly any as they are.
/// Nothing where some name has a colon.
void name_subjects(MarkerClip& clip);

/// Markers that are told apart by where they are on the body.
struct PlacedMarkers {
  std::vector<int> columns;   ///< [M] of the clip
  std::vector<int> segments;  ///< [M] which of them are on one stiff part: the same number
  Points rest;                ///< [M,3] metres, of a person who looks along z, left along x
};

/// The warning of a clip (Y up) whose person looks backwards of what left and right say: of a
/// mirror image, or of names with their sides exchanged ("motion-mirrored"). What is ahead is told
/// by markers ahead and behind on one stiff part, toes and heels say; nothing where fewer than five
/// frames tell, or fewer than four fifths of them say so.
std::optional<Finding> mirrored_finding(const MarkerClip& clip, const PlacedMarkers& markers);

}  // namespace atelier
