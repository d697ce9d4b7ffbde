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

}  // namespace

HumanAtlas human_atlas(const HumanTemplate& body, const Triangles& faces) {
  const HumanField field = human_field(human_anatomy({}));
  const HumanJoints& j = field.anatomy.joints;
  const double k = field.anatomy.build.stature / 1000;
  const std::size_t half_faces = body.faces.size();

  // Parts by vertex, islands by face.
  std::vector<std::size_t> part(body.points.size());
  for (std::size_t v = 0; v < part.size(); ++v) {
    const auto d = part_distances(field, body.points[v]);
    part[v] = static_cast<std::size_t>(std::min_element(d.begin(), d.end()) - d.begin());
  }
  const Vec3d arm_axis = field.anatomy.arm.axis;
  const Vec3d hand_up = field.anatomy.arm.u;
  const Vec3d head_centre = {0, k * 937, k * 18};
  const auto island_of = [&](const std::array<int, 3>& face) {
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
    const double along_arm = dot(p - j.wrist, arm_axis) / k;
    if (p.x > j.elbow.x && along_arm > 0) {
      return dot(n, hand_up) > 0 ? HandBackIsland : PalmIsland;
    }
    if (p.y < k * 52) {
      if (p.z > k * 76) {  // round toes: cut half way up
        return n.y > 0 ? FootTopIsland : SoleIsland;
      }
      return n.y > 0.25 * norm(n) || p.y > k * 14 ? FootTopIsland : SoleIsland;
    }
    if (count(3) >= 2 && p.y > k * 866) {
      return p.z > head_centre.z ? FaceIsland : BackOfHeadIsland;
    }
    if (count(2) + count(4) >= 2 && dot(p - j.shoulder, {0.93, -0.37, 0}) > 0) {
      return ArmIsland;
    }
    if (dot(p - j.hip, {0.61, -0.79, 0}) > 0 && p.y < k * 600) {
      return LegIsland;
    }
    return n.z > 0 ? FrontIsland : BackIsland;
  };
  // A face's corner in its island, in metres.
  const auto place = [&](Island island, Vec3d p, double near_angle) -> std::array<double, 2> {
    const auto round_tube = [&](const HumanTube& tube, double cut) -> std::array<double, 2> {
      const Vec3d q = p - tube.origin;
      const double s = dot(q, tube.axis);
      const double tau = station_at(tube, s);
      const HumanSection section =
          section_at(tube, std::clamp(tau, 0.0, static_cast<double>(tube.sections.size() - 1)));
      double angle = std::atan2(dot(q, tube.v) - section.cv, dot(q, tube.u) - section.cu) - cut;
      while (angle < near_angle - std::numbers::pi) {
        angle += 2 * std::numbers::pi;
      }
      while (angle > near_angle + std::numbers::pi) {
        angle -= 2 * std::numbers::pi;
      }
      return {angle, -s};
    };
    switch (island) {
      case FaceIsland:
      case BackOfHeadIsland: {
        Vec3d d = p - head_centre;
        d = (1 / norm(d)) * d;
        const double z = island == FaceIsland ? d.z : -d.z;
        const double across = std::hypot(d.x, d.y);
        const double angle = std::acos(std::clamp(z, -1.0, 1.0));
        const double r = across > 1e-9 ? angle / across : 1;
        return {(island == FaceIsland ? 1 : -1) * r * d.x, r * d.y};
      }
      case FrontIsland:
        return {p.x, p.y};
      case BackIsland:
        return {-p.x, p.y};
      case ArmIsland:
        return round_tube(field.anatomy.arm, 0);
      case LegIsland:
        return round_tube(field.anatomy.leg, 0);
      case HandBackIsland:
        return {dot(p - j.wrist, {0, 0, 1}), -dot(p - j.wrist, arm_axis)};
      case PalmIsland:
        return {-dot(p - j.wrist, {0, 0, 1}), -dot(p - j.wrist, arm_axis)};
      case FootTopIsland: {
        // Spread like a skirt: what is lower lies further out from the foot's middle line.
        const double ahead = std::clamp(p.z - j.ankle.z, 0.0, 70 * k);
        const double x = p.x - j.ankle.x - 0.09 * ahead;
        const double z = p.z - j.ankle.z - ahead;
        const double r = std::hypot(x, z);
        const double out =
            r > 1e-9 ? (r + 0.9 * std::max(0.0, (52 - 34 * ahead / (70 * k)) * k - p.y)) / r : 0;
        return {out * x + 0.09 * ahead, -(out * z + ahead)};
      }
      default:
        return {-p.x, -p.z};
    }
  };

  std::vector<Island> island(half_faces);
  std::vector<std::array<Corner, 3>> corners(half_faces);
  std::array<double, IslandCount> facing{};
  const auto put = [&](std::size_t f, Island where) {
    island[f] = where;
    Vec3d centre = {0, 0, 0};
    for (int v : body.faces[f]) {
      centre += (1.0 / 3) * body.points[static_cast<std::size_t>(v)];
    }
    const double near_angle = place(where, centre, 0)[0];
    for (std::size_t c = 0; c < 3; ++c) {
      const auto uv =
          place(where, body.points[static_cast<std::size_t>(body.faces[f][c])], near_angle);
      corners[f][c] = {uv[0], uv[1]};
    }
  };
  for (std::size_t f = 0; f < half_faces; ++f) {
    put(f, island_of(body.faces[f]));
    const auto& [p, q, r] = corners[f];
    facing[island[f]] += (q.u - p.u) * (r.v - p.v) - (q.v - p.v) * (r.u - p.u);
  }
  // Where a part hangs over (behind the ears, the rim of the sole) its projection folds. A folded
  // triangle on a border goes to the island next to it if it lies flat there, the others are
  // smoothed out.
  const auto twice_area = [&](std::size_t f) {
    const auto& [p, q, r] = corners[f];
    const double area = (q.u - p.u) * (r.v - p.v) - (q.v - p.v) * (r.u - p.u);
    return facing[island[f]] < 0 ? -area : area;
  };
  for (int round = 0; round < 6; ++round) {
    std::map<std::pair<int, int>, std::size_t> edges;
    for (std::size_t f = 0; f < half_faces; ++f) {
      for (std::size_t c = 0; c < 3; ++c) {
        edges[{body.faces[f][c], body.faces[f][(c + 1) % 3]}] = f;
      }
    }
    for (std::size_t f = 0; f < half_faces; ++f) {
      for (std::size_t c = 0; c < 3 && twice_area(f) <= 0; ++c) {
        const auto beside = edges.find({body.faces[f][(c + 1) % 3], body.faces[f][c]});
        if (beside == edges.end() || island[beside->second] == island[f]) {
          continue;
        }
        const Island before = island[f];
        const std::array<Corner, 3> kept = corners[f];
        put(f, island[beside->second]);
        if (twice_area(f) <= 0) {
          island[f] = before;
          corners[f] = kept;
        }
      }
    }
  }
  std::vector<std::vector<int>> points(half_faces, std::vector<int>(3));
  std::vector<Corner> placed;
  {
    std::map<std::tuple<int, double, double>, int> known[IslandCount];
    for (std::size_t f = 0; f < half_faces; ++f) {
      for (std::size_t c = 0; c < 3; ++c) {
        const Corner& corner = corners[f][c];
        const auto [it, fresh] = known[island[f]].try_emplace(
            {body.faces[f][c], corner.u, corner.v}, static_cast<int>(placed.size()));
        if (fresh) {
          placed.push_back(corner);
        }
        points[f][c] = it->second;
      }
    }
  }
  smooth_out(points, placed, [&](std::size_t f) { return facing[island[f]] < 0 ? -1.0 : 1.0; });
  for (std::size_t f = 0; f < half_faces; ++f) {
    for (std::size_t c = 0; c < 3; ++c) {
      corners[f][c] = placed[static_cast<std::size_t>(points[f][c])];
    }
  }
  double low[IslandCount][2];
  double high[IslandCount][2];
  for (int i = 0; i < IslandCount; ++i) {
    low[i][0] = low[i][1] = 1e9;
    high[i][0] = high[i][1] = -1e9;
  }
  for (std::size_t f = 0; f < half_faces; ++f) {
    const auto i = static_cast<std::size_t>(island[f]);
    for (Corner& corner : corners[f]) {
      if (facing[i] < 0) {  // seen from outside, as the faces are
        corner.u = -corner.u;
      }
      low[i][0] = std::min(low[i][0], kBoxes[i].middle ? -std::abs(corner.u) : corner.u);
      high[i][0] = std::max(high[i][0], kBoxes[i].middle ? std::abs(corner.u) : corner.u);
      low[i][1] = std::min(low[i][1], corner.v);
      high[i][1] = std::max(high[i][1], corner.v);
    }
  }
  HumanAtlas atlas;
  atlas.uv_faces.resize(faces.rows(), 3);
  std::map<std::array<double, 2>, int> seen[2 * IslandCount];
  std::vector<std::array<double, 2>> uvs;
  std::vector<std::vector<int>> members(2 * IslandCount);
  for (int side = 0; side < 2; ++side) {
    for (std::size_t f = 0; f < half_faces; ++f) {
      const auto i = static_cast<std::size_t>(island[f]);
      const Box& box = kBoxes[i];
      const std::size_t slot = box.middle ? 2 * i : 2 * i + static_cast<std::size_t>(side);
      const Index row = static_cast<Index>(f + (side == 0 ? 0 : half_faces));
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t source = side == 0 ? c : (c == 0 ? 0 : 3 - c);
        double u = corners[f][source].u;
        if (side == 1) {
          u = -u;
        }
        const double left = side == 1 && !box.middle ? -high[i][0] : low[i][0];
        const double size_u = high[i][0] - low[i][0];
        const double size_v = high[i][1] - low[i][1];
        const double offset = side == 1 && !box.middle ? box.width + 0.01 : 0.0;
        const std::array<double, 2> uv = {
            box.u + offset + box.width * (u - left) / size_u,
            box.v + box.height * (corners[f][source].v - low[i][1]) / size_v};
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
  for (std::size_t i = 0; i < IslandCount; ++i) {
    for (std::size_t side = 0; side < 2; ++side) {
      std::vector<int>& list = members[2 * i + side];
      if (list.empty()) {
        continue;
      }
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
      const std::string prefix = kBoxes[i].middle ? "uv_" : (side == 0 ? "uv_left_" : "uv_right_");
      atlas.islands.push_back({prefix + kBoxes[i].name, std::move(list)});
    }
  }
  return atlas;
}

}  // namespace atelier
