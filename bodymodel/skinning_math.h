#pragma once

#include "core/host_device.h"
#include "core/vec.h"

namespace atelier {

/// The transform of rest points by a joint: x = rotation * rest + translation, row-major 3x4.
struct SkinTransform {
  double m[12];
};

/// The same motion as a unit dual quaternion: real and dual part, each (x, y, z, w).
struct DualQuaternion {
  double real[4];
  double dual[4];
};

/// Linear blend skinning of one point: sum_k w_k (A_k rest + b_k). `joints` and `weights` have
/// `slots` entries.
ATELIER_HOST_DEVICE inline Vec3d skin_linear(const SkinTransform* transforms, const int* joints,
                                             const double* weights, int slots, Vec3d rest) {
  double blend[12] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  for (int k = 0; k < slots; ++k) {
    const double weight = weights[k];
    if (weight == 0) {
      continue;
    }
    const double* m = transforms[joints[k]].m;
    for (int i = 0; i < 12; ++i) {
      blend[i] += weight * m[i];
    }
  }
  return {blend[0] * rest.x + blend[1] * rest.y + blend[2] * rest.z + blend[3],
          blend[4] * rest.x + blend[5] * rest.y + blend[6] * rest.z + blend[7],
          blend[8] * rest.x + blend[9] * rest.y + blend[10] * rest.z + blend[11]};
}

/// Dual quaternion skinning of one point (Kavan et al., "Geometric Skinning with Approximate Dual
/// Quaternion Blending", TOG 2008): blend with signs that agree with the first slot, normalise,
/// apply. Slots should be sorted by weight so that the first is the heaviest.
ATELIER_HOST_DEVICE inline Vec3d skin_dual_quaternion(const DualQuaternion* transforms,
                                                      const int* joints, const double* weights,
                                                      int slots, Vec3d rest) {
  double r[4] = {0, 0, 0, 0};
  double d[4] = {0, 0, 0, 0};
  const DualQuaternion& pivot = transforms[joints[0]];
  for (int k = 0; k < slots; ++k) {
    if (weights[k] == 0) {
      continue;
    }
    const DualQuaternion& q = transforms[joints[k]];
    const double along = q.real[0] * pivot.real[0] + q.real[1] * pivot.real[1] +
                         q.real[2] * pivot.real[2] + q.real[3] * pivot.real[3];
    const double weight = along < 0 ? -weights[k] : weights[k];
    for (int i = 0; i < 4; ++i) {
      r[i] += weight * q.real[i];
      d[i] += weight * q.dual[i];
    }
  }
  const double scale = 1 / std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3]);
  const Vec3d rv{scale * r[0], scale * r[1], scale * r[2]};
  const double rw = scale * r[3];
  const Vec3d dv{scale * d[0], scale * d[1], scale * d[2]};
  const double dw = scale * d[3];
  // x = rest + 2 rv x (rv x rest + rw rest) + 2 (rw dv - dw rv + rv x dv)
  return rest + 2.0 * cross(rv, cross(rv, rest) + rw * rest) +
         2.0 * (rw * dv - dw * rv + cross(rv, dv));
}

}  // namespace atelier
