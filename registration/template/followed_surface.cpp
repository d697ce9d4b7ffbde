#include "registration/template/followed_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/median.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"
#include "core/topology.h"
#include "core/tree.h"
#include "registration/rim_vertices.h"
#include "registration/tracking/register_garment.h"

namespace atelier {
namespace {

constexpr double kBlend = 0.03;          // m
constexpr double kFarthestBlend = 12;    // in units of kBlend: exp(-12) of the nearest's weight
constexpr double kCarriedWeight = 0.5;   // of a point of the own frame
constexpr double kMissing = 1.5;         // spacings
constexpr double kGoesOn = 0.02;         // m
constexpr double kDeepest = 0.035;       // m
constexpr double kOff = 0.03;            // m
constexpr double kOffShare = 0.5;        // of the way from the rim
constexpr double kAgree = 0.025;         // m between points of two frames that show the same
constexpr double kSomethingElse = 0.01;  // m
constexpr double kNearFlesh = 0.04;      // m
constexpr double kCovered = 0.8;         // share of the cover, which fades where nothing was seen
constexpr double kBeyond = 0.03;         // m past the rim

/// Where a point's foot on a surface is.
struct FootOnCloth {
  int face = 0;
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
  double along = 0;  // m past the rim, along the surface
  double off = 0;    // m from the surface, along its normal
};

std::vector<FootOnCloth> feet_on(const Mesh& mesh, const Points& points) {
  const std::vector<char> rim = rim_vertices(topology_of(mesh.faces, mesh.vertices.rows()));
  const Points normals = vertex_normals(mesh.vertices, mesh.faces);
  const std::vector<ClosestPoint> closest =
      closest_points(build_tree(mesh.vertices, mesh.faces), points);
  std::vector<FootOnCloth> feet(closest.size());
  for (std::size_t i = 0; i < feet.size(); ++i) {
    const ClosestPoint& on = closest[i];
    bool at_rim = true;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const int corner = mesh.faces(on.face, k);
      at_rim = at_rim && (on.barycentric[k] < 1e-6 || rim[static_cast<std::size_t>(corner)] != 0);
      normal += on.barycentric[k] * normals.row(corner).transpose();
    }
    const Eigen::Vector3d away = points.row(static_cast<Index>(i)).transpose() - on.point;
    const double height = normal.isZero() ? 0 : away.dot(normal.normalized());
    feet[i].face = on.face;
    feet[i].barycentric = on.barycentric;
    feet[i].off = at_rim ? std::abs(height) : away.norm();
    feet[i].along = at_rim ? std::sqrt(std::max(0.0, away.squaredNorm() - height * height)) : 0;
  }
  return feet;
}

/// Share of the area of a garment's part of a scan that lies past the rim of the surface.
double share_beyond(const Mesh& surface, const GarmentScan& scan) {
  if (scan.faces.rows() == 0) {
    return 0;
  }
  const std::vector<FootOnCloth> feet = feet_on(surface, scan.vertices);
  double beyond = 0;
  for (std::size_t v = 0; v < feet.size(); ++v) {
    beyond += feet[v].along > kBeyond ? scan.areas[static_cast<Index>(v)] : 0;
  }
  return beyond / std::max(1e-9, scan.areas.sum());
}

/// Cubes of a grid.
using CubeKey = std::array<long, 3>;

CubeKey cube_of(const Eigen::RowVector3d& point, double size) {
  CubeKey key{};
  for (std::size_t c = 0; c < 3; ++c) {
    key[c] = saturating_cast<long>(std::floor(point[static_cast<Index>(c)] / size));
  }
  return key;
}

/// The clusters of points that are no farther apart than about `size`: a number for each.
std::vector<int> clusters_of(const Points& points, double size) {
  std::map<CubeKey, int> cluster;
  for (Index i = 0; i < points.rows(); ++i) {
    cluster.emplace(cube_of(points.row(i), size), -1);
  }
  int count = 0;
  for (auto& [seed, number] : cluster) {
    if (number >= 0) {
      continue;
    }
    number = count;
    std::vector<CubeKey> front = {seed};
    while (!front.empty()) {
      const CubeKey at = front.back();
      front.pop_back();
      for (long n = 0; n < 27; ++n) {
        const auto next =
            cluster.find({at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1});
        if (next != cluster.end() && next->second < 0) {
          next->second = count;
          front.push_back(next->first);
        }
      }
    }
    ++count;
  }
  std::vector<int> numbers(static_cast<std::size_t>(points.rows()));
  for (Index i = 0; i < points.rows(); ++i) {
    numbers[static_cast<std::size_t>(i)] = cluster.at(cube_of(points.row(i), size));
  }
  return numbers;
}

void keep_rows(OrientedPoints& cloud, const std::vector<Index>& rows) {
  cloud.points = Points(cloud.points(rows, Eigen::all));
  cloud.normals = Points(cloud.normals(rows, Eigen::all));
}

void append(OrientedPoints& cloud, const OrientedPoints& more) {
  const Index first = cloud.points.rows();
  cloud.points.conservativeResize(first + more.points.rows(), 3);
  cloud.points.bottomRows(more.points.rows()) = more.points;
  cloud.normals.conservativeResize(first + more.normals.rows(), 3);
  cloud.normals.bottomRows(more.normals.rows()) = more.normals;
}

/// Faces that were seen and have no corner of the label.
Triangles other_faces(const Mesh& scan, std::uint8_t label) {
  std::vector<Index> rows;
  for (Index f = 0; f < scan.faces.rows(); ++f) {
    bool other = true;
    for (int k = 0; k < 3; ++k) {
      const int v = scan.faces(f, k);
      other = other && scan.labels[static_cast<std::size_t>(v)] != label &&
              (scan.confidence.size() == 0 || scan.confidence[v] > 0);
    }
    if (other) {
      rows.push_back(f);
    }
  }
  return scan.faces(rows, Eigen::all);
}

/// How far a frame's cloth goes on past each vertex of the rims of the surface that was followed
/// there: for each loop the median, m. A whole rim that lies short of the cloth is one that slid.
std::vector<double> slides_of(const Mesh& placed, const std::vector<FootOnCloth>& feet) {
  std::vector<double> past(static_cast<std::size_t>(placed.vertices.rows()), 0);
  for (const FootOnCloth& foot : feet) {
    Index corner = 0;
    foot.barycentric.maxCoeff(&corner);
    double& most = past[static_cast<std::size_t>(placed.faces(foot.face, corner))];
    most = std::max(most, foot.along);
  }
  std::vector<double> slides(past.size(), 0);
  for (const std::vector<int>& loop :
       boundary_loops(topology_of(placed.faces, placed.vertices.rows()))) {
    std::vector<double> of_loop;
    for (const int v : loop) {
      of_loop.push_back(past[static_cast<std::size_t>(v)]);
    }
    const double slid = median(of_loop);
    for (const int v : loop) {
      slides[static_cast<std::size_t>(v)] = slid;
    }
  }
  return slides;
}

/// The vertices that carry a point: those within kFarthestBlend of it, and more.
class VerticesAround {
 public:
  explicit VerticesAround(const Points& vertices)
      : tree_(build_point_tree(vertices)), near_(static_cast<std::size_t>(vertices.rows())) {
    for (int v = 0; v < static_cast<int>(vertices.rows()); ++v) {
      all_.push_back(v);
    }
    parallel_for(vertices.rows(), 64, [&](Index begin, Index end) {
      for (Index v = begin; v < end; ++v) {
        for (const int w : all_) {
          if ((vertices.row(w) - vertices.row(v)).squaredNorm() <= kAround * kAround) {
            near_[static_cast<std::size_t>(v)].push_back(w);
          }
        }
      }
    });
  }

  /// In increasing order.
  const std::vector<int>& of(const Eigen::RowVector3d& point) const {
    const ClosestPoint nearest = closest_point(tree_, point.transpose());
    // The nearest one that agrees may be twice as far.
    const double squared = nearest.squared_distance;
    const double reach =
        std::sqrt(4 * squared + 2 * kFarthestBlend * std::max(kBlend * kBlend, squared));
    return reach + std::sqrt(squared) <= kAround ? near_[static_cast<std::size_t>(nearest.face)]
                                                 : all_;
  }

 private:
  static constexpr double kAround = 0.18;  // m
  TriangleTree tree_;
  std::vector<int> all_;
  std::vector<std::vector<int>> near_;
};

/// Points of a frame where the own frame has none, in the pose of that one, and how deep they lie
/// in what is missing, m.
struct MissingPoints {
  OrientedPoints cloud;
  std::vector<double> depths;
};

MissingPoints missing_of(OrientedPoints cloud, const FollowedSurface& followed,
                         const Points& vertices, const TriangleTree& own, double spacing) {
  Mesh placed = followed.mesh;
  placed.vertices = vertices;
  const std::vector<FootOnCloth> feet = feet_on(placed, cloud.points);
  Points places(cloud.points.rows(), 3);
  for (Index i = 0; i < places.rows(); ++i) {
    const FootOnCloth& foot = feet[static_cast<std::size_t>(i)];
    places.row(i).setZero();
    for (int k = 0; k < 3; ++k) {
      places.row(i) += foot.barycentric[k] * followed.mesh.vertices.row(placed.faces(foot.face, k));
    }
  }
  const std::vector<ClosestPoint> nearest = closest_points(own, places);
  const std::vector<double> slides = slides_of(placed, feet);
  MissingPoints missing;
  std::vector<Index> rows;
  for (std::size_t i = 0; i < feet.size(); ++i) {
    Index corner = 0;
    feet[i].barycentric.maxCoeff(&corner);
    const double slid = slides[static_cast<std::size_t>(placed.faces(feet[i].face, corner))];
    const double past = feet[i].along > 0 ? feet[i].along - slid : 0;
    if (past < 0) {
      continue;
    }
    const double depth = std::sqrt(nearest[i].squared_distance) + past;
    if (depth >= kMissing * spacing && feet[i].off <= kOff + kOffShare * depth) {
      rows.push_back(static_cast<Index>(i));
      missing.depths.push_back(depth);
    }
  }
  keep_rows(cloud, rows);
  missing.cloud = carried(cloud, placed.faces, vertices, followed.mesh.vertices);
  return missing;
}

/// Of what is missing, what is no fringe of following: near to what goes on for long enough.
std::vector<Index> without_fringe(const Points& points, const std::vector<double>& depths) {
  std::vector<Index> deep;
  for (std::size_t i = 0; i < depths.size(); ++i) {
    if (depths[i] >= kGoesOn) {
      deep.push_back(static_cast<Index>(i));
    }
  }
  if (deep.empty()) {
    return {};
  }
  const Points core = points(deep, Eigen::all);
  const std::vector<int> cluster = clusters_of(core, kGoesOn);
  std::map<int, double> deepest;
  for (std::size_t i = 0; i < deep.size(); ++i) {
    double& most = deepest[cluster[i]];
    most = std::max(most, depths[static_cast<std::size_t>(deep[i])]);
  }
  const std::vector<ClosestPoint> nearest =
      closest_points(build_point_tree(core), points, 1.5 * kGoesOn);
  std::vector<Index> kept;
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const int at = nearest[i].face;
    if (at >= 0 && deepest[cluster[static_cast<std::size_t>(at)]] >= kDeepest) {
      kept.push_back(static_cast<Index>(i));
    }
  }
  return kept;
}

}  // namespace

FollowedSurface followed_surface(const Mesh& surface, Index home, const ClothedFrames& frames,
                                 const std::vector<Index>& rows, std::uint8_t label) {
  FollowedSurface followed;
  followed.label = label;
  followed.mesh = surface;
  Garment garment;
  garment.mesh = surface;
  RegisterOptions options;
  options.photometric = false;
  options.code = false;
  options.collision = false;     // the scans are outside of the body
  options.sample_spacing = 0.1;  // none of them is looked at
  const RegistrationModel model = registration_model(garment, options);
  ShapeSolver solver(model.cloth);
  const Points home_body = frames.load(home).body;
  std::vector<Index> ordered = rows;
  std::sort(ordered.begin(), ordered.end());
  ordered.erase(std::unique(ordered.begin(), ordered.end()), ordered.end());
  const auto follow = [&](Index row, const Points& before, const Points& body_before) {
    const ClothedFrame clothed = frames.load(row);
    RegistrationFrame frame;
    frame.scan = garment_scan(clothed.scan, {label});
    const BodyDrivenCloth driven =
        body_driven(before, frames.body_faces, body_before, clothed.body);
    const BodyDrivenCloth from_home =
        body_driven(surface.vertices, frames.body_faces, home_body, clothed.body);
    const Points start =
        predicted_cloth(solver, model.cloth, {before, driven, from_home, Points()});
    RegisteredGarment there = register_garment(solver, model, start, frame, {}, options);
    Mesh placed = surface;
    placed.vertices = there.vertices;
    const double beyond = share_beyond(placed, frame.scan);
    return FollowedSurface::Frame{row, std::move(there.vertices), clothed.body, there.support,
                                  beyond};
  };
  const auto chain = [&](auto first, auto last) {
    const Points* before = &surface.vertices;
    const Points* body = &home_body;
    std::vector<FollowedSurface::Frame> chained;
    chained.reserve(static_cast<std::size_t>(std::distance(first, last)));  // they are pointed to
    for (; first != last; ++first) {
      chained.push_back(follow(*first, *before, *body));
      before = &chained.back().vertices;
      body = &chained.back().body;
    }
    return chained;
  };
  const auto after = std::upper_bound(ordered.begin(), ordered.end(), home);
  const auto until = std::lower_bound(ordered.begin(), ordered.end(), home);
  followed.frames = chain(std::make_reverse_iterator(until), ordered.rend());
  std::reverse(followed.frames.begin(), followed.frames.end());
  std::vector<FollowedSurface::Frame> later = chain(after, ordered.end());
  std::move(later.begin(), later.end(), std::back_inserter(followed.frames));
  return followed;
}

OrientedPoints carried(const OrientedPoints& cloud, const Triangles& faces, const Points& from,
                       const Points& to) {
  ATELIER_CHECK(from.rows() == to.rows() && from.rows() > 0, "one surface at two times");
  const Topology topology = topology_of(faces, from.rows());
  const std::vector<Eigen::Matrix3d> turns =
      edge_rotations(topology.edges, Eigen::VectorXd::Ones(topology.edges.rows()), from, to);
  const Points normals = vertex_normals(from, faces);
  OrientedPoints moved{Points(cloud.points.rows(), 3), Points(cloud.points.rows(), 3)};
  const VerticesAround around(from);
  parallel_for(cloud.points.rows(), 256, [&](Index begin, Index end) {
    std::vector<double> squared;
    std::vector<double> agree;
    for (Index i = begin; i < end; ++i) {
      const Eigen::RowVector3d point = cloud.points.row(i);
      const Eigen::RowVector3d normal = cloud.normals.row(i);
      const std::vector<int>& near = around.of(point);
      squared.resize(near.size());
      agree.resize(near.size());
      double nearest = 1e300;
      for (std::size_t k = 0; k < near.size(); ++k) {
        squared[k] = (from.row(near[k]) - point).squaredNorm();
        agree[k] = normals.row(near[k]).dot(normal);
        nearest = std::min(nearest, agree[k] > 0 ? squared[k] : 4 * squared[k]);
      }
      const double wide = std::max(kBlend * kBlend, 0.25 * nearest);
      Eigen::RowVector3d place = Eigen::RowVector3d::Zero();
      Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
      double sum = 0;
      for (std::size_t k = 0; k < near.size(); ++k) {
        const double apart = (squared[k] - nearest) / (2 * wide);
        if (apart > kFarthestBlend) {
          continue;
        }
        const double weight = std::exp(-std::max(apart, -1.0)) * (0.02 + std::max(0.0, agree[k]));
        const int v = near[k];
        const Eigen::Matrix3d& own = turns[static_cast<std::size_t>(v)];
        place += weight * (to.row(v) + (point - from.row(v)) * own.transpose());
        turn += weight * own;
        sum += weight;
      }
      moved.points.row(i) = place / sum;
      const Eigen::RowVector3d turned = normal * turn.transpose();
      moved.normals.row(i) = turned.norm() > 0 ? Eigen::RowVector3d(turned.normalized()) : normal;
    }
  });
  return moved;
}

bool is_followed_well(const FollowedSurface::Frame& frame) {
  constexpr double kShows = 0.75;  // of the surface
  return frame.support >= kShows;
}

double median_beyond(const FollowedSurface& followed) {
  std::vector<double> shares;
  for (const FollowedSurface::Frame& frame : followed.frames) {
    if (is_followed_well(frame)) {
      shares.push_back(frame.beyond);
    }
  }
  return median(std::move(shares));
}

double add_carried(GarmentPoints& cloud, const ClothedFrame& own_frame, const GarmentCover& cover,
                   const FollowedSurface& followed, const ClothedFrames& frames, double spacing) {
  ATELIER_CHECK(cloud.seen == cloud.points.rows() && cloud.observed == cloud.seen,
                "points of the own frame alone");
  if (cloud.seen == 0) {
    return 0;
  }
  const TriangleTree own = build_point_tree(cloud.points);
  std::vector<MissingPoints> shown;
  std::vector<TriangleTree> trees;
  for (const FollowedSurface::Frame& frame : followed.frames) {
    if (is_followed_well(frame)) {
      const ClothedFrame clothed = frames.load(frame.row);
      GarmentPoints all =
          garment_points(clothed.scan, followed.label, clothed.body, frames.body_faces, spacing);
      shown.push_back(missing_of({std::move(all.points), std::move(all.normals)}, followed,
                                 frame.vertices, own, spacing));
      trees.push_back(build_point_tree(shown.back().cloud.points));
    }
  }
  const Triangles others = other_faces(own_frame.scan, followed.label);
  const TriangleTree elsewhere = build_tree(own_frame.scan.vertices, others);
  const TriangleTree body = build_tree(own_frame.body, frames.body_faces);
  const auto bare = [&](const Eigen::Vector3d& point) {
    const ClosestPoint flesh = closest_point(body, point, kNearFlesh);
    Index corner = 0;
    flesh.barycentric.maxCoeff(&corner);
    return flesh.face >= 0 && cover.share[frames.body_faces(flesh.face, corner)] < kCovered;
  };
  const auto agreed = [&](std::size_t frame, const Eigen::Vector3d& point) {
    bool found = shown.size() < 3;
    for (std::size_t j = 0; j < trees.size() && !found; ++j) {
      found = j != frame && shown[j].cloud.points.rows() > 0 &&
              closest_point(trees[j], point, kAgree).face >= 0;
    }
    return found && !bare(point) &&
           (others.rows() == 0 || closest_point(elsewhere, point, kSomethingElse).face < 0);
  };
  OrientedPoints added;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    OrientedPoints& found = shown[i].cloud;
    std::vector<Index> rows;
    std::vector<double> depths;
    for (Index m = 0; m < found.points.rows(); ++m) {
      if (agreed(i, found.points.row(m).transpose())) {
        rows.push_back(m);
        depths.push_back(shown[i].depths[static_cast<std::size_t>(m)]);
      }
    }
    keep_rows(found, rows);
    std::vector<Index> kept = without_fringe(found.points, depths);
    if (added.points.rows() > 0) {
      const TriangleTree taken = build_point_tree(added.points);
      std::erase_if(kept, [&](Index row) {
        // Beside what an earlier frame has given, not over or under it.
        const Eigen::RowVector3d point = found.points.row(row);
        const int at = closest_point(taken, point.transpose(), kAgree).face;
        if (at < 0) {
          return false;
        }
        const Eigen::RowVector3d away = point - added.points.row(at);
        const Eigen::RowVector3d normal = added.normals.row(at);
        return (away - away.dot(normal) * normal).norm() <= kMissing * spacing;
      });
    }
    keep_rows(found, kept);
    append(added, found);
  }
  const Index first = cloud.points.rows();
  const Index count = first + added.points.rows();
  cloud.points.conservativeResize(count, 3);
  cloud.points.bottomRows(added.points.rows()) = added.points;
  cloud.normals.conservativeResize(count, 3);
  cloud.normals.bottomRows(added.normals.rows()) = added.normals;
  cloud.weights.conservativeResize(count);
  cloud.weights.tail(added.points.rows()).setConstant(kCarriedWeight);
  cloud.observed = count;
  return static_cast<double>(added.points.rows()) * spacing * spacing;
}

}  // namespace atelier
