#include "registration/tracking/register_garment.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/normals.h"
#include "core/saturating_cast.h"
#include "registration/rim_vertices.h"
#include "registration/tracking/unfolded.h"

namespace atelier {
namespace {

double between(double first, double last, double share) {
  return first * std::pow(last / first, share);
}

double fourth_power(double value) {
  return value * value * value * value;
}

/// Weights that hold the cloth together, `share` of the way from coarse to fine.
ClothTerms shape_terms(const RegistrationModel& model, const Points& start, const Points& x,
                       const RegisterOptions& options, double share) {
  ClothTerms terms;
  terms.stretch = options.stretch * options.stretch;
  terms.compress = options.compress * options.compress;
  terms.bend = fourth_power(between(options.bend, options.final_bend, share));
  terms.edge_weights =
      rigid_weights(model.cloth, between(options.rigid, options.final_rigid, share));
  terms.edge_vectors = turned_edges(model.cloth.topology.edges, terms.edge_weights, start, x);
  return terms;
}

void add_rows(std::vector<SurfaceRow>& rows, const std::vector<SurfaceRow>& more) {
  rows.insert(rows.end(), more.begin(), more.end());
}

/// Correspondences with scan and body, `share` of the way from coarse to fine. A scan has more
/// vertices than cloth: in each step as many of them pull, others in the next.
Eigen::VectorXd add_geometry(ClothTerms& terms, const RegistrationModel& model, const Points& x,
                             const TriangleTree& tree, const RegistrationFrame& frame,
                             const RegisterOptions& options, double share, int step) {
  ScanRowOptions rows;
  rows.reach = between(options.reach, options.final_reach, share);
  rows.scale = rows.reach / 2;
  rows.border_reach = rows.reach;
  rows.border_weight = options.border_weight;
  constexpr Index kMost = 8;
  rows.every = static_cast<int>(std::clamp<Index>(frame.scan.vertices.rows() / x.rows(), 1, kMost));
  rows.first = step % rows.every;
  ScanRows scan = scan_rows(model.cloth, x, tree, frame.scan, rows);
  add_rows(terms.rows, scan.rows);
  if (options.collision) {
    add_rows(terms.rows, body_rows(model.cloth, x, frame.body, {.gap = options.gap}));
  }
  return std::move(scan.support);
}

/// Rows that keep vertices from sliding along the surface at `start`.
std::vector<SurfaceRow> body_prior_rows(const RegistrationModel& model, const Points& start,
                                        const Eigen::VectorXd& body_prior) {
  std::vector<SurfaceRow> rows;
  constexpr double kLetGo = 0.008;  // m; cloth that must slide farther is held no more
  const Points normals = vertex_normals(start, model.cloth.topology.faces);
  for (Index v = 0; v < body_prior.size(); ++v) {
    const Eigen::Vector3d normal = normals.row(v).transpose();
    if (normal.isZero(0)) {  // folded flat: no surface to slide along
      continue;
    }
    const Eigen::Vector3d first = normal.unitOrthogonal();
    for (const Eigen::Vector3d& along : {first, Eigen::Vector3d(normal.cross(first))}) {
      SurfaceRow row;
      const int vertex = static_cast<int>(v);
      row.vertices = {vertex, vertex, vertex};
      row.normal = along;
      row.offset = start.row(v).dot(along);
      row.weight = body_prior[v] * model.cloth.areas[v];
      row.scale = kLetGo;
      rows.push_back(row);
    }
  }
  return rows;
}

double strain_quantile(const ClothModel& model, const Points& x, double quantile) {
  std::vector<double> strains;
  for (Index e = 0; e < model.topology.edges.rows(); ++e) {
    const double length =
        (x.row(model.topology.edges(e, 0)) - x.row(model.topology.edges(e, 1))).norm();
    strains.push_back(std::abs(length / model.lengths[e] - 1));
  }
  const auto at =
      saturating_cast<std::ptrdiff_t>(quantile * static_cast<double>(strains.size() - 1));
  std::nth_element(strains.begin(), strains.begin() + at, strains.end());
  return strains[static_cast<std::size_t>(at)];
}

double rms_to_scan(const GarmentScan& scan, const Points& x, double reach) {
  if (scan.faces.rows() == 0) {
    return 0;
  }
  double sum = 0;
  double count = 0;
  for (const ClosestPoint& closest : closest_points(scan.tree, x, reach)) {
    if (closest.face >= 0) {
      sum += closest.squared_distance;
      count += 1;
    }
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

}  // namespace

OptionTable describe(RegisterOptions& options) {
  OptionTable table;
  table.add("rounds", options.rounds, 1, 100, "",
            "Number of rounds of ICP correspondences, with one solver step each, for the shape");
  table.add(
      "reach", options.reach, 0.005, 1, "m",
      "Maximum distance of ICP correspondences in the first round; raise it where motion is fast");
  table.add("final_reach", options.final_reach, 0.002, 1, "m",
            "Maximum distance of ICP correspondences in the last round");
  table.add("rigid", options.rigid, 0.001, 10, "m",
            "Length over which the predicted shape is preserved in the first round");
  table.add(
      "final_rigid", options.final_rigid, 0.0001, 10, "m",
      "Length over which the predicted shape is preserved in the last round; longer is smoother");
  table.add("bend", options.bend, 0.0001, 1, "m",
            "Size below which folds are smoothed in the first round");
  table.add("final_bend", options.final_bend, 0.0001, 1, "m",
            "Size below which folds are smoothed in the last round; raise it for noisy scans");
  table.add("stretch", options.stretch, 0, 10, "m",
            "Length that sets the stretching stiffness: a stretch of 1% costs as much as a "
            "distance of 1% of this");
  table.add("compress", options.compress, 0, 10, "m",
            "Length that sets the stiffness against compression, as for stretch; lower, since "
            "folds finer than the triangles shorten cloth");
  table.add("border_weight", options.border_weight, 0, 100, "",
            "Weight of the edges of openings relative to the surface");
  table.add("collision", options.collision, "Penetration removal between cloth and body");
  table.add("gap", options.gap, 0, 0.05, "m", "Gap that cloth keeps from the body");
  table.add("photometric", options.photometric,
            "Photometric term, by which images determine sliding along the surface; off where "
            "images are not reliable");
  table.add("photometric_levels", options.photometric_levels, 1, 6, "",
            "Number of levels of the image pyramid, each half the size of the one before; more "
            "where motion is fast");
  table.add("photometric_steps", options.photometric_steps, 1, 20, "",
            "Maximum number of steps at each level; more where motion is fast");
  table.add("photometric_detail", options.photometric_detail, 0, 100, "px",
            "Radius at each level within which images lose their mean before they are compared, so "
            "that shading, which moves with folds, does not drag cloth; 0: none is taken");
  table.add("settled", options.settled, 0, 0.01, "m",
            "Mean motion of the cloth in a step below which a level has converged; 0: all steps "
            "are taken");
  table.add(
      "photometric_weight", options.photometric_weight, 0, 1, "m2",
      "Weight of a colour difference of one standard deviation, relative to a squared distance");
  table.add("sample_spacing", options.sample_spacing, 0.0005, 0.1, "m",
            "Spacing of the points of the cloth whose colours are compared");
  table.add(
      "code", options.code,
      "Matching of coded prints, no two points of which look alike, however far the cloth slid");
  table.add("code_reach", options.code_reach, 0.01, 10, "m",
            "Maximum distance that a coded print may have slid; larger takes longer");
  table.add("code_weight", options.code_weight, 0, 100, "",
            "Weight of a code match relative to the scan at 1");
  return table;
}

RegistrationModel registration_model(const Garment& garment, const RegisterOptions& options,
                                     const std::string& file) {
  RegistrationModel model;
  model.cloth = cloth_model(garment.mesh.vertices, garment.mesh.faces, file);
  model.vertices = garment.mesh.vertices;
  model.samples = cloth_samples(garment.mesh.vertices, garment.mesh.faces, options.sample_spacing);
  return model;
}

std::vector<int> inverted_faces(const Topology& topology, const Points& x) {
  const Triangles& faces = topology.faces;
  Points area_normals(faces.rows(), 3);
  Points sums = Points::Zero(x.rows(), 3);
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d a = x.row(faces(f, 0)).transpose();
    const Eigen::Vector3d b = x.row(faces(f, 1)).transpose();
    const Eigen::Vector3d c = x.row(faces(f, 2)).transpose();
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    area_normals.row(f) = normal.transpose();
    for (int k = 0; k < 3; ++k) {
      sums.row(faces(f, k)) += normal.transpose();
    }
  }
  std::vector<int> wrong;
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector3d around = sums.row(faces(f, 0)) + sums.row(faces(f, 1)) +
                                      sums.row(faces(f, 2)) - 3 * area_normals.row(f);
    if (around.dot(area_normals.row(f)) < 0) {
      wrong.push_back(static_cast<int>(f));
    }
  }
  return wrong;
}

Points turned_back(const Topology& topology, Points x) {
  constexpr int kPasses = 80;
  constexpr int kPassesOfARing = 10;
  const Adjacency around = vertex_neighbors(topology);
  const Adjacency faces_around = vertex_faces(topology);
  const std::vector<char> rim = rim_vertices(topology);
  for (int pass = 0; pass < kPasses; ++pass) {
    const std::vector<int> wrong = inverted_faces(topology, x);
    if (wrong.empty()) {
      break;
    }
    std::vector<char> marked(static_cast<std::size_t>(x.rows()), 0);
    std::vector<int> turned(static_cast<std::size_t>(x.rows()), 0);
    for (const int f : wrong) {
      for (int k = 0; k < 3; ++k) {
        marked[static_cast<std::size_t>(topology.faces(f, k))] = 1;
        ++turned[static_cast<std::size_t>(topology.faces(f, k))];
      }
    }
    for (int ring = 0; ring < pass / kPassesOfARing; ++ring) {
      const std::vector<char> inner = marked;
      for (Index v = 0; v < x.rows(); ++v) {
        for (const int w : around[v]) {
          marked[static_cast<std::size_t>(v)] |= inner[static_cast<std::size_t>(w)];
        }
      }
    }
    const Points before = x;
    for (Index v = 0; v < x.rows(); ++v) {
      const auto at = static_cast<std::size_t>(v);
      if (marked[at] == 0) {
        continue;
      }
      Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
      for (const int w : around[v]) {
        middle += before.row(w) / static_cast<double>(around[v].size());
      }
      const bool all = turned[at] == static_cast<int>(faces_around[v].size());
      x.row(v) += (rim[at] != 0 && all ? 2 : 0.5) * (middle - before.row(v));
    }
  }
  return x;
}

std::vector<std::vector<float>> garment_views(const RegistrationModel& model, const Points& x,
                                              const RegistrationFrame& frame) {
  const TriangleTree own = build_tree(x, model.cloth.topology.faces);
  return vertex_views(x, model.cloth.topology.faces, frame.views,
                      {&own, &frame.body.tree, &frame.other});
}

RegisteredGarment register_garment(ShapeSolver& solver, const RegistrationModel& model,
                                   const Points& start, const RegistrationFrame& frame,
                                   const std::vector<const GarmentTexture*>& textures,
                                   const RegisterOptions& options) {
  const Triangles& faces = model.cloth.topology.faces;
  ATELIER_CHECK(start.rows() == model.cloth.topology.vertex_count && start.allFinite(),
                "a start of another garment");
  RegisteredGarment result;
  Points x = start;
  TriangleTree tree = build_tree(x, faces);
  const std::vector<SurfaceRow> held = body_prior_rows(model, start, frame.body_prior);
  Eigen::VectorXd support = Eigen::VectorXd::Zero(x.rows());
  for (int round = 0; round < options.rounds; ++round) {
    const double share = options.rounds > 1 ? static_cast<double>(round) / (options.rounds - 1) : 1;
    ClothTerms terms = shape_terms(model, start, x, options, share);
    support = add_geometry(terms, model, x, tree, frame, options, share, round);
    add_rows(terms.rows, held);
    x = solver.lower(terms, x);
    tree = refit_tree(std::move(tree), x);
  }
  std::vector<SurfaceRow> read;
  if (options.code && model.code.descriptors.cols() > 0 && !frame.views.empty()) {
    // The second time also what lay too far off, or was not seen from there.
    constexpr int kReadings = 2;
    constexpr int kSteps = 6;
    for (int reading = 0; reading < kReadings; ++reading) {
      const CodeMatches readings = match_code(
          model.code, {model.cloth.topology, x, frame.views, garment_views(model, x, frame)});
      read = code_rows(model.code, readings, model.cloth.topology, x, options.code_weight);
      result.code_read = static_cast<int>(readings.kept.size());
      result.code_contradicted = readings.contradicted;
      for (int step = 0; step < kSteps && !read.empty(); ++step) {
        const double share = 0.5 + 0.5 * step / (kSteps - 1);
        ClothTerms terms = shape_terms(model, start, x, options, share);
        support = add_geometry(terms, model, x, tree, frame, options, share, step);
        add_rows(terms.rows, held);
        add_rows(terms.rows, read);
        x = solver.lower(terms, x);
        tree = refit_tree(std::move(tree), x);
      }
    }
  }
  // Places are millimetres apart: what is finer, images say.
  constexpr double kFiner = 0.1;
  for (SurfaceRow& row : read) {
    row.weight *= kFiner;
  }
  Eigen::VectorXd correlation = Eigen::VectorXd::Constant(x.rows(), -1);
  Eigen::VectorXi views = Eigen::VectorXi::Zero(x.rows());
  if (options.photometric && !frame.views.empty() && !textures.empty() &&
      !textures.front()->levels.empty()) {
    PhotometricOptions photometric;
    photometric.weight = options.photometric_weight;
    const int levels = static_cast<int>(
        std::min(textures.front()->levels.size(), frame.views.front().levels.size()));
    for (int level = levels - 1; level >= 0; --level) {
      const auto seen = garment_views(model, x, frame);
      for (int step = 0; step < options.photometric_steps; ++step) {
        ClothTerms terms = shape_terms(model, start, x, options, 1);
        support = add_geometry(terms, model, x, tree, frame, options, 1, step);
        add_rows(terms.rows, held);
        add_rows(terms.rows, read);
        PhotometricTerm pictures =
            photometric_term({model.cloth.topology, x, compared_views(frame), seen}, model.samples,
                             textures, level, photometric);
        terms.quadratics = std::move(pictures.quadratics);
        terms.origin = x;
        const Points moved = solver.lower(terms, x);
        const double move = (moved - x).rowwise().norm().mean();
        x = moved;
        tree = refit_tree(std::move(tree), x);
        correlation = std::move(pictures.correlation);
        views = std::move(pictures.views);
        ++result.picture_steps;
        if (move < options.settled) {
          break;
        }
      }
    }
  }
  const std::vector<Points> shapes = {start, model.vertices};
  x = options.collision
          ? clear_of_body(solver, model.cloth, std::move(x), frame.body, options.gap, shapes)
          : unfolded(model.cloth.topology, std::move(x), shapes).vertices;
  result.contact = body_contact(x, faces, frame.body);
  result.inverted = static_cast<int>(inverted_faces(model.cloth.topology, x).size());
  result.vertices = std::move(x);
  result.confidence.resize(support.size());
  double compared = 0;
  double correlations = 0;
  double twice = 0;
  for (Index v = 0; v < support.size(); ++v) {
    const double picture = views[v] > 0 ? std::clamp(correlation[v], 0.0, 1.0) : 0;
    result.confidence[v] = static_cast<float>(0.5 * support[v] + 0.5 * picture);
    compared += views[v] > 0 ? 1 : 0;
    correlations += views[v] > 0 ? correlation[v] : 0;
    twice += views[v] > 1 ? 1 : 0;
  }
  result.vertex_correlation =
      views.maxCoeff() > 0 ? (views.array() > 0).select(correlation, 0) : Eigen::VectorXd();
  result.support = support.dot(model.cloth.areas) / model.cloth.areas.sum();
  result.correlation = compared > 0 ? correlations / compared : 0;
  result.seen = twice / static_cast<double>(support.size());
  result.scan_rms = rms_to_scan(frame.scan, result.vertices, options.final_reach);
  result.strain_p95 = strain_quantile(model.cloth, result.vertices, 0.95);
  return result;
}

}  // namespace atelier
