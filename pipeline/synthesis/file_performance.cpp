#include "pipeline/synthesis/file_performance.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/printable.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

/// The file's frame at the capture's i-th: by time where the file has a rate, else one by one.
Index file_frame(const FilePerformance& performance, const SynthesisOptions& options, int i,
                 bool clothed) {
  const Index count = frame_count(performance.body.sequence);
  if (!clothed) {
    return options.minimal_frames < 2 ? 0 : (count - 1) * i / (options.minimal_frames - 1);
  }
  const double rate = performance.body.sequence.fps;
  return rate > 0 ? saturating_cast<Index>(std::round(i * rate / options.fps)) : i;
}

/// [V,3] the garment's vertices in a frame of the file.
Points garment_vertices(const FilePerformance& performance, Index at) {
  const Points all = frame(performance.cloth.sequence, at).vertices;
  Points vertices(static_cast<Index>(performance.garment.rows.size()), 3);
  for (Index v = 0; v < vertices.rows(); ++v) {
    vertices.row(v) = all.row(performance.garment.rows[static_cast<std::size_t>(v)]);
  }
  return vertices;
}

/// Velocities by the difference to the next frame of the file, or from the one before the last.
void add_velocities(PerformedFrame& result, const FilePerformance& performance,
                    const SynthesisOptions& options, Index at) {
  const auto velocity = [&](const Sequence& sequence, Index rows, const auto& vertices) -> Points {
    const Index count = frame_count(sequence);
    if (count < 2 || rows == 0) {
      return Points::Zero(rows, 3);
    }
    const Index first = std::min(at, count - 2);
    const double rate = sequence.fps > 0 ? sequence.fps : options.fps;
    return rate * (vertices(first + 1) - vertices(first));
  };
  result.body_velocity =
      velocity(performance.body.sequence, result.truth.body.rows(),
               [&](Index f) -> Points { return frame(performance.body.sequence, f).vertices; });
  for (const Points& garment : result.truth.garments) {
    result.garment_velocities.push_back(
        velocity(performance.cloth.sequence, garment.rows(),
                 [&](Index f) { return garment_vertices(performance, f); }));
  }
}

Label label_by_place(const Points& cloth, const Points& body) {
  const double floor = body.col(1).minCoeff();
  const double height = body.col(1).maxCoeff() - floor;
  const double low = (cloth.col(1).minCoeff() - floor) / height;
  const double high = (cloth.col(1).maxCoeff() - floor) / height;
  if (low > 0.38) {
    return Label::Upper;
  }
  return high > 0.7 ? Label::Dress : Label::Lower;
}

}  // namespace

FilePerformance read_performance(const SynthesisOptions& options) {
  FilePerformance performance;
  performance.body = read_mesh_sequence(options.body_sequence, SequenceOf::Person);
  const std::vector<std::uint8_t>& labels = performance.body.shared.labels;
  const bool background = std::all_of(labels.begin(), labels.end(), [](std::uint8_t label) {
    return label == static_cast<std::uint8_t>(Label::Background);
  });
  if (!labels.empty() && background) {
    throw DataError(options.body_sequence, "labels", "nothing but 0, the background",
                    "labels of a person's parts (1 is skin), or none: all is skin then");
  }
  const Points first = frame(performance.body.sequence, 0).vertices;
  const Eigen::RowVector3d middle = first.colwise().mean();
  performance.shift = {-middle.x(), -first.col(1).minCoeff(), -middle.z()};
  if (!options.cloth_sequence.empty()) {
    performance.cloth = read_mesh_sequence(options.cloth_sequence, SequenceOf::Cloth);
    performance.garment = sequence_garment(performance.cloth);
    performance.garment.truth.label =
        label_by_place(frame(performance.cloth.sequence, 0).vertices, first);
  }
  const Index have = options.cloth_sequence.empty()
                         ? frame_count(performance.body.sequence)
                         : std::min(frame_count(performance.body.sequence),
                                    frame_count(performance.cloth.sequence));
  const Index want =
      options.frames > 0 ? file_frame(performance, options, options.frames - 1, true) + 1 : 1;
  if (want > have) {
    throw DataError(options.body_sequence, "", counted(have, "frame"),
                    "at least " + std::to_string(want) + ", or a smaller --frames");
  }
  performance.person = sequence_person(performance.body);
  return performance;
}

GroundTruth truth_of(const FilePerformance& performance, const SynthesisOptions& options) {
  GroundTruth truth;
  truth.body = performance.body.shared;
  truth.body.vertices = frame(performance.body.sequence, 0).vertices;
  truth.body.vertices.rowwise() += performance.shift;
  if (performance.cloth.shared.faces.rows() > 0) {
    GroundTruthGarment garment = performance.garment.truth;
    garment.garment.mesh.vertices.rowwise() += performance.shift;
    truth.garments.push_back(garment);
  }
  truth.skeleton = performance.person.skeleton;
  for (const SequenceKeypoint& keypoint : performance.person.keypoints) {
    truth.keypoint_names.push_back(keypoint.name);
  }
  truth.numbers = {{"seed", static_cast<double>(options.seed)},
                   {"exposure", options.sensor.exposure}};
  truth.texts = {{"subject", "from files"}, {"subject_kind", "files"}};
  return truth;
}

PerformedFrame performed_frame(const FilePerformance& performance, const SynthesisOptions& options,
                               int i, bool clothed) {
  const Index at = file_frame(performance, options, i, clothed);
  PerformedFrame result;
  result.truth.body = frame(performance.body.sequence, at).vertices;
  result.truth.body.rowwise() += performance.shift;
  const bool cloth = performance.cloth.shared.faces.rows() > 0;
  if (cloth) {
    result.truth.garments.emplace_back(0, 3);
    if (clothed) {
      result.truth.garments[0] = garment_vertices(performance, at);
      result.truth.garments[0].rowwise() += performance.shift;
    }
  }
  if (options.shutter > 0) {
    add_velocities(result, performance, options, at);
  }
  const SequencePerson& person = performance.person;
  if (!performance.body.joints.empty()) {
    Points joints = performance.body.joints[static_cast<std::size_t>(at)];
    joints.rowwise() += performance.shift;
    result.truth.joints = person_joints(person, joints);
    result.truth.keypoints =
        person_keypoints(person, joints, result.truth.body, performance.body.shared.faces);
  }
  return result;
}

}  // namespace atelier
