#include "registration/register_sequence.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "core/error.h"

namespace atelier {
namespace {

/// What a chain of frames knows at its end.
struct Chain {
  GarmentTexture texture;
  Index last = -1;       ///< row that was registered last
  Points drift;          ///< of that row
  Points body;           ///< of that row
  Eigen::VectorXd told;  ///< correlation of that row's pictures at each vertex, 0 where none sees
                         ///< it; empty before any were compared
};

/// How much firmer each vertex is held on the body by how badly pictures agreed around it, 4 cm
/// about, in the frame before. Nearest points do not know what slides, but their errors add up to a
/// way along the surface: where no picture speaks against it, trousers turn round the hips by
/// degrees a frame, and the side of a sleeve that no camera sees round the arm.
Eigen::VectorXd firmness(const ClothModel& model, Eigen::VectorXd told) {
  constexpr double kMost = 20;
  constexpr int kRounds = 6;
  const PhotometricOptions trusted;
  const Edges& edges = model.topology.edges;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::VectorXd sums = model.areas.cwiseProduct(told);
    Eigen::VectorXd weights = model.areas;
    for (Index e = 0; e < edges.rows(); ++e) {
      for (int k = 0; k < 2; ++k) {
        const int other = edges(e, 1 - k);
        sums[edges(e, k)] += model.areas[other] * told[other];
        weights[edges(e, k)] += model.areas[other];
      }
    }
    told = sums.cwiseQuotient(weights);
  }
  const Eigen::ArrayXd doubt =
      1 - ((told.array() - trusted.bad) / (trusted.good - trusted.bad)).max(0).min(1);
  return (kMost * doubt.square()).max(1);
}

/// A window's frames, both ways from its anchor.
struct Window {
  std::mutex mutex;
  std::map<Index, RegisteredGarment> done;
  Chain forward, backward;
  bool begun = false;
};

}  // namespace

OptionTable describe(RegisterSequenceOptions& options) {
  OptionTable table;
  table.add(describe(options.fit));
  table.add("near", options.predict.near, 0.001, 10, "m",
            "Cloth farther from the body follows it less");
  table.add("home", options.predict.home, 0, 1, "",
            "Share with which cloth on the body tends to its place in the template");
  table.add("hold", options.predict.hold, 0, 100, "",
            "What keeps cloth on the body from sliding, against the scan's 1; up to 20 times as "
            "much where pictures of the frame before did not agree, or none shows it");
  table.add("momentum", options.predict.momentum, 0, 1, "",
            "Share of its last motion against the body that cloth is expected to go on with");
  table.add("window", options.window, 1, 100000, "frames",
            "Registered one from the other; shorter ones split better over machines");
  return table;
}

struct RegisteredSequence::State {
  RegistrationModel model;
  RegistrationSource source;
  RegisterSequenceOptions options;
  std::mutex mutex;  // of what follows
  bool begun = false;
  RegisteredGarment origin;  ///< the template in its own frame
  Points origin_body;
  GarmentTexture texture;
  std::map<Index, std::unique_ptr<Window>> windows;  // by first row

  /// First row of the window of a row.
  Index first_row(Index row) const {
    const auto after = std::upper_bound(source.starts.begin(), source.starts.end(), row);
    const Index take = after == source.starts.begin() ? 0 : *(after - 1);
    return take + (row - take) / options.window * options.window;
  }

  Index anchor(Index row) const {
    const Index first = first_row(row);
    const auto after = std::upper_bound(source.starts.begin(), source.starts.end(), row);
    const Index end = after == source.starts.end() ? source.rows : *after;
    return std::clamp(source.template_row, first, std::min(end, first + options.window) - 1);
  }

  /// Registers the template's own frame, once. It has the shape already; the pictures say nothing,
  /// since they are what the texture is made of.
  void begin() {
    const std::lock_guard lock(mutex);
    if (begun) {
      return;
    }
    RegistrationFrame frame = source.load(source.template_row);
    model.cloth.goes_on = covered_rim(model.cloth.topology, model.vertices, frame.scan);
    frame.hold = Eigen::VectorXd::Constant(model.vertices.rows(), 10);
    RegisterOptions fine = options.fit;
    fine.photometric = false;
    fine.rounds = 3;
    fine.reach = fine.final_reach;
    fine.rigid = fine.final_rigid;
    fine.bend = fine.final_bend;
    ShapeSolver solver(model.cloth);
    origin = register_garment(solver, model, model.vertices, frame, {}, fine);
    origin_body = frame.body.vertices;
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
      add_texture(texture, model.samples, origin.vertices, model.cloth.topology.faces, frame.views,
                  seen);
      if (options.fit.code) {
        model.code = printed_code(model.cloth.topology, origin.vertices, frame.views, seen,
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

  /// Registers `row` from the end of a chain, which then ends there.
  RegisteredGarment follow(Chain& chain, const Points& before, Index row) const {
    RegistrationFrame frame = source.load(row);
    ShapeSolver solver(model.cloth);
    const RiddenCloth ridden =
        ride_on_body(before, source.body_faces, chain.body, frame.body.vertices);
    const RiddenCloth home =
        ride_on_body(origin.vertices, source.body_faces, origin_body, frame.body.vertices);
    const Points start =
        predicted_cloth(solver, model.cloth, before, ridden, home, chain.drift, options.predict);
    frame.hold = options.predict.hold * closeness(ridden, options.predict.near / 2);
    if (chain.told.size() > 0) {
      frame.hold = frame.hold.cwiseProduct(firmness(model.cloth, chain.told));
    }
    RegisteredGarment result =
        register_garment(solver, model, start, frame, chain.texture, options.fit);
    chain.drift = result.vertices - ridden.vertices;
    chain.body = frame.body.vertices;
    chain.last = row;
    chain.told = result.told;
    if (options.fit.photometric && !frame.views.empty()) {
      add_texture(chain.texture, model.samples, result.vertices, model.cloth.topology.faces,
                  frame.views, garment_views(model, result.vertices, frame));
    }
    return result;
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
  State& state = *state_;
  ATELIER_CHECK(row >= 0 && row < state.source.rows, "no such frame");
  state.begin();
  Window& window = state.window_of(row);
  const std::lock_guard lock(window.mutex);
  const Index anchor = state.anchor(row);
  if (!window.begun) {
    Chain chain;
    chain.texture = state.texture;
    chain.last = state.source.template_row;
    chain.body = state.origin_body;
    if (anchor == state.source.template_row) {
      window.done[anchor] = state.origin;
    } else {
      window.done[anchor] = state.follow(chain, state.origin.vertices, anchor);
      chain.drift.resize(0, 3);  // nothing is known of its speed
    }
    window.forward = chain;
    window.backward = std::move(chain);
    window.begun = true;
  }
  Chain& chain = row > anchor ? window.forward : window.backward;
  const Index step = row > anchor ? 1 : -1;
  while (!window.done.contains(row)) {
    const Index next = chain.last + step;
    window.done[next] = state.follow(chain, window.done.at(chain.last).vertices, next);
  }
  return window.done.at(row);
}

RegisteredGarment RegisteredSequence::again(Index row, Index from, const Points& result) const {
  state_->begin();
  Chain chain;
  chain.body = state_->source.body(from);
  chain.texture = state_->texture;
  return state_->follow(chain, result, row);
}

RegisteredGarment RegisteredSequence::from_template(Index row) const {
  state_->begin();
  Chain chain;
  chain.body = state_->origin_body;
  chain.texture = state_->texture;
  return state_->follow(chain, state_->origin.vertices, row);
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
