#include "capture/detection/detect.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

/// Image pixel = scale * network pixel + offset, the same scale across and down.
struct Placement {
  double scale = 1;
  double x = 0;
  double y = 0;
};

Placement placement_of(const DetectBox& box, const DetectOptions& options) {
  ATELIER_CHECK(box.width > 0 && box.height > 0, "a box without area");
  Placement place;
  place.scale = std::max(box.width / options.width, box.height / options.height);
  place.x = box.x + 0.5 * (box.width - place.scale * options.width);
  place.y = box.y + 0.5 * (box.height - place.scale * options.height);
  return place;
}

/// Mean of the image over the square that one pixel of the network covers; between four pixels
/// where it is smaller than one. Nothing outside.
bool color_at(const ByteImage& image, double x, double y, double size, std::array<double, 3>& rgb) {
  const int samples = std::clamp(saturating_cast<int>(std::ceil(size)), 1, 8);
  rgb = {0, 0, 0};
  if (x < 0 || y < 0 || x >= image.width || y >= image.height) {
    return false;
  }
  for (int sy = 0; sy < samples; ++sy) {
    for (int sx = 0; sx < samples; ++sx) {
      const double px =
          std::clamp(x + ((sx + 0.5) / samples - 0.5) * size - 0.5, 0.0, image.width - 1.0);
      const double py =
          std::clamp(y + ((sy + 0.5) / samples - 0.5) * size - 0.5, 0.0, image.height - 1.0);
      const int x0 = saturating_cast<int>(px);
      const int y0 = saturating_cast<int>(py);
      const int x1 = std::min(x0 + 1, image.width - 1);
      const int y1 = std::min(y0 + 1, image.height - 1);
      for (int c = 0; c < 3; ++c) {
        const int from = image.channels == 3 ? c : 0;
        const double top =
            (1 - (px - x0)) * image.at(x0, y0, from) + (px - x0) * image.at(x1, y0, from);
        const double low =
            (1 - (px - x0)) * image.at(x0, y1, from) + (px - x0) * image.at(x1, y1, from);
        rgb[static_cast<std::size_t>(c)] +=
            ((1 - (py - y0)) * top + (py - y0) * low) / (samples * samples);
      }
    }
  }
  return true;
}

NetworkInput input_of(const DetectPicture& picture, const DetectOptions& options) {
  ATELIER_CHECK(picture.image.channels == 1 || picture.image.channels == 3,
                "an image of 1 or 3 channels");
  const Placement place = placement_of(picture.box, options);
  NetworkInput input{Image(options.width, options.height, 3)};
  std::array<double, 3> rgb{};
  for (int y = 0; y < options.height; ++y) {
    for (int x = 0; x < options.width; ++x) {
      const bool inside = color_at(picture.image, place.scale * (x + 0.5) + place.x,
                                   place.scale * (y + 0.5) + place.y, place.scale, rgb);
      for (int c = 0; c < 3; ++c) {
        const auto k = static_cast<std::size_t>(c);
        const double value = rgb[static_cast<std::size_t>(options.bgr ? 2 - c : c)];
        input.pixels.at(x, y, c) =
            inside ? static_cast<float>((value - options.mean[k]) / options.standard_deviation[k])
                   : 0;
      }
    }
  }
  return input;
}

DetectedPoints in_picture(DetectedPoints points, const Placement& place, double threshold) {
  for (Eigen::Index k = 0; k < points.rows(); ++k) {
    if (points(k, 2) < threshold) {
      points.row(k).setZero();
    } else {
      points(k, 0) = place.scale * points(k, 0) + place.x;
      points(k, 1) = place.scale * points(k, 1) + place.y;
    }
  }
  return points;
}

const NetworkOutput& output_at(const std::vector<NetworkOutput>& outputs, std::size_t number,
                               const char* what, const std::string& file) {
  if (outputs.size() <= number) {
    throw DataError(file, "", std::to_string(outputs.size()) + " outputs", what);
  }
  return outputs[number];
}

}  // namespace

OptionTable describe(DetectOptions& options) {
  OptionTable table;
  table.add("kind", options.kind,
            {{"simcc", NetworkKind::Simcc},
             {"heatmap", NetworkKind::Heatmap},
             {"openpose", NetworkKind::OpenPose},
             {"parsing", NetworkKind::Parsing}},
            "Outputs of the network: simcc (rows for x and y, as of RTMPose), heatmap (a map for "
            "each keypoint), openpose (maps with affinity fields), parsing (logits of classes)");
  table.add("width", options.width, 8, 4096, "px", "Width of the network's input");
  table.add("height", options.height, 8, 4096, "px", "Height of the network's input");
  table.add("points", options.points, 0, 1000, "",
            "Number of maps that are keypoints where others follow, for kind heatmap; 0: all");
  table.add("mean", options.mean, -1000, 1000, "",
            "Mean subtracted from values of 0 to 255, in the network's order of channels");
  table.add("standard_deviation", options.standard_deviation, 1e-6, 1e6, "",
            "Standard deviation that values are divided by after the mean is subtracted");
  table.add("bgr", options.bgr, "Channels in the order blue, green, red");
  table.add("box", options.box, {{"whole", DetectArea::Whole}, {"mask", DetectArea::Mask}},
            "Part of the image given to the network: whole, or mask, a box around the mask where "
            "there is one");
  table.add("padding", options.padding, 1, 4, "",
            "Factor by which the box around a mask is enlarged");
  table.add("threshold", options.threshold, 0, 1, "",
            "Minimum confidence of a keypoint that counts as detected");
  table.add("batch", options.batch, 1, 1000, "",
            "Number of images in one run of the confined child program");
  table.add("seconds", options.seconds, 1, 100000, "s",
            "Maximum processor time of one run of the confined child program");
  table.add("memory", options.memory, 64, 1000000, "MB",
            "Maximum memory of one run of the confined child program");
  return table;
}

DetectBox whole_box(int width, int height) {
  return {0, 0, static_cast<double>(width), static_cast<double>(height)};
}

DetectBox mask_box(const ByteImage& mask, double padding) {
  int x0 = mask.width, y0 = mask.height, x1 = -1, y1 = -1;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.at(x, y) != 0) {
        x0 = std::min(x0, x);
        x1 = std::max(x1, x);
        y0 = std::min(y0, y);
        y1 = std::max(y1, y);
      }
    }
  }
  if (x1 < 0) {
    return whole_box(mask.width, mask.height);
  }
  const double width = x1 + 1 - x0;
  const double height = y1 + 1 - y0;
  return {x0 - 0.5 * (padding - 1) * width, y0 - 0.5 * (padding - 1) * height, padding * width,
          padding * height};
}

std::vector<Detection> detect(std::span<const std::byte> model,
                              const std::vector<DetectPicture>& pictures,
                              const DetectOptions& options, const std::string& file,
                              const Limits& limits) {
  ATELIER_CHECK(options.mean.size() == 3 && options.standard_deviation.size() == 3,
                "three means and deviations");
  ATELIER_CHECK(options.width > 0 && options.height > 0, "a network's input has pixels");
  std::vector<NetworkInput> inputs;
  for (const DetectPicture& picture : pictures) {
    inputs.push_back(input_of(picture, options));
  }
  Limits confined = limits;
  confined.worker_cpu_seconds = options.seconds;
  confined.worker_memory_bytes = static_cast<std::int64_t>(options.memory) << 20;
  const auto outputs = run_network(model, inputs, file, confined);
  std::vector<Detection> detections;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const Placement place = placement_of(pictures[i].box, options);
    const NetworkOutput& first = output_at(outputs[i], 0, "one at least", file);
    Detection detection;
    std::vector<DetectedPoints> people;
    switch (options.kind) {
      case NetworkKind::Simcc: {
        // Exports differ in the order of the two; their lengths tell them apart.
        const NetworkOutput& second =
            output_at(outputs[i], 1, "two: SimCC's rows for x and for y", file);
        const bool swapped = options.width != options.height && first.shape.size() == 2 &&
                             second.shape.size() == 2 &&
                             static_cast<std::int64_t>(first.shape[1]) * options.width ==
                                 static_cast<std::int64_t>(second.shape[1]) * options.height;
        people.push_back(decode_simcc(swapped ? second : first, swapped ? first : second,
                                      options.width, options.height, file));
        break;
      }
      case NetworkKind::Heatmap:
        people.push_back(decode_heatmaps(first,
                                         options.points > 0    ? options.points
                                         : first.shape.empty() ? 0
                                                               : first.shape[0],
                                         options.width, options.height, file));
        break;
      case NetworkKind::OpenPose:
        people =
            decode_openpose_people(first, options.width, options.height, options.threshold, file);
        break;
      case NetworkKind::Parsing: {
        const ByteImage classes = decode_parsing(first, options.width, options.height, file);
        detection.class_count = first.shape[0];
        const ByteImage& image = pictures[i].image;
        detection.classes = ByteImage(image.width, image.height, 1);
        for (int y = 0; y < image.height; ++y) {
          for (int x = 0; x < image.width; ++x) {
            const double nx = (x + 0.5 - place.x) / place.scale;
            const double ny = (y + 0.5 - place.y) / place.scale;
            if (nx >= 0 && ny >= 0 && nx < options.width && ny < options.height) {
              detection.classes.at(x, y) =
                  classes.at(saturating_cast<int>(nx), saturating_cast<int>(ny));
            }
          }
        }
        break;
      }
    }
    for (const DetectedPoints& points : people) {
      detection.people.push_back(in_picture(points, place, options.threshold));
    }
    detections.push_back(std::move(detection));
  }
  return detections;
}

}  // namespace atelier
