#include "pipeline/cloth/simulation_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "bodymodel/formats/body_file.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/retarget/retarget.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_sequence_file.h"
#include "core/io/sequence_folder.h"
#include "core/nearest_name.h"
#include "core/saturating_cast.h"
#include "core/sequence.h"
#include "core/sequence_archive.h"
#include "core/unknown_value.h"
#include "core/usage_error.h"
#include "simulation/files/material_file.h"

namespace atelier {

Points body_at(const BodyTrack& track, double time) {
  const double place = std::clamp(time * track.fps, 0.0, static_cast<double>(track.count - 1));
  const auto first = saturating_cast<Index>(place);
  const double share = place - static_cast<double>(first);
  if (share < 1e-9) {
    return track.at(first);
  }
  return (1 - share) * track.at(first) + share * track.at(first + 1);
}

namespace {

/// Frames are asked for twice in a row or more: the last two are kept.
std::function<Points(Index)> keeping_two(std::function<Points(Index)> load) {
  struct Kept {
    Index frame = -1;
    Points points;
  };
  auto kept = std::make_shared<std::array<Kept, 2>>();
  return [kept, load = std::move(load)](Index frame) {
    for (const Kept& k : *kept) {
      if (k.frame == frame) {
        return k.points;
      }
    }
    Kept& oldest = (*kept)[0].frame < (*kept)[1].frame ? (*kept)[0] : (*kept)[1];
    oldest = {frame, load(frame)};
    return oldest.points;
  };
}

BodyTrack track_of(const Sequence& sequence, const std::string& file, double fps) {
  BodyTrack track;
  const Mesh first = frame(sequence, 0);
  track.faces = first.faces;
  track.fps = fps;
  track.count = atelier::frame_count(sequence);
  track.at = keeping_two([sequence, file, faces = first.faces](Index i) {
    Mesh mesh = frame(sequence, i);
    if (mesh.faces.rows() != faces.rows() || mesh.faces != faces) {
      throw DataError(file, "frame " + std::to_string(i), "another topology than the first frame's",
                      "one body that moves");
    }
    return std::move(mesh.vertices);
  });
  return track;
}

bool named_human(const std::filesystem::path& body) {
  return body == "female" || body == "male";
}

BodyModel posable_body(const std::filesystem::path& body, std::vector<std::string>& notes) {
  if (named_human(body)) {
    return default_human(body == "male" ? male_human() : female_human());
  }
  BodyFile file = read_body_file(body);
  for (const Finding& finding : file.findings) {
    notes.push_back(finding.what);
  }
  return std::move(file.model);
}

/// From the rest pose into the motion, then along it.
BodyTrack moving_body(const ScenePaths& paths, double fps, double fall_in,
                      std::vector<std::string>& notes) {
  if (std::filesystem::is_directory(paths.body) &&
      !std::filesystem::exists(paths.body / "base.obj")) {
    throw UsageError("--motion moves a body model; '" + paths.body.string() +
                     "' is a folder of meshes, which move by themselves");
  }
  const auto model = [&] {
    try {
      return std::make_shared<BodyModel>(posable_body(paths.body, notes));
    } catch (const DataError& error) {
      if (error.where == "groups") {  // an OBJ that is not MakeHuman's
        throw DataError(error.file, "rig", "none, and a mesh without a rig cannot be posed",
                        error.expected + "; or without --motion");
      }
      throw;
    }
  }();
  const MotionClip clip = read_motion_file(paths.motion, of_body(*model));
  RetargetOptions options;
  options.fps = fps;
  Retargeted moved = retarget(clip, *model, {}, options);
  for (const Finding& finding : clip.findings) {
    if (finding.severity != Severity::Note) {
      notes.push_back(kWarning + finding.what + "; " + finding.advice);
    }
  }
  for (const Finding& finding : moved.findings) {
    notes.push_back(finding.what);
  }
  if (moved.motion.poses.empty()) {
    throw DataError(paths.motion.string(), "frames", "none", "a motion of at least one frame");
  }
  auto poses = std::make_shared<std::vector<Pose>>();
  const Pose& first = moved.motion.poses.front();
  const auto steps = saturating_cast<Index>(std::round(fall_in * fps));
  for (Index i = 0; i < steps; ++i) {
    // Slow at both ends, so that nothing is thrown.
    const double t = static_cast<double>(i) / static_cast<double>(steps);
    const double share = t * t * (3 - 2 * t);
    poses->push_back({share * first.root_translation, share * first.rotations});
  }
  poses->insert(poses->end(), moved.motion.poses.begin(), moved.motion.poses.end());
  auto body = std::make_shared<ShapedBody>(shape_body(*model));
  BodyTrack track;
  track.faces = model->mesh.faces;
  track.fps = fps;
  track.count = static_cast<Index>(poses->size());
  track.at = keeping_two([model, body, poses](Index i) {
    return skin_vertices(*model, *body, (*poses)[static_cast<std::size_t>(i)]);
  });
  return track;
}

/// A mesh, a folder of meshes, a sequence of ours, or one file of a sequence (.h5).
Sequence body_sequence(const std::filesystem::path& body) {
  if (std::filesystem::exists(body / "sequence.h5")) {
    return open_sequence(body);
  }
  if (lower_extension(body) == ".h5") {
    return read_mesh_sequence(body, SequenceOf::Body).sequence;
  }
  if (!std::filesystem::exists(body)) {
    const std::string expected = "a mesh, a folder of meshes, a body model, female or male" +
                                 did_you_mean(body.string(), {"female", "male"});
    if (!body.has_parent_path() && !body.has_extension()) {  // "femal"
      throw UnknownValue("", "body", body.string(), expected);
    }
    throw DataError(body.string(), "", "no such file or folder", expected);
  }
  return read_sequence_folder(body);
}

}  // namespace

BodyTrack read_body_track(const ScenePaths& paths, const SimulateOptions& options,
                          std::vector<std::string>& notes) {
  if (!paths.motion.empty()) {
    return moving_body(paths, options.fps, options.fall_in, notes);
  }
  const std::string extension = lower_extension(paths.body);
  if (named_human(paths.body) || extension == ".npz") {
    return track_of(sequence_of({posable_body(paths.body, notes).mesh}, 1), paths.body.string(), 1);
  }
  const Sequence sequence = body_sequence(paths.body);
  if (options.body_fps > 0 && sequence.fps > 0 && sequence.fps != options.body_fps) {
    notes.push_back(paths.body.string() + " says " + number_text(sequence.fps) +
                    " frames a second; --body-fps is taken instead");
  }
  const double fps = options.body_fps > 0 ? options.body_fps
                     : sequence.fps > 0   ? sequence.fps
                                          : options.fps;
  return track_of(sequence, paths.body.string(), fps);
}

}  // namespace atelier
