#include "bodymodel/human/human_head.h"

#include <cmath>

#include "bodymodel/human/human_shapes.h"

namespace atelier {
namespace {

// Everything below is in thousandths of stature: x to the left side, y up from the ground, z to the
// front.

HumanCone cone(Vec3d a, double ra, Vec3d b, double rb) {
  return {a, b, ra, rb};
}

double sphere_distance(Vec3d p, Vec3d centre, double radius) {
  return norm(p - centre) - radius;
}

constexpr Vec3d kEye = {18.3, 934.3, 57.6};

// The socket takes skull away; the eyeball and its lids, with a slit between them, stand in it.
double with_eye(double d, Vec3d p) {
  d = smooth_max(d, -ellipsoid_distance(p, {18.6, 934.2, 77}, {14.5, 8.8, 14.2}), 6);
  // Inner corner, where the socket meets the nose.
  d = smooth_max(d, -sphere_distance(p, {8.8, 935.5, 70.5}, 4.0), 4);
  d = smooth_min(d, sphere_distance(p, kEye, 7.1), 1.2);
  const double slit = ellipsoid_distance(p, {18.5, 934.2, 66}, {9.3, 3.9, 12});
  const double lid = smooth_max(sphere_distance(p, kEye, 8.9), -slit, 0.8);
  d = smooth_min(d, lid, 1.3);
  // Fold over the upper lid.
  const double fold = cone_distance(cone({12.5, 939.6, 65.6}, 0.9, {24.5, 939.2, 63.5}, 0.9), p);
  return smooth_max(d, -fold, 1.4);
}

double with_brow_and_cheek(double d, Vec3d p) {
  d = smooth_min(d, cone_distance(cone({7, 944.8, 65.8}, 3.4, {19, 947.0, 63.3}, 3.2), p), 8);
  d = smooth_min(d, cone_distance(cone({19, 947.0, 63.3}, 3.2, {30, 944.0, 53.5}, 2.7), p), 8);
  return smooth_min(d, cone_distance(cone({21, 919.5, 57.5}, 5.0, {33.5, 922, 37}, 4.0), p), 10);
}

// From the angle under the ear to the chin: the edge that tells the face from the neck.
double with_jaw(double d, Vec3d p) {
  d = smooth_min(d, cone_distance(cone({27, 898, 12}, 4.2, {25.5, 889.5, 18}, 4.4), p), 13);
  return smooth_min(d, cone_distance(cone({25.5, 889.5, 18}, 4.4, {10, 876.5, 55}, 6.5), p), 12);
}

double with_nose(double d, Vec3d p) {
  d = smooth_min(d, cone_distance(cone({0, 939.5, 66.8}, 3.3, {0, 920, 76.3}, 4.2), p), 5);
  d = smooth_min(d, sphere_distance(p, {0, 916.4, 78.8}, 5.3), 3.5);
  d = smooth_min(d, ellipsoid_distance(p, {6.3, 914.2, 72.6}, {4.2, 4.4, 6.6}), 3.2);
  d = smooth_min(d, cone_distance(cone({0, 913, 79}, 3.0, {0, 911, 73}, 3.4), p), 3);
  // Nostrils are hinted.
  return smooth_max(d, -ellipsoid_distance(p, {4.6, 909.2, 76.0}, {2.0, 1.3, 3.0}), 1.2);
}

double with_mouth_and_chin(double d, Vec3d p) {
  // The dental arch carries the lips.
  d = smooth_min(d, ellipsoid_distance(p, {0, 896, 52.5}, {21, 17, 20.5}), 7);
  d = smooth_min(d, cone_distance(cone({0, 877.4, 62.2}, 9.4, {7, 878.0, 59.4}, 8.4), p), 8);
  // Philtrum.
  d = smooth_max(d, -cone_distance(cone({0, 908, 76.0}, 1.3, {0, 901.5, 76.6}, 1.7), p), 2.2);
  double upper = cone_distance(cone({0, 898.3, 73.1}, 3.1, {3.6, 898.9, 72.9}, 3.1), p);
  upper = smooth_min(upper, cone_distance(cone({3.6, 898.9, 72.9}, 3.1, {10, 897.0, 70.0}, 2.4), p),
                     0.8);
  upper =
      smooth_min(upper, cone_distance(cone({10, 897.0, 70.0}, 2.3, {15, 895, 65.6}, 1.2), p), 0.8);
  double lower = cone_distance(cone({0, 890.6, 71.6}, 4.0, {6.5, 891.0, 70.6}, 3.5), p);
  lower = smooth_min(
      lower, cone_distance(cone({6.5, 891.0, 70.6}, 3.5, {14.6, 893.8, 65.6}, 1.2), p), 0.8);
  d = smooth_min(d, smooth_min(upper, lower, 0.5), 2.6);
  // Where the lips meet, sinking towards the corner.
  d = smooth_max(d, -cone_distance(cone({0, 895.0, 76.8}, 1.1, {8.5, 894.8, 74.0}, 1.1), p), 1.2);
  return smooth_max(d, -cone_distance(cone({8.5, 894.8, 74.0}, 1.1, {15.5, 894.3, 69.6}, 0.7), p),
                    1.2);
}

// Distance to an arc of an ellipse in the plane of the ear, from the angle `low` to `high`
// (radians, from the front over the top), thinner by `thin` at its ends.
double arc_distance(Vec3d e, double out, double centre_y, double centre_z, double radius_y,
                    double radius_z, double low, double high, double thickness, double thin) {
  const double y = e.y - centre_y;
  const double z = e.z - centre_z;
  double angle = std::atan2(y / radius_y, z / radius_z);
  if (angle < low - 0.5 * (low + 2 * 3.14159265358979 - high)) {
    angle += 2 * 3.14159265358979;
  }
  const double at = std::clamp(angle, low, high);
  const double share = (at - low) / (high - low);
  const double near_end = 4 * share * (1 - share);
  const Vec3d c = {out, centre_y + radius_y * std::sin(at), centre_z + radius_z * std::cos(at)};
  return norm(e - c) - (thickness - thin * (1 - near_end));
}

// A leaning dish: helix round it, antihelix inside, concha, tragus before it, lobe below.
double with_ear(double d, Vec3d p) {
  const double lean = 0.22;
  const Vec3d q = p - Vec3d{42.3, 924.5, 5};
  // e.x stands off the head, more so behind.
  const Vec3d e = {q.x + 0.42 * q.z, std::cos(lean) * q.y + std::sin(lean) * q.z,
                   -std::sin(lean) * q.y + std::cos(lean) * q.z};
  double ear = ellipsoid_distance(e, {0, 0, -0.5}, {3.4, 16.2, 9.6});
  ear = smooth_min(ear, ellipsoid_distance(e, {0.8, -13.5, 2.6}, {2.4, 5.0, 4.8}), 3);
  ear = smooth_min(ear, arc_distance(e, 2.6, 1, -0.5, 14.8, 8.9, 0.3, 4.1, 2.1, 1.4), 2.0);
  ear = smooth_min(ear, arc_distance(e, 2.6, -0.5, 0.2, 9.0, 4.6, 1.3, 4.4, 1.5, 1.0), 2.4);
  ear = smooth_max(ear, -ellipsoid_distance(e, {4.4, -2.0, 1.8}, {4.6, 6.8, 4.0}), 2.0);
  ear = smooth_min(ear, ellipsoid_distance(e, {1.0, -3.0, 7.4}, {2.2, 3.2, 2.2}), 3.0);
  return smooth_min(d, ear, 2.5);
}

}  // namespace

HumanTube human_skull(double k) {
  struct SkullRow {
    double y, side, front, back, exponent;
  };
  constexpr SkullRow kRows[] = {
      {868, 10, 58, 16, 2.0},    {877, 20, 67, -2, 2.1},      {890, 29.5, 71, -6, 2.25},
      {905, 35.5, 71, -18, 2.4}, {920, 39.5, 69.5, -31, 2.4}, {935, 42, 70.5, -38, 2.35},
      {950, 42.7, 73, -41, 2.3}, {965, 41.8, 71, -39.5, 2.2}, {978, 38.3, 65.5, -34, 2.1},
      {988, 31.5, 56, -25, 2.0}, {995, 22, 42, -12, 2.0},     {999, 10.5, 25, 4, 2.0},
      {1000, 3, 17, 13, 2.0}};
  HumanTube skull = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {}};
  for (const SkullRow& row : kRows) {
    const double depth = k * (row.front - row.back) / 2;
    skull.sections.push_back({k * row.y, 0, k * (row.front + row.back) / 2, k * row.side,
                              k * row.side, depth, depth, row.exponent, 2.1});
  }
  return skull;
}

double head_features(double skull, Vec3d p, double k) {
  const Vec3d q = (1 / k) * p;
  double d = skull / k;
  d = with_brow_and_cheek(d, q);
  d = with_jaw(d, q);
  d = with_eye(d, q);
  d = with_mouth_and_chin(d, q);
  d = with_nose(d, q);
  return k * with_ear(d, q);
}

Vec3d head_of_sex(Vec3d p, double male) {
  const double t = 2 * male - 1;
  const auto near = [&](Vec3d place, Vec3d width) {
    const Vec3d e = {(p.x - place.x) / width.x, (p.y - place.y) / width.y,
                     (p.z - place.z) / width.z};
    return t * std::exp(-0.5 * squared_norm(e));
  };
  Vec3d d = {0, 0, 0};
  d.z += 1.3 * near({10, 945, 68}, {15, 6, 12});                    // brow ridge
  d.y -= 0.9 * near({20, 945, 62}, {12, 6, 14});                    // brow's height
  d.z -= 1.2 * near({0, 968, 66}, {32, 12, 24});                    // slope of the forehead
  d.y -= 0.13 * (p.y - 934.2) * near({18.4, 934, 64}, {9, 6, 10});  // opening of the eye
  d.x += 1.4 * near({30, 890, 18}, {11, 15, 26}) * std::min(1.0, p.x / 15);  // angle of the jaw
  const double chin = near({0, 876, 60}, {15, 11, 18});
  d += chin * Vec3d{0.13 * p.x, -1.3, 0.8};
  const double lips = near({0, 894.8, 72}, {13, 6, 10});
  d += lips * Vec3d{0.03 * p.x, -0.17 * (p.y - 894.8), -0.9};
  const double nose = near({0, 917, 76}, {9, 12, 12});
  d += nose * Vec3d{0.12 * p.x, -0.8, 1.1};
  d.z -= 0.8 * near({22, 918, 57}, {10, 9, 14});  // fullness of the cheek
  return p + d;
}

}  // namespace atelier
