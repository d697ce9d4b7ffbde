#pragma once

#include "simulation/cloth/vec4.h"

namespace atelier {

/// External forces on a particle.
template <class T>
struct ParticleDrive {
  Vec3<T> acceleration;  ///< of a free one
  Vec3<T> target;        ///< of a fixed one, at the end of the frame
};

/// Start of a substep of `h` seconds: free particles fall, fixed ones go an even share of the way
/// to their target. `share` is 1 / (substeps left, this one included).
template <class T>
ATELIER_HOST_DEVICE inline void predict(Vec4<T>& x, Vec4<T>& start, Vec3<T>& velocity,
                                        const ParticleDrive<T>& drive, T share, T h) {
  start = x;
  if (x.w > T(0)) {
    velocity = velocity + h * drive.acceleration;
    x = with_w(xyz(x) + h * velocity, x.w);
  } else {
    const Vec3<T> moved = xyz(x) + share * (drive.target - xyz(x));
    velocity = (T(1) / h) * (moved - xyz(x));
    x = with_w(moved, x.w);
  }
}

/// End of a substep: the velocity takes up what the constraints moved. Differences to the predicted
/// position, not to the start, so that free flight loses nothing to rounding. `start` may have been
/// shifted by contacts that must not turn an old overlap into speed.
template <class T>
ATELIER_HOST_DEVICE inline void update_velocity(const Vec4<T>& x, const Vec4<T>& start,
                                                Vec3<T>& velocity, T h, T keep) {
  if (x.w > T(0)) {
    const Vec3<T> predicted = xyz(start) + h * velocity;
    velocity = keep * (velocity + (T(1) / h) * (xyz(x) - predicted));
  }
}

/// Pulls a particle back to within `length` of its anchor.
template <class T>
ATELIER_HOST_DEVICE inline void project_tether(Vec4<T>& x, Vec3<T> anchor, T length) {
  const Vec3<T> d = xyz(x) - anchor;
  const T distance = norm(d);
  if (x.w > T(0) && distance > length && distance > T(0)) {
    x = with_w(anchor + (length / distance) * d, x.w);
  }
}

}  // namespace atelier
