#include "capture/keypoints2d.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "capture/person_id.h"
#include "core/error.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/printable.h"

namespace atelier {
namespace {

/// Beyond this no detection lies, whatever the picture's size.
constexpr double kFarthest = 1e6;

Keypoints2d keypoints_of(const JsonPlace& place, const std::vector<double>& values, double shift) {
  if (values.size() % 3 != 0) {
    place.fail(counted(static_cast<std::int64_t>(values.size()), "number"),
               "triples of x, y and confidence");
  }
  Keypoints2d points(static_cast<Index>(values.size() / 3), 3);
  for (Index i = 0; i < points.rows(); ++i) {
    for (Index j = 0; j < 3; ++j) {
      points(i, j) = values[static_cast<std::size_t>(3 * i + j)];
      if (!(std::abs(points(i, j)) < kFarthest)) {
        place.fail("point " + std::to_string(i) + " at a million pixels or beyond",
                   "pixels and a confidence");
      }
    }
    // Keypoints that were not found stay 0, 0, 0.
    if (points(i, 2) != 0 || points(i, 0) != 0 || points(i, 1) != 0) {
      points(i, 0) += shift;
      points(i, 1) += shift;
    }
  }
  return points;
}

/// Numbers of [x, y, c, x, y, c, ...] or [[x, y, c], ...].
std::vector<double> flat_numbers(const JsonPlace& place) {
  if (place.size() == 0 || !place.value().front().is_array()) {
    return place.numbers();
  }
  std::vector<double> values;
  for (const JsonPlace& row : place.items()) {
    const std::vector<double> triple = row.numbers();
    if (triple.size() != 3) {
      row.fail(counted(static_cast<std::int64_t>(triple.size()), "number"), "x, y and confidence");
    }
    values.insert(values.end(), triple.begin(), triple.end());
  }
  return values;
}

void check_same_length(const std::vector<PersonKeypoints>& people, const JsonPlace& place) {
  for (const PersonKeypoints& person : people) {
    if (person.points.rows() != people.front().points.rows()) {
      place.fail("people of " + std::to_string(people.front().points.rows()) + " and " +
                     std::to_string(person.points.rows()) + " points",
                 "as many for everybody");
    }
  }
}

int id_of(const JsonPlace& place) {
  return static_cast<int>(place.integer(-1, kMaxPeople));
}

}  // namespace

std::vector<PersonKeypoints> parse_openpose(std::string_view text, const std::string& file,
                                            double shift, const Limits& limits) {
  const nlohmann::json parsed = parse_json(text, file, limits);
  const JsonPlace root(parsed, file);
  std::vector<PersonKeypoints> people;
  for (const JsonPlace& entry : root.at("people").items()) {
    const JsonPlace body = entry.at("pose_keypoints_2d");
    PersonKeypoints person;
    person.points = keypoints_of(body, body.numbers(), shift);
    if (person.points.rows() == 0) {
      continue;  // what the detector writes for a person of whom only a hand was seen
    }
    if (const auto id = entry.find("person_id")) {
      if (id->value().is_array()) {
        const std::vector<JsonPlace> ids = id->items();
        person.id = ids.empty() ? -1 : id_of(ids.front());
      } else {
        person.id = id_of(*id);
      }
    }
    people.push_back(std::move(person));
  }
  check_same_length(people, root);
  return people;
}

std::vector<PersonKeypoints> parse_easymocap_annotation(std::string_view text,
                                                        const std::string& file, double shift,
                                                        const Limits& limits) {
  const nlohmann::json parsed = parse_json(text, file, limits);
  const JsonPlace root(parsed, file);
  std::vector<PersonKeypoints> people;
  for (const JsonPlace& entry : parsed.is_array() ? root.items() : root.at("annots").items()) {
    const JsonPlace body = entry.at("keypoints");
    PersonKeypoints person;
    person.points = keypoints_of(body, flat_numbers(body), shift);
    if (const auto id = entry.has("personID") ? entry.find("personID") : entry.find("id")) {
      person.id = id_of(*id);
    }
    if (person.points.rows() > 0) {
      people.push_back(std::move(person));
    }
  }
  check_same_length(people, root);
  return people;
}

std::string openpose_json(const std::vector<PersonKeypoints>& people, double shift) {
  nlohmann::ordered_json root;
  root["version"] = 1.3;
  root["people"] = nlohmann::ordered_json::array();
  for (const PersonKeypoints& person : people) {
    nlohmann::ordered_json values = nlohmann::ordered_json::array();
    for (Index i = 0; i < person.points.rows(); ++i) {
      const bool found = !person.points.row(i).isZero(0);
      values.push_back(found ? person.points(i, 0) - shift : 0.0);
      values.push_back(found ? person.points(i, 1) - shift : 0.0);
      values.push_back(person.points(i, 2));
    }
    nlohmann::ordered_json entry;
    entry["person_id"] = {person.id};
    entry["pose_keypoints_2d"] = values;
    root["people"].push_back(entry);
  }
  return root.dump() + "\n";
}

}  // namespace atelier
