#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/device.h"
#include "core/image.h"
#include "pipeline/outfit/worn_subject.h"

namespace atelier {

/// An image that is to be drawn as it was taken.
struct TakenView {
  Camera camera;
  int frame_id = 0;
  Image picture;  ///< [H,W,3] linear light
};

/// Images, each beside what networks draw of the same camera and frame, three pairs in a row;
/// linear light. Nothing if it was stopped.
/// @param models  network of each surface that has one, by its place among the subject's
/// @param views   one or more
std::optional<Image> taken_and_drawn(const WornSubject& worn,
                                     const std::map<std::size_t, std::string>& models,
                                     const std::vector<TakenView>& views, Device device,
                                     const std::function<bool()>& stop = {});

}  // namespace atelier
