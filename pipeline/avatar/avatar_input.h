#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "bodymodel/formats/personal_body.h"
#include "bodymodel/skinning.h"
#include "bodymodel/underlying/clothed_scan.h"
#include "capture/dataset.h"
#include "capture/layouts/open_dataset.h"
#include "core/sequence.h"
#include "core/store/stage.h"
#include "pipeline/outfit/worn_subject.h"

namespace atelier {

/// Frames that an avatar is made from.
enum class AvatarKind {
  All,         ///< both
  Minimal,     ///< the minimally clothed sequence, where all of the body is seen
  Underlying,  ///< the clothed sequences, where skin, hair and shoes are seen
};

/// All that the stage reads. Nothing of it is held out.
struct AvatarInput {
  PersonalBody person;
  ShapedBody shaped;
  Dataset dataset;
  std::vector<Camera> cameras;
  std::vector<Index> camera_idx;    ///< of the data set
  std::vector<int> frame_ids;       ///< tracked, with a scan
  std::map<int, Pose> poses;        ///< of these
  std::set<int> minimal;            ///< those of them that are minimally clothed
  double fps = 0;                   ///< of the first of their sequences
  std::filesystem::path scans;      ///< folder
  std::optional<Sequence> bodies;   ///< surfaces under the clothes, of clothed frames
  std::optional<WornSubject> worn;  ///< registered garments, of clothed frames
  /// face_displacements of the frames, [3K] each, where the capture has keypoints of the face and
  /// the person a head.
  std::map<int, std::vector<float>> faces;
};

/// Chooses the frames; says what it does without. Where no minimally clothed frame has a scan,
/// clothed ones are taken. Throws DataError where neither is there, or nothing but clothed frames
/// without label images, of which nobody knows what is skin.
AvatarInput avatar_input(StageRun& run, AvatarKind kind, const DatasetOptions& options);

/// The vertices of the head; none where nobody can tell.
std::vector<Index> head_vertices(const BodyModel& model);

/// The body of a frame, which the seen surface is displaced from: the posed person, under clothes
/// the surface of `body`. [V,3] m
Points body_of_frame(const AvatarInput& input, int frame_id);

/// The frame's scan with the roles that outer_surface takes: hair and shoes are Cover, clothes
/// Ignored, and of a minimally clothed person all else is skin.
ClothedScan avatar_scan(const AvatarInput& input, int frame_id);

/// A label image as one of the seen body (Label::Skin) and of everything else: skin, hair and
/// shoes; of a minimally clothed person all of the person. Empty for an empty one.
ByteImage body_labels(ByteImage labels, bool minimal);

}  // namespace atelier
