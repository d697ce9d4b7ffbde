#include "bodymodel/underlying/underlying_sequence.h"

#include <algorithm>
#include <utility>

#include "core/error.h"

namespace atelier {
namespace {

/// So many of [0, count), spread evenly, the first and the last among them.
std::vector<Index> spread_frames(Index count, Index wanted) {
  std::vector<Index> frames;
  const Index taken = std::min(count, wanted);
  for (Index i = 0; i < taken; ++i) {
    frames.push_back(taken > 1 ? i * (count - 1) / (taken - 1) : count / 2);
  }
  return frames;
}

constexpr int kFirstIterations = 4;   // of a frame on its own
constexpr int kSecondIterations = 3;  // from there
constexpr double kUnseen = 0.05;      // weight of a frame that did not see a vertex

}  // namespace

OptionTable describe(UnderlyingSequenceOptions& options) {
  OptionTable table;
  table.add(describe(options.body));
  table.add("vote_reach", options.cover.reach, 0.001, 1, "m",
            "Distance from the body beyond which scans do not vote on what is covered");
  table.add("loose", options.cover.loose, 0, 5, "m",
            "Maximum distance of loose clothing, such as a skirt, from the skin that it covers");
  table.add("tight_gap", options.cover.tight_gap, 0.0001, 1, "m",
            "Maximum gap of tight clothes; raise it where clothes are thick");
  table.add("cover_frames", options.cover_frames, 1, 10000, "",
            "Number of frames, evenly spread, that determine what is covered");
  table.add("gap_frames", options.gap_frames, 0, 1000, "",
            "Number of these frames fitted beforehand to estimate the gap of clothes; 0: the gap "
            "as tracking has it");
  table.add("around", options.around, 0, 100, "frames",
            "Number of frames before and after that shape a frame");
  return table;
}

BodyCover sequence_cover(const Triangles& faces, Index count,
                         const std::function<PosedScan(Index frame)>& load,
                         const UnderlyingSequenceOptions& options) {
  CoverVotes votes;
  for (const Index frame : spread_frames(count, options.cover_frames)) {
    const PosedScan at = load(frame);
    const CoverVotes more = cover_votes(faces, at.posed, at.scan, options.cover);
    votes = votes.bare.size() == 0 ? more : votes + more;
  }
  if (votes.bare.size() == 0) {
    return {};
  }
  BodyCover cover = body_cover(faces, votes, options.cover);
  if (options.body.gap > 0) {
    cover.gap = options.body.gap;
    return cover;
  }
  // Poses' errors blur the gaps; bodies that lie on skin and stay inside show them sharper.
  UnderlyingBodyOptions untightened = options.body;
  untightened.tight_weight = 0;
  CoverVotes sharper;
  for (const Index frame : spread_frames(count, options.gap_frames)) {
    const PosedScan at = load(frame);
    if (at.scan.cover.faces.rows() == 0) {
      continue;
    }
    const UnderlyingBody body = underlying_body(faces, at.posed, at.scan, cover, {}, untightened);
    const CoverVotes more = cover_votes(faces, body.vertices, at.scan, options.cover);
    sharper = sharper.bare.size() == 0 ? more : sharper + more;
  }
  if (sharper.bare.size() > 0 && sharper.gaps.sum() > 0) {
    cover.gap = body_cover(faces, sharper, options.cover).gap;
  }
  return cover;
}

struct UnderlyingSequence::Alone {
  std::once_flag once;
  Points offsets;  // no rows: the frame has no scan
  Eigen::VectorXd support;
};

UnderlyingSequence::UnderlyingSequence(Triangles faces, Index count,
                                       std::function<PosedScan(Index frame)> load,
                                       const UnderlyingSequenceOptions& options)
    : faces_(std::move(faces)), load_(std::move(load)), options_(options) {
  ATELIER_CHECK(count >= 0, "a negative number of frames");
  cover_ = sequence_cover(faces_, count, load_, options_);
  for (Index i = 0; i < count; ++i) {
    alone_.push_back(std::make_shared<Alone>());
  }
}

const UnderlyingSequence::Alone& UnderlyingSequence::alone(Index frame) const {
  Alone& found = *alone_[static_cast<std::size_t>(frame)];
  std::call_once(found.once, [&] {
    const PosedScan at = load_(frame);
    if (at.scan.vertices.rows() > 0) {
      UnderlyingBodyOptions options = options_.body;
      options.iterations = std::min(options.iterations, kFirstIterations);
      UnderlyingBody body = underlying_body(faces_, at.posed, at.scan, cover_, {}, options);
      found.offsets = std::move(body.offsets);
      found.support = std::move(body.support);
    }
  });
  return found;
}

/// The mean of the offsets around a frame, of each vertex those frames first that saw it.
Points UnderlyingSequence::usual_offsets(Index frame) const {
  const auto count = static_cast<Index>(alone_.size());
  Points sum;
  Eigen::VectorXd weights;
  for (Index i = std::max<Index>(0, frame - options_.around);
       i <= std::min(count - 1, frame + options_.around); ++i) {
    const Alone& at = alone(i);
    if (at.offsets.rows() == 0) {
      continue;
    }
    if (sum.rows() == 0) {
      sum = Points::Zero(at.offsets.rows(), 3);
      weights = Eigen::VectorXd::Zero(at.offsets.rows());
    }
    const Eigen::VectorXd weight = at.support.array() + kUnseen;
    sum += weight.asDiagonal() * at.offsets;
    weights += weight;
  }
  return sum.rows() == 0 ? sum : Points(weights.cwiseInverse().asDiagonal() * sum);
}

UnderlyingBody UnderlyingSequence::at(Index frame) const {
  const auto count = static_cast<Index>(alone_.size());
  ATELIER_CHECK(frame >= 0 && frame < count, "no such frame");
  KnownOffsets known;
  known.start = alone(frame).offsets;
  UnderlyingBodyOptions options = options_.body;
  if (options.temporal) {
    known.usual = usual_offsets(frame);
    options.iterations = std::min(options.iterations, kSecondIterations);
  }
  const PosedScan at = load_(frame);
  return underlying_body(faces_, at.posed, at.scan, cover_, known, options);
}

}  // namespace atelier
