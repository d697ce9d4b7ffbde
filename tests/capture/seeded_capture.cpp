#include "tests/capture/seeded_capture.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "capture/detector.h"
#include "capture/keypoint_schema.h"
#include "core/atomic_file.h"
#include "core/io/cameras_file.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/random.h"

namespace atelier::fixtures {
namespace {

constexpr std::uint8_t kBackground = 0;
constexpr std::uint8_t kHair = 2;
constexpr std::uint8_t kUpper = 5;
constexpr std::uint8_t kTrousers = 9;
constexpr std::uint8_t kFace = 13;
constexpr std::uint8_t kLeftArm = 14;
constexpr std::uint8_t kRightArm = 15;
constexpr std::uint8_t kLeftShoe = 18;

/// A part of the body: a limb of some thickness with a label.
struct Part {
  const char* from;
  const char* to;
  double radius;  // m
  std::uint8_t label;
};

constexpr Part kParts[] = {
    {"neck", "mid_hip", 0.13, kUpper},
    {"left_shoulder", "left_hip", 0.09, kUpper},
    {"right_shoulder", "right_hip", 0.09, kUpper},
    {"left_shoulder", "left_elbow", 0.055, kUpper},
    {"right_shoulder", "right_elbow", 0.055, kUpper},
    {"left_elbow", "left_wrist", 0.05, kLeftArm},
    {"right_elbow", "right_wrist", 0.05, kRightArm},
    {"left_hip", "left_knee", 0.09, kTrousers},
    {"right_hip", "right_knee", 0.09, kTrousers},
    {"left_knee", "left_ankle", 0.065, kTrousers},
    {"right_knee", "right_ankle", 0.065, kTrousers},
    {"left_ankle", "left_big_toe", 0.05, kLeftShoe},
    {"right_ankle", "right_big_toe", 0.05, kLeftShoe + 1},
    {"nose", "nose", 0.09, kFace},
    {"left_ear", "right_ear", 0.075, kHair},
};

Eigen::Vector3d joint(const Points& points, const char* name) {
  const int k = find_keypoint(body_25_schema(), name);
  return points.row(k).transpose();
}

std::array<double, 3> colour_of(std::uint8_t label) {
  switch (label) {
    case kHair:
      return {60, 45, 35};
    case kUpper:
      return {60, 90, 160};
    case kTrousers:
      return {80, 80, 90};
    case kFace:
    case kLeftArm:
    case kRightArm:
      return {205, 150, 125};
    default:
      return {40, 40, 40};
  }
}

}  // namespace

Points walking_person(const SeededRig& rig, double frame) {
  const KeypointSchema& schema = body_25_schema();
  Points points(static_cast<Index>(schema.points.size()), 3);
  Random random{rig.seed, 77, 0};
  const double phase = 6.28 * uniform(random);
  const double turn = 6.28 * uniform(random);
  const double seconds = frame / rig.fps;
  const double swing = std::sin(7 * seconds + phase);
  const double walk = 1.2 * seconds - 0.3;
  const double s = rig.stature / 1.7;
  for (Index k = 0; k < points.rows(); ++k) {
    const std::string& name = schema.points[static_cast<std::size_t>(k)];
    const double side = name.starts_with("left") ? 1 : name.starts_with("right") ? -1 : 0;
    const auto put = [&](double x, double y, double z) { points.row(k) << side * x, y, z; };
    if (name.ends_with("shoulder")) {
      put(0.18, 1.4, 0);
    } else if (name.ends_with("elbow")) {
      put(0.3, 1.15, 0.15 * side * swing);
    } else if (name.ends_with("wrist")) {
      put(0.36, 0.95, 0.1 + 0.3 * side * swing);
    } else if (name.ends_with("_hip")) {
      put(0.09, 0.9, 0);
    } else if (name.ends_with("knee")) {
      put(0.1, 0.48, 0.05 - 0.15 * side * swing);
    } else if (name.ends_with("ankle")) {
      put(0.1, 0.09 + 0.03 * std::abs(swing), -0.25 * side * swing);
    } else if (name.ends_with("heel")) {
      put(0.1, 0.03, -0.05 - 0.25 * side * swing);
    } else if (name.ends_with("big_toe")) {
      put(0.09, 0.03, 0.17 - 0.25 * side * swing);
    } else if (name.ends_with("small_toe")) {
      put(0.14, 0.03, 0.14 - 0.25 * side * swing);
    } else if (name.ends_with("ear")) {
      put(0.075, 1.57, 0.02);
    } else if (name.ends_with("eye")) {
      put(0.035, 1.6, 0.1);
    } else if (name == "nose") {
      put(0, 1.56, 0.12);
    } else if (name == "neck") {
      put(0, 1.43, 0);
    } else {  // mid_hip
      put(0, 0.92, 0);
    }
    const double z = s * points(k, 2) + walk;
    const double x = s * points(k, 0) + 0.15 * std::sin(2 * seconds + phase);
    points.row(k) << std::cos(turn) * x + std::sin(turn) * z, s * points(k, 1),
        std::cos(turn) * z - std::sin(turn) * x;
  }
  return points;
}

std::vector<SeededRig> seeded_rigs() {
  SeededRig upright;
  upright.circle = {.count = 8, .width = 72, .height = 90, .focal = 95, .radius = 3};
  upright.seed = 3;
  SeededRig lying;
  lying.circle = {
      .count = 6, .width = 112, .height = 84, .focal = 110, .radius = 3.6, .low = 0.5, .high = 2.2};
  lying.distortion = {-0.08, 0.03, 0.0005, -0.0004, -0.005};
  lying.fps = 24;
  lying.stature = 1.85;
  lying.seed = 11;
  SeededRig sharp;
  sharp.circle = {.count = 9,
                  .width = 1280,
                  .height = 1000,
                  .focal = 1000,
                  .radius = 2.4,
                  .low = 0.9,
                  .high = 1.6};
  sharp.distortion = {-0.28, 0.12, 0.001, -0.0008, -0.04};
  sharp.frames = 24;
  sharp.stature = 1.6;
  sharp.seed = 29;
  sharp.pictures = false;
  return {upright, lying, sharp};
}

std::vector<Keypoints2d> seeded_detections(const SeededRig& rig, const Camera& camera,
                                           std::size_t camera_idx, double later, int from) {
  std::vector<Keypoints2d> all;
  for (int f = 0; f < rig.frames; ++f) {
    const Points points = walking_person(rig, f + (f >= from ? later : 0));
    all.push_back(
        detected_keypoints(camera, body_25_schema(), points,
                           std::vector<KeypointSight>(static_cast<std::size_t>(points.rows())),
                           {.noise = rig.noise, .outliers = 0.04},
                           Random{rig.seed, 1000 * camera_idx + static_cast<std::uint64_t>(f), 0}));
  }
  return all;
}

SeededPicture seeded_picture(const SeededRig& rig, const Camera& camera, std::size_t camera_idx,
                             double frame) {
  SeededPicture made{ByteImage(camera.width, camera.height, 3),
                     ByteImage(camera.width, camera.height, 1, kBackground)};
  const Points points = walking_person(rig, frame);
  std::vector<double> depth(made.labels.data.size(), 1e9);
  for (const Part& part : kParts) {
    constexpr int kSteps = 14;
    for (int i = 0; i <= kSteps; ++i) {
      const Eigen::Vector3d place =
          joint(points, part.from) +
          (joint(points, part.to) - joint(points, part.from)) * (static_cast<double>(i) / kSteps);
      const auto pixel = project(camera, place);
      if (!pixel) {
        continue;
      }
      const double z = camera_from_world(camera, place).z() - part.radius;
      const double radius = part.radius * camera.fx / camera_from_world(camera, place).z();
      const int reach = static_cast<int>(std::ceil(radius));
      for (int dy = -reach; dy <= reach; ++dy) {
        for (int dx = -reach; dx <= reach; ++dx) {
          const int x = static_cast<int>(std::floor(pixel->x())) + dx;
          const int y = static_cast<int>(std::floor(pixel->y())) + dy;
          if (x < 0 || y < 0 || x >= camera.width || y >= camera.height ||
              dx * dx + dy * dy > radius * radius) {
            continue;
          }
          double& nearest = depth[static_cast<std::size_t>(y * camera.width + x)];
          if (z < nearest) {
            nearest = z;
            made.labels.at(x, y) = part.label;
          }
        }
      }
    }
  }
  Random random{rig.seed, 5000 + 100 * camera_idx, static_cast<std::uint64_t>(frame * 8)};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const std::uint8_t label = made.labels.at(x, y);
      const double wall =
          120 + 30 * std::sin(0.7 * x + static_cast<double>(camera_idx)) * std::cos(0.5 * y);
      for (int c = 0; c < 3; ++c) {
        const double value =
            (label == kBackground ? wall : colour_of(label)[static_cast<std::size_t>(c)]) +
            6 * (uniform(random) - 0.5);
        made.picture.at(x, y, c) = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
      }
    }
  }
  return made;
}

SeededCapture seeded_capture(const SeededRig& rig) {
  SeededCapture capture;
  capture.cameras = circle_of_cameras(rig.circle);
  capture.info.subject = "somebody";
  capture.info.label_taxonomy = "lip";
  CaptureSequence sequence{.name = "walk", .kind = "clothed", .fps = rig.fps, .frame_ids = {}};
  for (int f = 0; f < rig.frames; ++f) {
    sequence.frame_ids.push_back(f + 1);
  }
  capture.info.sequences = {sequence};
  Consent consent;
  consent.who = "somebody";
  consent.scope = "tests";
  capture.info.consent = {consent};
  for (std::size_t c = 0; c < capture.cameras.size(); ++c) {
    Camera& camera = capture.cameras[c];
    if (rig.distortion[0] != 0) {
      camera.distortion_model = Distortion::Brown;
      std::copy(rig.distortion.begin(), rig.distortion.end(), camera.distortion.begin());
    }
    capture.keypoints.push_back(seeded_detections(rig, camera, c));
    if (!rig.pictures) {
      continue;
    }
    auto& pictures = capture.pictures.emplace_back();
    auto& masks = capture.masks.emplace_back();
    auto& labels = capture.labels.emplace_back();
    for (int f = 0; f < rig.frames; ++f) {
      SeededPicture made = seeded_picture(rig, camera, c, f);
      ByteImage mask = made.labels;
      for (std::uint8_t& value : mask.data) {
        value = value == kBackground ? 0 : 255;
      }
      pictures.push_back(std::move(made.picture));
      masks.push_back(std::move(mask));
      labels.push_back(std::move(made.labels));
    }
  }
  return capture;
}

void write_seeded(const SeededCapture& capture, const std::filesystem::path& folder) {
  const std::vector<int>& frames = capture.info.sequences.front().frame_ids;
  for (std::size_t c = 0; c < capture.cameras.size(); ++c) {
    const std::string& id = capture.cameras[c].id;
    const auto write = [&](const char* kind, const char* extension, const auto& all,
                           const auto& how) {
      if (c < all.size()) {
        make_private_directory(folder / kind / id);
        for (std::size_t f = 0; f < all[c].size(); ++f) {
          how(folder / kind / id / (frame_name(frames[f]) + extension), all[c][f]);
        }
      }
    };
    const auto picture = [](const std::filesystem::path& file, const ByteImage& image) {
      write_image(file, image);
    };
    write("images", ".png", capture.pictures, picture);
    write("masks", ".png", capture.masks, picture);
    write("labels", ".png", capture.labels, picture);
    write("keypoints2d", ".json", capture.keypoints,
          [](const std::filesystem::path& file, const Keypoints2d& rows) {
            std::ofstream(file) << openpose_json({{-1, rows}});
          });
  }
  std::ofstream(folder / "cameras.json") << cameras_json(capture.cameras);
  std::ofstream(folder / "capture.toml") << capture_toml(capture.info);
}

}  // namespace atelier::fixtures
