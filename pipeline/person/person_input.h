#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bodymodel/tracking/track.h"
#include "capture/capture_info.h"
#include "capture/label_taxonomy.h"
#include "capture/layouts/open_dataset.h"
#include "capture/worn_labels.h"
#include "core/store/stage.h"

namespace atelier {

/// Where `personalize` and `track` have surfaces from.
enum class ScanSource {
  Reconstructed,  ///< scans of the stage reconstruct
  Truth,          ///< of a synthetic capture: ground-truth surfaces that two cameras see
  None,           ///< keypoints alone
};

struct PersonInputOptions {
  DatasetOptions capture;
  ScanSource scans = ScanSource::Reconstructed;
  int person = 0;             ///< number of the person where keypoints have several, [0, 1000]
  double keypoint_noise = 0;  ///< m, of a keypoint, added to the fit's own, [0, 1]
  std::string excluded = "dress,outer";  ///< labels whose clothing `--exclude labels` leaves out
};
OptionTable describe(PersonInputOptions& options);

/// Where a person's evidence is.
struct PersonFiles {
  std::filesystem::path capture;
  std::filesystem::path scans;      ///< folder with scans/<frame>.h5
  std::filesystem::path keypoints;  ///< folder with keypoints3d/<frame>.json
};
PersonFiles person_files(const StageRun& run);

/// Sequences and keypoints of the capture. Throws DataError where keypoints show people, but never
/// the one of that number.
CaptureInfo person_capture(const PersonFiles& files, const PersonInputOptions& options);
/// The same refusal of a workspace's keypoints, before a stage runs; "": of none.
void require_person(const std::filesystem::path& workspace, const PersonInputOptions& options);

/// Role of a label for the body under it. Hair, carried objects and background have none.
ScanPart part_of(Label label, const std::vector<Label>& excluded = {});

/// A person's evidence, and what is doubtful about it.
struct PersonEvidence {
  TrackInput input;
  std::vector<Finding> findings;  ///< "keypoints-bridged", "people-several", "labels-absent",
                                  ///< "label-nowhere", and "no-scans" where labels are left out
};

/// Keypoints and scans of a sequence, as the workspace's `reconstruct` or the ground truth has
/// them; frames without a file have neither. Keypoints that no camera saw, which `reconstruct`
/// bridges by straight lines, count as missing. A scan that is all background has no labels.
/// `minimal`: every surface but hair counts as skin.
PersonEvidence person_input(const PersonFiles& files, const CaptureInfo& info,
                            const CaptureSequence& sequence, const PersonInputOptions& options,
                            const std::vector<Label>& excluded = {});

}  // namespace atelier
