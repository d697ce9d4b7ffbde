#include "bodymodel/skinning_device.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr Index kVerticesPerChunk = 4096;

template <class Transform, class SkinOne>
Points skin(const Points& rest, const SkinWeights& weights,
            const std::vector<Transform>& transforms, const SkinOne& skin_one) {
  Points skinned(rest.rows(), 3);
  const int slots = static_cast<int>(weights.weights.cols());
  parallel_for(rest.rows(), kVerticesPerChunk, [&](Index begin, Index end) {
    const double* from = rest.data() + 3 * begin;
    double* to = skinned.data() + 3 * begin;
    const int* joints = weights.joints.data() + slots * begin;
    const double* shares = weights.weights.data() + slots * begin;
    for (Index v = begin; v < end; ++v, from += 3, to += 3, joints += slots, shares += slots) {
      const Vec3d x =
          skin_one(transforms.data(), joints, shares, slots, Vec3d{from[0], from[1], from[2]});
      to[0] = x.x;
      to[1] = x.y;
      to[2] = x.z;
    }
  });
  return skinned;
}

}  // namespace

Points skin_linear_cpu(const Points& rest, const SkinWeights& weights,
                       const std::vector<SkinTransform>& transforms, bool vectors) {
#if defined(__x86_64__) && defined(__GNUC__)
  static const bool has_avx2 = has_skin_avx2();
  if (vectors && has_avx2) {
    Points skinned(rest.rows(), 3);
    const int slots = static_cast<int>(weights.weights.cols());
    parallel_for(rest.rows(), kVerticesPerChunk, [&](Index begin, Index end) {
      const SkinBatch batch{end - begin, slots, rest.data() + 3 * begin,
                            weights.joints.data() + slots * begin,
                            weights.weights.data() + slots * begin};
      skin_linear_avx2(batch, transforms.data(), skinned.data() + 3 * begin);
    });
    return skinned;
  }
#else
  static_cast<void>(vectors);
#endif
  return skin(rest, weights, transforms,
              [](auto&&... arguments) { return skin_linear(arguments...); });
}

Points skin_dual_quaternion_cpu(const Points& rest, const SkinWeights& weights,
                                const std::vector<DualQuaternion>& transforms) {
  return skin(rest, weights, transforms,
              [](auto&&... arguments) { return skin_dual_quaternion(arguments...); });
}

}  // namespace atelier
