#include "capture/people/second_look.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "capture/associate_people.h"
#include "capture/keypoint_schema.h"
#include "capture/triangulation.h"
#include "core/error.h"
#include "core/median.h"

namespace atelier {
namespace {

constexpr int kFewPoints = 10;       ///< a person with fewer in space proposes nothing
constexpr double kHeadRoom = 1.15;   ///< the crop's circle beyond the furthest point
constexpr double kMirrorGain = 0.5;  ///< the mirrored person fits at least so much better

/// px of an image 1000 rows high: median distance over the points that both have; nothing for
/// fewer than kFewPoints.
std::optional<double> disagreement(const Keypoints2d& found, const Keypoints2d& expected,
                                   int height) {
  std::vector<double> distances;
  for (Index k = 0; k < found.rows(); ++k) {
    if (found(k, 2) > 0 && expected(k, 2) > 0) {
      distances.push_back((found.row(k).head<2>() - expected.row(k).head<2>()).norm());
    }
  }
  if (static_cast<int>(distances.size()) < kFewPoints) {
    return std::nullopt;
  }
  return median(std::move(distances)) * 1000 / height;
}

Keypoints2d mirrored_points(const Keypoints2d& points, const KeypointSchema& schema) {
  Keypoints2d result = points;
  for (Index k = 0; k < points.rows(); ++k) {
    result.row(k) = points.row(schema.mirror[static_cast<std::size_t>(k)]);
  }
  return result;
}

Keypoints2d projected(const Camera& camera, const SpacePose& pose) {
  Keypoints2d points = Keypoints2d::Zero(static_cast<Index>(pose.points.size()), 3);
  for (std::size_t k = 0; k < pose.points.size(); ++k) {
    const SpacePoint& point = pose.points[k];
    const auto pixel = point.confidence > 0 ? project(camera, point.place) : std::nullopt;
    if (pixel) {
      points.row(static_cast<Index>(k)) << pixel->x(), pixel->y(), point.confidence;
    }
  }
  return points;
}

/// The crop of a person that is mostly in the image; nothing where it is not, or where hips or
/// shoulders are not known.
std::optional<PersonCrop> proposed_crop(const Keypoints2d& points, const KeypointSchema& schema,
                                        const Camera& camera) {
  int known = 0;
  int inside = 0;
  for (Index k = 0; k < points.rows(); ++k) {
    if (points(k, 2) > 0) {
      ++known;
      inside += points(k, 0) >= 0 && points(k, 1) >= 0 && points(k, 0) < camera.width &&
                points(k, 1) < camera.height;
    }
  }
  const auto middle_of = [&](const char* left,
                             const char* right) -> std::optional<Eigen::Vector2d> {
    const int a = find_keypoint(schema, left);
    const int b = find_keypoint(schema, right);
    if (points(a, 2) <= 0 || points(b, 2) <= 0) {
      return std::nullopt;
    }
    return Eigen::Vector2d((points.row(a) + points.row(b)).head<2>() / 2);
  };
  const auto hips = middle_of("left_hip", "right_hip");
  const auto shoulders = middle_of("left_shoulder", "right_shoulder");
  if (known < kFewPoints || 2 * inside < known || !hips || !shoulders ||
      !((*shoulders - *hips).norm() > 1)) {
    return std::nullopt;
  }
  double radius = 0;
  for (Index k = 0; k < points.rows(); ++k) {
    if (points(k, 2) > 0) {
      radius = std::max(radius, (points.row(k).head<2>().transpose() - *hips).norm());
    }
  }
  return person_crop(*hips, *hips + kHeadRoom * radius * (*shoulders - *hips).normalized());
}

}  // namespace

Keypoints2d found_points(const PersonLandmarks& person, int width, int height, double threshold) {
  Keypoints2d points = person.points;
  for (Index k = 0; k < points.rows(); ++k) {
    const bool inside =
        points(k, 0) >= 0 && points(k, 1) >= 0 && points(k, 0) < width && points(k, 1) < height;
    if (!inside || points(k, 2) < threshold) {
      points.row(k).setZero();
    }
  }
  return points;
}

std::vector<SecondLook> second_looks(const std::vector<Camera>& cameras, PeopleInViews& people,
                                     const SecondLookOptions& options, int& mirrored) {
  ATELIER_CHECK(people.size() == cameras.size(), "people of each camera");
  const std::size_t frame_count = people.empty() ? 0 : people.front().size();
  const KeypointSchema& schema = keypoint_schema(kBuiltInSchema);
  Detections seen;
  seen.people.resize(frame_count);
  for (std::size_t f = 0; f < frame_count; ++f) {
    seen.frame_ids.push_back(static_cast<int>(f));
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      ATELIER_CHECK(people[c].size() == frame_count, "as many frames in each camera");
      std::vector<PersonKeypoints> persons;
      for (const PersonLandmarks& one : people[c][f]) {
        persons.push_back(
            {-1, found_points(one, cameras[c].width, cameras[c].height, options.threshold)});
      }
      seen.people[f].push_back(std::move(persons));
    }
  }
  TriangulationOptions how;
  how.min_confidence = options.threshold;
  how.inlier = options.agree;
  how.distances = false;
  how.bridge = 0;
  std::vector<std::vector<std::vector<Keypoints2d>>> persons = {main_person(seen)};
  if (max_people(seen) > 1) {
    persons = associate_people(cameras, seen, schema, how);
  }
  std::vector<SecondLook> looks;
  for (const auto& person : persons) {
    const Triangulation space = triangulate(cameras, person, schema, options.fps, how);
    for (std::size_t f = 0; f < frame_count; ++f) {
      for (std::size_t c = 0; c < cameras.size(); ++c) {
        SecondLook look{
            static_cast<Index>(c), f, -1, -1, {}, projected(cameras[c], space.frames[f])};
        if (const Keypoints2d& found = person[f][c]; found.rows() > 0) {
          const auto error = disagreement(found, look.expected, cameras[c].height);
          if (!error || *error <= options.agree) {
            continue;
          }
          look.error = *error;
          const auto& all = seen.people[f][c];
          const auto same = std::find_if(all.begin(), all.end(), [&](const PersonKeypoints& one) {
            return one.points == found;
          });
          look.person = static_cast<int>(same - all.begin());
          const auto other =
              disagreement(mirrored_points(found, schema), look.expected, cameras[c].height);
          if (same != all.end() && other && *other <= kMirrorGain * *error &&
              *other <= options.agree) {
            PersonLandmarks& one = people[c][f][static_cast<std::size_t>(look.person)];
            one.points = mirrored_points(one.points, schema);
            ++mirrored;
            continue;
          }
        }
        if (const auto crop = proposed_crop(look.expected, schema, cameras[c])) {
          look.crop = *crop;
          looks.push_back(std::move(look));
        }
      }
    }
  }
  return looks;
}

bool take_second_look(const SecondLook& look, const PersonLandmarks& found, const Camera& camera,
                      const SecondLookOptions& options, double min_presence,
                      PeopleInViews& people) {
  const auto error =
      disagreement(found_points(found, camera.width, camera.height, options.threshold),
                   look.expected, camera.height);
  if (!error || found.presence < min_presence ||
      *error >= (look.person < 0 ? options.agree : look.error)) {
    return false;
  }
  PeopleInImage& image = people[static_cast<std::size_t>(look.camera)][look.frame];
  if (look.person < 0) {
    image.push_back(found);
  } else if (static_cast<std::size_t>(look.person) < image.size()) {
    image[static_cast<std::size_t>(look.person)] = found;
  }
  return true;
}

}  // namespace atelier
