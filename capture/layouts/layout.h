#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "capture/layouts/open_dataset.h"
#include "core/io/text_writer.h"

namespace atelier {

/// One sequence of a data set, for writing it in another layout.
struct LayoutSource {
  FrameReader* reader = nullptr;
  CaptureSequence sequence;    ///< of the native layout: the frames of all sequences
  std::function<bool()> stop;  ///< true: write no further frame; empty: never

  /// The reader, for one image or one frame's points: they are what takes time. Throws
  /// StopRequested (digest_meter.h) if `stop` says so.
  FrameReader& frames() const;
  const Dataset& dataset() const { return reader->dataset(); }
  const std::vector<Camera>& cameras() const { return reader->dataset().cameras; }
};

/// One layout: how it is told, read and written. Each header of capture/layouts has
/// the three functions of a row of the table in layout_table.cpp, and what of its files is read
/// from memory.
struct Layout {
  const char* name;
  const char* summary;
  /// The evidence for the layout at `path`, one sentence; "" if there is none.
  std::string (*recognize)(const std::filesystem::path& path);
  /// Cameras in the layout's own world (Dataset::world_convention), with width 0 where the layout
  /// does not say, and what there is of each; open_dataset does the rest, which is the same for
  /// all.
  Dataset (*read)(const std::filesystem::path& path, const DatasetOptions& options,
                  const Limits& limits);
  /// Writes under `out`, which is there and empty; returns what is lost.
  std::vector<std::string> (*write)(const LayoutSource& source, const std::filesystem::path& out);
  /// Where `write` says which images are held out, for a training to leave them closed; null: the
  /// layout has no place for it.
  const char* held_out = nullptr;
};

/// True for an image of a held-out camera or frame.
bool is_held_out(const LayoutSource& source, Index camera_idx, int frame_id);

/// Writes the image of a frame, its bytes as they are, to `stem` with the extension of its bytes;
/// returns that extension, "" if there is none. A copy: a link would share the capture's own file.
std::string write_picture(const LayoutSource& source, Index camera_idx, int frame_id,
                          const std::filesystem::path& stem);

/// Writes 255 where the person is, 0 elsewhere, as PNG; false if there is neither mask nor labels.
bool write_mask(const LayoutSource& source, Index camera_idx, int frame_id,
                const std::filesystem::path& path);

/// Writes the detections as OpenPose JSON; false if there is no file of them.
/// @param shift  px, taken off: 0.5 where the layout counts from the first pixel's centre
bool write_keypoints(const LayoutSource& source, Index camera_idx, int frame_id,
                     const std::filesystem::path& path, double shift);

/// The cameras in the world of a layout.
std::vector<Camera> cameras_in(const LayoutSource& source, const WorldConvention& world);

}  // namespace atelier
