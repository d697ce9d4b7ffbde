#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bodymodel/retarget/synthetic_motion.h"
#include "capture/detector.h"
#include "capture/dome.h"
#include "capture/fabric.h"
#include "capture/sensor.h"
#include "core/options.h"
#include "pipeline/outfit/dressing.h"
#include "pipeline/synthesis/synthetic_subject.h"

namespace atelier {

/// Everything that a synthetic capture depends on: the same options give the same bytes. Defaults
/// are the preset "tiny"'s.
struct SynthesisOptions {
  std::int64_t seed = 1;
  int frames = 4;          ///< of the clothed sequence; 0: none
  int minimal_frames = 2;  ///< of the minimal one; 0: none
  double fps = 12;         ///< of the clothed sequence
  SubjectOptions subject;
  MotionChoice motion;
  OutfitOptions outfit = {.edge_length = 0.03};
  std::string cloth_sequence;  ///< file or folder of draped cloth, with body_sequence
  std::string body_sequence;   ///< file or folder of bodies
  FabricOptions fabric = {.resolution = 1024};
  DomeOptions dome = {.cameras = 6, .pairs = false, .width = 240, .height = 320};
  SensorOptions sensor;
  DetectorOptions detector;
  LabelNoiseOptions labels;
  std::string keypoints = "body_25";
  double calibration_error = 0.2;  ///< px rms at 1000 rows
  int miscalibrated = 0;           ///< cameras whose calibration is off by 2 degrees
  int held_out_cameras = 1;        ///< spread over the dome
  double held_out_share = 0.25;    ///< last share of the clothed frames
  bool perfect = false;  ///< no noise, perfect detections and calibration, equal exposures
  bool ground_truth_images = true;  ///< noise-free images
  bool plates = false;              ///< images of the empty stage: plates/<camera>.png
  bool ground_truth_maps = false;   ///< depth and surface position of every pixel
  std::string image_format = "png";
  int samples = 4;             ///< rays a pixel
  int light_samples = 96;      ///< rays to the surroundings from every vertex, [3, 65536]
  double shutter = 0;          ///< s of motion blur
  int shutter_samples = 5;     ///< instants within it
  int skin_resolution = 1024;  ///< texels a side of the body's albedo
};
OptionTable describe(SynthesisOptions& options);

/// The names of --preset.
const std::vector<std::string>& synthesis_presets();

/// The options of a preset. Throws LogicError for another name.
SynthesisOptions preset_options(const std::string& preset);

/// Errors in the options, one sentence each: values out of range, nothing to take, an odd number of
/// cameras in pairs, a held-out camera too many, sequences that need each other.
std::vector<std::string> impossible_options(const SynthesisOptions& options);

}  // namespace atelier
