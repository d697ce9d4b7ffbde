#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "capture/detection/decode.h"
#include "core/image.h"
#include "core/limits.h"
#include "core/options.h"

namespace atelier {

/// Kind of a network's outputs.
enum class NetworkKind {
  Simcc,     ///< RTMPose: rows for x and for y
  Heatmap,   ///< one map a point; OpenPose's too, of one person
  OpenPose,  ///< COCO maps and part affinity fields: several people
  Parsing,   ///< logits of classes
};

/// The part of an image that the network is given.
enum class DetectArea {
  Whole,  ///< all of it: networks that look at whole images
  Mask,   ///< a box round the mask, where there is one: networks that look at one person
};

struct DetectOptions {
  NetworkKind kind = NetworkKind::Simcc;
  int width = 192;   ///< px that the network takes, 8 to 4096
  int height = 256;  ///< px, 8 to 4096
  int points = 0;    ///< of Heatmap: maps that are points; 0: all of them, 0 to 1000
  std::vector<double> mean = {123.675, 116.28, 103.53};  ///< taken off, of 0 to 255, in its order
  std::vector<double> standard_deviation = {58.395, 57.12, 57.375};  ///< divided by, above 0
  bool bgr = false;  ///< channels in the order blue, green, red
  DetectArea box = DetectArea::Mask;
  double padding = 1.25;   ///< the box round a mask is so much larger, [1, 4]
  double threshold = 0.1;  ///< confidence below which a point was not found, [0, 1]
  int batch = 8;           ///< images of one confined run, 1 to 1000
  int seconds = 60;        ///< processor time of one confined run, 1 to 100000
  int memory = 4096;       ///< MB more than the program has, for one confined run, 64 to 1e6
};
OptionTable describe(DetectOptions& options);

/// A part of an image, px.
struct DetectBox {
  double x = 0, y = 0, width = 0, height = 0;
};
DetectBox whole_box(int width, int height);
/// Round what is not 0, larger by `padding`; the whole image where nothing is set.
DetectBox mask_box(const ByteImage& mask, double padding);

struct DetectPicture {
  ByteImage image;  ///< sRGB, 1 or 3 channels
  DetectBox box;
};

/// A network's detections in one image.
struct Detection {
  std::vector<DetectedPoints> people;  ///< px of the image; below the threshold: 0, 0, 0
  ByteImage classes;    ///< [H,W] of a parsing network, of the image's size; 0 outside the box
  int class_count = 0;  ///< of a parsing network
};

/// Cuts each box out, keeping its shape (what is beyond it in the network's rectangle is the
/// image's, and beyond that the mean), normalises it as the network was trained, runs it
/// (run_network), reads its outputs and takes them back to the image. Throws as run_network and the
/// decoders do; LogicError for options out of range and boxes without area.
std::vector<Detection> detect(std::span<const std::byte> model,
                              const std::vector<DetectPicture>& pictures,
                              const DetectOptions& options, const std::string& file,
                              const Limits& limits = {});

}  // namespace atelier
