#include "capture/keypoint_schema.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/nearest_name.h"

namespace atelier {
namespace {

std::string mirrored_name(const std::string& name) {
  if (name.starts_with("left_")) {
    return "right_" + name.substr(5);
  }
  return name.starts_with("right_") ? "left_" + name.substr(6) : name;
}

/// The mirror image of each point of the 68 of iBUG 300-W (Sagonas et al. 2013).
std::vector<int> face_mirror() {
  std::vector<int> mirror(68);
  const auto pair = [&](int a, int b) {
    mirror[static_cast<std::size_t>(a)] = b;
    mirror[static_cast<std::size_t>(b)] = a;
  };
  for (int i = 0; i <= 8; ++i) {
    pair(i, 16 - i);  // jaw
  }
  for (int i = 17; i <= 21; ++i) {
    pair(i, 43 - i);  // brows
  }
  for (int i = 27; i <= 30; ++i) {
    pair(i, i);  // bridge of the nose
  }
  for (int i = 31; i <= 33; ++i) {
    pair(i, 66 - i);  // under the nose
  }
  for (int i = 36; i <= 39; ++i) {
    pair(i, 81 - i);  // upper lids
  }
  pair(40, 47);
  pair(41, 46);
  for (int i = 48; i <= 51; ++i) {
    pair(i, 102 - i);  // outer upper lip
  }
  for (int i = 55; i <= 57; ++i) {
    pair(i, 114 - i);  // outer lower lip
  }
  for (int i = 60; i <= 62; ++i) {
    pair(i, 124 - i);
  }
  pair(65, 67);
  pair(66, 66);
  return mirror;
}

KeypointSchema make_schema(std::string name, std::vector<std::string> points) {
  KeypointSchema schema{std::move(name), std::move(points), {}};
  const std::vector<int> face = face_mirror();
  const int face_begin = find_keypoint(schema, "face_0");
  for (std::size_t i = 0; i < schema.points.size(); ++i) {
    if (schema.points[i].starts_with("face_")) {
      schema.mirror.push_back(face_begin + face[i - static_cast<std::size_t>(face_begin)]);
    } else {
      schema.mirror.push_back(find_keypoint(schema, mirrored_name(schema.points[i])));
    }
  }
  return schema;
}

/// Limbs that join a person's outline in every schema that has both ends.
constexpr std::array<std::pair<const char*, const char*>, 15> kLimbs = {{
    {"left_shoulder", "left_elbow"},
    {"left_elbow", "left_wrist"},
    {"right_shoulder", "right_elbow"},
    {"right_elbow", "right_wrist"},
    {"left_shoulder", "left_hip"},
    {"right_shoulder", "right_hip"},
    {"left_hip", "left_knee"},
    {"left_knee", "left_ankle"},
    {"right_hip", "right_knee"},
    {"right_knee", "right_ankle"},
    {"left_shoulder", "right_shoulder"},
    {"left_hip", "right_hip"},
    {"nose", "left_eye"},
    {"nose", "right_eye"},
    {"left_ankle", "left_heel"},
}};

std::vector<std::string> coco_points() {
  return {"nose",          "left_eye",       "right_eye",  "left_ear",    "right_ear",
          "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist",
          "right_wrist",   "left_hip",       "right_hip",  "left_knee",   "right_knee",
          "left_ankle",    "right_ankle"};
}

std::vector<std::string> with(std::vector<std::string> points,
                              const std::vector<std::string>& more) {
  points.insert(points.end(), more.begin(), more.end());
  return points;
}

std::vector<std::string> wholebody_points() {
  std::vector<std::string> points =
      with(coco_points(), {"left_big_toe", "left_small_toe", "left_heel", "right_big_toe",
                           "right_small_toe", "right_heel"});
  for (int i = 0; i < 68; ++i) {
    points.push_back("face_" + std::to_string(i));
  }
  for (const std::string side : {"left", "right"}) {
    points.push_back(side + "_hand_root");
    for (const std::string finger : {"thumb", "index", "middle", "ring", "little"}) {
      for (int i = 1; i <= 4; ++i) {
        std::string point = side;
        point.append("_").append(finger).append("_").append(std::to_string(i));
        points.push_back(std::move(point));
      }
    }
  }
  return points;
}

/// BlazePose's order (Bazarevsky et al. 2020); knuckles under the names of COCO-WholeBody.
std::vector<std::string> blazepose_points() {
  std::vector<std::string> points = {"nose",
                                     "left_eye_inner",
                                     "left_eye",
                                     "left_eye_outer",
                                     "right_eye_inner",
                                     "right_eye",
                                     "right_eye_outer",
                                     "left_ear",
                                     "right_ear",
                                     "left_mouth_corner",
                                     "right_mouth_corner"};
  for (const char* part : {"shoulder", "elbow", "wrist", "little_1", "index_1", "thumb_2", "hip",
                           "knee", "ankle", "heel", "foot_index"}) {
    points.push_back(std::string("left_").append(part));
    points.push_back(std::string("right_").append(part));
  }
  return points;
}

/// In the order in which a number of points alone decides.
const std::vector<KeypointSchema>& all_schemas() {
  static const std::vector<KeypointSchema> schemas = {
      body_25_schema(),
      make_schema("body_25b", with(coco_points(), {"upper_neck", "head_top", "left_big_toe",
                                                   "left_small_toe", "left_heel", "right_big_toe",
                                                   "right_small_toe", "right_heel"})),
      make_schema("coco_17", coco_points()),
      make_schema("coco_18",
                  {"nose", "neck", "right_shoulder", "right_elbow", "right_wrist", "left_shoulder",
                   "left_elbow", "left_wrist", "right_hip", "right_knee", "right_ankle", "left_hip",
                   "left_knee", "left_ankle", "right_eye", "left_eye", "right_ear", "left_ear"}),
      make_schema("halpe_26", with(coco_points(), {"head_top", "neck", "mid_hip", "left_big_toe",
                                                   "right_big_toe", "left_small_toe",
                                                   "right_small_toe", "left_heel", "right_heel"})),
      coco_wholebody_schema(),
      make_schema("coco_19", {"neck", "nose", "mid_hip", "left_shoulder", "left_elbow",
                              "left_wrist", "left_hip", "left_knee", "left_ankle", "right_shoulder",
                              "right_elbow", "right_wrist", "right_hip", "right_knee",
                              "right_ankle", "left_eye", "left_ear", "right_eye", "right_ear"}),
      make_schema("blazepose_33", blazepose_points())};
  return schemas;
}

}  // namespace

const KeypointSchema& body_25_schema() {
  static const KeypointSchema schema = make_schema(
      "body_25",
      {"nose",           "neck",        "right_shoulder", "right_elbow",     "right_wrist",
       "left_shoulder",  "left_elbow",  "left_wrist",     "mid_hip",         "right_hip",
       "right_knee",     "right_ankle", "left_hip",       "left_knee",       "left_ankle",
       "right_eye",      "left_eye",    "right_ear",      "left_ear",        "left_big_toe",
       "left_small_toe", "left_heel",   "right_big_toe",  "right_small_toe", "right_heel"});
  return schema;
}

const KeypointSchema& coco_wholebody_schema() {
  static const KeypointSchema schema = make_schema("coco_wholebody", wholebody_points());
  return schema;
}

const std::vector<std::string>& keypoint_schema_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const KeypointSchema& schema : all_schemas()) {
      result.push_back(schema.name);
    }
    return result;
  }();
  return names;
}

const KeypointSchema& keypoint_schema(std::string_view name) {
  for (const KeypointSchema& schema : all_schemas()) {
    if (schema.name == name) {
      return schema;
    }
  }
  std::string known;
  for (const std::string& other : keypoint_schema_names()) {
    known += (known.empty() ? "" : ", ") + other;
  }
  throw DataError("", "keypoint_schema", "'" + std::string(name.substr(0, 60)) + "'",
                  "one of " + known + did_you_mean(name, keypoint_schema_names()));
}

int find_keypoint(const KeypointSchema& schema, std::string_view point) {
  const auto found = std::find(schema.points.begin(), schema.points.end(), point);
  return found == schema.points.end() ? -1 : static_cast<int>(found - schema.points.begin());
}

std::optional<double> limb_stretch(const KeypointSchema& schema, const Keypoints2d& points,
                                   double least) {
  ATELIER_CHECK(points.rows() == static_cast<Index>(schema.points.size()),
                "points of another schema");
  Eigen::AlignedBox2d box;
  for (Index i = 0; i < points.rows(); ++i) {
    if (points(i, 2) > least) {
      box.extend(Eigen::Vector2d(points(i, 0), points(i, 1)));
    }
  }
  double sum = 0;
  int count = 0;
  for (const auto& [from, to] : kLimbs) {
    const int a = find_keypoint(schema, from);
    const int b = find_keypoint(schema, to);
    if (a >= 0 && b >= 0 && points(a, 2) > least && points(b, 2) > least) {
      sum += (points.block<1, 2>(a, 0) - points.block<1, 2>(b, 0)).norm();
      ++count;
    }
  }
  constexpr int kEnough = 4;
  if (count < kEnough || !(box.diagonal().norm() > 0)) {
    return std::nullopt;
  }
  return sum / count / box.diagonal().norm();
}

std::string guess_keypoint_schema(Index points, const std::vector<Keypoints2d>& people) {
  std::string best;
  double best_stretch = std::numeric_limits<double>::infinity();
  for (const KeypointSchema& schema : all_schemas()) {
    if (static_cast<Index>(schema.points.size()) != points) {
      continue;
    }
    double sum = 0;
    int count = 0;
    for (const Keypoints2d& person : people) {
      if (person.rows() == points) {
        if (const std::optional<double> stretch = limb_stretch(schema, person)) {
          sum += *stretch;
          ++count;
        }
      }
    }
    const double stretch = count > 0 ? sum / count : std::numeric_limits<double>::max();
    if (stretch < best_stretch) {
      best_stretch = stretch;
      best = schema.name;
    }
  }
  return best;
}

}  // namespace atelier
