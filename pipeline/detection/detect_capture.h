#pragma once

#include <filesystem>
#include <string>

#include "capture/dataset.h"
#include "capture/detection/detect.h"
#include "capture/people/detect_people.h"
#include "capture/people/person_mask.h"

namespace atelier {

struct CaptureDetectOptions {
  std::string schema = "auto";
  std::string taxonomy = "auto";
  DetectOptions network;
  FindPeopleOptions people;
  bool views = true;   ///< look again where calibrated cameras disagree
  bool masks = false;  ///< of the built-in detector, as labels
  PeopleMaskOptions mask;
};

/// Result of a user's network.
struct DetectedCapture {
  std::string said;  ///< order of its points, or taxonomy of its classes; "": nobody was found
  int images = 0;
  int people = 0;
};

/// Notes the order of points in capture.toml of a native capture whose own the results are.
void note_schema(const std::filesystem::path& capture, const std::string& schema);

/// By a network of the user's, in every image: OUT/keypoints2d/<camera>/<frame>.json, or of a
/// parsing network OUT/labels/<camera>/<frame>.png. Throws DataError, UsageError.
DetectedCapture detect_by_own_network(const Dataset& dataset, const std::string& model_file,
                                      const CaptureDetectOptions& options,
                                      const std::filesystem::path& out);

/// By the built-in detector, keypoints and, if asked for, masks at the same places.
PeopleCount detect_by_built_in(const Dataset& dataset, const PeopleNetworks& networks,
                               const CaptureDetectOptions& options,
                               const std::filesystem::path& out);

}  // namespace atelier
