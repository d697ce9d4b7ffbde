#pragma once

#include <vector>

#include "bodymodel/tracking/scan_match.h"

namespace atelier {

/// How far a scan bears out a posed body where nothing else says that the pose is right: the body
/// by limbs, so that an arm in the wrong place is not outweighed by a trunk in the right one, and
/// the scan by what of it the body leaves over (our choice).
struct ScanAgreement {
  std::vector<int> loose;  ///< joints whose part of the surface lies where no scan is, or of which
                           ///< nothing can be said (an end of a limb under clothing left out)
  double off = 0;          ///< share of the judged scan that lies off the body, [0, 1]
  double apart = 0;        ///< m, rms distance of what is loose and of what is off
  bool holds = false;      ///< nothing is loose, and at most 3% is off
};

/// Judges a frame's pose by its scan. Skin lies within 3 cm of the body, clothing within 10 cm;
/// clothing over `region` ([V] or none) and what is ignored or left out does not count, nor does
/// the body under it: in `region`, or behind points that are left out, unless it is near what
/// counts. Parts are those of sought joints, with at least 1% of the surface; of each half of what
/// is judged must be near the scan, for cameras do not see all. A part of which less than a quarter
/// is judged is where it must be if one further out is: a thigh by its foot. `areas` [V] m2, of the
/// body at rest. Throws LogicError on sizes that do not agree. O(V log N), of some thousand points.
ScanAgreement scan_agreement(const FittedPerson& person, const BodySurface& surface,
                             const Eigen::VectorXd& areas, const ScanPoints& scan,
                             const std::vector<char>& region);

}  // namespace atelier
