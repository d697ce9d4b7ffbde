#include "capture/stored_upright.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "capture/camera_conventions.h"
#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr std::size_t kPairs = 4;  // of images
constexpr int kReach = 3;          // px round a joint

/// Mean change between two images round a pixel, levels; nothing outside.
std::optional<double> change_at(const ByteImage& now, const ByteImage& then,
                                const Eigen::Vector2d& pixel) {
  if (!(pixel.x() >= 0 && pixel.x() < now.width && pixel.y() >= 0 && pixel.y() < now.height)) {
    return std::nullopt;
  }
  const int x = saturating_cast<int>(pixel.x());
  const int y = saturating_cast<int>(pixel.y());
  double sum = 0;
  double count = 0;
  for (int v = std::max(0, y - kReach); v <= std::min(now.height - 1, y + kReach); ++v) {
    for (int u = std::max(0, x - kReach); u <= std::min(now.width - 1, x + kReach); ++u) {
      for (int c = 0; c < now.channels; ++c) {
        sum += std::abs(now.at(u, v, c) - then.at(u, v, c));
        ++count;
      }
    }
  }
  return sum / count;
}

}  // namespace

int upright_as_stored(FrameReader& reader, const KeypointCheck& keypoints, std::size_t camera) {
  constexpr double kFew = 10;   // joints
  constexpr double kMoves = 2;  // levels: noise of a sensor or of JPEG makes less
  constexpr double kClear = 2;  // times
  const std::size_t frames = keypoints.found.frames.size();
  if (frames < 2) {
    return 0;
  }
  const Camera& own = reader.dataset().cameras[camera];
  const Camera turned = turned_camera(own, 2);
  const auto index = static_cast<Index>(camera);
  double as_stored = 0;
  double if_turned = 0;
  double count = 0;
  const std::size_t step = std::max<std::size_t>(1, frames / kPairs);
  for (std::size_t f = 0; f + 1 < frames; f += step) {
    const std::size_t later = std::min(f + step, frames - 1);
    std::optional<ByteImage> now;
    std::optional<ByteImage> then;
    try {
      now = reader.byte_image(index, keypoints.frame_ids[f]);
      then = reader.byte_image(index, keypoints.frame_ids[later]);
    } catch (const DataError&) {
      continue;  // check_frames says so
    }
    if (!now || !then || now->width != own.width || now->height != own.height ||
        then->data.size() != now->data.size()) {
      continue;
    }
    for (const SpacePoint& point : keypoints.found.frames[f].points) {
      const auto pixel =
          point.confidence > 0 && !point.bridged ? project(own, point.place) : std::nullopt;
      const auto other = pixel ? project(turned, point.place) : std::nullopt;
      const auto there = pixel ? change_at(*now, *then, *pixel) : std::nullopt;
      const auto turned_there = other ? change_at(*now, *then, *other) : std::nullopt;
      if (there && turned_there) {
        as_stored += *there;
        if_turned += *turned_there;
        ++count;
      }
    }
  }
  if (count < kFew || std::max(as_stored, if_turned) < kMoves * count) {
    return 0;
  }
  return as_stored > kClear * if_turned ? 1 : if_turned > kClear * as_stored ? -1 : 0;
}

}  // namespace atelier
