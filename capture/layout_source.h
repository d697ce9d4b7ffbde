#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/capture_info.h"
#include "core/camera.h"
#include "core/image.h"

namespace atelier {

/// One sequence of a native capture, for who writes it in another layout.
struct LayoutSource {
  std::filesystem::path capture;
  CaptureInfo info;
  CaptureSequence sequence;
  std::vector<Camera> cameras;

  std::filesystem::path image(const Camera& camera, int frame) const;
  std::filesystem::path labels(const Camera& camera, int frame) const;
  std::filesystem::path keypoints(const Camera& camera, int frame) const;
};

/// A file under another name: a hard link, or a copy where links cannot be. The folder is made.
void link_file(const std::filesystem::path& from, const std::filesystem::path& to);

/// 255 where a label image shows the person, 0 elsewhere, as PNG at `to`; nothing if there are no
/// labels.
void write_mask(const std::filesystem::path& labels, const std::filesystem::path& to);

/// Shortest text that reads back to the same number.
std::string number_text(double value);

/// The writers; each returns what is lost.
std::vector<std::string> write_easymocap(const LayoutSource& source,
                                         const std::filesystem::path& out);
std::vector<std::string> write_colmap(const LayoutSource& source, const std::filesystem::path& out);
std::vector<std::string> write_panoptic(const LayoutSource& source,
                                        const std::filesystem::path& out);
std::vector<std::string> write_dna(const LayoutSource& source, const std::filesystem::path& out);
std::vector<std::string> write_actorshq(const LayoutSource& source,
                                        const std::filesystem::path& out);
std::vector<std::string> write_nerfstudio(const LayoutSource& source,
                                          const std::filesystem::path& out);

}  // namespace atelier
