#include "capture/associate_people.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr double kAgree = 0.4;      // mean support of the joints of two detections of one person
constexpr int kMinJoints = 4;       // that two detections have in common
constexpr std::size_t kSeeds = 24;  // best pairs that are tried as a person
constexpr double kStride = 0.6;     // m, furthest that somebody gets between two frames

/// One person in one picture.
struct Node {
  std::size_t camera = 0;
  std::size_t person = 0;
  const Keypoints2d* rows = nullptr;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  std::vector<std::optional<Eigen::Vector3d>> rays;  ///< of the confident joints
};

/// Joints in space; none where they are not known.
using Body = std::vector<std::optional<Eigen::Vector3d>>;

/// Somebody in one frame: a node of each camera, or none.
struct Person {
  std::vector<int> nodes;  ///< [camera], -1: none
  Body body;
  double support = 0;
  int views = 0;
};

std::vector<Node> nodes_of(const std::vector<Camera>& cameras,
                           const std::vector<std::vector<PersonKeypoints>>& people,
                           double min_confidence) {
  std::vector<Node> nodes;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    for (std::size_t p = 0; p < people[c].size(); ++p) {
      Node node;
      node.camera = c;
      node.person = p;
      node.rows = &people[c][p].points;
      node.origin = camera_center(cameras[c]);
      int seen = 0;
      for (Index k = 0; k < node.rows->rows(); ++k) {
        node.rays.push_back((*node.rows)(k, 2) >= std::max(min_confidence, 0.05)
                                ? ray_direction(cameras[c], node.rows->row(k).head<2>().transpose())
                                : std::nullopt);
        seen += node.rays.back() ? 1 : 0;
      }
      if (seen >= kMinJoints) {
        nodes.push_back(std::move(node));
      }
    }
  }
  return nodes;
}

std::optional<Eigen::Vector3d> meeting(const Node& a, const Node& b, std::size_t k) {
  if (!a.rays[k] || !b.rays[k]) {
    return std::nullopt;
  }
  const double cosine = a.rays[k]->dot(*b.rays[k]);
  const double sine2 = 1 - cosine * cosine;
  constexpr double kNearlyParallel = 0.003;
  if (sine2 < kNearlyParallel) {
    return std::nullopt;
  }
  const Eigen::Vector3d offset = b.origin - a.origin;
  const double s = (offset.dot(*a.rays[k]) - offset.dot(*b.rays[k]) * cosine) / sine2;
  const double t = (offset.dot(*a.rays[k]) * cosine - offset.dot(*b.rays[k])) / sine2;
  if (s <= 0 || t <= 0) {
    return std::nullopt;
  }
  return Eigen::Vector3d(0.5 * (a.origin + s * *a.rays[k] + b.origin + t * *b.rays[k]));
}

/// Mean support of a node's joints by a body: 1 exact, 0 beyond the inlier distance. Nothing with
/// too few joints in common.
std::optional<double> agreement(const Camera& camera, const Node& node, const Body& body,
                                double inlier) {
  double sum = 0;
  int count = 0;
  const double far2 = std::pow(inlier * camera.height / 1000.0, 2);
  for (std::size_t k = 0; k < body.size(); ++k) {
    if (!node.rays[k] || !body[k]) {
      continue;
    }
    ++count;
    if (const auto pixel = project(camera, *body[k])) {
      const double off2 =
          (*pixel - node.rows->row(static_cast<Index>(k)).head<2>().transpose()).squaredNorm();
      sum += std::max(0.0, 1 - off2 / far2);
    }
  }
  if (count < kMinJoints) {
    return std::nullopt;
  }
  return sum / count;
}

Body body_of(const Node& a, const Node& b) {
  Body body(a.rays.size());
  for (std::size_t k = 0; k < body.size(); ++k) {
    body[k] = meeting(a, b, k);
  }
  return body;
}

/// The detections that fit a body best, one of each camera at most.
void gather(const std::vector<Camera>& cameras, const std::vector<Node>& nodes,
            const std::vector<bool>& taken, double inlier, Person& person) {
  person.nodes.assign(cameras.size(), -1);
  person.support = 0;
  person.views = 0;
  std::vector<double> best(cameras.size(), kAgree);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const std::size_t c = nodes[n].camera;
    if (taken[n]) {
      continue;
    }
    const auto agreed = agreement(cameras[c], nodes[n], person.body, inlier);
    if (agreed && *agreed > best[c]) {
      best[c] = *agreed;
      person.nodes[c] = static_cast<int>(n);
    }
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (person.nodes[c] >= 0) {
      person.support += best[c];
      ++person.views;
    }
  }
}

/// The body of all of a person's detections.
void refine(const std::vector<Camera>& cameras, const std::vector<Node>& nodes,
            const TriangulationOptions& options, Person& person) {
  const auto points = person.body.size();
  for (std::size_t k = 0; k < points; ++k) {
    Keypoints2d rows = Keypoints2d::Zero(static_cast<Index>(cameras.size()), 3);
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      if (person.nodes[c] >= 0) {
        rows.row(static_cast<Index>(c)) =
            nodes[static_cast<std::size_t>(person.nodes[c])].rows->row(static_cast<Index>(k));
      }
    }
    const SpacePoint point = triangulate_point(cameras, rows, options);
    person.body[k] =
        point.confidence > 0 ? std::optional<Eigen::Vector3d>(point.place) : std::nullopt;
  }
}

struct Pair {
  std::size_t a = 0;
  std::size_t b = 0;
  double agreed = 0;
};

std::vector<Pair> pairs_of(const std::vector<Camera>& cameras, const std::vector<Node>& nodes,
                           double inlier) {
  std::vector<Pair> pairs;
  for (std::size_t a = 0; a < nodes.size(); ++a) {
    for (std::size_t b = a + 1; b < nodes.size(); ++b) {
      if (nodes[a].camera == nodes[b].camera) {
        continue;
      }
      const Body body = body_of(nodes[a], nodes[b]);
      const auto of_a = agreement(cameras[nodes[a].camera], nodes[a], body, inlier);
      const auto of_b = agreement(cameras[nodes[b].camera], nodes[b], body, inlier);
      if (of_a && of_b && std::min(*of_a, *of_b) > kAgree) {
        pairs.push_back({a, b, *of_a + *of_b});
      }
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& x, const Pair& y) { return x.agreed > y.agreed; });
  return pairs;
}

std::vector<Person> people_of(const std::vector<Camera>& cameras, const std::vector<Node>& nodes,
                              const TriangulationOptions& options) {
  const std::vector<Pair> pairs = pairs_of(cameras, nodes, options.inlier);
  std::vector<bool> taken(nodes.size(), false);
  std::vector<Person> people;
  // Two detections of different people meet by chance; three hardly ever do.
  const int least = cameras.size() > 3 ? std::max(options.min_views, 3) : options.min_views;
  for (;;) {
    Person best;
    std::size_t tried = 0;
    for (const Pair& pair : pairs) {
      if (taken[pair.a] || taken[pair.b]) {
        continue;
      }
      if (++tried > kSeeds) {
        break;
      }
      Person person;
      person.body = body_of(nodes[pair.a], nodes[pair.b]);
      gather(cameras, nodes, taken, options.inlier, person);
      if (person.views >= least && person.support > best.support) {
        best = std::move(person);
      }
    }
    if (best.views < least) {
      return people;
    }
    refine(cameras, nodes, options, best);
    gather(cameras, nodes, taken, options.inlier, best);
    bool any = false;
    for (const int node : best.nodes) {
      if (node >= 0) {
        taken[static_cast<std::size_t>(node)] = true;
        any = true;
      }
    }
    if (!any || best.views < options.min_views) {
      return people;
    }
    people.push_back(std::move(best));
  }
}

/// Mean distance of the joints that both have; infinity where there are too few.
double distance(const Body& a, const Body& b) {
  double sum = 0;
  int count = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (a[k] && b[k]) {
      sum += (*a[k] - *b[k]).norm();
      ++count;
    }
  }
  return count < kMinJoints ? std::numeric_limits<double>::infinity() : sum / count;
}

/// Somebody over time.
struct Track {
  Body last;
  Body before;               ///< the frame before `last`, for where it goes
  std::size_t frame = 0;     ///< of `last`
  std::vector<int> persons;  ///< [F], -1: not there
  int views = 0;
};

/// Where somebody is expected some frames on: as fast as before, for a while.
Body expected(const Track& track, std::size_t frames) {
  Body body = track.last;
  if (frames > 2 || track.before.empty()) {
    return body;
  }
  for (std::size_t k = 0; k < body.size(); ++k) {
    if (body[k] && track.before[k]) {
      *body[k] += static_cast<double>(frames) * (*track.last[k] - *track.before[k]);
    }
  }
  return body;
}

std::vector<Track> tracks_of(const std::vector<std::vector<Person>>& frames) {
  std::vector<Track> tracks;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    struct Match {
      double distance;
      std::size_t track;
      std::size_t person;
    };
    std::vector<Match> matches;
    for (std::size_t t = 0; t < tracks.size(); ++t) {
      const std::size_t gap = f - tracks[t].frame;
      const Body body = expected(tracks[t], gap);
      for (std::size_t p = 0; p < frames[f].size(); ++p) {
        const double off = distance(body, frames[f][p].body);
        constexpr double kMaxGaps = 3;
        if (off < kStride * std::min(static_cast<double>(gap), kMaxGaps)) {
          matches.push_back({off, t, p});
        }
      }
    }
    std::stable_sort(matches.begin(), matches.end(),
                     [](const Match& a, const Match& b) { return a.distance < b.distance; });
    std::vector<bool> taken(frames[f].size(), false);
    std::vector<bool> continued(tracks.size(), false);
    const auto put = [&](Track& track, std::size_t p) {
      track.before = f > 0 && track.frame + 1 == f ? track.last : Body{};
      track.last = frames[f][p].body;
      track.frame = f;
      track.persons[f] = static_cast<int>(p);
      track.views += frames[f][p].views;
      taken[p] = true;
    };
    for (const Match& match : matches) {
      if (!taken[match.person] && !continued[match.track]) {
        continued[match.track] = true;
        put(tracks[match.track], match.person);
      }
    }
    for (std::size_t p = 0; p < frames[f].size(); ++p) {
      if (!taken[p]) {
        Track track;
        track.persons.assign(frames.size(), -1);
        tracks.push_back(std::move(track));
        put(tracks.back(), p);
      }
    }
  }
  std::stable_sort(tracks.begin(), tracks.end(),
                   [](const Track& a, const Track& b) { return a.views > b.views; });
  return tracks;
}

}  // namespace

std::vector<std::vector<std::vector<Keypoints2d>>> associate_people(
    const std::vector<Camera>& cameras, const Detections& detections, const KeypointSchema& schema,
    const TriangulationOptions& options) {
  for (const auto& frame : detections.people) {
    ATELIER_CHECK(frame.size() == cameras.size(), "detections for each camera");
    for (const auto& people : frame) {
      for (const PersonKeypoints& person : people) {
        ATELIER_CHECK(person.points.rows() == static_cast<Index>(schema.points.size()),
                      "points of the schema");
      }
    }
  }
  const std::size_t frames = detections.people.size();
  std::vector<std::vector<Node>> nodes(frames);
  std::vector<std::vector<Person>> people(frames);
  parallel_for(static_cast<Index>(frames), 1, [&](Index begin, Index end) {
    for (auto f = static_cast<std::size_t>(begin); f < static_cast<std::size_t>(end); ++f) {
      nodes[f] = nodes_of(cameras, detections.people[f], options.min_confidence);
      people[f] = people_of(cameras, nodes[f], options);
    }
  });
  const std::vector<Track> tracks = tracks_of(people);
  std::vector<std::vector<std::vector<Keypoints2d>>> all;
  constexpr double kChance = 0.05;
  for (const Track& track : tracks) {
    if (track.views < kChance * tracks.front().views) {
      continue;
    }
    auto& of_person =
        all.emplace_back(frames, std::vector<Keypoints2d>(cameras.size(), Keypoints2d(0, 3)));
    for (std::size_t f = 0; f < frames; ++f) {
      if (track.persons[f] < 0) {
        continue;
      }
      const Person& person = people[f][static_cast<std::size_t>(track.persons[f])];
      for (std::size_t c = 0; c < cameras.size(); ++c) {
        if (person.nodes[c] >= 0) {
          of_person[f][c] = *nodes[f][static_cast<std::size_t>(person.nodes[c])].rows;
        }
      }
    }
  }
  return all;
}

}  // namespace atelier
