#include "capture/keypoint_schema.h"

#include <algorithm>

#include "core/error.h"

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

std::vector<std::string> wholebody_points() {
  std::vector<std::string> points = {
      "nose",          "left_eye",        "right_eye",    "left_ear",       "right_ear",
      "left_shoulder", "right_shoulder",  "left_elbow",   "right_elbow",    "left_wrist",
      "right_wrist",   "left_hip",        "right_hip",    "left_knee",      "right_knee",
      "left_ankle",    "right_ankle",     "left_big_toe", "left_small_toe", "left_heel",
      "right_big_toe", "right_small_toe", "right_heel"};
  for (int i = 0; i < 68; ++i) {
    points.push_back("face_" + std::to_string(i));
  }
  for (const std::string side : {"left", "right"}) {
    points.push_back(side + "_hand_root");
    for (const std::string finger : {"thumb", "index", "middle", "ring", "little"}) {
      for (int i = 1; i <= 4; ++i) {
        points.push_back(side + "_" + finger + "_" + std::to_string(i));
      }
    }
  }
  return points;
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

const KeypointSchema& keypoint_schema(std::string_view name) {
  if (name == "body_25") {
    return body_25_schema();
  }
  if (name == "coco_wholebody") {
    return coco_wholebody_schema();
  }
  throw DataError("", "keypoint_schema", "'" + std::string(name) + "'",
                  "body_25 or coco_wholebody");
}

int find_keypoint(const KeypointSchema& schema, std::string_view point) {
  const auto found = std::find(schema.points.begin(), schema.points.end(), point);
  return found == schema.points.end() ? -1 : static_cast<int>(found - schema.points.begin());
}

}  // namespace atelier
