#pragma once

#include "capture/stereo/fuse.h"
#include "capture/stereo/stereo.h"
#include "capture/stereo/visual_hull.h"
#include "capture/surface/occluding_contours.h"
#include "capture/surface/refine_cameras.h"
#include "capture/surface/surface_from_points.h"
#include "capture/surface/surface_labels.h"
#include "core/camera.h"
#include "core/image.h"

namespace atelier {

/// One camera's image of one instant, with distortion.
struct InstantView {
  Camera camera;     ///< gain included: images are divided by it
  Image image;       ///< [H,W,3] linear RGB
  ByteImage mask;    ///< [H,W] not 0: the subject; empty: known nowhere
  ByteImage labels;  ///< [H,W] numbers of the taxonomy, or empty
};

/// How the views of an instant become a surface.
struct ReconstructOptions {
  VisualHullOptions hull;
  StereoOptions stereo;
  FuseOptions fuse;
  SurfaceOptions surface;
  SurfaceLabelOptions labels;
  RefineCameraOptions refine;
  ContourOptions contours;
  bool exposure_compensation = true;  ///< measure the views' gains first, on small images
  bool align = true;          ///< find the views' poses again by the surface on small images
  bool hull_support = false;  ///< close what stereo sees nothing of by the hull, with confidence 0
};
OptionTable describe(ReconstructOptions& options);

}  // namespace atelier
