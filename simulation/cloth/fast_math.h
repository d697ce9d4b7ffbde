#pragma once

#include <cmath>

#include "core/host_device.h"

namespace atelier {

/// Division and roots of constraint projections. On the device in float they are the hardware's
/// approximations (relative error below 3e-7; the exact ones cost a third of a projection), unless
/// the build compares twins bit for bit (ATELIER_EXACT). On the host, and in double, exact.
ATELIER_HOST_DEVICE inline float quotient(float a, float b) {
#if defined(__CUDA_ARCH__) && !defined(ATELIER_EXACT)
  float inverse;
  asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(inverse) : "f"(b));
  return a * inverse;
#else
  return a / b;
#endif
}
ATELIER_HOST_DEVICE inline double quotient(double a, double b) {
  return a / b;
}

/// 1 / sqrt(a) for a > 0.
ATELIER_HOST_DEVICE inline float inverse_root(float a) {
#if defined(__CUDA_ARCH__) && !defined(ATELIER_EXACT)
  float root;
  asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(root) : "f"(a));
  return root;
#else
  return 1.0f / std::sqrt(a);
#endif
}
ATELIER_HOST_DEVICE inline double inverse_root(double a) {
  return 1.0 / std::sqrt(a);
}

}  // namespace atelier
