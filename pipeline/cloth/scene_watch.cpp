#include "pipeline/cloth/scene_watch.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/saturating_cast.h"
#include "core/sequence_archive.h"

namespace atelier {

SceneWatch::SceneWatch(const SimulationScene& scene, const Cloth& cloth, const ScenePaths& paths,
                       const SimulateOptions& options)
    : scene_(scene), cloth_(cloth) {
  if (paths.captured.empty()) {
    return;
  }
  captured_ = open_sequence(paths.captured);
  if (!equal_arrays(captured_->faces, cloth.faces)) {
    throw DataError(paths.captured.string(), "faces", "another topology than the garment's",
                    "the same garments in every captured frame; or leave the folder out");
  }
  constexpr double kSameMoment = 0.01;  // of a simulated frame
  const double fps = options.body_fps > 0 ? options.body_fps : captured_->fps;
  for (Index row = 0; row < frame_count(*captured_); ++row) {
    const double moment = static_cast<double>(row) / fps * options.fps;
    const auto frame = saturating_cast<Index>(std::round(moment));
    if (std::abs(moment - static_cast<double>(frame)) < kSameMoment) {
      rows_[options.settle + frame] = row;
    }
  }
}

WatchedFrame SceneWatch::at(Index frame, const Points& positions) const {
  WatchedFrame watched;
  std::vector<double> strains;
  for (int i = 0; i < cloth_.fibre_count; ++i) {
    const ClothSpring& spring = cloth_.springs[static_cast<std::size_t>(i)];
    if (spring.rest > 0) {
      strains.push_back(
          std::abs((positions.row(spring.a) - positions.row(spring.b)).norm() / spring.rest - 1));
    }
  }
  if (!strains.empty()) {
    constexpr double kShare = 0.999;
    const auto at = strains.begin() +
                    static_cast<std::ptrdiff_t>(kShare * static_cast<double>(strains.size() - 1));
    std::nth_element(strains.begin(), at, strains.end());
    watched.strain_p999 = *at;
  }
  if (const auto found = rows_.find(frame); found != rows_.end()) {
    watched.captured =
        (positions - atelier::frame(*captured_, found->second).vertices).rowwise().norm().mean();
  }
  if (!scene_.places.empty()) {
    const Points body = scene_.body(frame);
    for (const RingPlace& place : scene_.places) {
      watched.away.push_back(ring_distance(place, positions, body, scene_.body_faces));
    }
  }
  return watched;
}

void tell_watched(StageRun& run, const SimulationScene& scene,
                  const std::vector<WatchedFrame>& frames) {
  double strain = 0;
  double captured = 0;
  double count = 0;
  double held = 0;
  std::vector<RingLeft> left(scene.places.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    strain = std::max(strain, frames[i].strain_p999);
    if (frames[i].captured >= 0) {
      captured += frames[i].captured;
      count += 1;
    }
    for (std::size_t p = 0; p < left.size(); ++p) {
      left[p].add(frames[i].away[p], static_cast<int>(i) + 1);
      held = std::max(held, left[p].distance);
    }
  }
  run.metric("strain_p999", strain);
  if (count > 0) {
    run.metric("captured_distance", captured / count);
  }
  if (!left.empty()) {
    run.metric("held_distance", held);
  }
  for (const std::string& doubt : left_places(scene.places, left)) {
    run.warn(doubt);
  }
}

}  // namespace atelier
