#include "capture/stereo/share_views.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace atelier {

std::vector<std::size_t> share_of_views(const std::vector<Camera>& cameras, int share, int shares) {
  ATELIER_CHECK(share >= 0 && share < shares, "a share out of range");
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Camera& camera : cameras) {
    middle += camera_center(camera) / static_cast<double>(cameras.size());
  }
  std::vector<std::pair<double, std::size_t>> around;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Eigen::Vector3d from = camera_center(cameras[i]) - middle;
    around.emplace_back(std::atan2(from.x(), from.z()), i);
  }
  std::sort(around.begin(), around.end());
  std::vector<std::size_t> views;
  const std::size_t count = around.size();
  const auto part = static_cast<std::size_t>(share);
  const auto parts = static_cast<std::size_t>(shares);
  for (std::size_t i = part * count / parts; i < (part + 1) * count / parts; ++i) {
    views.push_back(around[i].second);
  }
  std::sort(views.begin(), views.end());
  return views;
}

std::vector<std::size_t> with_sources(const std::vector<std::size_t>& wanted,
                                      const std::vector<std::vector<int>>& sources) {
  std::vector<std::size_t> views;
  for (const std::size_t view : wanted) {
    ATELIER_CHECK(view < sources.size(), "a view out of range");
    views.push_back(view);
    for (const int source : sources[view]) {
      views.push_back(static_cast<std::size_t>(source));
    }
  }
  std::sort(views.begin(), views.end());
  views.erase(std::unique(views.begin(), views.end()), views.end());
  return views;
}

}  // namespace atelier
