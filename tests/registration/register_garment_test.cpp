#include "registration/tracking/register_garment.h"

#include <Eigen/Geometry>
#include <map>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/random.h"
#include "registration/edge_paths.h"
#include "registration/flattening/cut_to_disks.h"
#include "registration/flattening/flat_pattern.h"
#include "registration/tracking/register_sequence.h"
#include "registration/tracking/registration_error.h"
#include "tests/registration/registered_shapes.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

constexpr std::uint8_t kCloth = 5;

Garment garment_of_tube(int around = 24, int along = 14) {
  Garment garment;
  garment.name = "tube";
  garment.mesh = fixtures::cloth_tube(around, along);
  return garment;
}

Mesh labelled(Mesh mesh, const Points& vertices, std::uint8_t label = kCloth) {
  mesh.vertices = vertices;
  mesh.labels.assign(static_cast<std::size_t>(vertices.rows()), label);
  return mesh;
}

/// A slim body inside the tube.
Mesh body_of_tube(int levels = 2) {
  Mesh body = fixtures::sphere(levels);
  body.vertices.col(0) *= 0.10;
  body.vertices.col(2) *= 0.10;
  body.vertices.col(1) = 0.35 * body.vertices.col(1).array() + 1.05;
  return body;
}

RegisterOptions shape_alone() {
  RegisterOptions options;
  options.photometric = false;
  return options;
}

TEST(RegisterGarment, MovedTube_IsRecovered) {
  const Garment garment = garment_of_tube();
  const RegistrationModel model = registration_model(garment);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.15, Eigen::Vector3d(1, 0, 0.3).normalized()).toRotationMatrix();
  const Eigen::RowVector3d centre(0, 1.05, 0);
  const Points moved = ((model.vertices.rowwise() - centre) * turn.transpose()).rowwise() +
                       (centre + Eigen::RowVector3d(0.03, 0.02, -0.02));
  const Mesh fine = fixtures::cloth_tube(60, 33);
  const Points scan = ((fine.vertices.rowwise() - centre) * turn.transpose()).rowwise() +
                      (centre + Eigen::RowVector3d(0.03, 0.02, -0.02));
  RegistrationFrame frame;
  frame.scan = garment_scan(labelled(fine, scan), {kCloth});
  ShapeSolver solver(model.cloth);
  const RegisteredGarment found =
      register_garment(solver, model, model.vertices, frame, {}, shape_alone());
  const Eigen::VectorXd before = (model.vertices - moved).rowwise().norm();
  const Eigen::VectorXd after = (found.vertices - moved).rowwise().norm();
  EXPECT_GT(before.mean(), 0.03);
  EXPECT_LT(after.mean(), 0.004);
  EXPECT_EQ(found.inverted, 0);
  EXPECT_GT(found.support, 0.9);
  EXPECT_LT(found.scan_rms, 0.003);
}

TEST(RegisterGarment, RegisteredTube_GivesItsPatternBack) {
  // From a moved scan with noise of 1 mm: the rectangle that the tube was cut from.
  const Garment garment = garment_of_tube();
  const RegistrationModel model = registration_model(garment);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.001);
  Mesh fine = fixtures::cloth_tube(60, 33);
  for (double& coordinate : fine.vertices.reshaped()) {
    coordinate += noise(random);
  }
  const Points scan = fine.vertices.rowwise() + Eigen::RowVector3d(0.02, 0.01, -0.02);
  RegistrationFrame frame;
  frame.scan = garment_scan(labelled(fine, scan), {kCloth});
  ShapeSolver solver(model.cloth);
  Mesh registered = garment.mesh;
  registered.vertices =
      register_garment(solver, model, model.vertices, frame, {}, shape_alone()).vertices;
  const Topology topology = topology_of(registered.faces, registered.vertices.rows());
  const std::vector<char> cut =
      cut_to_disks(topology, std::vector<char>(static_cast<std::size_t>(topology.edges.rows())),
                   edge_lengths(topology, registered.vertices));
  const FlatPattern flat = flatten_surface(registered, cut);
  const FlatMeasures measures = measure_flat(registered, flat);
  const double around = 2 * std::numbers::pi * 0.15;
  const double area = measures.area_ratio * face_areas(registered.vertices, registered.faces).sum();
  EXPECT_NEAR(area, 0.5 * around, 0.03 * 0.5 * around);
  EXPECT_NEAR(measures.seam_length, 0.5, 0.03 * 0.5);
  EXPECT_LT(measures.strain_p99, 0.03);
  EXPECT_LT(measures.seam_mismatch, 0.003);
  EXPECT_EQ(measures.inverted + measures.overlaps, 0);
}

TEST(RegisterGarment, StretchedTube_IsRecoveredFromItsOpenings) {
  const Garment garment = garment_of_tube();
  const RegistrationModel model = registration_model(garment);
  const auto stretched = [](Points points) {
    points.col(1) = 1.04 * (points.col(1).array() - 1.05) + 1.05;
    return points;
  };
  const Mesh fine = fixtures::cloth_tube(60, 33);
  RegistrationFrame frame;
  frame.scan = garment_scan(labelled(fine, stretched(fine.vertices)), {kCloth});
  RegisterOptions options = shape_alone();
  options.stretch = options.compress = 0.01;
  options.border_weight = 5;
  options.rounds = 30;
  options.rigid = 0.02;
  ShapeSolver solver(model.cloth);
  const RegisteredGarment found =
      register_garment(solver, model, model.vertices, frame, {}, options);
  const Points expected = stretched(model.vertices);
  // Nothing says how it is turned about its axis.
  EXPECT_LT((found.vertices - expected).col(1).cwiseAbs().mean(),
            0.4 * (model.vertices - expected).col(1).cwiseAbs().mean());
  EXPECT_EQ(found.inverted, 0);
}

TEST(RegisterGarment, TwistInvisibleInTheShape_IsFoundFromImages) {
  const Garment garment = garment_of_tube(30, 16);
  RegisterOptions options;
  options.photometric_levels = 3;
  options.sample_spacing = 0.008;
  const RegistrationModel model = registration_model(garment, options);
  const double angle = 0.06;
  RegistrationFrame before;
  before.views = fixtures::cylinder_views(3, fixtures::blotches);
  GarmentTexture texture;
  add_texture(texture, model.samples,
              {model.cloth.topology, model.vertices, before.views,
               garment_views(model, model.vertices, before)});
  const Mesh fine = fixtures::cloth_tube(60, 33);
  RegistrationFrame frame;
  frame.scan = garment_scan(labelled(fine, fine.vertices), {kCloth});
  frame.views = fixtures::cylinder_views(
      3, [=](double u, double y) { return 0.6 * fixtures::blotches(u - angle, y); });
  const Points expected = fixtures::screwed(model.vertices, angle, 0);
  ShapeSolver solver(model.cloth);
  const auto error = [&](const RegisterOptions& with) {
    return (register_garment(solver, model, model.vertices, frame, {&texture}, with).vertices -
            expected)
        .rowwise()
        .norm()
        .mean();
  };
  EXPECT_LT(error(options), 0.0015);
  options.photometric = false;
  EXPECT_GT(error(options), 0.005);
}

TEST(RegisterGarment, RegisteredCloth_StaysOutsideTheBody) {
  const Garment garment = garment_of_tube();
  const RegistrationModel model = registration_model(garment);
  RegistrationFrame frame;  // nothing was seen
  Mesh body = body_of_tube(4);
  body.vertices.col(0) *= 1.7;
  body.vertices.col(2) *= 1.7;
  frame.body = body_obstacle(body.vertices, body.faces);
  ShapeSolver solver(model.cloth);
  const auto registered = [&](bool collision) {
    RegisterOptions options = shape_alone();
    options.collision = collision;
    return register_garment(solver, model, model.vertices, frame, {}, options);
  };
  const auto deepest = [&](const Points& x) {
    double least = 0;
    const auto look = [&](const Eigen::RowVector3d& point) {
      const Eigen::Vector3d q(point.x() / 0.17, (point.y() - 1.05) / 0.35, point.z() / 0.17);
      least = std::min(least, 0.17 * (q.norm() - 1));
    };
    for (Index v = 0; v < x.rows(); ++v) {
      look(x.row(v));
    }
    for (const auto& face : garment.mesh.faces.rowwise()) {
      look(x(face, Eigen::all).colwise().mean());
    }
    return least;
  };
  const RegisteredGarment through = registered(false);
  EXPECT_LT(deepest(through.vertices), -0.015);
  EXPECT_GT(through.contact.inside, 0.2);
  EXPECT_NEAR(through.contact.depth, -deepest(through.vertices), 0.002);
  EXPECT_GT(through.contact.crossings, 10);
  const RegisteredGarment outside = registered(true);
  EXPECT_GT(deepest(outside.vertices), -0.0005);
  EXPECT_EQ(outside.contact.inside, 0);
  EXPECT_EQ(outside.contact.crossings, 0);
  EXPECT_EQ(outside.inverted, 0);
}

TEST(RegisterGarment, NoScan_KeepsThePrediction) {
  const Garment garment = garment_of_tube();
  const RegistrationModel model = registration_model(garment);
  ShapeSolver solver(model.cloth);
  const RegisteredGarment found =
      register_garment(solver, model, model.vertices, {}, {}, shape_alone());
  EXPECT_LT((found.vertices - model.vertices).cwiseAbs().maxCoeff(), 0.003);
  EXPECT_EQ(found.support, 0);
  EXPECT_EQ(found.confidence.maxCoeff(), 0);
}

TEST(RegisterGarment, LabelsCoveringNothing_GiveNoScan) {
  const Mesh tube = fixtures::cloth_tube(12, 4);
  EXPECT_EQ(garment_scan(labelled(tube, tube.vertices, 1), {kCloth}).faces.rows(), 0);
  EXPECT_EQ(garment_scan(tube, {kCloth}).faces.rows(), tube.faces.rows());  // no labels: all
}

TEST(RegisterGarment, SurfaceWithZeroConfidence_IsNoScan) {
  Mesh scan = labelled(fixtures::cloth_tube(12, 4), fixtures::cloth_tube(12, 4).vertices);
  const double middle = scan.vertices.col(1).mean();
  scan.confidence = (scan.vertices.col(1).array() > middle)
                        .select(Eigen::VectorXf::Ones(scan.vertices.rows()), 0);
  const GarmentScan part = garment_scan(scan, {kCloth});
  ASSERT_GT(part.faces.rows(), 0);
  EXPECT_LT(part.faces.rows(), scan.faces.rows());
  EXPECT_GT(part.vertices.col(1).minCoeff(), middle);
}

TEST(RegisterGarment, SpecksOfWrongLabels_AreLeftOut) {
  Mesh scan = labelled(fixtures::cloth_tube(20, 10), fixtures::cloth_tube(20, 10).vertices);
  const Index vertices = scan.vertices.rows();
  const Index faces = scan.faces.rows();
  scan.vertices.conservativeResize(vertices + 3, 3);
  scan.vertices.bottomRows(3) << 1, 1, 1, 1.01, 1, 1, 1, 1.01, 1;
  scan.faces.conservativeResize(faces + 1, 3);
  scan.faces.row(faces) << static_cast<int>(vertices), static_cast<int>(vertices + 1),
      static_cast<int>(vertices + 2);
  scan.labels.resize(static_cast<std::size_t>(vertices + 3), kCloth);
  EXPECT_EQ(garment_scan(scan, {kCloth}).faces.rows(), faces);
}

constexpr std::uint8_t kOver = 6;

/// Trousers of radius 0.15 m up to `hem`, and a wider tee from there on, over a slim body.
struct Layers {
  Mesh scan;
  TriangleTree body;
};
Layers layers(double hem = 1.1) {
  Mesh under = fixtures::cloth_tube(40, 40);
  Mesh over = under;
  over.vertices.col(0) *= 1.1;
  over.vertices.col(2) *= 1.1;
  under.vertices.col(1) = 0.8 + (hem - 0.8) / 0.5 * (under.vertices.col(1).array() - 0.8);
  over.vertices.col(1) = hem + 0.4 * (over.vertices.col(1).array() - 0.8);
  Layers both;
  const Index count = under.vertices.rows();
  both.scan.vertices.resize(2 * count, 3);
  both.scan.vertices << under.vertices, over.vertices;
  both.scan.faces.resize(2 * under.faces.rows(), 3);
  both.scan.faces << under.faces, (over.faces.array() + static_cast<int>(count)).matrix();
  both.scan.labels.assign(static_cast<std::size_t>(count), kCloth);
  both.scan.labels.resize(static_cast<std::size_t>(2 * count), kOver);
  const Mesh body = body_of_tube(3);
  both.body = build_tree(body.vertices, body.faces);
  return both;
}

TEST(GarmentScan, BorderCoveredByAnotherGarment_IsNoEnd) {
  const Layers both = layers();
  const GarmentScan under = garment_scan(both.scan, {kCloth});
  const GarmentScan over = garment_scan(both.scan, {kOver});
  ASSERT_EQ(under.border_vertices.size(), 80U);
  const GarmentScan left = without_covered_border(under, over, both.body);
  ASSERT_EQ(left.border_vertices.size(), 40U);  // the ankles
  for (const int v : left.border_vertices) {
    EXPECT_NEAR(left.vertices(v, 1), 0.8, 1e-9);
  }
  EXPECT_EQ(left.border, under.border);
  EXPECT_EQ(closest_point(left.border_tree, {0.15, 1.1, 0}).face,
            closest_point(left.border_tree, {0.15, 0.8, 0}).face);
  EXPECT_EQ(without_covered_border(over, under, both.body).border_vertices, over.border_vertices);
  // The rim of what was cut of the whole garment there goes on.
  const Mesh cloth = fixtures::cloth_tube(24, 14);
  Points at_hem = cloth.vertices;
  at_hem.col(1) = 0.8 + 0.6 * (at_hem.col(1).array() - 0.8);
  const std::vector<char> rim =
      covered_rim(topology_of(cloth.faces, cloth.vertices.rows()), at_hem, left);
  for (Index v = 0; v < at_hem.rows(); ++v) {
    EXPECT_EQ(rim[static_cast<std::size_t>(v)] != 0, at_hem(v, 1) > 1.1 - 1e-9) << v;
  }
}

TEST(GarmentScan, NoBodyOrOtherGarment_MakesEveryBorderAnEnd) {
  const Layers both = layers();
  const GarmentScan under = garment_scan(both.scan, {kCloth});
  const GarmentScan over = garment_scan(both.scan, {kOver});
  EXPECT_EQ(without_covered_border(under, over, {}).border_vertices, under.border_vertices);
  EXPECT_EQ(without_covered_border(under, {}, both.body).border_vertices, under.border_vertices);
  EXPECT_TRUE(without_covered_border({}, over, both.body).border_vertices.empty());
  const Mesh cloth = fixtures::cloth_tube(12, 4);
  const std::vector<char> rim =
      covered_rim(topology_of(cloth.faces, cloth.vertices.rows()), cloth.vertices, {});
  EXPECT_EQ(std::count(rim.begin(), rim.end(), 1), 0);
}

TEST(RegisterGarment, OverlyingHem_DoesNotPullTheClothAlong) {
  // The template ends where the tee did, at 1.1 m; now the tee hangs 1.5 cm lower, then higher.
  Garment garment = garment_of_tube();
  garment.mesh.vertices.col(1) = 0.8 + 0.6 * (garment.mesh.vertices.col(1).array() - 0.8);
  RegistrationModel model = registration_model(garment);
  for (const double hem : {1.085, 1.115}) {
    const Layers both = layers(hem);
    const auto moved = [&](bool covered) {
      RegistrationFrame frame;
      frame.scan = garment_scan(both.scan, {kCloth});
      if (covered) {
        const Layers at_first = layers();
        frame.scan = without_covered_border(std::move(frame.scan), garment_scan(both.scan, {kOver}),
                                            both.body);
        model.cloth.goes_on = covered_rim(
            model.cloth.topology, model.vertices,
            without_covered_border(garment_scan(at_first.scan, {kCloth}),
                                   garment_scan(at_first.scan, {kOver}), at_first.body));
      }
      RegisterOptions options = shape_alone();
      options.border_weight = 5;
      ShapeSolver solver(model.cloth);
      const Points x = register_garment(solver, model, model.vertices, frame, {}, options).vertices;
      double sum = 0;
      double count = 0;
      for (Index v = 0; v < x.rows(); ++v) {
        if (model.vertices(v, 1) > 1.05) {
          sum += x(v, 1) - model.vertices(v, 1);
          count += 1;
        }
      }
      model.cloth.goes_on.clear();
      return std::abs(sum / count);
    };
    const double pulled = moved(false);
    EXPECT_GT(pulled, 0.001) << hem;
    EXPECT_LT(moved(true), 0.3 * pulled) << hem;
  }
}

TEST(RegisterGarment, InvalidScanMeshes_AreRefused) {
  Mesh scan = labelled(fixtures::cloth_tube(6, 2), fixtures::cloth_tube(6, 2).vertices);
  scan.faces(0, 0) = 1000;
  ATELIER_EXPECT_REFUSED(garment_scan(scan, {kCloth}, "000001.h5"), DataError, "000001.h5");
  scan = labelled(fixtures::cloth_tube(6, 2), fixtures::cloth_tube(6, 2).vertices);
  scan.vertices(0, 0) = std::nan("");
  ATELIER_EXPECT_REFUSED(garment_scan(scan, {kCloth}), DataError, "finite");
}

TEST(RegisterGarment, InvertedTriangles_AreFound) {
  const Mesh mesh = fixtures::grid(6, 6);
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  EXPECT_TRUE(inverted_faces(topology, mesh.vertices).empty());
  Points folded = mesh.vertices;
  folded(24, 0) += 0.3;  // beyond its neighbours
  EXPECT_FALSE(inverted_faces(topology, folded).empty());
}

TEST(RegisterGarment, InvertedTriangles_AreRepaired) {
  const Garment garment = garment_of_tube();
  const RegistrationModel model = registration_model(garment);
  Points start = model.vertices;
  start.row(24 * 7) += Eigen::RowVector3d(0, 0.06, 0.0);
  ASSERT_FALSE(inverted_faces(model.cloth.topology, start).empty());
  RegisterOptions options = shape_alone();
  options.rounds = 1;
  options.rigid = options.final_rigid = 10;  // which keeps what is wrong
  ShapeSolver solver(model.cloth);
  EXPECT_EQ(register_garment(solver, model, start, {}, {}, options).inverted, 0);
}

// Crumpled places of every size, at borders too, where going to the middle of one's neighbours
// alone leaves what is folded as it is.
TEST(RegisterGarment, CrumpledRegions_AreRepairedAndTheRestStays) {
  const Mesh mesh = fixtures::cloth_tube(40, 20);
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random{seed, 5};
    const auto centre =
        static_cast<Index>(uniform(random) * static_cast<double>(mesh.vertices.rows()));
    const double reach = 0.02 + 0.1 * uniform(random);
    Points x = mesh.vertices;
    for (Index v = 0; v < x.rows(); ++v) {
      const double away = (mesh.vertices.row(v) - mesh.vertices.row(centre)).norm();
      for (int axis = 0; axis < 3 && away < reach; ++axis) {
        x(v, axis) += 0.05 * normal(random);
      }
    }
    const Points righted = turned_back(topology, x);
    EXPECT_TRUE(inverted_faces(topology, righted).empty()) << seed;
    for (Index v = 0; v < x.rows(); ++v) {
      if ((mesh.vertices.row(v) - mesh.vertices.row(centre)).norm() > reach + 0.25) {
        EXPECT_EQ(righted.row(v), x.row(v)) << seed;
      }
    }
  }
}

// Going to the middle of their neighbours, both vertices of such a fold come to the same place.
TEST(RegisterGarment, FoldAtTheRim_IsRepairedWithoutLosingArea) {
  const Mesh tube = fixtures::with_fold_at_rim(fixtures::cloth_tube(24, 14));
  const Topology topology = topology_of(tube.faces, tube.vertices.rows());
  ASSERT_EQ(manifold_defects(topology).inconsistent_edges.size(), 0U);
  ASSERT_EQ(inverted_faces(topology, tube.vertices).size(), 2U);
  const Points righted = turned_back(topology, tube.vertices);
  EXPECT_TRUE(inverted_faces(topology, righted).empty());
  EXPECT_GT(face_areas(righted, tube.faces).minCoeff(), 1e-6);
  EXPECT_EQ(righted.middleRows(24, 24 * 14), tube.vertices.middleRows(24, 24 * 14));
}

/// A tube that turns with its body, frame by frame.
struct Spin {
  Garment garment = garment_of_tube(20, 10);
  Mesh body = body_of_tube();
  Mesh fine = fixtures::cloth_tube(40, 20);
  RegistrationSource source;
  int loads = 0;

  explicit Spin(Index rows = 6, Index template_row = 2) {
    body.vertices.col(0) *= 1.3;  // not round: so that it shows that it turns
    source.rows = rows;
    source.template_row = template_row;
    source.body_faces = body.faces;
    source.body = [this](Index row) { return at(row, body.vertices); };
    source.load = [this](Index row) {
      ++loads;
      RegistrationFrame frame;
      frame.scan = garment_scan(labelled(fine, at(row, fine.vertices)), {kCloth});
      frame.body = body_obstacle(at(row, body.vertices), body.faces);
      return frame;
    };
  }
  Points at(Index row, const Points& points) const {
    return fixtures::screwed(points, 0.2 * static_cast<double>(row - source.template_row),
                             0.01 * static_cast<double>(row - source.template_row));
  }
};

RegisterSequenceOptions sequence_options(int window) {
  RegisterSequenceOptions options;
  options.fit = shape_alone();
  options.window = window;
  return options;
}

TEST(RegisterSequence, SpinningBody_IsFollowedByTheCloth) {
  Spin spin;
  RegisteredSequence sequence(spin.garment, spin.source, sequence_options(10));
  for (Index row = 0; row < spin.source.rows; ++row) {
    const Points expected = spin.at(row, spin.garment.mesh.vertices);
    EXPECT_LT((sequence.at(row).vertices - expected).rowwise().norm().mean(), 0.005) << row;
  }
}

// The second frame of a chain has no speed yet: cloth is simulated from the third on, from where
// the two before it are, and what comes back is where registration begins.
TEST(RegisterSequence, SimulatedStep_BeginsFromTheFramesBefore) {
  Spin spin(5, 2);
  std::map<Index, Index> from;
  std::map<Index, Points> here, before;
  spin.source.simulate = [&](const ClothStep& step) {
    EXPECT_EQ(step.confidence.size(), step.vertices.rows());
    from[step.to] = step.from;
    here[step.to] = step.vertices;
    before[step.to] = step.before;
    return spin.at(step.to, spin.garment.mesh.vertices);
  };
  RegisteredSequence sequence(spin.garment, spin.source, sequence_options(10));
  for (const Index row : {0, 4}) {
    const Points expected = spin.at(row, spin.garment.mesh.vertices);
    EXPECT_LT((sequence.at(row).vertices - expected).rowwise().norm().mean(), 0.005) << row;
  }
  EXPECT_EQ(from, (std::map<Index, Index>{{0, 1}, {4, 3}}));
  EXPECT_EQ(here.at(4), sequence.at(3).vertices);
  EXPECT_EQ(before.at(4), sequence.at(2).vertices);
  EXPECT_EQ(here.at(0), sequence.at(1).vertices);
  EXPECT_EQ(before.at(0), sequence.at(2).vertices);
}

TEST(RegisterSequence, SimulationWithoutAnAnswer_ChangesNothing) {
  Spin spin(5, 2);
  RegisteredSequence without(spin.garment, spin.source, sequence_options(10));
  spin.source.simulate = [](const ClothStep&) { return Points(0, 3); };
  RegisteredSequence with(spin.garment, spin.source, sequence_options(10));
  EXPECT_EQ(with.at(0).vertices, without.at(0).vertices);
}

// Other frames keep the lengths of its edges: one of none makes every energy no number, so that no
// frame takes a step.
TEST(RegisterSequence, FoldInTheTemplate_DoesNotStopOtherFrames) {
  Spin spin;
  spin.garment.mesh = fixtures::with_fold_at_rim(spin.garment.mesh);
  const Eigen::RowVector3d aside(0.03, 0, 0);
  spin.source.body = [&](Index) { return spin.body.vertices; };
  spin.source.load = [&](Index row) {
    RegistrationFrame frame;
    const Points scan =
        spin.fine.vertices.rowwise() + static_cast<double>(row - spin.source.template_row) * aside;
    frame.scan = garment_scan(labelled(spin.fine, scan), {kCloth});
    frame.body = body_obstacle(spin.body.vertices, spin.body.faces);
    return frame;
  };
  RegisteredSequence sequence(spin.garment, spin.source, sequence_options(10));
  const Points expected = spin.garment.mesh.vertices.rowwise() + aside;
  EXPECT_LT((sequence.at(3).vertices - expected).rowwise().norm().mean(), 0.005);
}

TEST(RegisterSequence, ClothOfPlainImages_StaysOnTheBody) {
  Spin spin(5, 0);
  const auto slid = [&](bool pictures) {
    RegistrationSource source = spin.source;
    source.body = [&](Index) { return spin.body.vertices; };
    source.load = [&, pictures](Index row) {
      RegistrationFrame frame;
      Points lifted = spin.fine.vertices;
      lifted.col(1).array() += 0.006 * static_cast<double>(row);
      frame.scan = garment_scan(labelled(spin.fine, lifted), {kCloth});
      frame.body = body_obstacle(spin.body.vertices, spin.body.faces);
      if (pictures) {  // of plain cloth
        frame.views = fixtures::cylinder_views(2, [](double, double) { return 0.4; });
      }
      return frame;
    };
    RegisterSequenceOptions options;
    options.fit.photometric_levels = 2;
    RegisteredSequence sequence(spin.garment, source, options);
    return (sequence.at(4).vertices - spin.garment.mesh.vertices).col(1).mean();
  };
  const double before = slid(false);
  EXPECT_GT(before, 0.002);
  EXPECT_LT(slid(true), 0.8 * before);
}

TEST(RegisterSequence, PartUnseenInImages_IsHeldByTheBodyPrior) {
  // A printed tube that stands still, seen from one side alone. On the other side the scan is
  // lifted frame by frame, as ICP correspondences would slide cloth.
  Spin spin(5, 0);
  RegistrationSource source = spin.source;
  source.body = [&](Index) { return spin.body.vertices; };
  std::vector<ViewPyramid> views = fixtures::cylinder_views(2, fixtures::blotches);
  views.resize(1);
  Eigen::RowVector3d eye = camera_center(views.front().camera).transpose();
  eye[1] = 0;  // to which side
  source.load = [&](Index row) {
    RegistrationFrame frame;
    Points scan = spin.fine.vertices;
    for (Index v = 0; v < scan.rows(); ++v) {
      scan(v, 1) += scan.row(v).dot(eye) < 0 ? 0.006 * static_cast<double>(row) : 0;
    }
    frame.scan = garment_scan(labelled(spin.fine, scan), {kCloth});
    frame.body = body_obstacle(spin.body.vertices, spin.body.faces);
    frame.views = views;
    return frame;
  };
  const auto slid = [&](double body_prior) {
    RegisterSequenceOptions options;
    options.fit.photometric_levels = 2;
    options.predict.body_prior = body_prior;
    RegisteredSequence sequence(spin.garment, source, options);
    const Points& x = sequence.at(4).vertices;
    double sum = 0;
    double count = 0;
    for (Index v = 0; v < x.rows(); ++v) {
      if (spin.garment.mesh.vertices.row(v).dot(eye) < -0.05) {
        sum += x(v, 1) - spin.garment.mesh.vertices(v, 1);
        count += 1;
      }
    }
    return sum / count;
  };
  EXPECT_LT(slid(0.1), 0.8 * slid(0));
}

TEST(RegisterSequence, AnyFrameOrderAndThreadCount_GivesTheSameFrames) {
  Spin first_spin;
  Spin second_spin;
  RegisteredSequence forwards(first_spin.garment, first_spin.source, sequence_options(4));
  RegisteredSequence backwards(second_spin.garment, second_spin.source, sequence_options(4));
  std::vector<Points> results;
  set_thread_count(1);
  for (Index row = 0; row < 6; ++row) {
    results.push_back(forwards.at(row).vertices);
  }
  set_thread_count(3);
  for (Index row = 5; row >= 0; --row) {
    EXPECT_EQ(backwards.at(row).vertices, results[static_cast<std::size_t>(row)]) << row;
  }
  set_thread_count(0);
}

TEST(RegisterSequence, Window_NeedsNoOtherWindow) {
  Spin spin(8, 0);
  RegisteredSequence sequence(spin.garment, spin.source, sequence_options(4));
  sequence.at(5);
  EXPECT_EQ(spin.loads, 3);  // the template's, 4 and 5
  EXPECT_EQ(sequence.anchor(5), 4);
  EXPECT_EQ(sequence.anchor(3), 0);
}

TEST(RegisterSequence, Takes_AreSeparateWindows) {
  Spin spin(8, 0);
  spin.source.starts = {0, 3};
  RegisteredSequence sequence(spin.garment, spin.source, sequence_options(100));
  EXPECT_EQ(sequence.anchor(2), 0);
  EXPECT_EQ(sequence.anchor(7), 3);
}

TEST(RegisterSequence, TrackingBackwards_GivesTheSameFrame) {
  Spin spin;
  RegisteredSequence sequence(spin.garment, spin.source, sequence_options(10));
  const Points third = sequence.at(3).vertices;
  const Points again = sequence.again(3, 4, sequence.at(4).vertices).vertices;
  EXPECT_LT((again - third).rowwise().norm().mean(), 0.005);
  EXPECT_LT((sequence.from_template(4).vertices - sequence.at(4).vertices).rowwise().norm().mean(),
            0.005);
}

TEST(RegisterSequence, TemplateFrame_IsFoundFromItsAttachments) {
  Spin spin(5, 3);
  const Points body = spin.source.body(3);
  for (int v = 0; v < 20; ++v) {
    const ClosestPoint on = closest_point(build_tree(body, spin.body.faces),
                                          spin.garment.mesh.vertices.row(v).transpose());
    const Eigen::Vector3d a = body.row(spin.body.faces(on.face, 0)).transpose();
    const Eigen::Vector3d b = body.row(spin.body.faces(on.face, 1)).transpose();
    const Eigen::Vector3d c = body.row(spin.body.faces(on.face, 2)).transpose();
    const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
    spin.garment.attachments.push_back(
        {v, on.face, on.barycentric,
         normal.dot(spin.garment.mesh.vertices.row(v).transpose() - on.point)});
  }
  EXPECT_EQ(template_row_of(spin.garment, spin.source), 3);
  spin.garment.attachments[0].triangle = 100000;
  ATELIER_EXPECT_REFUSED(template_row_of(spin.garment, spin.source, "dress.h5"), DataError,
                         "make the template again");
  spin.garment.attachments.clear();
  EXPECT_EQ(template_row_of(spin.garment, spin.source), -1);
}

TEST(RegisterSequence, DefectiveTemplates_AreRefused) {
  Spin spin;
  spin.garment.mesh.faces.conservativeResize(spin.garment.mesh.faces.rows() + 1, 3);
  spin.garment.mesh.faces.row(spin.garment.mesh.faces.rows() - 1) << 0, 1, 50;
  ATELIER_EXPECT_REFUSED(
      RegisteredSequence(spin.garment, spin.source, sequence_options(4), "dress.h5"), DataError,
      "dress.h5");
  Spin other;
  other.source.template_row = 99;
  ATELIER_EXPECT_REFUSED(RegisteredSequence(other.garment, other.source, sequence_options(4)),
                         LogicError, "one of the sequence");
}

TEST(RegistrationError, Slides_AreErrorsOfPointsOnly) {
  const Mesh mesh = fixtures::cloth_tube(200, 40);
  const TrueBinding binding = bind_to_truth(mesh.vertices, mesh.vertices, mesh.faces);
  const Points slid = fixtures::screwed(mesh.vertices, 0.02, 0);
  const RegistrationError error =
      registration_error(slid, mesh.faces, binding, mesh.vertices, mesh.faces, {});
  EXPECT_EQ(static_cast<Index>(error.points.size()), mesh.vertices.rows());
  EXPECT_NEAR(error.points[100], 0.003, 1e-4);
  EXPECT_NEAR(error.tangential[100], 0.003, 1e-4);
  EXPECT_LT(error.to_truth, 1e-4);
  EXPECT_LT(error.from_truth, 1e-4);
}

TEST(RegistrationError, UnseenVertices_DoNotCount) {
  const Mesh mesh = fixtures::cloth_tube(10, 4);
  const TrueBinding binding = bind_to_truth(mesh.vertices, mesh.vertices, mesh.faces);
  const std::vector<char> none(static_cast<std::size_t>(mesh.vertices.rows()), 0);
  const RegistrationError error =
      registration_error(mesh.vertices, mesh.faces, binding, mesh.vertices, mesh.faces, none);
  EXPECT_TRUE(error.points.empty());
  EXPECT_EQ(error.from_truth, 0);
}

TEST(RegistrationError, BindingOfAnotherTemplate_IsRefused) {
  const Mesh mesh = fixtures::cloth_tube(10, 4);
  const TrueBinding binding = bind_to_truth(mesh.vertices, mesh.vertices, mesh.faces);
  ATELIER_EXPECT_REFUSED(registration_error(mesh.vertices.topRows(5), Triangles(0, 3), binding,
                                            mesh.vertices, mesh.faces, {}),
                         LogicError, "another template");
  ATELIER_EXPECT_REFUSED(bind_to_truth(mesh.vertices, mesh.vertices, Triangles(0, 3)), LogicError,
                         "has faces");
}

}  // namespace
}  // namespace atelier
