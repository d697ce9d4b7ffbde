#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <embree3/rtcore.h>

#include "core/render/vector_math.h"

namespace atelier {

/// Embree's tree over several meshes, and rays through it in packets of 16. Private to core/render:
/// the one place that knows Embree. Its builder is deterministic for any number of threads.
class RayTree {
 public:
  /// Throws EnvironmentError if Embree cannot start.
  RayTree();

  /// Mesh `n` for the n-th call. The arrays are borrowed and must outlive the tree;
  /// `positions` is [V,3] with one number more behind it, `indices` [F,3].
  void add(const std::vector<float>& positions, const std::vector<std::uint32_t>& indices);

  /// Builds the tree. Throws EnvironmentError if memory runs out.
  void build();

  /// Fills in the nearest hits: `hit.geomID` is the mesh or RTC_INVALID_GEOMETRY_ID. Lanes whose
  /// `tfar` is below `tnear` are left out.
  void intersect(RTCRayHit16& rays) const;

  /// Sets `tfar` to minus infinity where anything is hit. Lanes whose `tfar` is below `tnear` are
  /// left out.
  void occlude(RTCRay16& rays, bool coherent) const;

 private:
  struct ReleaseDevice {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  };
  struct ReleaseScene {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  std::unique_ptr<RTCDeviceTy, ReleaseDevice> device_;
  std::unique_ptr<RTCSceneTy, ReleaseScene> scene_;
};

/// Rays that ask only whether they are blocked, gathered and then traced together.
class OcclusionRays {
 public:
  void clear() { count_ = 0; }
  std::size_t size() const { return count_; }
  /// Returns the ray's number.
  std::size_t add(Vec3f origin, Vec3f direction, float near, float far);
  void trace(const RayTree& tree, bool coherent);
  /// After `trace`.
  bool visible(std::size_t ray) const { return packets_[ray / 16].tfar[ray % 16] >= 0; }

 private:
  std::vector<RTCRay16> packets_;
  std::size_t count_ = 0;
};

}  // namespace atelier
