#include "bodymodel/human/human_uv.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

namespace atelier {
namespace {

enum Island {
  FaceIsland,
  BackOfHeadIsland,
  FrontIsland,
  BackIsland,
  ArmIsland,
  HandBackIsland,
  PalmIsland,
  LegIsland,
  FootTopIsland,
  SoleIsland,
  IslandCount
};

// Where each island of the left half lies in the atlas: lower left corner and size; islands of the
// middle hold both halves. The right side's limbs lie beside the left side's.
struct Box {
  const char* name;
  bool middle;
  double u, v, width, height;
};
constexpr Box kBoxes[IslandCount] = {
    {"face", true, 0.01, 0.74, 0.22, 0.25},        {"back_of_head", true, 0.24, 0.74, 0.22, 0.25},
    {"torso_front", true, 0.01, 0.30, 0.25, 0.43}, {"torso_back", true, 0.27, 0.30, 0.25, 0.43},
    {"arm", false, 0.54, 0.36, 0.10, 0.37},        {"hand_back", false, 0.48, 0.80, 0.115, 0.19},
    {"palm", false, 0.73, 0.80, 0.115, 0.19},      {"leg", false, 0.76, 0.30, 0.11, 0.43},
    {"foot_top", false, 0.01, 0.06, 0.10, 0.22},   {"sole", false, 0.24, 0.06, 0.10, 0.22}};

struct Corner {
  double u, v;
};

// Moves the points of turned-over triangles, and more and more of those round them, to the middle
// of their neighbours until no triangle is turned over. Islands' borders stay; the body's middle
// line, where u is 0, slides along itself. `sign` is -1 for triangles whose area should be
// negative.
template <class Sign>
void smooth_out(const std::vector<std::vector<int>>& faces, std::vector<Corner>& points,
                const Sign& sign) {
  std::vector<std::vector<int>> neighbours(points.size());
  std::map<std::pair<int, int>, int> sides;
  for (const std::vector<int>& face : faces) {
    for (std::size_t c = 0; c < 3; ++c) {
      const int a = face[c];
      const int b = face[(c + 1) % 3];
      ++sides[{std::min(a, b), std::max(a, b)}];
    }
  }
  std::vector<char> border(points.size(), 0);
  for (const auto& [edge, count] : sides) {
    neighbours[static_cast<std::size_t>(edge.first)].push_back(edge.second);
    neighbours[static_cast<std::size_t>(edge.second)].push_back(edge.first);
    if (count == 1) {
      border[static_cast<std::size_t>(edge.first)] = 1;
      border[static_cast<std::size_t>(edge.second)] = 1;
    }
  }
  std::vector<char> moves(points.size(), 0);
  for (int round = 0; round < 12; ++round) {
    bool flat = true;
    for (std::size_t f = 0; f < faces.size(); ++f) {
      const Corner& p = points[static_cast<std::size_t>(faces[f][0])];
      const Corner& q = points[static_cast<std::size_t>(faces[f][1])];
      const Corner& r = points[static_cast<std::size_t>(faces[f][2])];
      if (sign(f) * ((q.u - p.u) * (r.v - p.v) - (q.v - p.v) * (r.u - p.u)) <= 0) {
        flat = false;
        for (const int v : faces[f]) {
          moves[static_cast<std::size_t>(v)] = 1;
        }
      }
    }
    if (flat) {
      return;
    }
    const std::vector<char> before = moves;
    for (std::size_t v = 0; v < points.size(); ++v) {
      for (const int other : neighbours[v]) {
        moves[v] = static_cast<char>(moves[v] | before[static_cast<std::size_t>(other)]);
      }
    }
    for (int step = 0; step < 200; ++step) {
      for (std::size_t v = 0; v < points.size(); ++v) {
        const bool middle_line = border[v] != 0 && points[v].u == 0;
        if (moves[v] == 0 || (border[v] != 0 && !middle_line)) {
          continue;
        }
        Corner middle = {0, 0};
        const double share = 1 / static_cast<double>(neighbours[v].size());
        for (const int other : neighbours[v]) {
          middle.u += share * points[static_cast<std::size_t>(other)].u;
          middle.v += share * points[static_cast<std::size_t>(other)].v;
        }
        points[v] = {middle_line ? 0 : middle.u, middle.v};
      }
    }
  }
}

// Twice the signed area of a triangle.
double twice_area(const std::array<Corner, 3>& corners) {
  const auto& [p, q, r] = corners;
  return (q.u - p.u) * (r.v - p.v) - (q.v - p.v) * (r.u - p.u);
}

// Which part of the anatomy each vertex is nearest to.
std::vector<std::size_t> nearest_parts(const HumanField& field, const std::vector<Vec3d>& points) {
  std::vector<std::size_t> part(points.size());
  for (std::size_t v = 0; v < part.size(); ++v) {
    const auto d = part_distances(field, points[v]);
    part[v] = static_cast<std::size_t>(std::min_element(d.begin(), d.end()) - d.begin());
  }
  return part;
}

Vec3d head_centre(const HumanAnatomy& anatomy) {
  const double k = anatomy.build.stature / 1000;
  return {0, k * 937, k * 18};
}

// The island of a face of the left half, by where it lies and looks. `part`: of each vertex.
Island island_of(const HumanAnatomy& anatomy, const HumanTemplate& body,
                 const std::vector<std::size_t>& part, const std::array<int, 3>& face) {
  const HumanJoints& j = anatomy.joints;
  const double k = anatomy.build.stature / 1000;
  const Vec3d a = body.points[static_cast<std::size_t>(face[0])];
  const Vec3d b = body.points[static_cast<std::size_t>(face[1])];
  const Vec3d c = body.points[static_cast<std::size_t>(face[2])];
  const Vec3d p = (1.0 / 3) * (a + b + c);
  const Vec3d n = cross(b - a, c - a);
  const auto count = [&](std::size_t which) {
    int hits = 0;
    for (int v : face) {
      hits += part[static_cast<std::size_t>(v)] == which;
    }
    return hits;
  };
  const double along_arm = dot(p - j.wrist, anatomy.arm.axis) / k;
  if (p.x > j.elbow.x && along_arm > 0) {
    return dot(n, anatomy.arm.u) > 0 ? HandBackIsland : PalmIsland;
  }
  if (p.y < k * 52) {
    if (p.z > k * 76) {  // round toes: cut half way up
      return n.y > 0 ? FootTopIsland : SoleIsland;
    }
    return n.y > 0.25 * norm(n) || p.y > k * 14 ? FootTopIsland : SoleIsland;
  }
  if (count(3) >= 2 && p.y > k * 866) {
    return p.z > head_centre(anatomy).z ? FaceIsland : BackOfHeadIsland;
  }
  if (count(2) + count(4) >= 2 && dot(p - j.shoulder, {0.93, -0.37, 0}) > 0) {
    return ArmIsland;
  }
  if (dot(p - j.hip, {0.61, -0.79, 0}) > 0 && p.y < k * 600) {
    return LegIsland;
  }
  return n.z > 0 ? FrontIsland : BackIsland;
}

// A limb's surface unrolled: the angle round its axis, within half a turn of `near_angle`, and
// the way along it, negative.
Corner unrolled(const HumanTube& tube, Vec3d p, double near_angle) {
  const Vec3d q = p - tube.origin;
  const double s = dot(q, tube.axis);
  const double tau = station_at(tube, s);
  const HumanSection section =
      section_at(tube, std::clamp(tau, 0.0, static_cast<double>(tube.sections.size() - 1)));
  double angle = std::atan2(dot(q, tube.v) - section.cv, dot(q, tube.u) - section.cu);
  while (angle < near_angle - std::numbers::pi) {
    angle += 2 * std::numbers::pi;
  }
  while (angle > near_angle + std::numbers::pi) {
    angle -= 2 * std::numbers::pi;
  }
  return {angle, -s};
}

// Half of the head on a plane, equidistant from the middle of the face or of the back.
Corner azimuthal(Vec3d centre, Vec3d p, bool front) {
  Vec3d d = p - centre;
  d = (1 / norm(d)) * d;
  const double z = front ? d.z : -d.z;
  const double across = std::hypot(d.x, d.y);
  const double angle = std::acos(std::clamp(z, -1.0, 1.0));
  const double r = across > 1e-9 ? angle / across : 1;
  return {(front ? 1 : -1) * r * d.x, r * d.y};
}

// The upper foot spread like a skirt: what is lower lies further out from the foot's middle line.
// `k`: metres in a thousandth of the stature.
Corner spread_foot(Vec3d ankle, double k, Vec3d p) {
  const double ahead = std::clamp(p.z - ankle.z, 0.0, 70 * k);
  const double x = p.x - ankle.x - 0.09 * ahead;
  const double z = p.z - ankle.z - ahead;
  const double r = std::hypot(x, z);
  const double out =
      r > 1e-9 ? (r + 0.9 * std::max(0.0, (52 - 34 * ahead / (70 * k)) * k - p.y)) / r : 0;
  return {out * x + 0.09 * ahead, -(out * z + ahead)};
}

// Where an island's projection takes a point of the body: metres, on limbs radians and metres.
Corner projected(const HumanAnatomy& anatomy, Island island, Vec3d p, double near_angle) {
  const HumanJoints& j = anatomy.joints;
  const Vec3d arm_axis = anatomy.arm.axis;
  switch (island) {
    case FaceIsland:
    case BackOfHeadIsland:
      return azimuthal(head_centre(anatomy), p, island == FaceIsland);
    case FrontIsland:
      return {p.x, p.y};
    case BackIsland:
      return {-p.x, p.y};
    case ArmIsland:
      return unrolled(anatomy.arm, p, near_angle);
    case LegIsland:
      return unrolled(anatomy.leg, p, near_angle);
    case HandBackIsland:
      return {dot(p - j.wrist, {0, 0, 1}), -dot(p - j.wrist, arm_axis)};
    case PalmIsland:
      return {-dot(p - j.wrist, {0, 0, 1}), -dot(p - j.wrist, arm_axis)};
    case FootTopIsland:
      return spread_foot(j.ankle, anatomy.build.stature / 1000, p);
    default:
      return {-p.x, -p.z};
  }
}

// The faces of the left half, each projected into its island.
struct Layout {
  std::vector<Island> island;
  std::vector<std::array<Corner, 3>> corners;
  std::array<double, IslandCount> facing{};  // twice each island's area; below 0: seen from inside

  // Twice a face's area, positive where it lies as most of its island does.
  double upright_area(std::size_t f) const {
    const double area = twice_area(corners[f]);
    return facing[island[f]] < 0 ? -area : area;
  }
};

void project_face(const HumanAnatomy& anatomy, const HumanTemplate& body, std::size_t f,
                  Island where, Layout& layout) {
  layout.island[f] = where;
  Vec3d centre = {0, 0, 0};
  for (int v : body.faces[f]) {
    centre += (1.0 / 3) * body.points[static_cast<std::size_t>(v)];
  }
  const double near_angle = projected(anatomy, where, centre, 0).u;
  for (std::size_t c = 0; c < 3; ++c) {
    layout.corners[f][c] = projected(
        anatomy, where, body.points[static_cast<std::size_t>(body.faces[f][c])], near_angle);
  }
}

Layout projected_islands(const HumanField& field, const HumanTemplate& body) {
  const std::vector<std::size_t> part = nearest_parts(field, body.points);
  Layout layout;
  layout.island.resize(body.faces.size());
  layout.corners.resize(body.faces.size());
  for (std::size_t f = 0; f < body.faces.size(); ++f) {
    project_face(field.anatomy, body, f, island_of(field.anatomy, body, part, body.faces[f]),
                 layout);
    layout.facing[layout.island[f]] += twice_area(layout.corners[f]);
  }
  return layout;
}

// Where a part hangs over (behind the ears, the rim of the sole) its projection folds. A folded
// triangle on a border goes to the island next to it if it lies flat there.
void hand_over_folded(const HumanAnatomy& anatomy, const HumanTemplate& body, Layout& layout) {
  for (int round = 0; round < 6; ++round) {
    std::map<std::pair<int, int>, std::size_t> edges;
    for (std::size_t f = 0; f < body.faces.size(); ++f) {
      for (std::size_t c = 0; c < 3; ++c) {
        edges[{body.faces[f][c], body.faces[f][(c + 1) % 3]}] = f;
      }
    }
    for (std::size_t f = 0; f < body.faces.size(); ++f) {
      for (std::size_t c = 0; c < 3 && layout.upright_area(f) <= 0; ++c) {
        const auto beside = edges.find({body.faces[f][(c + 1) % 3], body.faces[f][c]});
        if (beside == edges.end() || layout.island[beside->second] == layout.island[f]) {
          continue;
        }
        const Island before = layout.island[f];
        const std::array<Corner, 3> kept = layout.corners[f];
        project_face(anatomy, body, f, layout.island[beside->second], layout);
        if (layout.upright_area(f) <= 0) {
          layout.island[f] = before;
          layout.corners[f] = kept;
        }
      }
    }
  }
}

// Smooths out what is still folded, on the corners that the faces of an island share.
void smooth_out_folded(const HumanTemplate& body, Layout& layout) {
  std::vector<std::vector<int>> points(body.faces.size(), std::vector<int>(3));
  std::vector<Corner> placed;
  std::map<std::tuple<int, double, double>, int> known[IslandCount];
  for (std::size_t f = 0; f < points.size(); ++f) {
    for (std::size_t c = 0; c < 3; ++c) {
      const Corner& corner = layout.corners[f][c];
      const auto [it, fresh] = known[layout.island[f]].try_emplace(
          {body.faces[f][c], corner.u, corner.v}, static_cast<int>(placed.size()));
      if (fresh) {
        placed.push_back(corner);
      }
      points[f][c] = it->second;
    }
  }
  smooth_out(points, placed,
             [&](std::size_t f) { return layout.facing[layout.island[f]] < 0 ? -1.0 : 1.0; });
  for (std::size_t f = 0; f < points.size(); ++f) {
    for (std::size_t c = 0; c < 3; ++c) {
      layout.corners[f][c] = placed[static_cast<std::size_t>(points[f][c])];
    }
  }
}

// Turns islands over that are seen from inside.
void show_from_outside(Layout& layout) {
  for (std::size_t f = 0; f < layout.island.size(); ++f) {
    for (Corner& corner : layout.corners[f]) {
      if (layout.facing[layout.island[f]] < 0) {
        corner.u = -corner.u;
      }
    }
  }
}

// Extent of an island before it is scaled into its box.
struct Extent {
  Corner low = {1e9, 1e9};
  Corner high = {-1e9, -1e9};
};

std::array<Extent, IslandCount> extents_of(const Layout& layout) {
  std::array<Extent, IslandCount> extents;
  for (std::size_t f = 0; f < layout.island.size(); ++f) {
    const auto i = static_cast<std::size_t>(layout.island[f]);
    Extent& extent = extents[i];
    for (const Corner& corner : layout.corners[f]) {
      extent.low.u = std::min(extent.low.u, kBoxes[i].middle ? -std::abs(corner.u) : corner.u);
      extent.high.u = std::max(extent.high.u, kBoxes[i].middle ? std::abs(corner.u) : corner.u);
      extent.low.v = std::min(extent.low.v, corner.v);
      extent.high.v = std::max(extent.high.v, corner.v);
    }
  }
  return extents;
}

// A corner scaled into its island's box; the right half (side 1) mirrored.
std::array<double, 2> boxed(const Box& box, const Extent& extent, const Corner& corner, int side) {
  double u = corner.u;
  if (side == 1) {
    u = -u;
  }
  const double left = side == 1 && !box.middle ? -extent.high.u : extent.low.u;
  const double size_u = extent.high.u - extent.low.u;
  const double size_v = extent.high.v - extent.low.v;
  const double offset = side == 1 && !box.middle ? box.width + 0.01 : 0.0;
  return {box.u + offset + box.width * (u - left) / size_u,
          box.v + box.height * (corner.v - extent.low.v) / size_v};
}

// Vertices of the islands, by island and side; those of the middle are all of side 0.
using Members = std::vector<std::vector<int>>;

std::vector<VertexGroup> named_islands(Members members) {
  std::vector<VertexGroup> islands;
  for (std::size_t i = 0; i < IslandCount; ++i) {
    for (std::size_t side = 0; side < 2; ++side) {
      std::vector<int>& list = members[2 * i + side];
      if (list.empty()) {
        continue;
      }
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
      const std::string prefix = kBoxes[i].middle ? "uv_" : (side == 0 ? "uv_left_" : "uv_right_");
      islands.push_back({prefix + kBoxes[i].name, std::move(list)});
    }
  }
  return islands;
}

// Both halves in the unit square.
HumanAtlas packed_atlas_of(const Layout& layout, const Triangles& faces) {
  const std::array<Extent, IslandCount> extents = extents_of(layout);
  const std::size_t half_faces = layout.island.size();
  HumanAtlas atlas;
  atlas.uv_faces.resize(faces.rows(), 3);
  std::map<std::array<double, 2>, int> seen[2 * IslandCount];
  std::vector<std::array<double, 2>> uvs;
  Members members(2 * IslandCount);
  for (int side = 0; side < 2; ++side) {
    for (std::size_t f = 0; f < half_faces; ++f) {
      const auto i = static_cast<std::size_t>(layout.island[f]);
      const Box& box = kBoxes[i];
      const std::size_t slot = box.middle ? 2 * i : 2 * i + static_cast<std::size_t>(side);
      const Index row = static_cast<Index>(f + (side == 0 ? 0 : half_faces));
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t source = side == 0 ? c : (c == 0 ? 0 : 3 - c);
        const std::array<double, 2> uv = boxed(box, extents[i], layout.corners[f][source], side);
        const auto [it, fresh] = seen[slot].try_emplace(uv, static_cast<int>(uvs.size()));
        if (fresh) {
          uvs.push_back(uv);
        }
        atlas.uv_faces(row, static_cast<Index>(c)) = it->second;
        members[slot].push_back(faces(row, static_cast<Index>(c)));
      }
    }
  }
  atlas.uvs.resize(static_cast<Index>(uvs.size()), 2);
  for (std::size_t i = 0; i < uvs.size(); ++i) {
    atlas.uvs.row(static_cast<Index>(i)) << uvs[i][0], uvs[i][1];
  }
  atlas.islands = named_islands(std::move(members));
  return atlas;
}

}  // namespace

HumanAtlas human_atlas(const HumanTemplate& body, const Triangles& faces) {
  const HumanField field = human_field(human_anatomy({}));
  Layout layout = projected_islands(field, body);
  hand_over_folded(field.anatomy, body, layout);
  smooth_out_folded(body, layout);
  show_from_outside(layout);
  return packed_atlas_of(layout, faces);
}

}  // namespace atelier
