#include "pipeline/cloth/simulation_output.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_file.h"
#include "core/io/one_file_sequence.h"
#include "core/io/usd_sequence.h"
#include "core/render/video.h"
#include "core/saturating_cast.h"
#include "core/store/output_place.h"
#include "core/usage_error.h"
#include "core/writable_place.h"

namespace atelier {

std::filesystem::path OutputPlace::beside(const std::string& name) const {
  return one_file ? path.parent_path() / (path.stem().string() + "_" + name) : path / name;
}

namespace {

/// The folder in which frames are gathered.
std::filesystem::path gathered_in(const OutputPlace& place, const std::string& name) {
  return place.one_file ? std::filesystem::path(place.path.string() + ".frames")
                        : place.path / name;
}

}  // namespace

OutputPlace output_place(const std::string& out, const std::string& format) {
  if (!format.empty() && format != "h5" && format != "ply" && format != "obj" && format != "usda") {
    throw UsageError("--format cannot be '" + format + "': it takes h5, ply, obj or usda");
  }
  OutputPlace place{out, format.empty() ? "h5" : format, false};
  const std::string extension = lower_extension(place.path);
  if (extension == ".h5" || extension == ".usda") {
    if (!format.empty() && "." + format != extension) {
      throw UsageError("--format " + format + " and --out '" + out + "' contradict each other: " +
                       (format == "usda" ? "name a file that ends in .usda"
                                         : "name a folder for " + format + ", one file a frame"));
    }
    place.format = extension.substr(1);
    place.one_file = true;
    return place;
  }
  if (extension == ".obj" || extension == ".ply") {
    throw UsageError("--out cannot be '" + out + "': " + extension.substr(1) +
                     " is one file a frame; name a folder" +
                     (format.empty() ? " and --format " + extension.substr(1) : ""));
  }
  for (const char* other : {".glb", ".gltf", ".usd", ".usdc", ".abc", ".fbx", ".mp4", ".png",
                            ".csv", ".txt", ".json", ".npz", ".stl"}) {
    if (extension == other) {
      throw UsageError("--out cannot be '" + out + "': name a folder, or a file T.h5 or T.usda");
    }
  }
  return place;
}

void require_output_place(const OutputPlace& place) {
  if (!place.one_file) {
    require_new_place(place.path, "--out");
    require_folder_place(place.path);
    return;
  }
  if (std::filesystem::is_directory(place.path)) {
    throw UsageError("--out cannot be '" + place.path.string() +
                     "': that is a folder; name another file");
  }
  require_file_place(place.path);
  if (std::filesystem::exists(gathered_in(place, ""))) {
    throw UsageError("the frames of an earlier run that was stopped are in '" +
                     gathered_in(place, "").string() +
                     "': move or remove that folder, or name another file");
  }
}

FrameWriter::FrameWriter(OutputPlace place, std::string name, double fps, Index count,
                         const Triangles& faces)
    : place_(std::move(place)), name_(std::move(name)) {
  header_.fps = fps;
  for (Index i = 1; i <= count; ++i) {
    header_.frame_ids.push_back(static_cast<int>(i));
  }
  header_.shared.faces = faces;
  if (!place_.one_file) {
    make_private_directory(place_.path);
  }
  if (in_archive()) {
    write_sequence_header(gathered(), header_);
  }
}

std::filesystem::path FrameWriter::gathered() const {
  return gathered_in(place_, name_);
}

void FrameWriter::write(int frame, const Mesh& mesh) {
  if (in_archive()) {
    write_sequence_frame(gathered(), header_, frame, mesh);
  } else {
    char number[20];
    std::snprintf(number, sizeof number, "_%06d.", frame);
    write_mesh(place_.path / (name_ + number + place_.format), mesh);
  }
}

void FrameWriter::finish(Index frames) {
  if (frames == 0) {  // so that the same command can be given again
    std::filesystem::remove_all(gathered());
    if (!place_.one_file) {
      std::error_code not_empty;
      std::filesystem::remove(place_.path, not_empty);
    }
    return;
  }
  if (!in_archive()) {
    return;
  }
  if (frames < static_cast<Index>(header_.frame_ids.size())) {
    header_.frame_ids.resize(static_cast<std::size_t>(frames));
    write_sequence_header(gathered(), header_);
  }
  if (place_.format == "usda") {
    write_usd_sequence(place_.one_file ? place_.path : place_.path / (name_ + ".usda"),
                       open_sequence(gathered()));
  } else if (place_.one_file) {
    write_one_file_sequence(place_.path, open_sequence(gathered()));
  }
  if (place_.one_file) {
    finished_ = true;
    std::filesystem::remove_all(gathered());
  }
}

std::vector<RenderMesh> dressed(const std::vector<Mesh>& garments, const SimulationScene& scene,
                                const Points& body) {
  constexpr std::array<std::array<float, 3>, 3> kColors = {
      {{0.16F, 0.24F, 0.42F}, {0.45F, 0.16F, 0.14F}, {0.14F, 0.34F, 0.20F}}};
  std::vector<RenderMesh> meshes;
  for (std::size_t g = 0; g < garments.size(); ++g) {
    Look cloth = clay_look();
    const auto& color = kColors[g % kColors.size()];
    cloth.color = {color[0], color[1], color[2]};
    meshes.push_back({garments[g], cloth});
  }
  if (scene.body_faces.rows() > 0) {
    Mesh wearer;
    wearer.vertices = body;
    wearer.faces = scene.body_faces;
    meshes.push_back({wearer, clay_look()});
  }
  return meshes;
}

PictureOptions simulation_picture() {
  PictureOptions options;
  options.width = 360;
  options.height = 540;
  return options;
}

bool in_sheet(Index frame, Index count) {
  return frame % std::max<Index>(1, count / 8) == 0 || frame == 1 || frame == count;
}

CaptionedImage sheet_picture(Index frame, const std::vector<Mesh>& garments,
                             const SimulationScene& scene) {
  return {picture_of(dressed(garments, scene, scene.body ? scene.body(frame) : Points(0, 3)),
                     kThreeQuarter, simulation_picture()),
          "frame " + std::to_string(frame)};
}

Image simulation_sheet(const std::vector<CaptionedImage>& pictures) {
  ContactSheetOptions sheet;
  sheet.columns = 5;
  return contact_sheet(pictures, sheet);
}

/// Frames of a video, which is drawn when its extent is known: a minute at 15 a second. A longer
/// run is filmed at fewer.
constexpr Index kMaxVideoFrames = 900;

Album::Album(OutputPlace place, Index count, double fps)
    : place_(std::move(place)),
      video_every_(std::max({Index{1}, saturating_cast<Index>(std::round(fps / 15)),
                             (count + kMaxVideoFrames - 1) / kMaxVideoFrames})),
      count_(count),
      video_fps_(fps / static_cast<double>(video_every_)) {}

void Album::add(Index frame, const std::vector<Mesh>& garments, const SimulationScene& scene) {
  const bool last = frame == count_;
  if (!in_sheet(frame, count_) && frame % video_every_ != 0) {
    return;
  }
  std::vector<RenderMesh> meshes =
      dressed(garments, scene, scene.body ? scene.body(frame) : Points(0, 3));
  if (in_sheet(frame, count_)) {
    pictures_.push_back(sheet_picture(frame, garments, scene));
  }
  // A run shorter than the first image of the video has its last frame as one.
  if (frame % video_every_ == 0 || (last && video_.empty())) {
    video_.push_back(meshes);
  }
  if (last) {
    end_ = std::move(meshes);
  }
}

void Album::write_sheet() const {
  write_image(place_.beside("sheet.png"), simulation_sheet(pictures_));
}

void Album::write_videos(const std::function<bool()>& stop) const {
  constexpr int kTurn = 36;
  const std::vector<Image> turn = turntable_of(end_, kTurn, kFront, simulation_picture(), stop);
  std::vector<Image> writer;
  for (std::size_t i = 0; i < video_.size() && !stop(); ++i) {
    writer.push_back(picture_of(video_[i], kThreeQuarter, simulation_picture()));
  }
  if (stop()) {
    return;
  }
  write_video(place_.beside("turntable.mp4"), kTurn,
              [&](Index i) { return turn[static_cast<std::size_t>(i)]; }, {.fps = 12});
  write_video(place_.beside("motion.mp4"), static_cast<Index>(writer.size()),
              [&](Index i) { return writer[static_cast<std::size_t>(i)]; }, {.fps = video_fps_});
}

}  // namespace atelier
