#include "capture/check_labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include "capture/keypoint_schema.h"
#include "capture/label_taxonomy.h"
#include "capture/sentence.h"
#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr std::size_t kSamples = 4;  // frames of each camera

/// Labels that may be seen where a joint is.
struct JointLabels {
  const char* joint;
  std::array<Label, 4> labels;
};

constexpr std::array kJoints = {
    JointLabels{"nose", {Label::Skin, Label::Skin, Label::Hair, Label::Other}},
    JointLabels{"left_shoulder", {Label::Upper, Label::Dress, Label::Outer, Label::Skin}},
    JointLabels{"right_shoulder", {Label::Upper, Label::Dress, Label::Outer, Label::Skin}},
    JointLabels{"left_elbow", {Label::Upper, Label::Dress, Label::Outer, Label::Skin}},
    JointLabels{"right_elbow", {Label::Upper, Label::Dress, Label::Outer, Label::Skin}},
    JointLabels{"left_hip", {Label::Lower, Label::Dress, Label::Outer, Label::Upper}},
    JointLabels{"right_hip", {Label::Lower, Label::Dress, Label::Outer, Label::Upper}},
    JointLabels{"left_knee", {Label::Lower, Label::Dress, Label::Outer, Label::Skin}},
    JointLabels{"right_knee", {Label::Lower, Label::Dress, Label::Outer, Label::Skin}},
    JointLabels{"left_ankle", {Label::Lower, Label::Shoes, Label::Dress, Label::Skin}},
    JointLabels{"right_ankle", {Label::Lower, Label::Shoes, Label::Dress, Label::Skin}},
};

/// Where a joint is in a camera's image, if it is known.
std::optional<Eigen::Vector2d> pixel_of(const Dataset& dataset, const KeypointCheck& keypoints,
                                        std::size_t frame, std::size_t camera, int joint) {
  if (joint < 0) {
    return std::nullopt;
  }
  const SpacePoint& point = keypoints.found.frames[frame].points[static_cast<std::size_t>(joint)];
  return point.confidence > 0 && !point.bridged ? project(dataset.cameras[camera], point.place)
                                                : std::nullopt;
}

/// The pixel's value; nothing outside the picture.
std::optional<std::uint8_t> value_at(const ByteImage& image, const Eigen::Vector2d& pixel) {
  if (!(pixel.x() >= 0 && pixel.x() < image.width && pixel.y() >= 0 && pixel.y() < image.height)) {
    return std::nullopt;
  }
  return image.at(saturating_cast<int>(pixel.x()), saturating_cast<int>(pixel.y()));
}

std::vector<std::size_t> samples_of(const KeypointCheck& keypoints) {
  std::vector<std::size_t> frames;
  const std::size_t count = keypoints.found.frames.size();
  const std::size_t step = std::max<std::size_t>(1, count / kSamples);
  for (std::size_t f = step / 2; f < count; f += step) {
    frames.push_back(f);
  }
  return frames;
}

void check_mask(FrameReader& reader, const KeypointCheck& keypoints, std::size_t camera,
                std::vector<Finding>& findings) {
  const Dataset& dataset = reader.dataset();
  const KeypointSchema& schema = keypoint_schema(dataset.info.keypoint_schema);
  double inside = 0;
  double count = 0;
  for (const std::size_t f : samples_of(keypoints)) {
    std::optional<ByteImage> mask;
    try {
      mask = reader.mask(static_cast<Index>(camera), keypoints.frame_ids[f]);
    } catch (const DataError&) {
      continue;  // check_frames says so
    }
    if (!mask) {
      continue;
    }
    if (mask->width != dataset.cameras[camera].width ||
        mask->height != dataset.cameras[camera].height) {
      return;  // places in the image are none in the mask; check_frames says so
    }
    for (const JointLabels& joint : kJoints) {
      const auto pixel =
          pixel_of(dataset, keypoints, f, camera, find_keypoint(schema, joint.joint));
      const auto value = pixel ? value_at(*mask, *pixel) : std::nullopt;
      if (value) {
        count += 1;
        inside += *value != 0 ? 1 : 0;
      }
    }
  }
  const std::string& id = dataset.cameras[camera].id;
  constexpr double kFew = 8;
  if (count < kFew || inside >= 0.6 * count) {
    return;
  }
  if (inside < 0.15 * count) {
    findings.push_back({Severity::Error, "mask-inverted", id,
                        percent(1 - inside / count) + " of the joints are where the mask is not "
                                                      "set",
                        "is it inverted? the person is what is not 0",
                        "--capture.masks " + id + "=inverted"});
  } else {
    findings.push_back({Severity::Warning, "mask-disagrees", id,
                        "only " + percent(inside / count) + " of the joints lie on the mask",
                        "are the masks another camera's, or another frame's?"});
  }
}

/// How well a taxonomy's labels agree with the joints; negative: it does not have all numbers.
double taxonomy_score(FrameReader& reader, const KeypointCheck& keypoints) {
  const Dataset& dataset = reader.dataset();
  const KeypointSchema& schema = keypoint_schema(dataset.info.keypoint_schema);
  double agreed = 0;
  double count = 0;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    for (const std::size_t f : samples_of(keypoints)) {
      std::optional<ByteImage> labels;
      try {
        labels = reader.labels(static_cast<Index>(c), keypoints.frame_ids[f]);
      } catch (const DataError&) {
        return -1;
      }
      if (!labels) {
        continue;
      }
      for (const JointLabels& joint : kJoints) {
        const auto pixel = pixel_of(dataset, keypoints, f, c, find_keypoint(schema, joint.joint));
        const auto value = pixel ? value_at(*labels, *pixel) : std::nullopt;
        if (value && *value != static_cast<std::uint8_t>(Label::Background)) {
          count += 1;
          agreed +=
              std::any_of(joint.labels.begin(), joint.labels.end(),
                          [&](Label label) { return static_cast<std::uint8_t>(label) == *value; })
                  ? 1
                  : 0;
        }
      }
    }
  }
  constexpr double kFew = 10;
  return count < kFew ? -1 : agreed / count;
}

/// Sums of the colours of pixels.
struct Colour {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  Eigen::Vector3d mean() const { return sum / std::max(count, 1.0); }
};

/// Pixels that one taxonomy calls skin and another cloth, and those that both call the same.
struct Contested {
  Colour skin;
  Colour cloth;
  Colour contested;
  double called_skin = 0;  ///< of the contested ones, by the first
};

Contested contested_of(FrameReader& reader, FrameReader& other, const KeypointCheck& keypoints) {
  Contested all;
  for (std::size_t c = 0; c < reader.dataset().cameras.size(); ++c) {
    for (const std::size_t f : samples_of(keypoints)) {
      const auto index = static_cast<Index>(c);
      std::optional<ByteImage> a;
      std::optional<ByteImage> b;
      std::optional<ByteImage> picture;
      try {
        a = reader.labels(index, keypoints.frame_ids[f]);
        b = other.labels(index, keypoints.frame_ids[f]);
        picture = reader.byte_image(index, keypoints.frame_ids[f]);
      } catch (const DataError&) {
        continue;
      }
      if (!a || !b || !picture || picture->channels < 3 || picture->width != a->width ||
          picture->height != a->height) {
        continue;
      }
      for (int y = 0; y < a->height; ++y) {
        for (int x = 0; x < a->width; ++x) {
          const auto of_a = static_cast<Label>(a->at(x, y));
          const auto of_b = static_cast<Label>(b->at(x, y));
          const bool skin_a = of_a == Label::Skin;
          const bool skin_b = of_b == Label::Skin;
          if ((!skin_a && !is_cloth(of_a)) || (!skin_b && !is_cloth(of_b))) {
            continue;
          }
          Colour& colour = skin_a != skin_b ? all.contested : skin_a ? all.skin : all.cloth;
          colour.sum +=
              Eigen::Vector3d(picture->at(x, y, 0), picture->at(x, y, 1), picture->at(x, y, 2));
          colour.count += 1;
          all.called_skin += skin_a && !skin_b ? 1 : 0;
        }
      }
    }
  }
  return all;
}

/// True if what the first taxonomy calls skin (or cloth) and the second does not has the colour of
/// the other.
bool is_miscalled(const Contested& all) {
  constexpr double kFew = 40;  // pixels
  if (all.contested.count < kFew || all.skin.count < kFew || all.cloth.count < kFew) {
    return false;
  }
  const double to_skin = (all.contested.mean() - all.skin.mean()).norm();
  const double to_cloth = (all.contested.mean() - all.cloth.mean()).norm();
  const bool called_skin = 2 * all.called_skin > all.contested.count;
  constexpr double kClear = 0.5;
  return called_skin ? to_cloth < kClear * to_skin : to_skin < kClear * to_cloth;
}

void check_taxonomy(FrameReader& reader, const KeypointCheck& keypoints,
                    std::vector<Finding>& findings) {
  const Dataset& dataset = reader.dataset();
  const std::string& claimed = dataset.info.label_taxonomy;
  const bool colours = !label_taxonomy(claimed).colors.empty();
  if (colours || std::all_of(dataset.frames.begin(), dataset.frames.end(),
                             [](const CameraFrames& frames) { return frames.labels.empty(); })) {
    return;
  }
  const double now = taxonomy_score(reader, keypoints);
  double best_score = std::max(now, 0.0) + 0.2;
  std::string best;
  std::string why;
  for (const std::string& name : label_taxonomy_names()) {
    if (name == claimed) {
      continue;
    }
    Dataset meant = dataset;
    meant.info.label_taxonomy = name;
    FrameReader other(std::move(meant));
    const double score = taxonomy_score(other, keypoints);
    if (score > best_score) {
      best_score = score;
      best = name;
      why = percent(score) + " of the joints are on labels that fit, as " + claimed + " " +
            (now < 0 ? "has not even all the numbers" : "only " + percent(now));
    } else if (now >= 0 && score >= now - 0.1 && best.empty() &&
               is_miscalled(contested_of(reader, other, keypoints))) {
      best = name;
      why = "what " + claimed + " calls skin or cloth, and " + name +
            " the other, has the colour of the other";
    }
  }
  if (!best.empty()) {
    findings.push_back({Severity::Error, "label-taxonomy", dataset.root.string(),
                        "the numbers of the labels are not " + claimed + "'s: " + why,
                        "they are read better as " + best, "--capture.label-taxonomy " + best});
  }
}

}  // namespace

std::vector<Finding> check_labels(FrameReader& reader, const KeypointCheck& keypoints) {
  std::vector<Finding> findings;
  if (!keypoints.calibration_fits) {
    return findings;
  }
  for (std::size_t c = 0; c < reader.dataset().cameras.size(); ++c) {
    check_mask(reader, keypoints, c, findings);
  }
  check_taxonomy(reader, keypoints, findings);
  return findings;
}

}  // namespace atelier
