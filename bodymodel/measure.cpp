#include "bodymodel/measure.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

#include "bodymodel/body_pieces.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

// Length of an opening's edge, in statures, above which a skin encloses no volume: slits of eyes
// and lips are less, a missing hand is more. Our choice.
constexpr double kMaxBorder = 0.09;

using Eigen::Vector2d;
using Eigen::Vector3d;

// Convex hull (Andrew's monotone chain 1979) and its length.
double hull_length(std::vector<Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  std::vector<Vector2d> hull;
  const auto turn = [](const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
  };
  for (int side = 0; side < 2; ++side) {
    const std::size_t start = hull.size();
    for (const Vector2d& p : points) {
      while (hull.size() >= start + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  double length = 0;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    length += (hull[(i + 1) % hull.size()] - hull[i]).norm();
  }
  return length;
}

struct Cut {
  std::vector<Vector3d> points;              ///< where edges cross the plane
  std::vector<std::array<int, 2>> segments;  ///< with the mesh's inside on one side
};

Cut cut_mesh(const Points& vertices, const Triangles& faces, const Vector3d& origin,
             const Vector3d& normal) {
  const Eigen::VectorXd height = (vertices.rowwise() - origin.transpose()) * normal;
  Cut cut;
  std::unordered_map<std::int64_t, int> crossing;
  const auto point = [&](int a, int b) {
    if (a > b) {
      std::swap(a, b);
    }
    const std::int64_t key = (static_cast<std::int64_t>(a) << 32) | static_cast<std::uint32_t>(b);
    const auto [it, fresh] = crossing.try_emplace(key, static_cast<int>(cut.points.size()));
    if (fresh) {
      const double t = height[a] / (height[a] - height[b]);
      cut.points.push_back((vertices.row(a) + t * (vertices.row(b) - vertices.row(a))).transpose());
    }
    return it->second;
  };
  // Few faces are cut: bytes, which stay in the nearest cache, say which.
  std::vector<char> below(static_cast<std::size_t>(height.size()));
  for (Index i = 0; i < height.size(); ++i) {
    below[static_cast<std::size_t>(i)] = height[i] < 0 ? 1 : 0;
  }
  for (Index f = 0; f < faces.rows(); ++f) {
    const int* corners = faces.data() + 3 * f;
    const auto is_below = [&](int c) { return below[static_cast<std::size_t>(corners[c])]; };
    const int count = is_below(0) + is_below(1) + is_below(2);
    if (count == 0 || count == 3) {
      continue;
    }
    int from = -1;
    int to = -1;
    for (int c = 0; c < 3; ++c) {
      const int a = corners[c];
      const int b = corners[(c + 1) % 3];
      if (height[a] < 0 && height[b] >= 0) {
        from = point(a, b);
      } else if (height[a] >= 0 && height[b] < 0) {
        to = point(a, b);
      }
    }
    if (from >= 0 && to >= 0) {
      cut.segments.push_back({from, to});
    }
  }
  return cut;
}

// Distance along a ray to the nearest face, infinity if there is none. One ray per landmark: seen
// along the ray, only a few faces cover the origin.
double ray_length(const Points& vertices, const Triangles& faces, const Vector3d& origin,
                  const Vector3d& direction) {
  const Vector3d u = direction.unitOrthogonal();
  const Vector3d v = direction.cross(u);
  Eigen::Matrix3d frame;
  frame << u, v, direction;
  const Points seen = (vertices.rowwise() - origin.transpose()) * frame;
  double nearest = std::numeric_limits<double>::infinity();
  for (Index f = 0; f < faces.rows(); ++f) {
    const double* a = seen.data() + 3 * faces(f, 0);
    const double* b = seen.data() + 3 * faces(f, 1);
    const double* c = seen.data() + 3 * faces(f, 2);
    const double bc = b[0] * c[1] - b[1] * c[0];
    const double ca = c[0] * a[1] - c[1] * a[0];
    const double ab = a[0] * b[1] - a[1] * b[0];
    const bool covers = (bc >= 0 && ca >= 0 && ab >= 0) || (bc <= 0 && ca <= 0 && ab <= 0);
    const double area = bc + ca + ab;
    if (covers && area != 0) {
      const double t = (bc * a[2] + ca * b[2] + ab * c[2]) / area;
      if (t > 0) {
        nearest = std::min(nearest, t);
      }
    }
  }
  return nearest;
}

Vector3d joint(const Skeleton& skeleton, const Points& positions, const std::string& name) {
  const int index = find_joint(skeleton, name);
  ATELIER_CHECK(index >= 0, "measuring needs a joint named " + name);
  return positions.row(index);
}

// Heights are measured on a body that stands: trunk and legs within 45 degrees of upright.
void check_upright(const Skeleton& skeleton, const Points& joints) {
  const auto at = [&](const std::string& name) { return joint(skeleton, joints, name); };
  const auto check = [](const char* what, const Vector3d& bone) {
    if (!(bone.y() > std::sqrt(0.5) * bone.norm())) {
      throw DataError("", "rest pose", std::string(what) + " that do not stand upright",
                      "a person who stands: lengths and girths are measured from the ground up");
    }
  };
  check("hips and neck", at("neck") - at("pelvis"));
  for (const char* side : {"left_", "right_"}) {
    check("legs", at(std::string(side) + "hip") - at(std::string(side) + "ankle"));
  }
}

// Length of the longest opening: edges that only one face has, as they hang together. Vertices of
// one place must be one.
double longest_border(const Points& vertices, const Triangles& faces) {
  std::unordered_set<std::int64_t> sides;
  const auto side = [](int a, int b) {
    return (static_cast<std::int64_t>(a) << 32) | static_cast<std::uint32_t>(b);
  };
  for (Index f = 0; f < faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      sides.insert(side(faces(f, c), faces(f, (c + 1) % 3)));
    }
  }
  std::vector<std::array<int, 2>> border;
  std::vector<int> above(static_cast<std::size_t>(vertices.rows()));
  std::iota(above.begin(), above.end(), 0);
  const auto root = [&](int v) {
    while (above[static_cast<std::size_t>(v)] != v) {
      v = above[static_cast<std::size_t>(v)] =
          above[static_cast<std::size_t>(above[static_cast<std::size_t>(v)])];
    }
    return v;
  };
  for (Index f = 0; f < faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const int a = faces(f, c);
      const int b = faces(f, (c + 1) % 3);
      if (!sides.contains(side(b, a))) {
        border.push_back({a, b});
        above[static_cast<std::size_t>(root(a))] = root(b);
      }
    }
  }
  std::unordered_map<int, double> lengths;
  double longest = 0;
  for (const std::array<int, 2>& edge : border) {
    double& length = lengths[root(edge[0])];
    length += (vertices.row(edge[0]) - vertices.row(edge[1])).norm();
    longest = std::max(longest, length);
  }
  return longest;
}

}  // namespace

const std::vector<NamedMeasurement>& measurement_names() {
  static const std::vector<NamedMeasurement> names = {
      {"stature", "m", &BodyMeasurements::stature},
      {"mass", "kg", &BodyMeasurements::mass},
      {"leg_length", "m", &BodyMeasurements::leg_length},
      {"torso_length", "m", &BodyMeasurements::torso_length},
      {"arm_length", "m", &BodyMeasurements::arm_length},
      {"shoulder_breadth", "m", &BodyMeasurements::shoulder_breadth},
      {"neck_girth", "m", &BodyMeasurements::neck_girth},
      {"chest_girth", "m", &BodyMeasurements::chest_girth},
      {"waist_girth", "m", &BodyMeasurements::waist_girth},
      {"hip_girth", "m", &BodyMeasurements::hip_girth},
      {"thigh_girth", "m", &BodyMeasurements::thigh_girth},
      {"upper_arm_girth", "m", &BodyMeasurements::upper_arm_girth},
      {"calf_girth", "m", &BodyMeasurements::calf_girth},
      {"forearm_girth", "m", &BodyMeasurements::forearm_girth}};
  return names;
}

double mesh_volume(const Points& vertices, const Triangles& faces) {
  // About the first vertex, so that a body far from the origin loses no digits.
  double volume = 0;
  const Eigen::RowVector3d o =
      vertices.rows() > 0 ? Eigen::RowVector3d(vertices.row(0)) : Eigen::RowVector3d(0, 0, 0);
  for (Index f = 0; f < faces.rows(); ++f) {
    const Vector3d a = vertices.row(faces(f, 0)) - o;
    const Vector3d b = vertices.row(faces(f, 1)) - o;
    const Vector3d c = vertices.row(faces(f, 2)) - o;
    volume += a.dot(b.cross(c)) / 6;
  }
  return volume;
}

double girth_at(const Points& vertices, const Triangles& faces, const Vector3d& origin,
                const Vector3d& normal) {
  const Cut cut = cut_mesh(vertices, faces, origin, normal);
  const Vector3d u = normal.unitOrthogonal();
  const Vector3d v = normal.cross(u);
  std::vector<Vector2d> flat;
  for (const Vector3d& p : cut.points) {
    flat.push_back({(p - origin).dot(u), (p - origin).dot(v)});
  }
  std::vector<int> piece(cut.points.size());
  std::iota(piece.begin(), piece.end(), 0);
  const auto find = [&](int i) {
    while (piece[static_cast<std::size_t>(i)] != i) {
      piece[static_cast<std::size_t>(i)] =
          piece[static_cast<std::size_t>(piece[static_cast<std::size_t>(i)])];
      i = piece[static_cast<std::size_t>(i)];
    }
    return i;
  };
  for (const auto& s : cut.segments) {
    piece[static_cast<std::size_t>(find(s[0]))] = find(s[1]);
  }
  // Turns of each piece round the origin.
  std::unordered_map<int, double> turns;
  for (const auto& s : cut.segments) {
    const Vector2d& a = flat[static_cast<std::size_t>(s[0])];
    const Vector2d& b = flat[static_cast<std::size_t>(s[1])];
    turns[find(s[0])] += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
  }
  double shortest = 0;
  for (const auto& [id, angle] : turns) {
    if (std::abs(angle) < 3) {
      continue;
    }
    std::vector<Vector2d> outline;
    for (std::size_t i = 0; i < flat.size(); ++i) {
      if (find(static_cast<int>(i)) == id) {
        outline.push_back(flat[i]);
      }
    }
    const double length = hull_length(outline);
    shortest = shortest == 0 ? length : std::min(shortest, length);
  }
  return shortest;
}

BodyMeasurements measure_body(const Mesh& mesh, const Skeleton& skeleton) {
  const Points& vertices = mesh.vertices;
  const Triangles& faces = mesh.faces;
  ATELIER_CHECK(vertices.rows() > 0 && faces.rows() > 0, "measuring needs a mesh");
  const Points joints = rest_positions(skeleton);
  const auto at = [&](const std::string& name) { return joint(skeleton, joints, name); };
  const auto girth = [&](const std::string& what, const Vector3d& origin, const Vector3d& normal) {
    const double length = girth_at(vertices, faces, origin, normal.normalized());
    if (length == 0) {
      throw DataError("", what, "no closed outline round the bone",
                      "a closed mesh in rest pose with its joints inside");
    }
    return length;
  };
  check_upright(skeleton, joints);
  const Vector3d up = Vector3d::UnitY();
  const Vector3d pelvis = at("pelvis");
  const Vector3d neck = at("neck");
  const Vector3d head = at("head");

  BodyMeasurements m;
  double ground = std::numeric_limits<double>::infinity();
  double top = -ground;
  for (Index i = 0; i < faces.size(); ++i) {
    ground = std::min(ground, vertices(faces.data()[i], 1));
    top = std::max(top, vertices(faces.data()[i], 1));
  }
  m.stature = top - ground;
  const double volume = mesh_volume(vertices, faces);
  if (!(volume > 0)) {
    throw DataError("", "skin", "a volume of " + short_number(volume) + " m^3",
                    "a closed skin whose faces are counter-clockwise from outside");
  }
  m.mass = kBodyDensity * volume;

  double crotch = std::numeric_limits<double>::infinity();
  for (const Vector3d& p : cut_mesh(vertices, faces, pelvis, Vector3d::UnitX()).points) {
    crotch = std::min(crotch, p.y());
  }
  m.leg_length = crotch - ground;
  m.torso_length = neck.y() - crotch;
  // From the middle of the section in the median plane: the spine of some bodies (MakeHuman) runs
  // so near the back that the straight line from pelvis to neck leaves the skin.
  const auto trunk = [&](const std::string& what, double height) {
    const Vector3d level(pelvis.x(), height, pelvis.z());
    const Cut cut = cut_mesh(vertices, faces, level, up);
    double back = std::numeric_limits<double>::infinity();
    double front = -back;
    for (const auto& s : cut.segments) {
      const Vector3d& a = cut.points[static_cast<std::size_t>(s[0])];
      const Vector3d& b = cut.points[static_cast<std::size_t>(s[1])];
      if ((a.x() < level.x()) != (b.x() < level.x())) {
        const double z = a.z() + (level.x() - a.x()) / (b.x() - a.x()) * (b.z() - a.z());
        back = std::min(back, z);
        front = std::max(front, z);
      }
    }
    const Vector3d middle(level.x(), height, 0.5 * (back + front));
    return girth(what, front > back ? middle : level, up);
  };
  m.chest_girth = trunk("chest", pelvis.y() + 0.63 * (neck.y() - pelvis.y()));
  m.waist_girth = trunk("waist", pelvis.y() + 0.33 * (neck.y() - pelvis.y()));
  m.neck_girth = girth("neck", 0.5 * (neck + head), head - neck);
  Vector3d acromion[2];
  for (int side = 0; side < 2; ++side) {
    const std::string s = side == 0 ? "left_" : "right_";
    const Vector3d hip = at(s + "hip");
    const Vector3d knee = at(s + "knee");
    const Vector3d ankle = at(s + "ankle");
    const Vector3d shoulder = at(s + "shoulder");
    const Vector3d elbow = at(s + "elbow");
    const Vector3d wrist = at(s + "wrist");
    if (side == 0) {
      m.hip_girth = trunk("hip", hip.y());
    }
    const double outward = shoulder.x() > pelvis.x() ? 0.5 : -0.5;
    const Vector3d direction(outward, std::sqrt(0.75), 0);
    const double reach = ray_length(vertices, faces, shoulder, direction);
    if (!std::isfinite(reach)) {
      throw DataError("", s + "shoulder", "no skin above the joint",
                      "a closed mesh round its joints");
    }
    acromion[side] = shoulder + reach * direction;
    m.arm_length += 0.5 * ((acromion[side] - elbow).norm() + (elbow - wrist).norm());
    m.thigh_girth += 0.5 * girth(s + "thigh", hip + 0.28 * (knee - hip), knee - hip);
    m.calf_girth += 0.5 * girth(s + "calf", knee + 0.3 * (ankle - knee), ankle - knee);
    m.upper_arm_girth += 0.5 * girth(s + "upper arm", 0.5 * (shoulder + elbow), elbow - shoulder);
    m.forearm_girth += 0.5 * girth(s + "forearm", elbow + 0.25 * (wrist - elbow), wrist - elbow);
  }
  m.shoulder_breadth = (acromion[0] - acromion[1]).norm();
  return m;
}

BodyMeasurements measure_body(const BodyModel& model, const Eigen::VectorXd& shape) {
  const ShapedBody body = shape_body(model, shape);
  const MainPiece piece = main_piece(body.vertices, model.mesh.faces);
  Mesh mesh;
  mesh.vertices = body.vertices;
  mesh.faces = piece.faces;
  const double border = longest_border(mesh.vertices, mesh.faces);
  const bool open =
      border > kMaxBorder * (mesh.vertices.col(1).maxCoeff() - mesh.vertices.col(1).minCoeff());
  if (open && piece.pieces == 1) {
    throw DataError("", "skin", "an opening of " + short_number(border) + " m round",
                    "a closed skin: an open one has no volume");
  }
  BodyMeasurements measures = measure_body(mesh, body.skeleton);
  if (piece.pieces > 1) {
    measures.mass = 0;  // clothes over skin count some space twice, some not at all
  }
  return measures;
}

}  // namespace atelier
