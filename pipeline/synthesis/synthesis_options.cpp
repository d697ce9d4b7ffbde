#include "pipeline/synthesis/synthesis_options.h"

#include <algorithm>
#include <set>

#include "core/error.h"
#include "core/io/joined_names.h"

namespace atelier {
namespace {

/// The fields of a nested struct under their own names.
void append(OptionTable& table, const OptionTable& nested) {
  table.fields.insert(table.fields.end(), nested.fields.begin(), nested.fields.end());
}

}  // namespace

OptionTable describe(SynthesisOptions& options) {
  OptionTable table;
  table.add("seed", options.seed, 0, 1e15, "", "Seed of subject, cameras, cloth and noise")
      .add("frames", options.frames, 0, 100000, "", "Number of frames of the clothed sequence")
      .add("minimal_frames", options.minimal_frames, 0, 100000, "",
           "Number of frames of the minimally clothed sequence")
      .add("fps", options.fps, 1, 240, "1/s", "Frame rate of the clothed sequence");
  append(table, describe(options.subject));
  append(table, describe(options.motion));
  append(table, describe(options.outfit));
  table
      .add("cloth_sequence", options.cloth_sequence, std::vector<std::string>{},
           "File or folder of draped cloth used instead of simulating; requires body_sequence")
      .add("body_sequence", options.body_sequence, std::vector<std::string>{},
           "File or folder of bodies used instead of the synthetic subject")
      .add("fabric", describe(options.fabric))
      .add("dome", describe(options.dome))
      .add("sensor", describe(options.sensor))
      .add("detector", describe(options.detector))
      .add("label", describe(options.labels))
      .add("keypoints", options.keypoints, std::vector<std::string>{"body_25", "coco_wholebody"},
           "Order of the detected keypoints")
      .add("calibration_error", options.calibration_error, 0, 50, "px",
           "RMS error of the written calibration in an image 1000 rows high")
      .add("miscalibrated", options.miscalibrated, 0, 1000, "",
           "Number of cameras whose calibration is off by two degrees")
      .add("held_out_cameras", options.held_out_cameras, 0, 1000, "",
           "Number of cameras that no stage reads, for evaluation")
      .add("held_out_share", options.held_out_share, 0, 0.9, "",
           "Fraction of the clothed frames, the last ones, that no training reads")
      .add("perfect", options.perfect,
           "Ideal capture: no noise, exact detections, labels and calibration, equal exposure of "
           "all cameras")
      .add("ground_truth_images", options.ground_truth_images,
           "Writing of noise-free images as ground truth")
      .add("plates", options.plates, "Writing of images of the empty stage, plates/<camera>.png")
      .add("ground_truth_maps", options.ground_truth_maps,
           "Writing of the ground-truth depth and surface position of every pixel")
      .add("image_format", options.image_format, std::vector<std::string>{"png", "jpg"},
           "Format of the images; JPEG at quality 95")
      .add("samples", options.samples, 1, 1024, "", "Number of rays of a pixel")
      .add("light_samples", options.light_samples, 3, 65536, "",
           "Number of rays that gather ambient light at each vertex")
      .add("shutter", options.shutter, 0, 0.2, "s", "Exposure time, which blurs motion; 0: none")
      .add("shutter_samples", options.shutter_samples, 2, 64, "",
           "Number of instants within the exposure time")
      .add("skin_resolution", options.skin_resolution, 64, 8192, "",
           "Side of the body's albedo texture in texels");
  return table;
}

const std::vector<std::string>& synthesis_presets() {
  static const std::vector<std::string> names = {"tiny", "demo", "accuracy", "studio"};
  return names;
}

SynthesisOptions preset_options(const std::string& preset) {
  SynthesisOptions options;  // tiny
  if (preset == "tiny") {
    return options;
  }
  options.dome.cameras = 10;
  options.dome.pairs = true;
  options.dome.width = 400;
  options.dome.height = 480;
  options.frames = 12;
  options.minimal_frames = 4;
  options.outfit.edge_length = 0.022;
  options.outfit.substeps = 30;  // from 15 to 30 a spinning skirt moves by 32 mm
  options.fabric.resolution = 2048;
  options.skin_resolution = 2048;
  if (preset == "demo") {
    return options;
  }
  options.dome.cameras = 16;
  options.dome.width = 800;
  options.dome.height = 1000;
  options.frames = 24;
  options.minimal_frames = 6;
  options.held_out_cameras = 2;
  options.outfit.edge_length = 0.018;
  if (preset == "accuracy") {
    return options;
  }
  ATELIER_CHECK(preset == "studio", "no preset is called " + preset);
  options.dome.cameras = 40;
  options.dome.rows = 2;
  options.dome.pair_angle = 12;
  options.dome.width = 1536;
  options.dome.height = 2048;
  options.frames = 1;
  options.minimal_frames = 1;
  options.held_out_cameras = 0;
  options.held_out_share = 0;
  options.outfit.edge_length = 0.014;
  options.fabric.resolution = 4096;
  options.skin_resolution = 4096;
  options.image_format = "jpg";
  options.ground_truth_images = false;
  return options;
}

std::vector<std::string> impossible_options(const SynthesisOptions& options) {
  SynthesisOptions copy = options;
  std::vector<std::string> wrong = check_options(describe(copy));
  const auto say = [&](const std::string& sentence) { wrong.push_back(sentence); };
  if (options.frames + options.minimal_frames == 0) {
    say("--frames and --minimal-frames are both 0: the capture would be empty");
  }
  const int per_post = (options.dome.pairs ? 2 : 1) * options.dome.rows;
  if (options.dome.cameras % per_post != 0) {
    say("--dome.cameras cannot be " + std::to_string(options.dome.cameras) + ": posts carry " +
        std::to_string(per_post) + " each");
  }
  if (options.held_out_cameras + 2 > options.dome.cameras) {
    say("--held-out-cameras cannot be " + std::to_string(options.held_out_cameras) + ": of " +
        std::to_string(options.dome.cameras) + " cameras at least 2 must be left");
  }
  if (options.miscalibrated > options.dome.cameras) {
    say("--miscalibrated cannot be more than the cameras");
  }
  if (options.dome.low >= options.dome.high) {
    say("--dome.low must be below --dome.high");
  }
  if (!options.cloth_sequence.empty() && options.body_sequence.empty()) {
    say("--cloth-sequence needs --body-sequence: the body that wears the cloth");
  }
  std::set<std::string> worn;
  for (const std::string& garment : joined_names(options.outfit.garment)) {
    if (!worn.insert(garment).second) {
      say("--garment names '" + garment + "' twice");
    }
  }
  if (options.shutter * options.fps >= 1) {
    say("--shutter is longer than a frame");
  }
  const double pixels = static_cast<double>(options.dome.width) * options.dome.height;
  if (pixels > 64e6) {
    say("images of more than 64 million pixels");
  }
  return wrong;
}

}  // namespace atelier
