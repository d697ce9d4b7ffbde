#pragma once

#include <string>
#include <vector>

#include "capture/dataset.h"

namespace atelier {

/// Captures of one rig, each of one sequence, as one: that of part i is of `kinds[i]` ("clothed" or
/// "minimal") and called so, with a number from the second of a kind on. Frame numbers go on: those
/// of a part that would meet an earlier one's are raised beyond them, which a finding says. Cameras
/// are the first's; a part without calibration has theirs. What one part holds out stays held out,
/// and consent is all parts'.
///
/// Throws UsageError for other kinds or another number of them, and DataError for parts of several
/// sequences or none, of other cameras, of a calibration that is off by more than rounding (1e-6 of
/// focal length and place: then it is not one rig, or it was calibrated again), and of another
/// layout, keypoint schema, label taxonomy or subject.
Dataset join_datasets(const std::vector<Dataset>& parts, const std::vector<std::string>& kinds);

/// Whether two captures have the same images: one folder by two names, or a copy. Of each camera
/// the first, middle and last image are compared.
bool same_images(const Dataset& a, const Dataset& b);

}  // namespace atelier
