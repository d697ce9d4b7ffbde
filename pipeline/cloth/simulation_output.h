#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/render/contact_sheet.h"
#include "core/render/studio.h"
#include "core/sequence_archive.h"
#include "pipeline/cloth/simulation_scene.h"

namespace atelier {

/// Where a simulation's results go: into a folder, or into one file with the others beside it.
struct OutputPlace {
  std::filesystem::path path;  ///< as the user named it
  std::string format;          ///< of the frames: "h5", "ply", "obj" or "usda"
  bool one_file = false;       ///< `path` is a file: "T.h5" or "T.usda"

  /// "sheet.png" in the folder, or "T_sheet.png" beside T.h5.
  std::filesystem::path beside(const std::string& name) const;
};

/// Reads the place off --out and --format: a name that ends in .h5 or .usda is one file. Throws
/// UsageError for formats that there are not or that contradict each other. Looks at no disk.
OutputPlace output_place(const std::string& out, const std::string& format);

/// Refuses a place that is taken, or where frames of an earlier run wait (UsageError), and one that
/// cannot be written to (EnvironmentError).
void require_output_place(const OutputPlace& place);

/// Writes frames as they come, in the format asked for; what is one file gathers them first in a
/// folder beside it, which is removed once the file is whole.
class FrameWriter {
 public:
  /// `name`: of the garment's folder, or of each file of a frame.
  FrameWriter(OutputPlace place, std::string name, double fps, Index count, const Triangles& faces);
  void write(int frame, const Mesh& mesh);
  /// Closes the sequence after its first `frames`, of those that were written; of none nothing is
  /// left.
  void finish(Index frames);
  /// Where the frames are: what gathers them, until one file has them all.
  std::filesystem::path frames_place() const { return finished_ ? place_.path : unfinished(); }

 private:
  std::filesystem::path gathered() const;
  std::filesystem::path unfinished() const { return place_.one_file ? gathered() : place_.path; }
  bool in_archive() const { return place_.format == "h5" || place_.format == "usda"; }

  OutputPlace place_;
  std::string name_;
  SequenceHeader header_;
  bool finished_ = false;
};

/// The garments, and what wears them, as they are rendered.
std::vector<RenderMesh> dressed(const std::vector<Mesh>& garments, const SimulationScene& scene,
                                const Points& body);
PictureOptions simulation_picture();

/// A contact sheet of a simulation: of some eight frames, the first and the last among them.
bool in_sheet(Index frame, Index count);
CaptionedImage sheet_picture(Index frame, const std::vector<Mesh>& garments,
                             const SimulationScene& scene);
Image simulation_sheet(const std::vector<CaptionedImage>& pictures);

/// Images along the way, and two videos: of the motion and once round the end.
class Album {
 public:
  Album(OutputPlace place, Index count, double fps);
  void add(Index frame, const std::vector<Mesh>& garments, const SimulationScene& scene);
  /// sheet.png, of the frames so far.
  void write_sheet() const;
  /// turntable.mp4 and motion.mp4, once the last frame was added; neither where `stop`, asked
  /// before each image, says so.
  void write_videos(const std::function<bool()>& stop) const;

 private:
  OutputPlace place_;
  Index video_every_;
  Index count_;
  double video_fps_;
  std::vector<CaptionedImage> pictures_;
  std::vector<std::vector<RenderMesh>> video_;
  std::vector<RenderMesh> end_;
};

}  // namespace atelier
