#include "capture/keypoints2d.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "capture/frame_number.h"
#include "capture/person_id.h"
#include "core/error.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/printable.h"

namespace atelier {
namespace {

/// Beyond this no detection lies, whatever the picture's size.
constexpr double kFarthest = 1e6;

/// Numbers of an array, NaN among them, which Python writes for what was not found.
std::vector<double> numbers_or_nan(const JsonPlace& place) {
  std::vector<double> values;
  for (const JsonPlace& item : place.items()) {
    const nlohmann::json& value = item.value();
    const bool nan = value.is_number_float() && std::isnan(value.get<double>());
    values.push_back(nan ? value.get<double>() : item.number());
  }
  return values;
}

Keypoints2d keypoints_of(const JsonPlace& place, const std::vector<double>& values, double shift) {
  if (values.size() % 3 != 0) {
    place.fail(counted(static_cast<std::int64_t>(values.size()), "number"),
               "triples of x, y and confidence");
  }
  Keypoints2d points(static_cast<Index>(values.size() / 3), 3);
  for (Index i = 0; i < points.rows(); ++i) {
    for (Index j = 0; j < 3; ++j) {
      points(i, j) = values[static_cast<std::size_t>(3 * i + j)];
    }
    if (!points.row(i).allFinite()) {
      points.row(i).setZero();
      continue;
    }
    for (Index j = 0; j < 3; ++j) {
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
    return numbers_or_nan(place);
  }
  std::vector<double> values;
  for (const JsonPlace& row : place.items()) {
    const std::vector<double> triple = numbers_or_nan(row);
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

/// The people of OpenPose's object.
std::vector<PersonKeypoints> openpose_people(const JsonPlace& root, double shift) {
  std::vector<PersonKeypoints> people;
  for (const JsonPlace& entry : root.at("people").items()) {
    const JsonPlace body = entry.at("pose_keypoints_2d");
    PersonKeypoints person;
    person.points = keypoints_of(body, numbers_or_nan(body), shift);
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

/// One instance of MMPose (rows of x and y, scores beside them) or of AlphaPose (triples).
PersonKeypoints person_of(const JsonPlace& entry, double shift) {
  const JsonPlace body = entry.at("keypoints");
  PersonKeypoints person;
  if (const auto scores = entry.find("keypoint_scores")) {
    const std::vector<double> confidence = numbers_or_nan(*scores);
    const std::vector<JsonPlace> rows = body.items();
    if (rows.size() != confidence.size()) {
      entry.fail(std::to_string(rows.size()) + " keypoints and " +
                     std::to_string(confidence.size()) + " scores",
                 "as many of both");
    }
    std::vector<double> values;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const std::vector<double> place = numbers_or_nan(rows[k]);
      if (place.size() != 2 && place.size() != 3) {
        rows[k].fail(counted(static_cast<std::int64_t>(place.size()), "number"), "x and y");
      }
      values.insert(values.end(), {place[0], place[1], confidence[k]});
    }
    person.points = keypoints_of(body, values, shift);
  } else {
    person.points = keypoints_of(body, flat_numbers(body), shift);
  }
  for (const char* key : {"track_id", "idx"}) {
    const auto id = entry.find(key);
    if (id && id->value().is_number_integer()) {
      person.id = id_of(*id);
      break;
    }
  }
  return person;
}

std::vector<PersonKeypoints> people_of(const std::vector<JsonPlace>& instances, double shift,
                                       const JsonPlace& place) {
  std::vector<PersonKeypoints> people;
  people.reserve(instances.size());
  for (const JsonPlace& instance : instances) {
    people.push_back(person_of(instance, shift));
  }
  check_same_length(people, place);
  return people;
}

int frame_named(const JsonPlace& place) {
  constexpr int kMost = 999'999'999;
  if (!place.value().is_string()) {
    return static_cast<int>(place.integer(0, kMost));
  }
  const std::optional<int> number = frame_number(place.text());
  if (!number) {
    place.fail("'" + place.text().substr(0, 60) + "'", "an image's name with a number");
  }
  return *number;
}

using PeopleOfFrames = std::map<int, std::vector<PersonKeypoints>>;

/// Frames of MMPose, each with `instances`; without `frame_id` in their order.
PeopleOfFrames mmpose_frames(const std::vector<JsonPlace>& items, double shift) {
  PeopleOfFrames frames;
  int next = 0;
  for (const JsonPlace& item : items) {
    const auto id = item.find("frame_id");
    const int frame = id ? frame_named(*id) : next;
    next = frame + 1;
    auto people = people_of(item.at("instances").items(), shift, item);
    if (!frames.emplace(frame, std::move(people)).second) {
      item.fail("frame " + std::to_string(frame) + " a second time", "each once");
    }
  }
  return frames;
}

/// What COCO calls the third number of a keypoint is how visible it is: 0 for not there, 1 hidden,
/// 2 seen. Of detections it is a confidence.
void confidences_of_visibility(PeopleOfFrames& frames) {
  double largest = 0;
  for (const auto& [frame, people] : frames) {
    for (const PersonKeypoints& person : people) {
      const auto visibility = person.points.col(2).array();
      if ((visibility != 0 && visibility != 1 && visibility != 2).any()) {
        return;
      }
      largest = std::max(largest, person.points.rows() > 0 ? visibility.maxCoeff() : 0);
    }
  }
  for (auto& [frame, people] : frames) {
    for (PersonKeypoints& person : people) {
      person.points.col(2) *= largest > 1 ? 0.5 : 1;
    }
  }
}

/// A data set of COCO: `annotations` of `images`, whose names have the frames' numbers.
PeopleOfFrames coco_frames(const JsonPlace& root, double shift, const Limits& limits) {
  constexpr std::int64_t kLargestId = 1'000'000'000'000'000;
  const std::vector<JsonPlace> annotations = root.at("annotations").items();
  if (static_cast<std::int64_t>(annotations.size()) > limits.frames) {
    root.fail(std::to_string(annotations.size()) + " annotations",
              "at most " + std::to_string(limits.frames));
  }
  std::map<std::int64_t, int> frame_of;
  PeopleOfFrames frames;
  for (const JsonPlace& image : root.items("images")) {
    const int frame = frame_named(image.at("file_name"));
    frame_of[image.at("id").integer(0, kLargestId)] = frame;
    if (!frames.try_emplace(frame).second) {
      image.fail("frame " + std::to_string(frame) + " a second time",
                 "the images of one camera, each with a number of its own");
    }
  }
  for (const JsonPlace& annotation : annotations) {
    if (!annotation.has("keypoints")) {
      continue;  // of a thing without
    }
    const JsonPlace id = annotation.at("image_id");
    const auto found = frame_of.find(id.integer(0, kLargestId));
    if (found == frame_of.end()) {
      id.fail("image " + std::to_string(id.integer(0, kLargestId)), "one of images");
    }
    PersonKeypoints person = person_of(annotation, shift);
    if (!person.points.isZero(0)) {
      frames[found->second].push_back(std::move(person));
    }
  }
  for (const auto& [frame, people] : frames) {
    check_same_length(people, root);
  }
  confidences_of_visibility(frames);
  return frames;
}

/// Whatever MMPose, AlphaPose and COCO write, told by its members.
PeopleOfFrames frames_in(const JsonPlace& root, double shift, const Limits& limits) {
  const auto refuse = [&](const JsonPlace& place, const std::string& found) {
    place.fail(found,
               "people (OpenPose), instance_info or instances (MMPose), annotations (COCO), or a "
               "list of keypoints with image_id (AlphaPose)");
  };
  PeopleOfFrames frames;
  if (root.value().is_object() && root.has("instance_info")) {
    return mmpose_frames(root.at("instance_info").items(), shift);
  }
  if (root.value().is_object() && root.has("instances")) {
    return mmpose_frames({root}, shift);
  }
  if (root.value().is_object() && root.has("annotations")) {
    return coco_frames(root, shift, limits);
  }
  if (root.value().is_array()) {
    const std::vector<JsonPlace> items = root.items();
    if (static_cast<std::int64_t>(items.size()) > limits.frames) {
      root.fail(std::to_string(items.size()) + " entries",
                "at most " + std::to_string(limits.frames));
    }
    if (!items.empty() && items.front().value().is_object() && items.front().has("instances")) {
      return mmpose_frames(items, shift);
    }
    for (const JsonPlace& item : items) {
      if (!item.value().is_object() || !item.has("keypoints")) {
        refuse(item, "no keypoints");
      }
      const auto image = item.find("image_id");
      frames[image ? frame_named(*image) : 0].push_back(person_of(item, shift));
    }
    for (const auto& [frame, people] : frames) {
      check_same_length(people, root);
    }
    return frames;
  }
  if (!root.value().is_object() || root.value().empty()) {
    refuse(root, "nothing of a detector that is known");
  }
  // AlphaPose's other formats: an object with one of OpenPose's for each image, or (PoseFlow) the
  // list of its people.
  for (const auto& [name, value] : root.value().items()) {
    const std::optional<int> number = frame_number(name);
    const bool list = value.is_array() && (value.empty() || value.front().contains("keypoints"));
    const bool of_image =
        number &&
        (list || (value.is_object() && (value.contains("people") || value.contains("bodies"))));
    if (!of_image) {
      refuse(root, "the member '" + name.substr(0, 60) + "'");
    }
    const JsonPlace image = root.at(name);
    std::vector<PersonKeypoints> people;
    if (list) {
      people = people_of(image.items(), shift, image);
    } else if (image.has("people")) {
      people = openpose_people(image, shift);
    } else {
      for (const JsonPlace& body : image.at("bodies").items()) {
        PersonKeypoints person;
        person.points = keypoints_of(body, flat_numbers(body.at("joints")), shift);
        people.push_back(std::move(person));
      }
      check_same_length(people, image);
    }
    frames.emplace(*number, std::move(people));
  }
  return frames;
}

}  // namespace

std::vector<PersonKeypoints> parse_openpose(std::string_view text, const std::string& file,
                                            double shift, const Limits& limits) {
  const nlohmann::json parsed = parse_python_json(text, file, limits);
  return openpose_people(JsonPlace(parsed, file), shift);
}

std::map<int, std::vector<PersonKeypoints>> parse_detection_frames(std::string_view text,
                                                                   const std::string& file,
                                                                   double shift,
                                                                   const Limits& limits) {
  const nlohmann::json parsed = parse_python_json(text, file, limits);
  return frames_in(JsonPlace(parsed, file), shift, limits);
}

std::vector<PersonKeypoints> parse_detections(std::string_view text, const std::string& file,
                                              double shift, const Limits& limits) {
  const nlohmann::json parsed = parse_python_json(text, file, limits);
  const JsonPlace root(parsed, file);
  if (root.value().is_object() && root.has("people")) {
    return openpose_people(root, shift);
  }
  std::map<int, std::vector<PersonKeypoints>> frames = frames_in(root, shift, limits);
  if (frames.size() > 1) {
    root.fail(std::to_string(frames.size()) + " frames in the file of one",
              "a file for each frame, or one file for the camera");
  }
  return frames.empty() ? std::vector<PersonKeypoints>() : std::move(frames.begin()->second);
}

std::vector<PersonKeypoints> parse_easymocap_annotation(std::string_view text,
                                                        const std::string& file, double shift,
                                                        const Limits& limits) {
  const nlohmann::json parsed = parse_python_json(text, file, limits);
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
