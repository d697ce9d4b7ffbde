#include "bodymodel/human/human_field.h"

#include <algorithm>
#include <cmath>

#include "bodymodel/human/human_head.h"
#include "bodymodel/human/human_shapes.h"

namespace atelier {
namespace {

double tube_distance(const HumanTube& tube, Vec3d p) {
  const Vec3d q = p - tube.origin;
  const double s = dot(q, tube.axis);
  const double first = tube.sections.front().s;
  const double last = tube.sections.back().s;
  const double over = std::max({first - s, s - last, 0.0});
  if (over > 0.15) {
    return over;
  }
  const double inside = std::clamp(s, first, last);
  const double tau = station_at(tube, inside);
  const HumanSection section = section_at(tube, tau);
  const double a = dot(q, tube.u) - section.cu;
  const double b = dot(q, tube.v) - section.cv;
  const double r = std::hypot(a, b);
  const double c = r > 1e-9 ? a / r : 1.0;
  const double d = r > 1e-9 ? b / r : 0.0;
  const double radius = section_radius(section, c, d);
  double e = r - radius;
  if (std::abs(e) < 0.08) {
    // Slopes of the outline round and along the tube turn the radial gap into a distance.
    const double turn = 1e-3;
    const double around =
        (section_radius(section, c - turn * d, d + turn * c) - radius) / (turn * radius);
    double rise = 0;
    if (over == 0) {
      const double step = inside + 1e-3 < last ? 1e-3 : -1e-3;  // sections end at their ends
      const HumanSection next = section_at(tube, station_at(tube, inside + step));
      const double a2 = a + section.cu - next.cu;
      const double b2 = b + section.cv - next.cv;
      const double r2 = std::hypot(a2, b2);
      rise = r2 > 1e-9 ? ((r2 - section_radius(next, a2 / r2, b2 / r2)) - e) / step : 0.0;
    }
    e /= std::sqrt(1 + around * around + rise * rise);
  }
  if (over > 0) {
    return std::hypot(over, std::max(e, 0.0));
  }
  return e;
}

double cones(const std::vector<HumanCone>& list, std::size_t first, std::size_t count, Vec3d p,
             double k) {
  double d = cone_distance(list[first], p);
  for (std::size_t i = 1; i < count; ++i) {
    d = smooth_min(d, cone_distance(list[first + i], p), k);
  }
  return d;
}

double head_value(const HumanField& f, Vec3d p) {
  const double skull = tube_distance(f.head, p);
  return skull > 0.06 ? skull : head_features(skull, p, f.anatomy.build.stature / 1000);
}

double hand_value(const HumanField& f, Vec3d p) {
  const double k = f.anatomy.build.stature / 1.7;
  double d = tube_distance(f.palm, p);
  for (std::size_t finger = 0; finger < 5; ++finger) {
    d = smooth_min(d, cones(f.fingers, 3 * finger, 3, p, 0.0005 * k),
                   (finger == 0 ? 0.012 : 0.004) * k);
  }
  for (const HumanCone& knuckle : f.knuckles) {
    d = smooth_min(d, cone_distance(knuckle, p), 0.004 * k);
  }
  return d;
}

double foot_value(const HumanField& f, Vec3d p) {
  const double k = f.anatomy.build.stature / 1.7;
  // The webs between the toes lie on a slant.
  const Vec3d q = p - f.foot.origin;
  const double slant = dot(q, f.foot.axis) + 0.5 * dot(q, f.foot.u) - 0.156 * k;
  const double sole = smooth_max(tube_distance(f.foot, p), slant / std::hypot(1, 0.5), 0.010 * k);
  return smooth_min(sole, cones(f.toes, 0, 5, p, 0.001 * k), 0.009 * k);
}

}  // namespace

HumanField human_field(const HumanAnatomy& anatomy) {
  HumanField f;
  f.anatomy = anatomy;
  const HumanJoints& j = anatomy.joints;
  const double k = anatomy.build.stature / 1000;
  f.head = human_skull(k);
  const double hand = k * 108 / 182;
  const double h = std::sqrt(0.5);
  f.palm = {j.wrist, {h, -h, 0}, {h, h, 0}, {0, 0, 1}, {}};
  const double palm[][5] = {
      {-20, 11, 12, 16, 16},   {-10, 14, 15.5, 22, 22},     {8, 15, 17, 25, 26},
      {28, 14, 18.5, 30, 30},  {50, 12.5, 18.5, 34, 34},    {70, 11, 16, 37, 37},
      {84, 9.5, 13, 37.5, 38}, {96, 8.5, 11.5, 36.5, 36.5}, {104, 6, 8, 34, 34}};
  for (const auto& row : palm) {
    f.palm.sections.push_back({hand * row[0], 0, 0, hand * row[1], hand * row[2], hand * row[3],
                               hand * row[4], 2.5, 2.5});
  }
  const double radii[5][4] = {{15, 12, 10, 7.5},
                              {9.3, 8.4, 7.4, 6.2},
                              {9.6, 8.6, 7.6, 6.4},
                              {9.0, 8.0, 7.1, 6.0},
                              {8.2, 7.2, 6.4, 5.5}};
  for (std::size_t finger = 0; finger < 5; ++finger) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3d a = j.fingers[finger][i];
      Vec3d b = j.fingers[finger][i + 1];
      if (i == 2) {  // the skin ends where the tip is
        const Vec3d d = b - a;
        b = b - (hand * radii[finger][3] / norm(d)) * d;
      }
      f.fingers.push_back({a, b, hand * radii[finger][i], hand * radii[finger][i + 1]});
    }
  }

  const Vec3d back = {h, h, 0};  // of the hand
  for (std::size_t finger = 1; finger < 5; ++finger) {
    const auto& bones = j.fingers[finger];
    const double r = hand * radii[finger][0];
    const Vec3d head = bones[0] + (0.36 * r) * back;
    f.knuckles.push_back({head - (0.4 * r) * f.palm.axis, head, 0.86 * r, 0.9 * r});
    for (std::size_t i = 1; i < 3; ++i) {
      const double thick = hand * radii[finger][i];
      const Vec3d across = Vec3d{0, 0, 0.12 * thick};
      f.knuckles.push_back({bones[i] - across, bones[i] + across, 0.91 * thick, 0.91 * thick});
    }
  }
  const auto in_hand = [&](double s, double w, double depth) {
    return j.wrist + hand * (s * f.palm.axis + Vec3d{0, 0, w} - depth * back);
  };
  f.knuckles.push_back({in_hand(14, -19, 8), in_hand(62, -27, 9), hand * 12, hand * 8.5});
  f.knuckles.push_back({in_hand(16, 17, 9), in_hand(48, 36, 15), hand * 15, hand * 12});

  // Foot: axis forward from the ankle, in the foot's own direction (toes out by 5 degrees).
  const double toe_out = 0.0873;
  const Vec3d forward = {std::sin(toe_out), 0, std::cos(toe_out)};
  const Vec3d side = {std::cos(toe_out), 0, -std::sin(toe_out)};
  const Vec3d under = {j.ankle.x, 0, j.ankle.z};
  f.foot = {under, forward, side, {0, 1, 0}, {}};
  const double foot[][4] = {{-30, 1, 6, 24},    {-26, 1, 11, 32},   {-14, 1.5, 16, 42},
                            {5, 2, 18.5, 52},   {25, 1.5, 20, 50},  {45, 0, 24, 36},
                            {62, -1, 27, 25},   {76, -1.5, 27, 19}, {86, -2, 26.5, 15},
                            {96, -2, 25.5, 11}, {106, -2, 24, 9}};
  for (const auto& row : foot) {
    const double bottom = row[0] < -30 ? 8 : row[0] < -20 ? 3 : 0.5;
    f.foot.sections.push_back({k * row[0], k * row[1], k * (row[3] * 0.35 + bottom * 0.65),
                               k * row[2], k * row[2], k * (row[3] - bottom) * 0.65,
                               k * (row[3] - bottom) * 0.35, 2.0, 3.5});
  }
  // Big toe to little toe: base and tip (side, forward), radii.
  const double toes[5][6] = {{-15.5, 78, -17.0, 106, 10, 8.4},
                             {-1.4, 80, -1.0, 109, 5.4, 3.9},
                             {8.2, 78, 9.8, 103, 5.2, 3.7},
                             {17.0, 74, 19.8, 95, 5.0, 3.6},
                             {24.5, 67, 28.0, 85, 5.0, 3.6}};
  for (const auto& row : toes) {
    const auto place = [&](double u, double s, double r) {
      return under + (k * u) * side + (k * s) * forward + Vec3d{0, k * (r + 0.5), 0};
    };
    f.toes.push_back(
        {place(row[0], row[1], row[4]), place(row[2], row[3], row[5]), k * row[4], k * row[5]});
  }
  return f;
}

Vec3d with_bumps(const HumanAnatomy& anatomy, Vec3d p, double sign) {
  const double tau = station_at(anatomy.trunk, p.y);
  const double centre = section_at(anatomy.trunk, tau).cv;
  const double width = 0.012 * anatomy.build.stature;
  const double t = std::clamp((p.z - centre) / width, -1.0, 1.0);
  const double share = t * (1.5 - 0.5 * t * t);  // smooth step between -1 (back) and 1 (front)
  p.z += sign * share * bump_height(anatomy, p.x, p.y, share > 0);
  return p;
}

std::array<double, kHumanParts> part_distances(const HumanField& f, Vec3d p) {
  const HumanAnatomy& a = f.anatomy;
  std::array<double, kHumanParts> d;
  d.fill(0.5);
  d[0] = tube_distance(a.trunk, with_bumps(a, p, -1));
  if (p.y < a.joints.hip.y + 0.25) {
    d[1] = tube_distance(a.leg, p);
    if (p.y < 0.2) {
      d[5] = foot_value(f, p);
    }
  }
  if (p.x > a.joints.shoulder.x - 0.15) {
    d[2] = tube_distance(a.arm, p);
    if (dot(p - a.joints.wrist, a.arm.axis) > -0.1) {
      d[4] = hand_value(f, p);
    }
  }
  if (p.y > 0.84 * a.build.stature) {
    d[3] = head_value(f, p);
  }
  return d;
}

double field_value(const HumanField& f, Vec3d p) {
  p.x = std::abs(p.x);
  const double k = f.anatomy.build.stature / 1000;
  const std::array<double, kHumanParts> d = part_distances(f, p);
  const double leg = smooth_min(d[1], d[5], 12 * k);
  const double arm = smooth_min(d[2], d[4], 6 * k);
  return smooth_min(smooth_min(smooth_min(d[0], leg, 16 * k), arm, 22 * k), d[3], 9 * k);
}

Vec3d field_normal(const HumanField& f, Vec3d p) {
  const double h = 1e-4;
  const Vec3d g = {field_value(f, {p.x + h, p.y, p.z}) - field_value(f, {p.x - h, p.y, p.z}),
                   field_value(f, {p.x, p.y + h, p.z}) - field_value(f, {p.x, p.y - h, p.z}),
                   field_value(f, {p.x, p.y, p.z + h}) - field_value(f, {p.x, p.y, p.z - h})};
  const double n = norm(g);
  return n > 0 ? g * (1 / n) : Vec3d{0, 1, 0};
}

Vec3d field_project(const HumanField& f, Vec3d p) {
  const double h = 1e-4;
  for (int step = 0; step < 4; ++step) {
    const double v = field_value(f, p);
    if (std::abs(v) < 1e-6) {
      break;
    }
    const Vec3d g = {
        (field_value(f, {p.x + h, p.y, p.z}) - field_value(f, {p.x - h, p.y, p.z})) / (2 * h),
        (field_value(f, {p.x, p.y + h, p.z}) - field_value(f, {p.x, p.y - h, p.z})) / (2 * h),
        (field_value(f, {p.x, p.y, p.z + h}) - field_value(f, {p.x, p.y, p.z - h})) / (2 * h)};
    const double n2 = squared_norm(g);
    if (n2 < 0.01) {
      break;
    }
    p = p - std::clamp(v / n2, -0.01, 0.01) * g;
  }
  return p;
}

}  // namespace atelier
