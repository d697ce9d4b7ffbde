#include "registration/tracking/printed_code.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"
#include "registration/tracking/wide_numbers.h"

namespace atelier {
namespace {

using Vector3 = Eigen::Vector3d;

constexpr int kDirections = 24;
constexpr std::array<double, 5> kRings = {0.008, 0.015, 0.022, 0.029, 0.036};  // m
constexpr int kRingCount = static_cast<int>(kRings.size());
constexpr int kPoints = kRingCount * kDirections;
constexpr int kHues = 2;
constexpr int kTurns = 2;  // of 15 degrees, to either side
constexpr float kMinKnown = 0.75F;
constexpr double kApart = 0.03;  // m: another place, not the same one again

Vector3 corner(const Points& x, const Triangles& faces, int face, int k) {
  return x.row(faces(face, k)).transpose();
}

Vector3 point_of(const Points& x, const Triangles& faces, int face, const Vector3& barycentric) {
  return barycentric[0] * corner(x, faces, face, 0) + barycentric[1] * corner(x, faces, face, 1) +
         barycentric[2] * corner(x, faces, face, 2);
}

/// The garment as it is walked over.
struct Ground {
  const Points& x;
  const Triangles& faces;
  Triangles neighbors;
  Points normals;  ///< of faces
  const ClothSamples& samples;
  std::vector<int> face_of;  ///< [S]

  /// The sample of a face that is nearest to a point in it.
  int nearest(int face, const Vector3& point) const {
    int best = -1;
    double least = std::numeric_limits<double>::infinity();
    for (int s = samples.offsets[static_cast<std::size_t>(face)];
         s < samples.offsets[static_cast<std::size_t>(face) + 1]; ++s) {
      const double squared = (place(face, s) - point).squaredNorm();
      if (squared < least) {
        least = squared;
        best = s;
      }
    }
    return best;
  }
  Vector3 place(int face, int sample) const {
    return point_of(x, faces, face,
                    samples.barycentric[static_cast<std::size_t>(sample)].cast<double>());
  }
};

/// Samples straight ahead at the distance of every ring; -1 beyond the cloth's edge. The way is
/// straight on the surface: it crosses an edge at the angle at which it comes.
void walk(const Ground& ground, int face, Vector3 point, Vector3 direction,
          std::array<int, kRingCount>& found) {
  constexpr int kMaxFaces = 100;
  found.fill(-1);
  double gone = 0;
  std::size_t ring = 0;
  int entered = -1;
  for (int step = 0; step < kMaxFaces; ++step) {
    const Vector3 normal = ground.normals.row(face).transpose();
    double exit = std::numeric_limits<double>::infinity();
    int edge = -1;
    for (int k = 0; k < 3; ++k) {
      if (k == entered) {
        continue;
      }
      const Vector3 from = corner(ground.x, ground.faces, face, k);
      const Vector3 inward = normal.cross(corner(ground.x, ground.faces, face, (k + 1) % 3) - from);
      const double speed = -direction.dot(inward);
      if (speed > 0) {
        const double length = std::max(0.0, (point - from).dot(inward) / speed);
        if (length < exit) {
          exit = length;
          edge = k;
        }
      }
    }
    if (edge < 0) {
      return;
    }
    for (; ring < kRings.size() && kRings[ring] <= gone + exit; ++ring) {
      found[ring] = ground.nearest(face, point + (kRings[ring] - gone) * direction);
    }
    const int next = ground.neighbors(face, edge);
    if (ring == kRings.size() || next < 0) {
      return;
    }
    const Vector3 along = (corner(ground.x, ground.faces, face, (edge + 1) % 3) -
                           corner(ground.x, ground.faces, face, edge))
                              .normalized();
    const double forward = direction.dot(along);
    const double side = std::sqrt(std::max(0.0, 1 - forward * forward));
    // The next face runs along the edge the other way.
    const Vector3 inward = -Vector3(ground.normals.row(next).transpose()).cross(along);
    point += exit * direction;
    gone += exit;
    direction = (forward * along + side * inward.normalized()).normalized();
    const int end = ground.faces(face, (edge + 1) % 3);
    for (int k = 0; k < 3; ++k) {
      if (ground.faces(next, k) == end) {
        entered = k;
      }
    }
    face = next;
  }
}

/// Samples around a place, [rings x directions]; the first direction is the world's up.
void add_fan(const Ground& ground, int sample, int* points) {
  const int face = ground.face_of[static_cast<std::size_t>(sample)];
  const Vector3 normal = ground.normals.row(face).transpose();
  constexpr double kFlat = 0.2;
  Vector3 up = Vector3::UnitY() - normal.y() * normal;
  if (up.norm() < kFlat) {
    up = Vector3::UnitZ() - normal.z() * normal;
  }
  up.normalize();
  const Vector3 right = normal.cross(up);
  const Vector3 start = ground.place(face, sample);
  for (int d = 0; d < kDirections; ++d) {
    const double angle = 2 * std::numbers::pi * d / kDirections;
    std::array<int, kRingCount> found{};
    walk(ground, face, start, std::cos(angle) * up + std::sin(angle) * right, found);
    for (int ring = 0; ring < kRingCount; ++ring) {
      points[ring * kDirections + d] = found[static_cast<std::size_t>(ring)];
    }
  }
}

/// Those of `from` no two of which are nearer than `spacing`, the first ones first.
std::vector<int> thinned(const Points& places, double spacing) {
  std::map<std::array<int, 3>, std::vector<int>> cells;
  std::vector<int> kept;
  for (int i = 0; i < static_cast<int>(places.rows()); ++i) {
    std::array<int, 3> cell{};
    for (int k = 0; k < 3; ++k) {
      cell[static_cast<std::size_t>(k)] = saturating_cast<int>(std::floor(places(i, k) / spacing));
    }
    bool free = true;
    for (int n = 0; n < 27 && free; ++n) {
      const auto near =
          cells.find({cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1});
      if (near != cells.end()) {
        free = std::none_of(near->second.begin(), near->second.end(), [&](int other) {
          return (places.row(i) - places.row(other)).squaredNorm() < spacing * spacing;
        });
      }
    }
    if (free) {
      cells[cell].push_back(i);
      kept.push_back(i);
    }
  }
  return kept;
}

/// The part of a sample's colour that shade does not change: red against green, both against blue.
/// [S, 2], of what is known.
Eigen::Matrix<float, Eigen::Dynamic, kHues> hues_of(const GarmentTexture& texture) {
  const std::vector<float>& values = texture.levels.front();
  constexpr float kDark = 0.01F;  // light below which hues are noise
  Eigen::Matrix<float, Eigen::Dynamic, kHues> hues(static_cast<Index>(texture.known.size()), kHues);
  hues.setZero();
  for (std::size_t s = 0; s < texture.known.size(); ++s) {
    if (texture.known[s] != 0) {
      const float r = values[3 * s] * values[3 * s];
      const float g = values[3 * s + 1] * values[3 * s + 1];
      const float b = values[3 * s + 2] * values[3 * s + 2];
      const float all = r + g + b + kDark;
      hues(static_cast<Index>(s), 0) = (r - g) / all;
      hues(static_cast<Index>(s), 1) = (r + g - 2 * b) / all;
    }
  }
  return hues;
}

/// The descriptor around a place: hues less their means, of unit length; nothing where too little
/// is known, or too little differs.
bool add_word(const int* points, const Eigen::Matrix<float, Eigen::Dynamic, kHues>& hues,
              const std::vector<char>& known, double contrast, float* descriptor) {
  float all = 0;
  float sum = 0;
  std::array<float, kHues> means{};
  const auto weight_of = [](int i) {
    return static_cast<float>(kRings[static_cast<std::size_t>(i / kDirections)]);
  };
  for (int i = 0; i < kPoints; ++i) {
    all += weight_of(i);
    if (points[i] >= 0 && known[static_cast<std::size_t>(points[i])] != 0) {
      sum += weight_of(i);
      for (int h = 0; h < kHues; ++h) {
        means[static_cast<std::size_t>(h)] += weight_of(i) * hues(points[i], h);
      }
    }
  }
  std::fill(descriptor, descriptor + kHues * kPoints, 0.0F);
  if (!(sum >= kMinKnown * all)) {
    return false;
  }
  float squares = 0;
  for (int i = 0; i < kPoints; ++i) {
    if (points[i] >= 0 && known[static_cast<std::size_t>(points[i])] != 0) {
      for (int h = 0; h < kHues; ++h) {
        const float off = hues(points[i], h) - means[static_cast<std::size_t>(h)] / sum;
        squares += weight_of(i) * off * off;
        descriptor[h * kPoints + i] = std::sqrt(weight_of(i)) * off;
      }
    }
  }
  if (!(squares >= static_cast<float>(contrast * contrast) * sum)) {
    std::fill(descriptor, descriptor + kHues * kPoints, 0.0F);
    return false;
  }
  const float length = std::sqrt(squares);
  for (int i = 0; i < kHues * kPoints; ++i) {
    descriptor[i] /= length;
  }
  return true;
}

/// A descriptor as it is read when the cloth is turned by steps of a direction.
Eigen::VectorXf turned_word(const Eigen::VectorXf& descriptor, int steps) {
  Eigen::VectorXf turned(descriptor.size());
  for (int i = 0; i < static_cast<int>(descriptor.size()); ++i) {
    const int d = i % kDirections;
    turned[i] = descriptor[i - d + (d + steps + kDirections) % kDirections];
  }
  return turned;
}

std::vector<int> faces_of_samples(const ClothSamples& samples) {
  std::vector<int> faces(samples.areas.size());
  for (std::size_t f = 0; f + 1 < samples.offsets.size(); ++f) {
    std::fill(faces.begin() + samples.offsets[f], faces.begin() + samples.offsets[f + 1],
              static_cast<int>(f));
  }
  return faces;
}

/// A site and the place that it was read as.
struct Candidate {
  int site = 0;  ///< of the places
  int place = -1;
  float correlation = 0;
};

/// The most of what a descriptor has in common with one that is turned by several steps.
/// @param turned  [2 kTurns + 1, kHues kPoints]
[[gnu::always_inline]] inline float max_product(const float* descriptor, const float* turned) {
  constexpr int kWords = 2 * kTurns + 1;
  constexpr int kLanes = 8;
  constexpr int kLength = kHues * kPoints;
  static_assert(kLength % kLanes == 0);
  EightFloats sums[kWords] = {};
  for (int i = 0; i < kLength; i += kLanes) {
    const EightFloats part = *reinterpret_cast<const EightFloats*>(descriptor + i);
    for (int k = 0; k < kWords; ++k) {
      sums[k] += part * *reinterpret_cast<const EightFloats*>(turned + k * kLength + i);
    }
  }
  float most = -1;
  for (const EightFloats& lanes : sums) {
    float sum = 0;
    for (int lane = 0; lane < kLanes; ++lane) {
      sum += lanes[lane];
    }
    most = std::max(most, sum);
  }
  return most;
}

ATELIER_AVX2 float max_product_avx2(const float* descriptor, const float* turned) {
  return max_product(descriptor, turned);
}

float max_product_plain(const float* descriptor, const float* turned) {
  return max_product(descriptor, turned);
}

/// The place that a site's descriptor finds within reach, or none.
Candidate looked_up(const PrintedCodebook& code, int site, const Eigen::VectorXf& descriptor) {
  Eigen::MatrixXf turns(descriptor.size(), 2 * kTurns + 1);
  for (int steps = -kTurns; steps <= kTurns; ++steps) {
    turns.col(steps + kTurns) = turned_word(descriptor, steps);
  }
  const auto product = has_avx2() ? max_product_avx2 : max_product_plain;
  Candidate best;
  best.site = site;
  std::vector<std::pair<int, float>> all;
  for (Index i = 0; i < code.rest.rows(); ++i) {
    if (!((code.rest.row(i) - code.rest.row(site)).squaredNorm() <
          code.options.reach * code.options.reach)) {
      continue;
    }
    const float most = product(code.descriptors.col(i).data(), turns.data());
    all.emplace_back(static_cast<int>(i), most);
    if (most > best.correlation) {
      best.correlation = most;
      best.place = static_cast<int>(i);
    }
  }
  if (best.place < 0 || best.correlation < code.options.least) {
    best.place = -1;
    return best;
  }
  for (const auto& [place, correlation] : all) {
    if (correlation > best.correlation - static_cast<float>(code.options.margin) &&
        (code.rest.row(place) - code.rest.row(best.place)).norm() > kApart) {
      best.place = -1;
      return best;
    }
  }
  return best;
}

/// Matches with which most of those around them agree: cloth keeps its lengths, so that places
/// that were read are as far apart as those that they were read at.
std::vector<Candidate> agreeing(const PrintedCodebook& code, const std::vector<Candidate>& read,
                                int& contradicted) {
  constexpr double kAround = 0.1;  // m
  constexpr double kLoose = 0.01;  // m
  constexpr double kShare = 0.2;   // of the distance between them
  constexpr int kMinAround = 3;
  std::vector<Candidate> kept;
  for (const Candidate& one : read) {
    int agree = 0;
    int around = 0;
    for (const Candidate& other : read) {
      const double apart = (code.rest.row(one.site) - code.rest.row(other.site)).norm();
      if (&one == &other || apart > kAround) {
        continue;
      }
      const double far = (code.rest.row(one.place) - code.rest.row(other.place)).norm();
      ++around;
      agree += std::abs(far - apart) < kLoose + kShare * apart ? 1 : 0;
    }
    if (around >= kMinAround && 2 * agree > around) {
      kept.push_back(one);
    } else if (around >= kMinAround) {
      ++contradicted;
    }
  }
  return kept;
}

}  // namespace

PrintedCodebook printed_codebook(const ViewedCloth& cloth, const CodeOptions& options) {
  const auto& [topology, x, views, seen] = cloth;
  PrintedCodebook code;
  code.options = options;
  if (views.empty() || views.front().levels.front().channels != 3) {
    return code;
  }
  code.samples = cloth_samples(x, topology.faces, options.spacing);
  GarmentTexture texture;
  add_texture(texture, code.samples, cloth, 1);
  const auto hues = hues_of(texture);
  Eigen::RowVector2f sum = Eigen::RowVector2f::Zero();
  float squares = 0;
  float count = 0;
  for (Index s = 0; s < hues.rows(); ++s) {
    if (texture.known[static_cast<std::size_t>(s)] != 0) {
      sum += hues.row(s);
      squares += hues.row(s).squaredNorm();
      count += 1;
    }
  }
  // Cloth of one hue: nothing to read anywhere.
  if (!(count > 0) || squares / count - (sum / count).squaredNorm() <
                          static_cast<float>(options.contrast * options.contrast)) {
    return code;
  }
  const Ground ground{x,
                      topology.faces,
                      face_neighbors(topology),
                      face_normals(x, topology.faces),
                      code.samples,
                      faces_of_samples(code.samples)};
  Points all(static_cast<Index>(code.samples.areas.size()), 3);
  for (int s = 0; s < static_cast<int>(all.rows()); ++s) {
    all.row(s) = ground.place(ground.face_of[static_cast<std::size_t>(s)], s).transpose();
  }
  code.places = thinned(all, options.place * 0.8);
  const auto count_places = static_cast<Index>(code.places.size());
  code.rest.resize(count_places, 3);
  for (Index i = 0; i < count_places; ++i) {
    code.rest.row(i) = all.row(code.places[static_cast<std::size_t>(i)]);
  }
  code.sites = thinned(code.rest, options.site);
  code.points.assign(static_cast<std::size_t>(count_places) * kPoints, -1);
  code.descriptors = Eigen::MatrixXf::Zero(kHues * kPoints, count_places);
  parallel_for(count_places, 64, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      int* points = &code.points[static_cast<std::size_t>(i) * kPoints];
      add_fan(ground, code.places[static_cast<std::size_t>(i)], points);
      add_word(points, hues, texture.known, options.contrast, code.descriptors.col(i).data());
    }
  });
  return code;
}

CodeMatches match_code(const PrintedCodebook& code, const ViewedCloth& cloth) {
  const auto& [topology, x, views, seen] = cloth;
  CodeMatches matches;
  if (code.descriptors.cols() == 0 || views.empty() || views.front().levels.front().channels != 3) {
    return matches;
  }
  ATELIER_CHECK(code.samples.offsets.size() == static_cast<std::size_t>(topology.faces.rows()) + 1,
                "a code of another garment");
  GarmentTexture texture;
  add_texture(texture, code.samples, cloth, 1);
  const auto hues = hues_of(texture);
  std::vector<Candidate> all(code.sites.size());
  parallel_for(static_cast<Index>(code.sites.size()), 4, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const int site = code.sites[static_cast<std::size_t>(i)];
      Eigen::VectorXf descriptor(kHues * kPoints);
      if (add_word(&code.points[static_cast<std::size_t>(site) * kPoints], hues, texture.known,
                   code.options.contrast, descriptor.data())) {
        all[static_cast<std::size_t>(i)] = looked_up(code, site, descriptor);
      }
    }
  });
  std::erase_if(all, [](const Candidate& candidate) { return candidate.place < 0; });
  const std::vector<int> faces = faces_of_samples(code.samples);
  for (const Candidate& one : agreeing(code, all, matches.contradicted)) {
    const auto read = static_cast<std::size_t>(code.places[static_cast<std::size_t>(one.place)]);
    const auto at = static_cast<std::size_t>(code.places[static_cast<std::size_t>(one.site)]);
    CodeMatch match;
    match.face = faces[read];
    match.barycentric = code.samples.barycentric[read].cast<double>();
    match.seen_face = faces[at];
    match.seen_barycentric = code.samples.barycentric[at].cast<double>();
    match.correlation = one.correlation;
    matches.kept.push_back(match);
  }
  return matches;
}

std::vector<SurfaceRow> code_rows(const PrintedCodebook& code, const CodeMatches& matches,
                                  const Topology& topology, const Points& x, double weight) {
  constexpr double kWrong = 0.1;  // m; what is still farther off is hardly believed
  std::vector<SurfaceRow> rows;
  const Triangles& faces = topology.faces;
  const Points normals = vertex_normals(x, faces);
  for (const CodeMatch& match : matches.kept) {
    const Vector3 target = point_of(x, faces, match.seen_face, match.seen_barycentric);
    const Vector3 normal =
        point_of(normals, faces, match.seen_face, match.seen_barycentric).normalized();
    if (normal.isZero(0)) {  // folded flat: no surface to slide along
      continue;
    }
    const Vector3 first = normal.unitOrthogonal();
    for (const Vector3& along : {first, Vector3(normal.cross(first))}) {
      SurfaceRow row;
      for (int k = 0; k < 3; ++k) {
        row.vertices[static_cast<std::size_t>(k)] = faces(match.face, k);
      }
      row.barycentric = match.barycentric;
      row.normal = along;
      row.offset = along.dot(target);
      row.weight = weight * code.options.site * code.options.site;
      row.scale = kWrong;
      rows.push_back(row);
    }
  }
  return rows;
}

}  // namespace atelier
