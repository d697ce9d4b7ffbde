#include "pipeline/avatar/avatar_input.h"

#include <algorithm>
#include <set>
#include <string>

#include "bodymodel/humanoid.h"
#include "capture/capture_info.h"
#include "capture/frame_reader.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints3d_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/label.h"
#include "core/listed_frames.h"
#include "core/sequence_archive.h"
#include "core/store/manifest.h"
#include "pipeline/avatar/face_displacements.h"
#include "pipeline/avatar/moved_vertices.h"
#include "pipeline/person/tracked_take.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr std::uint8_t kBody = static_cast<std::uint8_t>(Label::Skin);

/// How a label counts in a minimally clothed frame, or a clothed one.
ScanRole role_of(Label label, bool minimal) {
  switch (label) {
    case Label::Skin:
      return ScanRole::Skin;
    case Label::Hair:
    case Label::Shoes:
      return ScanRole::Cover;
    case Label::Upper:
    case Label::Lower:
    case Label::Dress:
    case Label::Outer:
    case Label::Unknown:
      return minimal ? ScanRole::Skin : ScanRole::Ignored;
    case Label::Background:
    case Label::Other:
      break;
  }
  return ScanRole::Ignored;
}

/// Frames of sequences of a kind that are not held out, are tracked and have a scan.
std::vector<int> usable_frames(const AvatarInput& input, bool minimal) {
  const CaptureInfo& info = input.dataset.info;
  const std::set<int> held(info.held_out_frames.begin(), info.held_out_frames.end());
  std::vector<int> frames;
  for (const CaptureSequence& sequence : info.sequences) {
    if ((sequence.kind == "minimal") != minimal) {
      continue;
    }
    for (const int id : sequence.frame_ids) {
      if (!held.contains(id) && input.poses.contains(id) &&
          fs::exists(input.scans / (frame_name(id) + ".h5"))) {
        frames.push_back(id);
      }
    }
  }
  std::sort(frames.begin(), frames.end());
  return frames;
}

double rate_of(const CaptureInfo& info, int frame_id) {
  for (const CaptureSequence& sequence : info.sequences) {
    if (std::binary_search(sequence.frame_ids.begin(), sequence.frame_ids.end(), frame_id)) {
      return sequence.fps;
    }
  }
  return 1;
}

/// Poses of all frames; unreliable ones are left out where others are left.
std::map<int, Pose> tracked_poses(StageRun& run, const fs::path& tracked, Index joints) {
  std::map<int, Pose> poses;
  std::map<int, Pose> doubtful;
  for (const TrackedTake& take : tracked_takes(tracked)) {
    if (static_cast<Index>(take.tracked.skeleton.parents.size()) != joints) {
      throw DataError((tracked / take.name).string(), "skeleton", "another one than the person's",
                      "the person's own; run 'atelier track' again");
    }
    const Motion& motion = take.tracked.motion;
    for (std::size_t i = 0; i < motion.frame_ids.size(); ++i) {
      (take.tracked.trusted[i] != 0 ? poses : doubtful)[motion.frame_ids[i]] = motion.poses[i];
    }
  }
  if (poses.empty()) {
    return doubtful;
  }
  if (!doubtful.empty()) {
    std::vector<int> ids;
    ids.reserve(doubtful.size());
    for (const auto& [id, pose] : doubtful) {
      ids.push_back(id);
    }
    run.say("frames " + listed_frames(ids) +
            " are left out: tracking marked their poses as "
            "unreliable");
  }
  return poses;
}

/// What clothed frames take: bodies under the clothes, and what hides them.
void open_clothes(StageRun& run, AvatarInput& input) {
  if (run.has_input("bodies")) {
    input.bodies = open_sequence(run.input("bodies"));
    if (!equal_arrays(input.bodies->faces, input.person.model.mesh.faces)) {
      throw DataError(run.input("bodies").string(), "faces", "another body than the person's",
                      "bodies of this person; run 'atelier body' again");
    }
  }
  if (run.has_input("registered") && run.has_input("bodies")) {
    input.worn = worn_in_workspace(run.input("registered"), run.input("bodies"));
  }
}

/// Whether some camera has a label image of a frame.
bool is_labelled(const AvatarInput& input, int frame_id) {
  FrameReader reader(input.dataset);
  return std::any_of(input.camera_idx.begin(), input.camera_idx.end(),
                     [&](Index camera) { return reader.labels(camera, frame_id).has_value(); });
}

/// Chooses the frames of a kind.
void choose_frames(StageRun& run, AvatarKind kind, AvatarInput& input) {
  std::vector<int> minimal =
      kind == AvatarKind::Underlying ? std::vector<int>{} : usable_frames(input, true);
  if (minimal.empty() && kind != AvatarKind::Underlying) {
    run.warn(
        "no minimally clothed frame has a scan: clothed ones are used, and skin that clothes "
        "cover has the colour of the skin beside it");
  }
  std::vector<int> clothed;
  if (kind != AvatarKind::Minimal || minimal.empty()) {
    clothed = usable_frames(input, false);
  }
  if (!clothed.empty() && !is_labelled(input, clothed.front())) {
    run.warn(
        "clothed frames have no label images, which tell skin, hair and shoes from clothes; "
        "they are left out");
    clothed.clear();
  }
  input.minimal.insert(minimal.begin(), minimal.end());
  input.frame_ids = std::move(minimal);
  input.frame_ids.insert(input.frame_ids.end(), clothed.begin(), clothed.end());
  std::sort(input.frame_ids.begin(), input.frame_ids.end());
  if (!clothed.empty()) {
    open_clothes(run, input);
    if (!input.worn) {
      run.warn(
          "clothed frames have no registered garments, which hide the skin under them; run "
          "'atelier register' first, or take --kind minimal");
    }
  }
}

/// How the face differs from its mean in the frames; nothing without keypoints of it.
void read_faces(StageRun& run, AvatarInput& input) {
  if (input.dataset.info.keypoint_schema.empty() || head_vertices(input.person.model).empty()) {
    return;
  }
  constexpr std::int64_t kMaxText = 64 << 20;
  const std::vector<std::string>& names =
      keypoint_schema(input.dataset.info.keypoint_schema).points;
  const std::vector<int> places = face_keypoints(names);
  std::vector<Keypoints3d> faces;
  bool found = false;
  for (const int id : input.frame_ids) {
    Keypoints3d face = Keypoints3d::Zero(static_cast<Index>(places.size()), 4);
    const fs::path file = input.scans.parent_path() / "keypoints3d" / (frame_name(id) + ".json");
    if (!places.empty() && fs::exists(file)) {
      for (const PersonPoints& one :
           parse_keypoints3d(read_file_text(file, kMaxText), file.string())) {
        if (one.id <= 0 && one.points.rows() == static_cast<Index>(names.size())) {
          face = one.points(places, Eigen::all);
        }
      }
    }
    found = found || (face.col(3).array() > 0).any();
    faces.push_back(std::move(face));
  }
  if (!found) {
    return;
  }
  const std::vector<std::vector<float>> off = face_displacements(faces);
  for (std::size_t f = 0; f < off.size(); ++f) {
    input.faces[input.frame_ids[f]] = off[f];
  }
  run.say("the face is conditioned on its " + std::to_string(places.size()) + " keypoints");
}

}  // namespace

AvatarInput avatar_input(StageRun& run, AvatarKind kind, const DatasetOptions& options) {
  AvatarInput input;
  input.person = read_personal_body(run.input("person") / "person.npz");
  if (input.person.model.mesh.uv_faces.rows() == 0) {
    throw DataError((run.input("person") / "person.npz").string(), "uvs",
                    "no texture coordinates of the body",
                    "a body with an atlas, such as the default one");
  }
  input.shaped = shape_body(input.person.model);
  input.dataset = open_dataset(run.input("capture"), options);
  input.scans = run.input("scans") / "scans";
  input.poses = tracked_poses(run, run.input("tracked"), joint_count(input.person.model));
  const CaptureInfo& info = input.dataset.info;
  const std::set<std::string> held(info.held_out_cameras.begin(), info.held_out_cameras.end());
  for (std::size_t c = 0; c < input.dataset.cameras.size(); ++c) {
    if (!held.contains(input.dataset.cameras[c].id)) {
      input.cameras.push_back(input.dataset.cameras[c]);
      input.camera_idx.push_back(static_cast<Index>(c));
    }
  }
  choose_frames(run, kind, input);
  if (input.frame_ids.empty() || input.cameras.empty()) {
    throw DataError(input.scans.string(), "",
                    "no scan of a tracked and labelled frame that is not held out",
                    "scans (atelier reconstruct, from images with masks), without which the body "
                    "has no appearance and stays grey");
  }
  if (input.frame_ids.size() == 1) {
    run.warn("frame " + std::to_string(input.frame_ids[0]) +
             " is the only one: what it does not show is filled from what is beside it");
  }
  read_faces(run, input);
  input.fps = rate_of(info, input.frame_ids.front());
  return input;
}

std::vector<Index> head_vertices(const BodyModel& model) {
  const auto person = find_humanoid(model.skeleton);
  return person ? vertices_moved_below(model, person->neck.back()) : std::vector<Index>{};
}

Points body_of_frame(const AvatarInput& input, int frame_id) {
  if (input.bodies && !input.minimal.contains(frame_id)) {
    const std::vector<int>& ids = input.bodies->frame_ids;
    const auto at = std::lower_bound(ids.begin(), ids.end(), frame_id);
    if (at != ids.end() && *at == frame_id) {
      return frame(*input.bodies, at - ids.begin()).vertices;
    }
  }
  return skin_vertices(input.person.model, input.shaped, input.poses.at(frame_id));
}

ClothedScan avatar_scan(const AvatarInput& input, int frame_id) {
  const fs::path file = input.scans / (frame_name(frame_id) + ".h5");
  ClothedScan scan;
  scan.mesh = read_mesh_archive(file);
  const bool known =
      std::any_of(scan.mesh.labels.begin(), scan.mesh.labels.end(), [](std::uint8_t label) {
        return static_cast<Label>(label) != Label::Background &&
               static_cast<Label>(label) != Label::Unknown;
      });
  for (Index v = 0; v < scan.mesh.vertices.rows(); ++v) {
    const Label label =
        known ? static_cast<Label>(scan.mesh.labels[static_cast<std::size_t>(v)]) : Label::Unknown;
    scan.roles.push_back(role_of(label, input.minimal.contains(frame_id)));
  }
  return scan;
}

ByteImage body_labels(ByteImage labels, bool minimal) {
  for (std::uint8_t& label : labels.data) {
    if (role_of(static_cast<Label>(label), minimal) != ScanRole::Ignored) {
      label = kBody;
    }
  }
  return labels;
}

}  // namespace atelier
