#include "capture/keypoints3d_file.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "capture/person_id.h"
#include "core/error.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

Keypoints3d points_of(const JsonPlace& place, const std::vector<double>& values, double farthest) {
  if (values.size() % 4 != 0 || values.empty()) {
    place.fail(counted(static_cast<std::int64_t>(values.size()), "number"),
               "x, y, z and confidence of points");
  }
  Keypoints3d points(static_cast<Index>(values.size() / 4), 4);
  for (Index i = 0; i < points.rows(); ++i) {
    for (Index j = 0; j < 4; ++j) {
      points(i, j) = values[static_cast<std::size_t>(4 * i + j)];
      if (!(std::abs(points(i, j)) < farthest)) {
        place.fail("point " + std::to_string(i) + " is far beyond any capture", "coordinates");
      }
    }
    if (points(i, 3) <= 0) {
      points.row(i).setZero();
    }
  }
  return points;
}

nlohmann::ordered_json entry_of(int id) {
  nlohmann::ordered_json entry;
  entry["id"] = id;
  entry["keypoints3d"] = nlohmann::ordered_json::array();
  return entry;
}

}  // namespace

std::vector<PersonPoints> parse_keypoints3d(std::string_view text, const std::string& file,
                                            const Limits& limits) {
  const nlohmann::json parsed = parse_json(text, file, limits);
  const JsonPlace root(parsed, file);
  std::vector<PersonPoints> people;
  if (parsed.is_array()) {
    for (const JsonPlace& entry : root.items()) {
      std::vector<double> values;
      const JsonPlace rows = entry.at("keypoints3d");
      for (const JsonPlace& row : rows.items()) {
        const std::vector<double> four = row.numbers();
        if (four.size() != 4) {
          row.fail(counted(static_cast<std::int64_t>(four.size()), "number"),
                   "x, y, z and confidence");
        }
        values.insert(values.end(), four.begin(), four.end());
      }
      people.push_back({static_cast<int>(entry.integer_or("id", -1, -1, kMaxPeople)),
                        points_of(rows, values, limits.mesh_coordinate)});
    }
  } else {
    for (const JsonPlace& body : root.at("bodies").items()) {
      const JsonPlace joints = body.at("joints19");
      people.push_back({static_cast<int>(body.integer_or("id", -1, -1, kMaxPeople)),
                        points_of(joints, joints.numbers(), limits.mesh_coordinate)});
    }
  }
  return people;
}

std::map<int, std::vector<double>> parse_keypoint_deviations(std::string_view text,
                                                             const std::string& file,
                                                             const Limits& limits) {
  const nlohmann::json parsed = parse_json(text, file, limits);
  std::map<int, std::vector<double>> all;
  if (!parsed.is_array()) {
    return all;
  }
  for (const JsonPlace& entry : JsonPlace(parsed, file).items()) {
    if (!entry.has("deviations")) {
      continue;
    }
    const JsonPlace place = entry.at("deviations");
    std::vector<double> values = place.numbers();
    for (const double value : values) {
      if (!(value >= 0 && value < limits.mesh_coordinate)) {
        place.fail("a deviation of " + short_number(value), "metres of at least 0");
      }
    }
    if (values.size() == entry.at("keypoints3d").size()) {
      all[static_cast<int>(entry.integer_or("id", -1, -1, kMaxPeople))] = std::move(values);
    }
  }
  return all;
}

std::map<int, std::vector<int>> parse_bridged_keypoints(std::string_view text,
                                                        const std::string& file,
                                                        const Limits& limits) {
  const nlohmann::json parsed = parse_json(text, file, limits);
  std::map<int, std::vector<int>> all;
  if (!parsed.is_array()) {
    return all;
  }
  for (const JsonPlace& entry : JsonPlace(parsed, file).items()) {
    if (!entry.has("bridged")) {
      continue;
    }
    const JsonPlace place = entry.at("bridged");
    const auto points = static_cast<double>(entry.at("keypoints3d").size());
    std::vector<int> numbers;
    for (const double value : place.numbers()) {
      if (!(value >= 0 && value < points) || value != std::floor(value)) {
        place.fail("point " + std::to_string(value), "numbers of the points, from 0");
      }
      numbers.push_back(saturating_cast<int>(value));
    }
    all[static_cast<int>(entry.integer_or("id", -1, -1, kMaxPeople))] = std::move(numbers);
  }
  return all;
}

std::string keypoints3d_json(const std::vector<PersonPoints>& people) {
  nlohmann::ordered_json root = nlohmann::ordered_json::array();
  for (const PersonPoints& person : people) {
    nlohmann::ordered_json entry = entry_of(person.id);
    for (Index i = 0; i < person.points.rows(); ++i) {
      entry["keypoints3d"].push_back(
          {person.points(i, 0), person.points(i, 1), person.points(i, 2), person.points(i, 3)});
    }
    root.push_back(entry);
  }
  return root.dump() + "\n";
}

std::string keypoints3d_json(const std::vector<PersonPose>& people) {
  nlohmann::ordered_json root = nlohmann::ordered_json::array();
  for (const PersonPose& person : people) {
    nlohmann::ordered_json entry = entry_of(person.id);
    entry["bridged"] = nlohmann::ordered_json::array();
    entry["deviations"] = nlohmann::ordered_json::array();
    for (std::size_t k = 0; k < person.pose.points.size(); ++k) {
      const SpacePoint& point = person.pose.points[k];
      const bool found = point.confidence > 0;
      const Eigen::Vector3d place = found ? point.place : Eigen::Vector3d::Zero();
      entry["keypoints3d"].push_back(
          {place.x(), place.y(), place.z(), found ? point.confidence : 0.0});
      entry["deviations"].push_back(found ? std::sqrt(point.covariance.trace() / 3) : 0.0);
      if (found && point.bridged) {
        entry["bridged"].push_back(k);
      }
    }
    root.push_back(entry);
  }
  return root.dump() + "\n";
}

}  // namespace atelier
