#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/finding.h"
#include "tests/capture/seeded_capture.h"

namespace atelier::fixtures {

/// A good capture that is about to be spoiled.
struct Spoiled {
  SeededRig rig;
  SeededCapture capture;         ///< is written after `spoil`
  std::filesystem::path folder;  ///< is there for `spoil_files`
};

/// One thing that goes wrong with captures, and what validate is to say of it.
struct SeededDefect {
  const char* what;     ///< for docs/guide/troubleshooting.md
  const char* code;     ///< of the finding
  const char* place;    ///< its beginning: "cam2", "cam2 frame 5", "" for the whole capture
  const char* setting;  ///< that it advises and that makes it vanish; "": the files must be mended
  int rig;              ///< of seeded_rigs()
  void (*spoil)(Spoiled& spoiled) = nullptr;        ///< before it is written
  void (*spoil_files)(Spoiled& spoiled) = nullptr;  ///< after
};

/// An image, or detections in it, turned by 180 degrees.
void turn_upside_down(ByteImage& image);
void turn_rows_upside_down(Keypoints2d& rows, const Camera& camera);

/// Of calibrations, of images with masks and labels, of detections.
std::vector<SeededDefect> calibration_defects();
std::vector<SeededDefect> picture_defects();
std::vector<SeededDefect> detection_defects();
std::vector<SeededDefect> all_defects();

/// The capture with the defect in it, on disk.
void write_spoiled(const SeededDefect& defect, Spoiled spoiled);

/// What validate says of a capture under a setting ("--capture.sync cam2=3"), or none.
std::vector<Finding> findings_of(const std::filesystem::path& folder,
                                 const std::string& setting = "");

/// Whether a finding is the one that the defect is to have.
bool names(const Finding& finding, const SeededDefect& defect);

/// An error in one camera that is said of another.
bool blames_another(const Finding& finding, const SeededDefect& defect);

}  // namespace atelier::fixtures
