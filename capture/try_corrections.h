#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "capture/triangulation.h"
#include "core/finding.h"

namespace atelier {

/// Opens a capture again with other corrections than it was opened with: by option, as
/// Dataset::corrections. Throws where they go with nothing.
using Reopen = std::function<Dataset(const std::map<std::string, std::string>& corrections)>;

/// A capture without those of its corrections that make it worse, before anything else is blamed:
/// each is taken away by itself, and stays away where cameras and detections then surely fit
/// better, or fewer errors are found in the calibration. Each is an error "correction-wrong" among
/// the findings, which says what to leave out, or which other turn fits; one that changes nothing
/// stays, with a warning "correction-idle". Cost: opens the capture
/// and reads detections of some frames for each correction; nothing where there are none.
Dataset without_wrong_corrections(Dataset dataset, const Reopen& reopen,
                                  const TriangulationOptions& options = {});

/// Findings whose settings are advice to be followed at once: all corrections that they advise,
/// beside those that are set, are tried together. Where the capture cannot be opened so, or cameras
/// and detections then surely fit worse, they are taken one after the other, and what does not go
/// with those before keeps its words and loses its setting. Cost: opens the capture once, in the
/// second case once for each setting more.
std::vector<Finding> with_advice_that_joins(std::vector<Finding> findings, const Dataset& dataset,
                                            const Reopen& reopen,
                                            const TriangulationOptions& options = {});

}  // namespace atelier
