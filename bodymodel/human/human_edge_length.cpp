#include "bodymodel/human/human_edge_length.h"

#include <algorithm>
#include <cmath>

namespace atelier {

double human_edge_length(const HumanField& field, Vec3d p) {
  const HumanJoints& j = field.anatomy.joints;
  const double k = field.anatomy.build.stature / 1.7;
  const auto ramp = [](double x, double a, double b) {
    const double t = std::clamp((x - a) / (b - a), 0.0, 1.0);
    return t * t * (3 - 2 * t);
  };
  double edge = 0.0185;
  // The legs lie beyond the wrist's plane too.
  const double to_hand = p.x > j.elbow.x ? dot(p - j.wrist, field.anatomy.arm.axis) / k : -1.0;
  edge += (0.0088 - edge) * ramp(to_hand, -0.08, 0.03);
  edge += (0.0057 - edge) * ramp(to_hand, 0.05, 0.11);
  edge += (0.0100 - edge) * ramp(-p.y / k, -0.16, -0.05);
  const double ahead = (p.z - j.ankle.z + 0.09 * (p.x - j.ankle.x)) / k;
  edge += (0.0055 - edge) * ramp(-p.y / k, -0.08, -0.04) * ramp(ahead, 0.120, 0.150);
  const double head = ramp(p.y / k, 1.40, 1.50);
  const double face = ramp(p.z / k, 0.02, 0.09);
  const auto near = [&](Vec3d place, double all, double none) {
    return 1 - ramp(norm((1 / k) * p - place), all, none);
  };
  edge += (0.0085 - edge) * near({0, 1.069, 0.125}, 0.016, 0.055);  // navel
  double of_head = 0.0140 - 0.0083 * face;
  of_head += (0.0090 - of_head) * near({0.045, 1.512, 0.030}, 0.020, 0.055);  // jaw
  of_head += (0.0039 - of_head) * near({0.078, 1.570, 0.005}, 0.024, 0.050);  // ear
  of_head += (0.0034 - of_head) * near({0, 1.555, 0.130}, 0.014, 0.040);      // nose
  of_head += (0.0028 - of_head) * near({0.010, 1.522, 0.120}, 0.016, 0.042);  // mouth
  of_head += (0.0023 - of_head) * near({0.031, 1.589, 0.108}, 0.015, 0.042);  // eye
  edge += (of_head - edge) * head;
  return edge * k;
}

}  // namespace atelier
