#pragma once

#include <string>

#include "capture/dataset.h"

namespace atelier {

/// The capture with the cameras of a calibration (cameras.json), by name; those it does not have
/// are left out, which is a finding. Throws DataError for a file that is none, has no camera of the
/// capture, or is of images of another size.
Dataset with_cameras(Dataset dataset, const std::string& file);

}  // namespace atelier
