#include "bodymodel/human/human_rig.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/smooth_step.h"

namespace atelier {
namespace {

constexpr int kJointCount = 55;
constexpr double kDegree = 3.14159265358979323846 / 180;

// Left-side and middle joints; right ones follow by mirroring.
enum LeftJoint {
  Pelvis = 0,
  Hip = 1,
  Spine1 = 3,
  Knee = 4,
  Spine2 = 6,
  Ankle = 7,
  Spine3 = 9,
  Toes = 10,
  Neck = 12,
  Collar = 13,
  Head = 15,
  Shoulder = 16,
  Elbow = 18,
  Wrist = 20,
  Jaw = 22,
  Eye = 23,
  IndexFinger = 25,
  Middle = 28,
  Pinky = 31,
  Ring = 34,
  Thumb = 37
};

struct JointRow {
  const char* name;
  int parent;
};
constexpr JointRow kJoints[kJointCount] = {
    {"pelvis", -1},        {"left_hip", 0},        {"right_hip", 0},     {"spine1", 0},
    {"left_knee", 1},      {"right_knee", 2},      {"spine2", 3},        {"left_ankle", 4},
    {"right_ankle", 5},    {"spine3", 6},          {"left_foot", 7},     {"right_foot", 8},
    {"neck", 9},           {"left_collar", 9},     {"right_collar", 9},  {"head", 12},
    {"left_shoulder", 13}, {"right_shoulder", 14}, {"left_elbow", 16},   {"right_elbow", 17},
    {"left_wrist", 18},    {"right_wrist", 19},    {"jaw", 15},          {"left_eye", 15},
    {"right_eye", 15},     {"left_index1", 20},    {"left_index2", 25},  {"left_index3", 26},
    {"left_middle1", 20},  {"left_middle2", 28},   {"left_middle3", 29}, {"left_pinky1", 20},
    {"left_pinky2", 31},   {"left_pinky3", 32},    {"left_ring1", 20},   {"left_ring2", 34},
    {"left_ring3", 35},    {"left_thumb1", 20},    {"left_thumb2", 37},  {"left_thumb3", 38},
    {"right_index1", 21},  {"right_index2", 40},   {"right_index3", 41}, {"right_middle1", 21},
    {"right_middle2", 43}, {"right_middle3", 44},  {"right_pinky1", 21}, {"right_pinky2", 46},
    {"right_pinky3", 47},  {"right_ring1", 21},    {"right_ring2", 49},  {"right_ring3", 50},
    {"right_thumb1", 21},  {"right_thumb2", 52},   {"right_thumb3", 53}};

// Limits of motion in degrees about +x, +y, +z of the left side's or the middle's rest frame, from
// the A-pose (arm 45 degrees below horizontal). Ranges: American Academy of Orthopaedic Surgeons
// (Greene and Heckman 1994) and Kapandji, "The Physiology of the Joints"; a rotation vector's
// components are bounded one by one, so that combinations are looser than a real joint's.
struct LimitRow {
  int joint;
  double low[3], high[3];
};
constexpr LimitRow kLimits[] = {
    {Pelvis, {-180, -180, -180}, {180, 180, 180}},
    {Hip, {-120, -45, -30}, {30, 45, 45}},   // flexion 120, extension 30; rotation 45
    {Knee, {0, -10, -5}, {140, 10, 5}},      // flexion 140
    {Ankle, {-20, -15, -20}, {50, 15, 35}},  // dorsiflexion 20, plantar flexion 50
    {Toes, {-60, -5, -5}, {30, 5, 5}},
    {Spine1, {-15, -10, -12}, {30, 10, 12}},  // lumbar and thoracic flexion shared by three
    {Spine2, {-12, -15, -12}, {25, 15, 12}},
    {Spine3, {-8, -20, -10}, {15, 20, 10}},
    {Neck, {-30, -40, -20}, {25, 40, 20}},  // cervical: half at the neck, half at the head
    {Head, {-30, -40, -25}, {25, 40, 25}},
    {Collar, {-10, -25, -10}, {10, 20, 35}},
    {Shoulder, {-90, -130, -50}, {90, 60, 110}},  // abduction to 155 with the collar's share
    {Elbow, {-90, -145, -90}, {90, 145, 90}},     // flexion 145 about the forearm's own axis
    {Wrist, {-70, -80, -70}, {70, 80, 70}},
    {Jaw, {-3, -10, -3}, {30, 10, 3}},
    {Eye, {-30, -35, -5}, {30, 35, 5}}};
constexpr double kFingerLimit = 100;  // flexion 90 to 100 at each of the first two joints

Vec3d mirrored(Vec3d p) {
  return {-p.x, p.y, p.z};
}

// Positions of the left-side and middle joints; zero where the right side's will be.
std::vector<Vec3d> joint_positions(const HumanJoints& j) {
  std::vector<Vec3d> p(kJointCount, Vec3d{0, 0, 0});
  p[Pelvis] = j.pelvis;
  p[Hip] = j.hip;
  p[Spine1] = j.spine1;
  p[Knee] = j.knee;
  p[Spine2] = j.spine2;
  p[Ankle] = j.ankle;
  p[Spine3] = j.spine3;
  p[Toes] = j.toes;
  p[Neck] = j.neck;
  p[Collar] = j.collar;
  p[Head] = j.head;
  p[Shoulder] = j.shoulder;
  p[Elbow] = j.elbow;
  p[Wrist] = j.wrist;
  p[Jaw] = j.jaw;
  p[Eye] = j.eye;
  const int first[5] = {Thumb, IndexFinger, Middle, Ring, Pinky};
  for (std::size_t f = 0; f < 5; ++f) {
    for (std::size_t i = 0; i < 3; ++i) {
      p[static_cast<std::size_t>(first[f]) + i] = j.fingers[f][i];
    }
  }
  return p;
}

int mirror_of(int joint) {
  const std::string name = kJoints[joint].name;
  if (name.rfind("left_", 0) != 0) {
    return joint;
  }
  const std::string other = "right_" + name.substr(5);
  for (int i = 0; i < kJointCount; ++i) {
    if (other == kJoints[i].name) {
      return i;
    }
  }
  return joint;
}

using Row = std::array<double, kJointCount>;

// Weights of one vertex of the left half before averaging. Lengths in thousandths of stature.
Row vertex_weights(const HumanField& field, Vec3d point) {
  const HumanJoints& j = field.anatomy.joints;
  const double k = field.anatomy.build.stature / 1000;
  const auto [x, y, z] = Vec3d{point.x / k, point.y / k, point.z / k};
  const auto across = [&](Vec3d joint, Vec3d direction, double half_width) {
    return smooth_step(dot(point - joint, direction) / norm(direction) / k, -half_width,
                       half_width);
  };
  Row w;
  w.fill(0);
  // Trunk: one bone after the other up the spine.
  double rest = 1;
  const double up1 = smooth_step(y, 597 - 32, 597 + 32);
  const double up2 = smooth_step(y, 662 - 32, 662 + 32);
  const double up3 = smooth_step(y, 724 - 32, 724 + 32);
  const double to_neck = smooth_step(y + 0.25 * z, 838 - 18, 838 + 22);
  // From under the chin up to the nape: the whole face goes with the head.
  const double to_head = smooth_step(y + (z > 8 ? 0.75 : 0.25) * (z - 8), 886 - 14, 886 + 14);
  Row trunk;
  trunk.fill(0);
  const std::pair<int, double> chain[] = {
      {Head, to_head}, {Neck, to_neck}, {Spine3, up3}, {Spine2, up2}, {Spine1, up1}};
  for (const auto& [joint, share] : chain) {
    trunk[static_cast<std::size_t>(joint)] = rest * share;
    rest *= 1 - share;
  }
  trunk[Pelvis] = rest;
  // Collar: the shoulder girdle beside the neck.
  const double girdle = smooth_step(x, 22, 82) * smooth_step(y, 742, 800) * (1 - to_neck);
  for (double& value : trunk) {
    value *= 1 - girdle;
  }
  trunk[Collar] += girdle;
  // Jaw: chin and lower lip.
  const double jaw = smooth_step(z, 20, 52) * (1 - smooth_step(y, 888, 898)) * to_head;
  trunk[Head] -= jaw * trunk[Head];
  trunk[Jaw] = jaw;
  double sum = 0;
  for (double value : trunk) {
    sum += value;
  }
  for (double& value : trunk) {
    value /= sum;
  }

  const std::array<double, kHumanParts> d = part_distances(field, point);
  // Leg: the groin's plane runs from the crotch over the hip joint to the iliac crest.
  const double side = smooth_step(x, -14, 14);
  const double hip = across(j.hip, {0.61, -0.79, 0.0}, 34) * side;
  // Arm: leans so far that on top of the shoulder, which a raised arm presses together, the step is
  // spread from the neck to the deltoid and no build's skin folds there in T-pose.
  const double arm_plane = across(j.shoulder, {0.5, -0.86, 0}, 44);
  // Below the armpit the plane is not enough: ribs and hips lie beyond it too.
  const double limb = std::min(d[2], d[4]) / k;
  const double other = std::min({d[0], d[1], d[5]}) / k;
  const double nearer =
      std::max(smooth_step(other - limb, -7, 7), y > 700 ? smooth_step(y, 750, 778) : 0.0);
  const double arm = arm_plane * nearer * smooth_step(x, 70, 96);
  if (arm > 0) {
    for (std::size_t i = 0; i < kJointCount; ++i) {
      w[i] = (1 - arm) * trunk[i];
    }
    const double elbow = across(j.elbow, field.anatomy.arm.axis, 21);
    const double wrist = across(j.wrist, field.anatomy.arm.axis, 17);
    w[Shoulder] += arm * (1 - elbow);
    w[Elbow] += arm * elbow * (1 - wrist);
    w[Wrist] += arm * elbow * wrist;
    // Fingers: the nearest one takes the vertex beyond its knuckle.
    const double hand = dot(point - j.wrist, field.anatomy.arm.axis) / k;
    if (hand > 5) {
      const int first[5] = {Thumb, IndexFinger, Middle, Ring, Pinky};
      std::size_t best = 0;
      double nearest = 1e9;
      for (std::size_t f = 0; f < 5; ++f) {
        for (std::size_t i = 0; i < 3; ++i) {
          const HumanCone& c = field.fingers[3 * f + i];
          const Vec3d e = c.b - c.a;
          const double t = std::clamp(dot(point - c.a, e) / squared_norm(e), 0.0, 1.0);
          const double gap = norm(point - c.a - t * e) - (c.ra + t * (c.rb - c.ra));
          if (gap < nearest) {
            nearest = gap;
            best = f;
          }
        }
      }
      double left = w[Wrist] * (1 - smooth_step(nearest / k, 1.5, 5));
      const double keep = w[Wrist] - left;
      double share[4] = {1, 0, 0, 0};
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec3d bone = j.fingers[best][i + 1] - j.fingers[best][i];
        const Vec3d before = i == 0 ? (best == 0 ? bone : field.anatomy.arm.axis)
                                    : j.fingers[best][i] - j.fingers[best][i - 1];
        const Vec3d direction = (1 / norm(bone)) * bone + (1 / norm(before)) * before;
        const double half = i == 0 ? 5.0 : 3.2;
        const double t = across(j.fingers[best][i], direction, half);
        share[i + 1] = t;
      }
      w[Wrist] = keep + left * (1 - share[1]);
      const auto at = static_cast<std::size_t>(first[best]);
      w[at] += left * share[1] * (1 - share[2]);
      w[at + 1] += left * share[1] * share[2] * (1 - share[3]);
      w[at + 2] += left * share[1] * share[2] * share[3];
    }
    return w;
  }
  for (std::size_t i = 0; i < kJointCount; ++i) {
    w[i] = (1 - hip) * trunk[i];
  }
  const double knee = across(j.knee, {0, -1, 0}, 27);
  const double ankle = across(j.ankle, {0, -1, 0.35}, 17);
  const double toes = across(j.toes, {0.09, 0.1, 1}, 9);
  w[Hip] += hip * (1 - knee);
  w[Knee] += hip * knee * (1 - ankle);
  w[Ankle] += hip * knee * ankle * (1 - toes);
  w[Toes] += hip * knee * ankle * toes;
  return w;
}

// At the middle each vertex belongs to both sides alike.
Row symmetric(const Row& row) {
  Row both = row;
  for (int joint = 0; joint < kJointCount; ++joint) {
    const int other = mirror_of(joint);
    if (other != joint) {
      const auto l = static_cast<std::size_t>(joint);
      const auto r = static_cast<std::size_t>(other);
      both[l] = both[r] = 0.5 * (row[l] + row[r]);
    }
  }
  return both;
}

}  // namespace

Skeleton human_skeleton(const HumanAnatomy& anatomy) {
  std::vector<Vec3d> position = joint_positions(anatomy.joints);
  Skeleton s;
  for (int i = 0; i < kJointCount; ++i) {
    const int other = mirror_of(i);
    if (other != i) {
      position[static_cast<std::size_t>(other)] = mirrored(position[static_cast<std::size_t>(i)]);
    }
  }
  s.offsets.resize(kJointCount, 3);
  s.limits_min.resize(kJointCount, 3);
  s.limits_max.resize(kJointCount, 3);
  for (int i = 0; i < kJointCount; ++i) {
    s.names.push_back(kJoints[i].name);
    s.parents.push_back(kJoints[i].parent);
    Vec3d p = position[static_cast<std::size_t>(i)];
    if (kJoints[i].parent >= 0) {
      p = p - position[static_cast<std::size_t>(kJoints[i].parent)];
    }
    s.offsets.row(i) << p.x, p.y, p.z;
    s.limits_min.row(i).setConstant(-kFingerLimit * kDegree);
    s.limits_max.row(i).setConstant(kFingerLimit * kDegree);
  }
  for (const LimitRow& row : kLimits) {
    for (int c = 0; c < 3; ++c) {
      s.limits_min(row.joint, c) = kDegree * row.low[c];
      s.limits_max(row.joint, c) = kDegree * row.high[c];
    }
    const int other = mirror_of(row.joint);
    if (other != row.joint) {  // mirroring in x keeps rotations about x, turns those about y and z
      s.limits_min.row(other) << kDegree * row.low[0], -kDegree * row.high[1],
          -kDegree * row.high[2];
      s.limits_max.row(other) << kDegree * row.high[0], -kDegree * row.low[1],
          -kDegree * row.low[2];
    }
  }
  return s;
}

SkinWeights human_weights(const HumanTemplate& body) {
  const HumanField field = human_field(human_anatomy({}));
  const std::size_t half = body.points.size();
  const auto middle = static_cast<std::size_t>(body.middle);
  std::vector<Row> rows(half);
  for (std::size_t v = 0; v < half; ++v) {
    rows[v] = vertex_weights(field, body.points[v]);
    if (v < middle) {
      rows[v] = symmetric(rows[v]);
    }
  }
  // Average over the surface: the trunk's and limbs' long edges spread further than the hands'.
  for (int round = 0; round < 6; ++round) {
    std::vector<Row> sum(half);
    std::vector<double> count(half, 0);
    for (Row& row : sum) {
      row.fill(0);
    }
    for (const auto& face : body.faces) {
      for (std::size_t c = 0; c < 3; ++c) {
        const auto a = static_cast<std::size_t>(face[c]);
        for (std::size_t other = 1; other < 3; ++other) {
          const Row& b = rows[static_cast<std::size_t>(face[(c + other) % 3])];
          for (std::size_t i = 0; i < kJointCount; ++i) {
            sum[a][i] += b[i];
          }
          ++count[a];
        }
      }
    }
    for (std::size_t v = 0; v < half; ++v) {
      for (std::size_t i = 0; i < kJointCount; ++i) {
        rows[v][i] = 0.5 * rows[v][i] + 0.5 * sum[v][i] / count[v];
      }
      if (v < middle) {
        rows[v] = symmetric(rows[v]);
      }
    }
  }
  constexpr int kSlots = 8;
  const Index total = static_cast<Index>(2 * half - middle);
  SkinWeights skin;
  skin.joints.setZero(total, kSlots);
  skin.weights.setZero(total, kSlots);
  for (std::size_t v = 0; v < half; ++v) {
    std::vector<std::pair<double, int>> best;
    for (int i = 0; i < kJointCount; ++i) {
      if (rows[v][static_cast<std::size_t>(i)] > 1e-4) {
        best.push_back({-rows[v][static_cast<std::size_t>(i)], i});
      }
    }
    std::stable_sort(best.begin(), best.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::size_t keep = std::min<std::size_t>(best.size(), kSlots);
    if (v < middle && keep < best.size() && mirror_of(best[keep - 1].second) == best[keep].second) {
      --keep;  // both of a pair or none
    }
    best.resize(keep);
    double sum = 0;
    for (const auto& [w, i] : best) {
      sum -= w;
    }
    const Index left = static_cast<Index>(v);
    const Index right = left + static_cast<Index>(half - middle);
    for (std::size_t slot = 0; slot < keep; ++slot) {
      const Index s = static_cast<Index>(slot);
      skin.joints(left, s) = best[slot].second;
      skin.weights(left, s) = -best[slot].first / sum;
      if (v >= middle) {
        const int i = best[slot].second;
        const std::string name = kJoints[i].name;
        int other = mirror_of(i);
        if (name.rfind("right_", 0) == 0) {
          for (int k = 0; k < kJointCount; ++k) {
            if (k != i && mirror_of(k) == i) {
              other = k;
            }
          }
        }
        skin.joints(right, s) = other;
        skin.weights(right, s) = skin.weights(left, s);
      }
    }
  }
  return skin;
}

// Shoulder and hip stand aside of the trunk: raising the limb sideways (about z) draws the flank
// with it and gains volume, lowering it presses the skin together and loses some. There `even` of
// the offset is enough, and an offset times the sine of the turn is taken off when raised, added
// when lowered: away from the joint's axis below the joint and to front and back, where the folds
// of an armpit are. At the top of the shoulder it goes the other way: a lowered arm lets the top
// sink, which would otherwise stand up square beside the neck. Chosen so that both ways stay within
// 8% (DefaultHumanVolume).
struct SideShare {
  double even = 1;
  double below = 0;
  double above = 0;
  double depth = 0;
};
SideShare side_share(const std::string& name) {
  return name.ends_with("shoulder") ? SideShare{1, 0.38, -0.2, 0.6}
         : name.ends_with("hip")    ? SideShare{0.4, 0.15, 0.15, 0}
                                    : SideShare{};
}

// Factor of the sine at x from the joint; `side` is 1 on the left, -1 on the right.
Eigen::RowVector3d side_offset(const SideShare& share, const Eigen::RowVector3d& x, double side) {
  const double height = std::sqrt(0.5) * (side * x[0] + x[1]);  // over the arm in A-pose, metres
  const double t = smooth_step(height, -0.03, 0.03);
  const double away = share.below + t * (share.above - share.below);
  return {away * x[0], away * x[1], share.depth * x[2]};
}

// The offset that goes with the diagonal entry `axis` of I - R, so that turns about x and y get the
// whole of x_perp and turns about z `along` of it: sums of two diagonal entries are what a turn
// about the third axis changes.
Eigen::RowVector3d diagonal_share(int axis, const Eigen::RowVector3d& x, double along) {
  Eigen::RowVector3d about[3] = {x, x, x};
  for (int i = 0; i < 3; ++i) {
    about[i][i] = 0;
  }
  about[2] *= along;
  return 0.5 * (about[(axis + 1) % 3] + about[(axis + 2) % 3] - about[axis]);
}

// A vertex that follows a joint's far side with weight w and its near side with 1 - w lands, after
// a rotation by t about an axis, at s |x| from the axis, s^2 = 1 - 2 w (1 - w) (1 - cos t): the
// loss of volume of linear blending (Lewis et al. 2000). Adding c (1 - cos t) x_perp to the rest
// vertex, c = 1 / sqrt(1 - 2 w (1 - w)) - 1, makes up for it exactly at 90 degrees, and since (1 -
// cos t) x_perp = (I - (R + R^T) / 2) x for any axis, it is linear in the entries of R - I.
std::vector<PoseCorrective> human_correctives(const Skeleton& skeleton, const SkinWeights& skin,
                                              const Points& rest) {
  const int joints = static_cast<int>(skeleton.names.size());
  Points position(joints, 3);
  for (int i = 0; i < joints; ++i) {
    position.row(i) = skeleton.offsets.row(i);
    if (skeleton.parents[static_cast<std::size_t>(i)] >= 0) {
      position.row(i) += position.row(skeleton.parents[static_cast<std::size_t>(i)]);
    }
  }
  // Weight of each joint's whole branch.
  const Index vertices = rest.rows();
  Eigen::MatrixXd branch = Eigen::MatrixXd::Zero(vertices, joints);
  for (Index v = 0; v < vertices; ++v) {
    for (Index slot = 0; slot < skin.joints.cols(); ++slot) {
      branch(v, skin.joints(v, slot)) += skin.weights(v, slot);
    }
    for (int i = joints - 1; i > 0; --i) {
      branch(v, skeleton.parents[static_cast<std::size_t>(i)]) += branch(v, i);
    }
  }
  std::vector<PoseCorrective> correctives;
  for (int joint = 1; joint < joints; ++joint) {
    const std::string& name = skeleton.names[static_cast<std::size_t>(joint)];
    if (name == "jaw" || name.find("eye") != std::string::npos) {
      continue;
    }
    const SideShare share = side_share(name);
    const double raised = name.starts_with("right") ? -1 : 1;  // sign of a raising turn about z
    std::vector<int> touched;
    for (Index v = 0; v < vertices; ++v) {
      if (branch(v, joint) > 0.02 && branch(v, joint) < 0.98) {
        touched.push_back(static_cast<int>(v));
      }
    }
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        PoseCorrective corrective;
        corrective.joint = joint;
        corrective.feature = PoseFeature::RotationEntry;
        corrective.component = 3 * a + b;
        corrective.surface.vertices = touched;
        corrective.surface.offsets.setZero(static_cast<Index>(touched.size()), 3);
        for (std::size_t i = 0; i < touched.size(); ++i) {
          const Index v = touched[i];
          const double w = branch(v, joint);
          const double c = 1 / std::sqrt(1 - 2 * w * (1 - w)) - 1;
          const Eigen::RowVector3d x = rest.row(v) - position.row(joint);
          const Index row = static_cast<Index>(i);
          if (a != b) {
            corrective.surface.offsets(row, a) -= 0.5 * c * x[b];
            corrective.surface.offsets(row, b) -= 0.5 * c * x[a];
            if (a + b == 1) {  // entries (1, 0) and (0, 1) are plus and minus the sine
              const double sine = (a == 1 ? 0.5 : -0.5) * raised;
              corrective.surface.offsets.row(row) -= sine * c * side_offset(share, x, raised);
            }
          } else {
            corrective.surface.offsets.row(row) -= c * diagonal_share(a, x, share.even);
          }
        }
        correctives.push_back(std::move(corrective));
      }
    }
  }
  return correctives;
}

}  // namespace atelier
