#include "core/render/ray_tree.h"

#include <limits>

#include "core/error.h"

namespace atelier {

namespace {

void check_device(RTCDevice device, const char* doing) {
  const RTCError error = rtcGetDeviceError(device);
  if (error != RTC_ERROR_NONE) {
    throw EnvironmentError("Embree", std::string(doing) + " failed" +
                                         (error == RTC_ERROR_OUT_OF_MEMORY
                                              ? ": out of memory"
                                              : " (error " + std::to_string(error) + ")"));
  }
}

// Lanes with an empty interval are unused.
void valid_lanes(const float* tnear, const float* tfar, int* valid) {
  for (int i = 0; i < 16; ++i) {
    valid[i] = tfar[i] >= tnear[i] ? -1 : 0;
  }
}

}  // namespace

RayTree::RayTree() : device_(rtcNewDevice(nullptr)) {
  if (!device_) {
    check_device(nullptr, "starting");
    throw EnvironmentError("Embree", "starting failed");
  }
  scene_.reset(rtcNewScene(device_.get()));
  check_device(device_.get(), "making a scene");
  // Robust: no ray slips through the seam of two triangles. Medium quality: its builder sorts what
  // threads hand it, so that the tree, and with it ties at shared edges, never depend on them.
  rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_MEDIUM);
}

void RayTree::add(const std::vector<float>& positions, const std::vector<std::uint32_t>& indices) {
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  check_device(device_.get(), "making a geometry");
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                             positions.data(), 0, 3 * sizeof(float), positions.size() / 3);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices.data(),
                             0, 3 * sizeof(std::uint32_t), indices.size() / 3);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_.get(), geometry);
  rtcReleaseGeometry(geometry);
  check_device(device_.get(), "adding a mesh");
}

void RayTree::build() {
  rtcCommitScene(scene_.get());
  check_device(device_.get(), "building the tree");
}

void RayTree::intersect(RTCRayHit16& rays) const {
  alignas(64) int valid[16];
  valid_lanes(rays.ray.tnear, rays.ray.tfar, valid);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid, scene_.get(), &context, &rays);
}

void RayTree::occlude(RTCRay16& rays, bool coherent) const {
  alignas(64) int valid[16];
  valid_lanes(rays.tnear, rays.tfar, valid);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags =
      coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  rtcOccluded16(valid, scene_.get(), &context, &rays);
}

std::size_t OcclusionRays::add(Vec3f origin, Vec3f direction, float near, float far) {
  const std::size_t packet = count_ / 16;
  const std::size_t lane = count_ % 16;
  if (packet == packets_.size()) {
    packets_.emplace_back();
  }
  RTCRay16& rays = packets_[packet];
  rays.org_x[lane] = origin.x;
  rays.org_y[lane] = origin.y;
  rays.org_z[lane] = origin.z;
  rays.dir_x[lane] = direction.x;
  rays.dir_y[lane] = direction.y;
  rays.dir_z[lane] = direction.z;
  rays.tnear[lane] = near;
  rays.tfar[lane] = far;
  rays.time[lane] = 0;
  rays.mask[lane] = ~0u;
  rays.id[lane] = 0;
  rays.flags[lane] = 0;
  return count_++;
}

void OcclusionRays::trace(const RayTree& tree, bool coherent) {
  for (std::size_t packet = 0; packet * 16 < count_; ++packet) {
    for (std::size_t lane = count_ - packet * 16; lane < 16; ++lane) {
      packets_[packet].tnear[lane] = 1;
      packets_[packet].tfar[lane] = 0;
    }
    tree.occlude(packets_[packet], coherent);
  }
}

}  // namespace atelier
