#include "registration/tracking/register_sequence.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <mutex>
#include <thread>

#include "core/error.h"

namespace atelier {
namespace {

/// State at the end of a chain of frames.
struct ChainEnd {
  GarmentTexture texture;
  GarmentTexture recent;              ///< as that row's images show it; empty: not taken yet
  Index last = -1;                    ///< row that was registered last
  Points vertices;                    ///< of that row
  Points before;                      ///< of the row before that one; no rows: there is none
  Eigen::VectorXd confidence;         ///< of that row, [V] in [0,1], local mean (cloth_confidence)
  Eigen::VectorXd confidence_before;  ///< of the row before that one
  Points drift;                       ///< of that row; no rows: unknown
  Eigen::VectorXd correlation;  ///< of that row's images at each vertex, 0 where none sees it;
                                ///< empty before any were compared
};

/// Frames that follow one from the other, from a window's anchor on.
struct Chain {
  std::mutex mutex;
  bool begun = false;  ///< the anchor is in it
  ChainEnd end;
};

/// Values of vertices averaged over their surroundings, 4 cm about.
Eigen::VectorXd around_each(const ClothModel& model, Eigen::VectorXd values) {
  constexpr int kRounds = 6;
  const Edges& edges = model.topology.edges;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::VectorXd sums = model.areas.cwiseProduct(values);
    Eigen::VectorXd weights = model.areas;
    for (Index e = 0; e < edges.rows(); ++e) {
      for (int k = 0; k < 2; ++k) {
        const int other = edges(e, 1 - k);
        sums[edges(e, k)] += model.areas[other] * values[other];
        weights[edges(e, k)] += model.areas[other];
      }
    }
    values = sums.cwiseQuotient(weights);
  }
  return values;
}

/// Reliability of each vertex of a registered frame, in [0,1]: a point that neither scan nor images
/// confirm says nothing about the velocity of the cloth. Where no images were compared, as
/// in the template's frame, the scan alone confirms it.
Eigen::VectorXd cloth_confidence(const ClothModel& model, const RegisteredGarment& garment) {
  constexpr double kLost = 0.4;
  constexpr double kFound = 0.7;
  const double all = garment.vertex_correlation.size() > 0 ? 1 : 0.5;  // that confidence can be
  const Eigen::ArrayXd confidence =
      around_each(model, garment.confidence.cast<double>() / all).array();
  return ((confidence - kLost) / (kFound - kLost)).max(0).min(1);
}

/// Factor on the body prior's weight at each vertex: the worse the images of the frame before
/// correlated around it, the higher. ICP correspondences do not resist sliding along the surface,
/// and their errors accumulate: without image evidence trousers turn round the hips by degrees a
/// frame, and so does the side of a sleeve that no camera sees.
Eigen::VectorXd firmness(const ClothModel& model, const Eigen::VectorXd& correlation) {
  constexpr double kMost = 20;
  const PhotometricOptions trusted;
  const Eigen::VectorXd mean = around_each(model, correlation);
  const Eigen::ArrayXd doubt =
      1 - ((mean.array() - trusted.bad) / (trusted.good - trusted.bad)).max(0).min(1);
  return (kMost * doubt.square()).max(1);
}

/// Mean correlation of the vertices that are seen.
double mean_visible(const Eigen::VectorXd& correlation) {
  return correlation.sum() /
         std::max<double>(1, static_cast<double>((correlation.array() != 0).count()));
}

/// Above this mean correlation the template's texture says all that images say.
constexpr double kMatchesWell = 0.65;

/// A window's frames, both ways from its anchor.
struct Window {
  Chain forward, backward;
};

}  // namespace

OptionTable describe(RegisterSequenceOptions& options) {
  OptionTable table;
  table.add(describe(options.fit));
  table.add("near", options.predict.near, 0.001, 10, "m",
            "Distance from the body beyond which cloth follows the body-driven prediction less");
  table.add(
      "home", options.predict.home, 0, 1, "",
      "Fraction by which cloth on the body returns to its place in the template in each frame");
  table.add("body_prior", options.predict.body_prior, 0, 100, "",
            "Weight of the body prior, which keeps cloth on the body from sliding, relative to the "
            "scan at 1; up to 20 times as much where the images of the frame before disagreed or "
            "do not show the cloth");
  table.add(
      "momentum", options.predict.momentum, 0, 1, "",
      "Fraction of its last motion relative to the body that cloth is predicted to continue with");
  table.add("recent_texture", options.recent_texture,
            "Comparison of images with those of the frame before as well as with the template's "
            "texture, for cloth without a print");
  table.add("window", options.window, 1, 100000, "frames",
            "Number of frames registered one from the other; shorter windows are distributed "
            "better over machines");
  return table;
}

struct RegisteredSequence::State {
  RegistrationModel model;
  RegistrationSource source;
  RegisterSequenceOptions options;
  std::mutex beginning;  // of what follows
  bool begun = false;
  RegisteredGarment origin;  ///< the template in its own frame
  GarmentTexture texture;
  std::mutex mutex;  // of what follows
  std::map<Index, FollowedFrame> done;
  std::map<Index, std::unique_ptr<Window>> windows;  // by first row

  /// All of a frame, with the detail of its views if that is compared.
  RegistrationFrame loaded(Index row) const {
    RegistrationFrame frame = source.load(row);
    if (options.fit.photometric && options.fit.photometric_detail > 0) {
      for (const ViewPyramid& view : frame.views) {
        frame.details.push_back(detail_view(view, options.fit.photometric_detail));
      }
    }
    return frame;
  }

  /// First row of the window of a row.
  Index first_row(Index row) const {
    const auto after = std::upper_bound(source.starts.begin(), source.starts.end(), row);
    const Index take = after == source.starts.begin() ? 0 : *(after - 1);
    return take + (row - take) / options.window * options.window;
  }
  /// One behind the last.
  Index end_row(Index row) const {
    const auto after = std::upper_bound(source.starts.begin(), source.starts.end(), row);
    const Index take = after == source.starts.end() ? source.rows : *after;
    return std::min(take, first_row(row) + options.window);
  }
  Index anchor(Index row) const {
    return std::clamp(source.template_row, first_row(row), end_row(row) - 1);
  }

  /// Whether a kept frame can be of this sequence: images have one number of sizes, and what the
  /// template's frame showed says how many channels. That one itself shows nothing new.
  bool may_be_of(Index row, const TextureGain& gain) const {
    if (gain.levels == 0 || row == source.template_row) {
      return gain.levels == 0;
    }
    return options.fit.photometric && gain.levels == options.fit.photometric_levels &&
           (texture.levels.empty() || gain.channels == texture.channels);
  }

  /// A frame that was followed, here or elsewhere; or null. Of others than the template's, once
  /// that has been registered.
  const FollowedFrame* finished(Index row) {
    const std::lock_guard lock(mutex);
    const auto found = done.find(row);
    if (found != done.end()) {
      return &found->second;
    }
    std::optional<FollowedFrame> kept;
    if (source.keeping.read) {
      kept = source.keeping.read(row, model);
    }
    if (kept && !may_be_of(row, kept->gain)) {
      kept.reset();  // followed again
    }
    return kept ? &done.emplace(row, std::move(*kept)).first->second : nullptr;
  }
  const FollowedFrame& finish(Index row, FollowedFrame frame) {
    if (source.keeping.write) {
      source.keeping.write(row, frame);
    }
    const std::lock_guard lock(mutex);
    return done.insert_or_assign(row, std::move(frame)).first->second;
  }

  /// Registers the template's own frame, once. It has the shape already; the images say nothing,
  /// since they are what the texture is made of.
  void begin() {
    const std::lock_guard lock(beginning);
    if (begun) {
      return;
    }
    RegistrationFrame frame = loaded(source.template_row);
    model.cloth.goes_on = covered_rim(model.cloth.topology, model.vertices, frame.scan);
    const FollowedFrame* kept = finished(source.template_row);
    if (kept == nullptr) {
      frame.body_prior = Eigen::VectorXd::Constant(model.vertices.rows(), 10);
      RegisterOptions fine = options.fit;
      fine.photometric = false;
      fine.rounds = 3;
      fine.reach = fine.final_reach;
      fine.rigid = fine.final_rigid;
      fine.bend = fine.final_bend;
      ShapeSolver solver(model.cloth);
      kept = &finish(source.template_row,
                     {register_garment(solver, model, model.vertices, frame, {}, fine), {}, {}});
    }
    origin = kept->garment;
    // A template is smoother than cloth, so that its edges are too short. One that came out much
    // shorter is crumpled, and says nothing of how long the cloth is.
    constexpr double kCrumpled = 0.5;
    const Edges& edges = model.cloth.topology.edges;
    for (Index e = 0; e < edges.rows(); ++e) {
      const double length =
          (origin.vertices.row(edges(e, 0)) - origin.vertices.row(edges(e, 1))).norm();
      model.cloth.lengths[e] = std::max(length, kCrumpled * model.cloth.lengths[e]);
    }
    if (options.fit.photometric) {
      const auto seen = garment_views(model, origin.vertices, frame);
      add_texture(texture, model.samples,
                  {model.cloth.topology, origin.vertices, compared_views(frame), seen});
      if (options.fit.code) {
        model.code = printed_codebook({model.cloth.topology, origin.vertices, frame.views, seen},
                                      {.reach = options.fit.code_reach});
      }
    }
    begun = true;
  }

  Window& window_of(Index row) {
    const std::lock_guard lock(mutex);
    std::unique_ptr<Window>& window = windows[first_row(row)];
    if (!window) {
      window = std::make_unique<Window>();
    }
    return *window;
  }

  /// The template in its own frame, from which every window begins.
  ChainEnd origin_end() const {
    ChainEnd end;
    end.texture = texture;
    end.last = source.template_row;
    end.vertices = origin.vertices;
    return end;
  }

  /// The texture as the images of a frame show it on cloth at x.
  GarmentTexture texture_in(const RegistrationFrame& frame, const Points& x) const {
    GarmentTexture shown;
    add_texture(shown, model.samples,
                {model.cloth.topology, x, compared_views(frame), garment_views(model, x, frame)});
    return shown;
  }

  /// A frame as it is registered from the end of a chain, without what it adds to the texture.
  FollowedFrame registered(const ChainEnd& end, Index row, RegistrationFrame& frame) const {
    ShapeSolver solver(model.cloth);
    const BodyDrivenCloth driven =
        body_driven(end.vertices, source.body_faces, source.body(end.last), frame.body.vertices);
    const BodyDrivenCloth home = body_driven(origin.vertices, source.body_faces,
                                             source.body(source.template_row), frame.body.vertices);
    Points start = predicted_cloth(solver, model.cloth, {end.vertices, driven, home, end.drift},
                                   options.predict);
    if (source.simulate && end.before.rows() > 0) {
      const Eigen::VectorXd confidence = end.confidence.cwiseMin(end.confidence_before);
      Points simulated =
          source.simulate({end.last, row, end.vertices, end.before, confidence, start});
      start = simulated.rows() > 0 ? std::move(simulated) : std::move(start);
    }
    frame.body_prior = options.predict.body_prior * closeness(driven, options.predict.near / 2);
    if (end.correlation.size() > 0) {
      frame.body_prior = frame.body_prior.cwiseProduct(firmness(model.cloth, end.correlation));
    }
    FollowedFrame result;
    std::vector<const GarmentTexture*> textures = {&end.texture};
    GarmentTexture recent;
    if (options.recent_texture && end.correlation.size() > 0 &&
        mean_visible(end.correlation) < kMatchesWell) {
      if (end.recent.levels.empty()) {  // kept by an earlier run
        recent = texture_in(loaded(end.last), end.vertices);
      }
      textures.push_back(end.recent.levels.empty() ? &recent : &end.recent);
    }
    result.garment = register_garment(solver, model, start, frame, textures, options.fit);
    result.drift = result.garment.vertices - driven.vertices;
    return result;
  }
  RegisteredGarment registered(const ChainEnd& end, Index row) const {
    RegistrationFrame frame = loaded(row);
    return registered(end, row, frame).garment;
  }

  /// Registers `row` from the end of a chain.
  /// @param recent  set to the texture as this frame shows it
  FollowedFrame follow(const ChainEnd& end, Index row, GarmentTexture& recent) const {
    RegistrationFrame frame = loaded(row);
    FollowedFrame result = registered(end, row, frame);
    if (row == anchor(row)) {
      result.drift.resize(0, 3);  // nothing is known of its speed
    }
    if (options.fit.photometric && !frame.views.empty()) {
      const Points& x = result.garment.vertices;
      GarmentTexture texture_now = end.texture;
      const auto seen = garment_views(model, x, frame);
      const ViewedCloth cloth{model.cloth.topology, x, compared_views(frame), seen};
      add_texture(texture_now, model.samples, cloth);
      result.gain = texture_gain(end.texture, texture_now);
      if (options.recent_texture &&
          mean_visible(result.garment.vertex_correlation) < kMatchesWell) {
        add_texture(recent, model.samples, cloth);
      }
    }
    return result;
  }

  /// A chain ends at the frame that was followed from its end.
  void append(Chain& chain, Index row, const FollowedFrame& frame) const {
    chain.end.before = chain.begun ? std::move(chain.end.vertices) : Points();
    chain.end.confidence_before = std::move(chain.end.confidence);
    chain.end.confidence = cloth_confidence(model.cloth, frame.garment);
    chain.begun = true;
    chain.end.last = row;
    chain.end.recent = {};
    chain.end.vertices = frame.garment.vertices;
    chain.end.drift = frame.drift;
    chain.end.correlation = frame.garment.vertex_correlation;
    add_gain(chain.end.texture, frame.gain, model.samples.areas.size());
  }

  /// Follows the next frame of a chain towards `goal`. False where there is nothing to do, or
  /// another one is at it.
  bool advance(Chain& chain, Index goal) {
    const std::unique_lock lock(chain.mutex, std::try_to_lock);
    if (!lock || finished(goal) != nullptr) {  // it may be beyond the goal meanwhile
      return false;
    }
    if (!chain.begun) {
      chain.end = origin_end();
    }
    while (!chain.begun || chain.end.last != goal) {
      const Index next =
          chain.begun ? chain.end.last + (goal > chain.end.last ? 1 : -1) : anchor(goal);
      const FollowedFrame* frame = finished(next);
      std::shared_ptr<void> reserved;
      if (frame == nullptr && source.keeping.reserve) {
        reserved = source.keeping.reserve(next);
        if (!reserved) {
          return false;
        }
        frame = finished(next);  // by whom it was reserved until now
      }
      if (frame == nullptr) {
        if (source.before_frame) {
          source.before_frame();
        }
        GarmentTexture recent;
        append(chain, next, finish(next, follow(chain.end, next, recent)));
        chain.end.recent = std::move(recent);
        return true;
      }
      append(chain, next, *frame);
    }
    return false;
  }

  /// The same of the chain that leads to a row. Both begin with the anchor, which the forward one
  /// follows.
  bool advance_to(Index row) {
    Window& window = window_of(row);
    const Index from = anchor(row);
    if (row < from && finished(from) != nullptr) {
      return advance(window.backward, row);
    }
    return advance(window.forward, std::max(row, from));
  }

  /// The same of any chain, those of the row's window first.
  bool advance_any(Index row) {
    Index first = first_row(row);
    do {
      const Index end = end_row(first);
      if (advance_to(end - 1) || advance_to(first)) {
        return true;
      }
      first = end % source.rows;
    } while (first != first_row(row));
    return false;
  }
};

RegisteredSequence::RegisteredSequence(const Garment& garment, RegistrationSource source,
                                       const RegisterSequenceOptions& options,
                                       const std::string& file)
    : state_(std::make_unique<State>()) {
  ATELIER_CHECK(source.rows > 0 && source.template_row >= 0 && source.template_row < source.rows,
                "the template's frame is one of the sequence");
  ATELIER_CHECK(options.window > 0, "a window has a frame");
  state_->model = registration_model(garment, options.fit, file);
  state_->source = std::move(source);
  state_->options = options;
}

RegisteredSequence::~RegisteredSequence() = default;

const RegistrationModel& RegisteredSequence::model() const {
  return state_->model;
}

Index RegisteredSequence::anchor(Index row) const {
  return state_->anchor(row);
}

const RegisteredGarment& RegisteredSequence::at(Index row) {
  constexpr std::chrono::milliseconds kPause(50);
  State& state = *state_;
  ATELIER_CHECK(row >= 0 && row < state.source.rows, "no such frame");
  state.begin();
  for (;;) {
    if (const FollowedFrame* frame = state.finished(row)) {
      return frame->garment;
    }
    if (!state.advance_to(row) && !state.finished(row) && !state.advance_any(row)) {
      if (state.source.before_frame) {
        state.source.before_frame();
      }
      std::this_thread::sleep_for(kPause);  // other processes tell nobody when they are done
    }
  }
}

RegisteredGarment RegisteredSequence::again(Index row, Index from, const Points& result) const {
  state_->begin();
  ChainEnd end = state_->origin_end();
  end.last = from;
  end.vertices = result;
  return state_->registered(end, row);
}

RegisteredGarment RegisteredSequence::from_template(Index row) const {
  state_->begin();
  return state_->registered(state_->origin_end(), row);
}

Index template_row_of(const Garment& garment, const RegistrationSource& source,
                      const std::string& file) {
  Index best = -1;
  double least = std::numeric_limits<double>::infinity();
  for (const Attachment& attachment : garment.attachments) {
    if (attachment.triangle >= source.body_faces.rows()) {
      throw DataError(file, "attachments", "triangle " + std::to_string(attachment.triangle),
                      "triangles of the body, which has " +
                          std::to_string(source.body_faces.rows()) + "; make the template again");
    }
  }
  for (Index row = 0; row < source.rows && !garment.attachments.empty(); ++row) {
    const Points body = source.body(row);
    double sum = 0;
    for (const Attachment& attachment : garment.attachments) {
      const auto corner = [&](int k) -> Eigen::Vector3d {
        return body.row(source.body_faces(attachment.triangle, k)).transpose();
      };
      const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
      const double length = normal.norm();
      const Eigen::Vector3d point = attachment.barycentric[0] * corner(0) +
                                    attachment.barycentric[1] * corner(1) +
                                    attachment.barycentric[2] * corner(2) +
                                    (length > 0 ? attachment.distance / length : 0) * normal;
      sum += (point - garment.mesh.vertices.row(attachment.vertex).transpose()).squaredNorm();
    }
    if (sum < least) {
      least = sum;
      best = row;
    }
  }
  return best;
}

}  // namespace atelier
