#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "core/finding.h"
#include "core/mesh.h"
#include "core/sequence.h"

namespace atelier {

/// Meshes over time that a page shows or hides as one.
struct ViewLayer {
  std::string name;   ///< "dress"
  std::string stage;  ///< that made it; "" of a file
  std::string role;   ///< "scan", "body", "garment": its colour, and what is compared with what
  bool shown = true;  ///< at first
  Sequence sequence;  ///< read one frame at a time; from several threads
  Mesh shared;        ///< uvs and uv_faces of every frame, or empty
  std::optional<Mesh> rest;                      ///< with the faces of `sequence`: strain is shown
  std::optional<Mesh> pattern;                   ///< uvs: its flat panels in m, with the same faces
  std::optional<std::filesystem::path> texture;  ///< an image over `shared`'s uvs
  /// [N+1] Of a rate of its own: frames of the timeline from which on its own are shown, and at
  /// last the one at which it has ended. Empty: its frames are those of the same numbers.
  std::vector<int> begins;
};

/// A number of each frame.
struct ViewSeries {
  std::string name;
  std::string stage;
  std::vector<int> frame_ids;
  std::vector<double> values;
};

/// A finding, with the frame or camera that a page can jump to.
struct ViewMark {
  Severity severity = Severity::Note;
  std::string text;
  std::string stage;
  std::optional<int> frame_id;
  std::string camera;  ///< "": of none
};

/// Frames of one rate, up to the next take.
struct ViewTake {
  std::string name;       ///< "clothed"; "" where there is one alone
  double fps = 0;         ///< frames a second
  std::size_t first = 0;  ///< its first frame, among those of the timeline
};

/// Data shown together: layers, series and videos of the same frames.
struct ViewTimeline {
  std::string name;             ///< "Capture", "Simulation", "Animation"
  std::vector<int> frame_ids;   ///< the files' own numbers, increasing
  std::vector<ViewTake> takes;  ///< one after the other, at least one
  std::vector<ViewLayer> layers;
  std::vector<ViewSeries> series;
  std::vector<ViewMark> marks;
  std::vector<std::filesystem::path> videos;  ///< .mp4 of the same frames
  std::optional<Dataset> capture;             ///< calibrated cameras and their images
  std::filesystem::path keypoints3d;          ///< folder of reconstruct's keypoints, or empty
};

/// Contents of a page.
struct ViewScene {
  std::string title;
  std::vector<ViewTimeline> timelines;
  std::size_t beside = 0;  ///< the first timeline of another scene that is beside it; 0: none
  std::vector<std::string> notes;  ///< what is not shown, and why; a sentence each
};

}  // namespace atelier
