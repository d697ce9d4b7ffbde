#include "capture/check_labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include "capture/camera_conventions.h"
#include "capture/keypoint_schema.h"
#include "capture/label_taxonomy.h"
#include "capture/mask_share.h"
#include "capture/seen_person.h"
#include "capture/sentence.h"
#include "core/error.h"
#include "core/quantity_text.h"
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
std::optional<Eigen::Vector2d> pixel_of(const Camera& camera, const KeypointCheck& keypoints,
                                        std::size_t frame, int joint) {
  if (joint < 0) {
    return std::nullopt;
  }
  const SpacePoint& point = keypoints.found.frames[frame].points[static_cast<std::size_t>(joint)];
  return point.confidence > 0 && !point.bridged ? project(camera, point.place) : std::nullopt;
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

/// How the joints of a camera lie on its masks, over some frames.
struct JointsOnMask {
  double count = 0;                ///< joints
  std::array<double, 4> inside{};  ///< on the mask: as it is, and if it was turned by k quarters
  double set = 0;                  ///< mean share of the masks that is set
};

JointsOnMask joints_on_mask(FrameReader& reader, const KeypointCheck& keypoints,
                            std::size_t camera) {
  const Dataset& dataset = reader.dataset();
  const Camera& own = dataset.cameras[camera];
  const KeypointSchema& schema = keypoint_schema(dataset.info.keypoint_schema);
  JointsOnMask all;
  double masks = 0;
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
    if (mask->width != own.width || mask->height != own.height) {
      return {};  // places in the image are none in the mask; check_frames says so
    }
    all.set += set_share(*mask, false);
    masks += 1;
    for (const JointLabels& joint : kJoints) {
      const int k = find_keypoint(schema, joint.joint);
      const auto pixel = pixel_of(own, keypoints, f, k);
      if (!pixel || !value_at(*mask, *pixel)) {
        continue;
      }
      all.count += 1;
      for (int quarters = 0; quarters < 4; ++quarters) {
        const bool fits = quarters % 2 == 0 || own.width == own.height;
        const auto turned = pixel_of(turned_camera(own, quarters), keypoints, f, k);
        const auto value = fits && turned ? value_at(*mask, *turned) : std::nullopt;
        all.inside[static_cast<std::size_t>(quarters)] += value && *value != 0 ? 1 : 0;
      }
    }
  }
  all.set = masks > 0 ? all.set / masks : 0;
  return all;
}

/// Whether a camera has detections of its own, which fit it as they are (else it is not asked).
bool detects(const KeypointCheck& keypoints, std::size_t camera) {
  return std::any_of(keypoints.detections.begin(), keypoints.detections.end(),
                     [&](const std::vector<Keypoints2d>& cameras) {
                       const Keypoints2d& rows = cameras[camera];
                       return rows.rows() > 0 && rows.col(2).maxCoeff() > kConfidentDetection;
                     });
}

/// Masks that fit if they are turned. Of a camera whose detections fit as they are, the masks alone
/// are turned; of one without detections its images, as far as can be told.
Finding mask_turned(const std::string& id, int quarters, double inside, double then,
                    bool masks_alone) {
  const std::string degrees = std::to_string(90 * quarters);
  return {Severity::Error,
          "mask-turned",
          id,
          percent(inside) + " of the joints lie on the mask, and " + percent(then) +
              " if it was turned by " + degrees + " degrees clockwise since the calibration",
          masks_alone ? "write its masks as its images are stored, without that turn"
                      : "read its images so, or write them as they were calibrated",
          masks_alone ? "" : setting_of("turned", id, degrees)};
}

/// Of a camera that the detections do not doubt. What is advised was tried: a share of the joints
/// counts for a reading of a mask as far as it is above the share of the image that is set so,
/// which joints anywhere would have.
void check_mask(FrameReader& reader, const KeypointCheck& keypoints, std::size_t camera,
                LabelCheck& check) {
  const JointsOnMask joints = joints_on_mask(reader, keypoints, camera);
  const std::string& id = reader.dataset().cameras[camera].id;
  constexpr double kFew = 8;
  if (joints.count < kFew) {
    return;
  }
  constexpr double kSure = 0.2;
  const double inside = joints.inside[0] / joints.count;
  if (inside >= 0.6) {
    if (inside > joints.set + kSure) {
      check.sound_masks.push_back(id);
    }
    return;
  }
  if (inside < 0.15 && inside < joints.set - kSure) {
    const bool of_labels = reader.dataset().frames[camera].masks.empty();
    check.findings.push_back(
        {Severity::Error, "mask-inverted", id,
         percent(1 - inside) + " of the joints are where the mask is not set",
         of_labels ? "is the labels' background another number? --capture.label-taxonomy says"
                   : "is it inverted? the person is what is not 0",
         of_labels ? "" : "--capture.masks " + id + "=inverted"});
    return;
  }
  for (int quarters = 1; quarters < 4; ++quarters) {
    const double then = joints.inside[static_cast<std::size_t>(quarters)] / joints.count;
    if (then >= 0.8 && then > joints.set + kSure) {
      check.findings.push_back(mask_turned(id, quarters, inside, then, detects(keypoints, camera)));
      return;
    }
  }
  if (joints.set == 0) {
    return;  // masks of nobody, as check_frames says
  }
  check.findings.push_back({Severity::Warning, "mask-disagrees", id,
                            "only " + percent(inside) + " of the joints lie on the mask",
                            "are the masks another camera's, or another frame's?"});
}

/// Masks against the labels of the same images: who is there in one is not in the other.
void check_masks_by_labels(FrameReader& reader, std::size_t camera,
                           std::vector<Finding>& findings) {
  const CameraFrames& frames = reader.dataset().frames[camera];
  std::vector<int> both = frames.masks.frames();
  std::erase_if(both, [&](int frame) { return !frames.labels.contains(frame); });
  const std::size_t step = std::max<std::size_t>(1, both.size() / kSamples);
  double agree = 0;
  double set = 0;
  double count = 0;
  for (std::size_t f = 0; f < both.size(); f += step) {
    try {
      const auto mask = reader.mask(static_cast<Index>(camera), both[f]);
      const auto labels = reader.labels(static_cast<Index>(camera), both[f]);
      if (!mask || !labels || mask->data.size() != labels->data.size()) {
        continue;
      }
      for (std::size_t i = 0; i < mask->data.size(); ++i) {
        const bool somebody = labels->data[i] != static_cast<std::uint8_t>(Label::Background);
        agree += (mask->data[i] != 0) == somebody ? 1 : 0;
        set += mask->data[i] != 0 ? 1 : 0;
      }
      count += static_cast<double>(mask->data.size());
    } catch (const DataError&) {  // check_frames says so
    }
  }
  constexpr double kOpposite = 0.3;
  constexpr double kFull = 0.98;  // inverted it shows nobody; check_frames says that it is full
  if (count > 0 && agree < kOpposite * count && set <= kFull * count) {
    const std::string& id = reader.dataset().cameras[camera].id;
    findings.push_back({Severity::Error, "mask-inverted", id,
                        "mask and labels agree on " + percent(agree / count) +
                            " of the pixels, and on " + percent(1 - agree / count) +
                            " with the mask inverted",
                        "the person is what is not 0", "--capture.masks " + id + "=inverted"});
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
        const auto pixel =
            pixel_of(dataset.cameras[c], keypoints, f, find_keypoint(schema, joint.joint));
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

LabelCheck check_labels(FrameReader& reader, const KeypointCheck& keypoints) {
  LabelCheck check;
  const std::vector<Camera>& cameras = reader.dataset().cameras;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    check_masks_by_labels(reader, c, check.findings);
  }
  if (!keypoints.calibration_fits) {
    return check;
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const bool doubted = std::any_of(
        keypoints.findings.begin(), keypoints.findings.end(), [&](const Finding& finding) {
          return finding.severity == Severity::Error &&
                 (finding.place == cameras[c].id || finding.place.starts_with(cameras[c].id + " "));
        });
    if (!doubted) {
      check_mask(reader, keypoints, c, check);
    }
  }
  check_taxonomy(reader, keypoints, check.findings);
  return check;
}

}  // namespace atelier
