// Hair: a part of the body's own surface, refined, smoothed and lifted off the skin.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "bodymodel/human/synthetic_head.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/smooth_step.h"
#include "pipeline/synthesis/synthetic_look.h"

namespace atelier {
namespace {

using Color = Eigen::Vector3f;

/// A part of a skinned surface. Weights are dense rows while it is being refined.
struct Part {
  Points vertices;
  Points normals;
  Triangles faces;
  Eigen::MatrixXd weights;  ///< [V,J]
};

std::vector<bool> descends_from(const Skeleton& skeleton, const std::vector<int>& joints) {
  std::vector<bool> result(skeleton.names.size(), false);
  for (std::size_t j = 0; j < result.size(); ++j) {
    const int parent = skeleton.parents[j];
    result[j] = std::find(joints.begin(), joints.end(), static_cast<int>(j)) != joints.end() ||
                (parent >= 0 && result[static_cast<std::size_t>(parent)]);
  }
  return result;
}

double share_of(const BodyModel& body, Index v, const std::vector<bool>& joints) {
  double share = 0;
  for (Index k = 0; k < body.skin.joints.cols(); ++k) {
    if (joints[static_cast<std::size_t>(body.skin.joints(v, k))]) {
      share += body.skin.weights(v, k);
    }
  }
  return share;
}

/// The faces of which every corner is wanted.
Part part_of(const BodyModel& body, const std::function<bool(Index)>& wanted) {
  const Points normals = vertex_normals(body.mesh.vertices, body.mesh.faces);
  std::vector<int> place(static_cast<std::size_t>(vertex_count(body)), -1);
  std::vector<Index> kept;
  std::vector<std::array<int, 3>> faces;
  for (Index f = 0; f < body.mesh.faces.rows(); ++f) {
    const auto corner = [&](int c) { return static_cast<Index>(body.mesh.faces(f, c)); };
    if (!wanted(corner(0)) || !wanted(corner(1)) || !wanted(corner(2))) {
      continue;
    }
    std::array<int, 3> face{};
    for (int c = 0; c < 3; ++c) {
      int& index = place[static_cast<std::size_t>(corner(c))];
      if (index < 0) {
        index = static_cast<int>(kept.size());
        kept.push_back(corner(c));
      }
      face[static_cast<std::size_t>(c)] = index;
    }
    faces.push_back(face);
  }
  Part part;
  part.vertices.resize(static_cast<Index>(kept.size()), 3);
  part.normals.resize(part.vertices.rows(), 3);
  part.weights = Eigen::MatrixXd::Zero(part.vertices.rows(), joint_count(body));
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const auto row = static_cast<Index>(i);
    part.vertices.row(row) = body.mesh.vertices.row(kept[i]);
    part.normals.row(row) = normals.row(kept[i]);
    for (Index k = 0; k < body.skin.joints.cols(); ++k) {
      part.weights(row, body.skin.joints(kept[i], k)) += body.skin.weights(kept[i], k);
    }
  }
  part.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    part.faces.row(static_cast<Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  }
  return part;
}

/// Every triangle into four.
Part refined(const Part& part) {
  std::map<std::pair<int, int>, int> middles;
  std::vector<std::pair<int, int>> edges;
  Part result;
  result.faces.resize(4 * part.faces.rows(), 3);
  const auto middle = [&](int a, int b) {
    const auto key = std::minmax(a, b);
    const auto [found, is_new] =
        middles.try_emplace(key, static_cast<int>(part.vertices.rows() + edges.size()));
    if (is_new) {
      edges.emplace_back(key);
    }
    return found->second;
  };
  for (Index f = 0; f < part.faces.rows(); ++f) {
    const int a = part.faces(f, 0);
    const int b = part.faces(f, 1);
    const int c = part.faces(f, 2);
    const int ab = middle(a, b);
    const int bc = middle(b, c);
    const int ca = middle(c, a);
    result.faces.row(4 * f) << a, ab, ca;
    result.faces.row(4 * f + 1) << ab, b, bc;
    result.faces.row(4 * f + 2) << ca, bc, c;
    result.faces.row(4 * f + 3) << ab, bc, ca;
  }
  const auto old = part.vertices.rows();
  const auto count = old + static_cast<Index>(edges.size());
  const auto widen = [&](auto& to, const auto& from) {
    to.resize(count, from.cols());
    to.topRows(old) = from;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      to.row(old + static_cast<Index>(i)) =
          (from.row(edges[i].first) + from.row(edges[i].second)) / 2;
    }
  };
  widen(result.vertices, part.vertices);
  widen(result.normals, part.normals);
  widen(result.weights, part.weights);
  result.normals.rowwise().normalize();
  return result;
}

/// Each vertex towards the mean of its neighbours, by a share of its own, `times` over.
void smooth(Part& part, const Eigen::VectorXd& share, int times) {
  for (int i = 0; i < times; ++i) {
    Points sum = Points::Zero(part.vertices.rows(), 3);
    Eigen::VectorXd count = Eigen::VectorXd::Zero(part.vertices.rows());
    for (Index f = 0; f < part.faces.rows(); ++f) {
      for (int c = 0; c < 3; ++c) {
        const int a = part.faces(f, c);
        const int b = part.faces(f, (c + 1) % 3);
        sum.row(a) += part.vertices.row(b);
        sum.row(b) += part.vertices.row(a);
        count[a] += 1;
        count[b] += 1;
      }
    }
    for (Index v = 0; v < part.vertices.rows(); ++v) {
      if (count[v] > 0) {
        part.vertices.row(v) += share[v] * (sum.row(v) / count[v] - part.vertices.row(v));
      }
    }
  }
}

BodyModel worn_model(const BodyModel& body, const std::string& name, const Part& part) {
  BodyModel model;
  model.name = name;
  model.skeleton = body.skeleton;
  model.mesh.vertices = part.vertices;
  model.mesh.faces = part.faces;
  constexpr Index kSlots = 6;
  model.skin.joints.resize(part.vertices.rows(), kSlots);
  model.skin.weights.resize(part.vertices.rows(), kSlots);
  for (Index v = 0; v < part.vertices.rows(); ++v) {
    Eigen::VectorXd weights = part.weights.row(v).transpose();
    for (Index k = 0; k < kSlots; ++k) {
      Index joint = 0;
      model.skin.weights(v, k) = weights.maxCoeff(&joint);
      model.skin.joints(v, k) = static_cast<int>(joint);
      weights[joint] = 0;
    }
    model.skin.weights.row(v) /= model.skin.weights.row(v).sum();
  }
  return model;
}

}  // namespace

HeadPlaces head_places(const BodyModel& body, std::uint64_t seed) {
  const Humanoid person = recognised_humanoid(body.skeleton);
  const int head = person.neck.back();
  const std::vector<bool> on_head = descends_from(body.skeleton, {head});
  HeadPlaces places;
  places.joint = rest_positions(body.skeleton).row(head).transpose();
  places.front = -1e9;
  places.back = 1e9;
  places.top = {0, -1e9, 0};
  for (Index v = 0; v < vertex_count(body); ++v) {
    if (share_of(body, v, on_head) < 0.7) {
      continue;
    }
    const Eigen::Vector3d p = body.mesh.vertices.row(v).transpose();
    if (p.y() > places.top.y()) {
      places.top = p;
    }
    if (p.y() > places.joint.y() + 0.06) {
      places.front = std::max(places.front, p.z());
      places.back = std::min(places.back, p.z());
    }
    if (p.y() > places.joint.y() + 0.10) {  // above the ears
      places.half_width = std::max(places.half_width, std::abs(p.x()));
    }
  }
  const SubjectKeypoints points = subject_keypoints(body);
  const auto at = [&](const char* name) {
    const auto found = std::find(points.names.begin(), points.names.end(), name);
    return points.places[static_cast<std::size_t>(found - points.names.begin())].rest;
  };
  places.eyes = (at("left_eye") + at("right_eye")) / 2;
  places.eye_distance = (at("left_eye") - at("right_eye")).norm();
  Random random{seed, 78};
  const double t = uniform(random);
  places.hair = t < 0.35   ? Color(0.018F, 0.013F, 0.010F)
                : t < 0.65 ? Color(0.060F, 0.030F, 0.014F)
                : t < 0.85 ? Color(0.16F, 0.080F, 0.030F)
                           : Color(0.32F, 0.21F, 0.090F);
  places.long_hair = uniform(random) < 0.5;
  return places;
}

double above_hairline(const HeadPlaces& head, const Eigen::Vector3d& place) {
  const double height = head.top.y() - head.joint.y();
  const double middle = (head.front + head.back) / 2;
  const double depth = (head.front - head.back) / 2;
  const double y = (place.y() - head.top.y()) / height;  // 0 at the top, -1 at the skull's base
  const double z = (place.z() - middle) / depth;         // 1 in front, -1 at the back
  const double sides = head.long_hair ? 0.85 * (1 - smooth_step(z, 0.05, 0.35))
                                      : 0.42 * (1 - smooth_step(z, -0.55, -0.05));
  const double line = -0.16 - 0.24 * (1 - smooth_step(z, 0.25, 0.85)) - sides;
  return (y - line) * height;
}

namespace {

/// Strands that run from the crown down: columns of the texture go round the head.
Image strands(const Color& hair, int resolution, std::uint64_t seed) {
  Image image(resolution, resolution, 3);
  parallel_for(resolution, 8, [&](Index begin, Index end) {
    for (Index row = begin; row < end; ++row) {
      const double down = (static_cast<double>(row) + 0.5) / resolution;
      for (int x = 0; x < resolution; ++x) {
        // On a circle the noise closes; strands wander a little on their way down.
        const double turn = (x + 0.5) / resolution;
        const double bend = 0.03 * value_noise(7 * turn, 3 * down, 0.5, seed + 3);
        const double angle = 2 * std::numbers::pi * (turn + bend);
        const auto at = [&](double radius, double speed, std::uint64_t stream) {
          return value_noise(radius * std::cos(angle), radius * std::sin(angle), speed * down,
                             seed + stream);
        };
        const double shade = 1 + 0.20 * at(9, 5, 0) + 0.38 * at(38, 6, 1) + 0.45 * at(110, 9, 2);
        const double tips =
            1 + 0.25 * smooth_step(down, 0.4, 1.0);  // lighter where the sun got them
        for (int c = 0; c < 3; ++c) {
          image.at(x, static_cast<int>(row), c) =
              std::clamp(static_cast<float>(std::max(0.12, shade) * tips) * hair[c], 0.003F, 0.9F);
        }
      }
    }
  });
  return image;
}

/// Texture coordinates round the crown, a row for each corner: those beside the seam go on past 1.
void wrap_strands(Mesh& mesh, const Eigen::Vector3d& crown, double reach) {
  mesh.uvs.resize(3 * mesh.faces.rows(), 2);
  mesh.uv_faces.resize(mesh.faces.rows(), 3);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    double first = 0;
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector3d d = mesh.vertices.row(mesh.faces(f, c)).transpose() - crown;
      double turn = std::atan2(d.x(), d.z()) / (2 * std::numbers::pi) + 0.5;
      first = c == 0 ? turn : first;
      turn += std::round(first - turn);
      mesh.uvs.row(3 * f + c) << turn, 1 - std::min(0.999, d.norm() / reach);
      mesh.uv_faces(f, c) = static_cast<int>(3 * f) + c;
    }
  }
}

}  // namespace

WornLayer hair_cap(const BodyModel& body, std::uint64_t seed) {
  const HeadPlaces head = head_places(body, seed);
  const Humanoid person = recognised_humanoid(body.skeleton);
  const std::vector<bool> on_head =
      descends_from(body.skeleton, {head.long_hair ? person.neck.front() : person.neck.back()});
  const double height = head.top.y() - head.joint.y();
  const double middle = (head.front + head.back) / 2;
  // A margin on every side, which dives into the skin: the hairline is where it comes out.
  Part part = part_of(body, [&](Index v) {
    const Eigen::Vector3d p = body.mesh.vertices.row(v).transpose();
    return share_of(body, v, on_head) > 0.3 &&
           (above_hairline(head, p) > -0.03 ||
            (head.long_hair && above_hairline(head, p - Eigen::Vector3d(0, 0, 0.03)) > -0.03));
  });
  ATELIER_CHECK(part.faces.rows() > 0, "a head without a scalp");
  part = refined(refined(part));
  smooth(part, Eigen::VectorXd::Constant(part.vertices.rows(), 0.5), 6);
  for (Index v = 0; v < part.vertices.rows(); ++v) {
    Eigen::Vector3d p = part.vertices.row(v).transpose();
    const double in = above_hairline(head, p);
    const double angle = std::atan2(p.x(), p.z() - middle);
    const double locks =
        value_noise(7 * std::cos(angle), 7 * std::sin(angle), 9 * p.y(), seed + 91);
    // At the forehead hair rises slowly out of the skin; elsewhere it is cut.
    const double front = smooth_step((p.z() - middle) / (head.front - middle), 0.2, 0.7);
    const double rise = (0.30 - 0.16 * front) * std::max(0.0, in);
    const double lift = -0.002 + std::min(rise, 0.012 + 0.011 * smooth_step(in, 0.0, 0.09)) +
                        0.0022 * locks * smooth_step(in, 0, 0.02) +
                        0.3 * std::clamp(in, -0.05, 0.0);
    const double y = (p.y() - head.top.y()) / height;
    const double before_ears = smooth_step((p.z() - middle) / (head.front - middle), -0.30, 0.08);
    const double hanging =
        head.long_hair ? (1 - smooth_step(y, -0.65, -0.30)) * (1 - before_ears) : 0;
    const Eigen::Vector2d outward(p.x(), p.z() - middle);
    p += (1 - hanging) * lift * part.normals.row(v).transpose();
    if (hanging > 0 && outward.norm() > 1e-6) {
      // Below the ears hair hangs as a curtain as wide as the skull, cut at one height.
      const Eigen::Vector2d way = outward.normalized();
      const double wide = 1 / std::hypot(way.x() / (head.half_width + 0.019),
                                         way.y() / ((head.front - head.back) / 2 + 0.014));
      const double reach = std::max(outward.norm() + 0.004, wide * (1 + 0.05 * locks));
      p.x() += hanging * (way.x() * reach - outward.x());
      p.z() += hanging * (way.y() * reach - outward.y());
      p.y() += hanging * std::max(0.0, -in);
    }
    part.vertices.row(v) = p.transpose();
  }
  WornLayer layer;
  layer.name = "hair";
  layer.model = worn_model(body, layer.name, part);
  const Eigen::Vector3d crown(0.012, head.top.y(), middle - 0.35 * (head.front - middle));
  wrap_strands(layer.model.mesh, crown, 1.7 * height);
  layer.label = Label::Hair;
  layer.in_minimal = true;
  layer.look.texture = std::make_shared<const Image>(strands(head.hair, 1024, seed + 92));
  layer.look.color = Color(1, 1, 1);
  layer.look.roughness = 0.42F;
  layer.look.specular = 0.6F;
  layer.look.sheen = 0.15F;
  return layer;
}

}  // namespace atelier
