#include "registration/flat_pattern.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/edge_paths.h"
#include "registration/find_seams.h"
#include "registration/garment_pattern_json.h"
#include "registration/offset_outline.h"
#include "registration/open_to_discs.h"
#include "registration/parametric_patterns.h"
#include "registration/pattern_garment.h"
#include "registration/pattern_pieces.h"
#include "registration/smooth_surface.h"
#include "tests/registration/pattern_files.h"
#include "tests/support/shapes.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<char> no_cut(const Topology& topology) {
  return std::vector<char>(static_cast<std::size_t>(topology.edges.rows()), 0);
}

Topology topology(const Mesh& mesh) {
  return topology_of(mesh.faces, mesh.vertices.rows());
}

std::vector<char> opened(const Mesh& mesh) {
  const Topology whole = topology(mesh);
  return opened_to_discs(whole, no_cut(whole), edge_lengths(whole, mesh.vertices));
}

TEST(CutSurface, WithoutCutsIsTheSurface) {
  const Mesh mesh = fixtures::tube(8, 4);
  const SurfaceCut cut = cut_surface(topology(mesh), no_cut(topology(mesh)));
  EXPECT_EQ(cut.panel_count, 1);
  EXPECT_EQ(static_cast<Index>(cut.source.size()), mesh.vertices.rows());
}

TEST(CutSurface, LabelsPartPanels) {
  const Mesh mesh = fixtures::grid(6, 4);
  std::vector<int> labels;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    labels.push_back(mesh.vertices(mesh.faces(f, 0), 0) < 0.49 ? 3 : 8);
  }
  const Topology whole = topology(mesh);
  const SurfaceCut cut = cut_surface(whole, cut_between_labels(whole, labels));
  EXPECT_EQ(cut.panel_count, 2);
  EXPECT_GT(static_cast<Index>(cut.source.size()), mesh.vertices.rows());
}

TEST(CutSurface, RefusesWhatIsNoEdge) {
  const Mesh mesh = fixtures::grid(3, 3);
  try {
    cut_at_edges(topology(mesh), {{0, 15}});
    FAIL() << "not refused";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("ends of an edge"));
  }
  EXPECT_THROW(cut_surface(topology(mesh), {}), LogicError);
  EXPECT_THROW(cut_between_labels(topology(mesh), {1}), LogicError);
}

TEST(OpenToDiscs, TubesSpheresAndToriBecomeDiscs) {
  for (const Mesh& mesh : {fixtures::tube(12, 5), fixtures::sphere(2), fixtures::torus(16, 8)}) {
    const SurfaceCut cut = cut_surface(topology(mesh), opened(mesh));
    const Topology open = topology_of(cut.faces, static_cast<Index>(cut.source.size()));
    EXPECT_EQ(cut.panel_count, 1);
    EXPECT_EQ(euler_characteristic(open), 1);
    EXPECT_EQ(boundary_loops(open).size(), 1U);
  }
}

TEST(OpenToDiscs, ATubeIsOpenedAlongTheShortestWay) {
  const Mesh mesh = fixtures::tube(12, 5, 2);
  const std::vector<char> cut = opened(mesh);
  const std::vector<double> lengths = edge_lengths(topology(mesh), mesh.vertices);
  double length = 0;
  for (std::size_t e = 0; e < cut.size(); ++e) {
    length += cut[e] != 0 ? lengths[e] : 0;
  }
  EXPECT_NEAR(length, 2, 1e-9);
}

TEST(OpenToDiscs, RefusesNegativeCosts) {
  const Mesh mesh = fixtures::tube(12, 5);
  const Topology whole = topology(mesh);
  std::vector<double> costs(static_cast<std::size_t>(whole.edges.rows()), -1);
  EXPECT_THROW(opened_to_discs(whole, no_cut(whole), costs), LogicError);
}

TEST(FlattenSurface, ATubeBecomesARectangle) {
  const Mesh mesh = fixtures::tube(24, 8, 2);
  const FlatPattern pattern = flatten_surface(mesh, opened(mesh));
  const FlatMeasures measures = measure_flat(mesh, pattern);
  EXPECT_EQ(pattern.cut.panel_count, 1);
  EXPECT_EQ(measures.inverted, 0);
  EXPECT_EQ(measures.overlaps, 0);
  EXPECT_LT(measures.strain_max, 1e-3);
  EXPECT_NEAR(measures.area_ratio, 1, 1e-4);
  ASSERT_EQ(pattern.seams.size(), 1U);
  EXPECT_NEAR(measures.seam_length, 2, 1e-3);
  EXPECT_LT(measures.seam_mismatch, 1e-6);
  // Grain along y: it is as high as the tube.
  EXPECT_NEAR(pattern.vertices.col(1).maxCoeff(), 2, 0.01);
  EXPECT_NEAR(pattern.vertices.col(0).maxCoeff(), 48 * std::sin(std::numbers::pi / 24), 0.02);
}

TEST(FlattenSurface, SeamsOfASphereHaveEqualSides) {
  const Mesh mesh = fixtures::sphere(3);
  const Topology whole = topology(mesh);
  std::vector<int> labels;  // eight segments
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      middle += mesh.vertices.row(mesh.faces(f, k)).transpose();
    }
    labels.push_back((middle.x() > 0 ? 1 : 0) + (middle.y() > 0 ? 2 : 0) +
                     (middle.z() > 0 ? 4 : 0));
  }
  const FlatPattern pattern = flatten_surface(mesh, cut_between_labels(whole, labels));
  const FlatMeasures measures = measure_flat(mesh, pattern);
  EXPECT_EQ(pattern.cut.panel_count, 8);
  EXPECT_EQ(pattern.seams.size(), 12U);
  EXPECT_EQ(measures.inverted, 0);
  EXPECT_LT(measures.seam_mismatch, 0.003);
  EXPECT_LT(measures.strain_p99, 0.15);
}

TEST(FlattenSurface, TheRestShapeOfTheGarmentIsThePattern) {
  const Mesh mesh = fixtures::tube(16, 6, 1);
  const FlatPattern pattern = flatten_surface(mesh, opened(mesh));
  const Garment garment = garment_of(mesh, pattern);
  EXPECT_NO_THROW(check_garment(garment));
  EXPECT_EQ(garment.boundaries.size(), 2U);
  EXPECT_EQ(garment.rest_faces.rows(), mesh.faces.rows());
}

/// Vertices of seams joined, as weld_seams of the simulation does; where each pattern vertex went.
Mesh welded(const Garment& garment, std::vector<int>& of_vertex) {
  of_vertex.resize(static_cast<std::size_t>(garment.mesh.vertices.rows()));
  for (std::size_t i = 0; i < of_vertex.size(); ++i) {
    of_vertex[i] = static_cast<int>(i);
  }
  const auto find = [&](int v) {
    while (of_vertex[static_cast<std::size_t>(v)] != v) {
      v = of_vertex[static_cast<std::size_t>(v)];
    }
    return v;
  };
  for (const Seam& seam : garment.seams) {
    for (std::size_t i = 0; i < seam.a.size(); ++i) {
      const int a = find(seam.a[i]);
      const int b = find(seam.b[i]);
      of_vertex[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  Mesh mesh = garment.mesh;
  for (std::size_t v = 0; v < of_vertex.size(); ++v) {
    of_vertex[v] = find(static_cast<int>(v));
  }
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      mesh.faces(f, k) = of_vertex[static_cast<std::size_t>(mesh.faces(f, k))];
    }
  }
  return mesh;
}

/// The largest difference of an edge of the panels' outlines, against the pattern's, as a share of
/// the longest edge; flat patterns of panels placed in the world, unsewn but bent.
double outline_error(const SewingPattern& sewing) {
  const Garment garment = garment_from_pattern(sewing, {.edge_length = 0.03});
  const Topology whole = topology(garment.mesh);
  const FlatPattern flat = flatten_surface(garment.mesh, no_cut(whole));
  EXPECT_EQ(flat.cut.panel_count, static_cast<int>(sewing.panels.size()));
  double worst = 0;
  for (const std::vector<int>& loop : boundary_loops(whole)) {
    double was = 0;
    double is = 0;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const int a = loop[i];
      const int b = loop[(i + 1) % loop.size()];
      was += (garment.rest.row(a) - garment.rest.row(b)).norm();
      int cut_a = -1;
      int cut_b = -1;
      for (std::size_t c = 0; c < flat.cut.source.size(); ++c) {
        cut_a = flat.cut.source[c] == a ? static_cast<int>(c) : cut_a;
        cut_b = flat.cut.source[c] == b ? static_cast<int>(c) : cut_b;
      }
      is += (flat.vertices.row(cut_a) - flat.vertices.row(cut_b)).norm();
    }
    worst = std::max(worst, std::abs(is / was - 1));
  }
  return worst;
}

TEST(FlattenSurface, GivesOurPatternsBack) {
  const TailorMeasures measures;
  EXPECT_LT(outline_error(skirt_pattern(measures)), 0.01);
  EXPECT_LT(outline_error(tee_pattern(measures)), 0.01);
  EXPECT_LT(outline_error(trousers_pattern(measures)), 0.01);
  EXPECT_LT(outline_error(dress_pattern(measures)), 0.01);
}

TEST(FlattenSurface, GivesRealPatternsBack) {
  for (const char* name :
       {"basic tee/tee.json", "skirts/skirt_4_panels.json", "pants/pants_straight_sides.json"}) {
    ATELIER_TEST_FILE(file, std::string("garments/pattern_generator/Patterns/") + name);
    std::ifstream stream(file);
    const std::string text((std::istreambuf_iterator<char>(stream)), {});
    EXPECT_LT(outline_error(garment_pattern_from_json(text, name)), 0.01) << name;
  }
}

/// Where the lines of a skirt panel's two sewn edges meet, and the angle of the first.
struct Sector {
  Eigen::Vector2d apex;
  double from;
};

Sector sector_of(const Panel& panel) {
  std::vector<Eigen::Vector2d> points;
  for (const PanelEdge& edge : panel.edges) {
    if (edge.name.empty()) {
      points.emplace_back(panel.corners.row(edge.start).transpose());
      points.emplace_back(panel.corners.row(edge.end).transpose());
    }
  }
  Eigen::Matrix2d lines;
  lines << points[1] - points[0], points[2] - points[3];
  const Eigen::Vector2d share = lines.inverse() * (points[2] - points[0]);
  const Eigen::Vector2d apex = points[0] + share.x() * (points[1] - points[0]);
  // Angles from straight down, so that a panel's are about 0.
  const auto angle = [&](const Eigen::Vector2d& p) {
    return std::atan2((p - apex).x(), -(p - apex).y());
  };
  return {apex, std::min(angle(points[0]), angle(points[2]))};
}

TEST(FlattenSurface, GivesSewnPanelsBackThroughTheirSeams) {
  // A skirt rolled into the cone that its sectors make: an exactly inextensible drape, welded. Cut
  // along the pattern's seams, its panels are those of the pattern.
  SkirtOptions options;
  options.flare = 1.2;
  const SewingPattern sewing = skirt_pattern({}, options);
  Garment garment = garment_from_pattern(sewing, {.edge_length = 0.02});
  const double sine = 2 * options.flare / (2 * std::numbers::pi);
  // Panel coordinates: `rest` holds the panels side by side; their outlines come first, in order.
  std::vector<Eigen::RowVector2d> moved;
  for (std::size_t p = 0; p < sewing.panels.size(); ++p) {
    const auto face = std::find(garment.panels.begin(), garment.panels.end(), static_cast<int>(p)) -
                      garment.panels.begin();
    int first = garment.rest_faces(face, 0);
    for (Index f = face; f < garment.rest_faces.rows(); ++f) {
      if (garment.panels[static_cast<std::size_t>(f)] == static_cast<int>(p)) {
        first = std::min(first, garment.rest_faces.row(f).minCoeff());
      }
    }
    const Panel& panel = sewing.panels[p];
    moved.emplace_back(panel.corners.row(panel.edges.front().start) - garment.rest.row(first));
  }
  std::vector<char> placed(static_cast<std::size_t>(garment.mesh.vertices.rows()), 0);
  for (Index f = 0; f < garment.mesh.faces.rows(); ++f) {
    const int p = garment.panels[static_cast<std::size_t>(f)];
    const Panel& panel = sewing.panels[static_cast<std::size_t>(p)];
    const Sector sector = sector_of(panel);
    for (int k = 0; k < 3; ++k) {
      const int v = garment.mesh.faces(f, k);
      if (placed[static_cast<std::size_t>(v)] != 0) {
        continue;
      }
      placed[static_cast<std::size_t>(v)] = 1;
      const Eigen::Vector2d at =
          (garment.rest.row(v) + moved[static_cast<std::size_t>(p)]).transpose() - sector.apex;
      const double turn = (std::atan2(at.x(), -at.y()) - sector.from + p * options.flare) / sine;
      garment.mesh.vertices.row(v) << at.norm() * sine * std::sin(turn),
          -at.norm() * std::sqrt(1 - sine * sine), at.norm() * sine * std::cos(turn);
    }
  }
  for (const Seam& seam : garment.seams) {
    for (std::size_t i = 0; i < seam.a.size(); ++i) {
      ASSERT_LT(
          (garment.mesh.vertices.row(seam.a[i]) - garment.mesh.vertices.row(seam.b[i])).norm(),
          1e-3);
    }
  }
  std::vector<int> joined;
  const Mesh mesh = welded(garment, joined);
  const Topology whole = topology(mesh);
  std::vector<std::pair<int, int>> ends;
  for (const Seam& seam : garment.seams) {
    for (std::size_t i = 1; i < seam.a.size(); ++i) {
      ends.emplace_back(joined[static_cast<std::size_t>(seam.a[i - 1])],
                        joined[static_cast<std::size_t>(seam.a[i])]);
    }
  }
  const FlatPattern flat = flatten_surface(mesh, cut_at_edges(whole, ends));
  const FlatMeasures measures = measure_flat(mesh, flat);
  EXPECT_EQ(flat.cut.panel_count, static_cast<int>(sewing.panels.size()));
  EXPECT_EQ(flat.seams.size(), garment.seams.size());
  EXPECT_LT(measures.strain_p99, 0.03);
  EXPECT_LT(measures.seam_mismatch, 0.003);
  // Every run of the outline, sewn or open, is as long as the pattern's.
  double sewn = 0;
  double was_sewn = 0;
  double outline = 0;
  double was_outline = 0;
  const Topology panels = topology_of(flat.cut.faces, static_cast<Index>(flat.cut.source.size()));
  for (Index e = 0; e < panels.edges.rows(); ++e) {
    if (corners_of_edge(panels, e).size() != 1) {
      continue;
    }
    const int face = corners_of_edge(panels, e).front() / 3;
    const int k = corners_of_edge(panels, e).front() % 3;
    const double is =
        (flat.vertices.row(panels.edges(e, 0)) - flat.vertices.row(panels.edges(e, 1))).norm();
    const double was = (garment.rest.row(garment.rest_faces(face, k)) -
                        garment.rest.row(garment.rest_faces(face, (k + 1) % 3)))
                           .norm();
    const bool seam = corners_of_edge(whole, whole.face_edges(face, k)).size() == 2;
    (seam ? sewn : outline) += is;
    (seam ? was_sewn : was_outline) += was;
  }
  EXPECT_NEAR(sewn, was_sewn, 0.01 * was_sewn);
  EXPECT_NEAR(outline, was_outline, 0.01 * was_outline);
}

template <class Act>
void expect_refused(const Act& act, const std::string& words) {
  try {
    act();
    FAIL() << "not refused";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr(words));
  }
}

TEST(CheckFlattenable, RefusesBadSurfaces) {
  expect_refused([] { check_flattenable(Mesh{}, "a.obj"); }, "a.obj");
  Mesh mesh = fixtures::grid(3, 3);
  mesh.vertices(2, 2) = std::numeric_limits<double>::infinity();
  expect_refused([&] { check_flattenable(mesh); }, "finite");
  const Mesh fin = fixtures::mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}},
                                     {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});
  expect_refused([&] { check_flattenable(fin); }, "three triangles");
  Mesh turned = fixtures::grid(2, 2);
  std::swap(turned.faces(0, 1), turned.faces(0, 2));
  expect_refused([&] { check_flattenable(turned); }, "opposite orientation");
  Mesh twice = fixtures::grid(2, 2);
  twice.faces.row(1) = twice.faces.row(0);
  expect_refused([&] { check_flattenable(twice); }, "twice");
  Mesh point = fixtures::grid(2, 2);
  point.faces(0, 1) = point.faces(0, 0);
  expect_refused([&] { check_flattenable(point); }, "three different");
}

TEST(FlattenSurface, RefusesPanelsThatAreNoDiscsByName) {
  const Mesh tube = fixtures::tube(8, 3);
  expect_refused([&] { flatten_surface(tube, no_cut(topology(tube))); }, "panel 0");
  const Mesh sphere = fixtures::sphere(1);
  expect_refused([&] { flatten_surface(sphere, no_cut(topology(sphere))); }, "closed surface");
  EXPECT_THROW(flatten_surface(tube, {}), LogicError);
}

TEST(FlattenSurface, RefusesTrianglesWithoutArea) {
  Mesh mesh = fixtures::grid(3, 3);
  mesh.vertices.row(5) = mesh.vertices.row(4);
  expect_refused([&] { flatten_surface(mesh, no_cut(topology(mesh))); }, "no area");
}

/// A sheet of 0.3 x 0.3 m in the plane y = 0, with waves of that length (m) and a height of 1 mm.
Mesh wavy_sheet(double wave) {
  Mesh mesh = fixtures::grid(60, 60);
  mesh.vertices *= 0.3 / (mesh.vertices.maxCoeff() - mesh.vertices.minCoeff());
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {  // with a crest in the middle
    const double turn = wave > 0 ? (mesh.vertices(v, 0) - 0.15) / wave : 0.25;
    mesh.vertices(v, 1) = 0.001 * std::cos(2 * std::numbers::pi * turn);
  }
  return mesh;
}

TEST(SmoothedSurface, PlanesStayWithTheirRims) {
  const Mesh sheet = wavy_sheet(0);
  EXPECT_LT((smoothed_surface(sheet, 0.02) - sheet.vertices).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(SmoothedSurface, AWaveOfTwoPiReachKeepsHalfItsHeightAndLongOnesAllOfIt) {
  const auto height_in_the_middle = [](double wave, double reach) {
    const Mesh sheet = wavy_sheet(wave);
    const Points smooth = smoothed_surface(sheet, reach);
    double most = 0;
    for (Index v = 0; v < smooth.rows(); ++v) {
      if ((sheet.vertices.row(v) - sheet.vertices.colwise().mean()).norm() < 0.06) {
        most = std::max(most, smooth(v, 1));
      }
    }
    return most;
  };
  constexpr double kReach = 0.008;
  EXPECT_NEAR(height_in_the_middle(2 * std::numbers::pi * kReach, kReach), 0.0005, 5e-5);
  EXPECT_GT(height_in_the_middle(0.2, kReach), 0.00098);
  EXPECT_LT(height_in_the_middle(0.02, kReach), 0.00004);
  EXPECT_EQ(smoothed_surface(wavy_sheet(0.05), 0), wavy_sheet(0.05).vertices);
}

TEST(SmoothedSurface, NegativeReachRefused) {
  EXPECT_THROW(smoothed_surface(wavy_sheet(0), -1), LogicError);
}

/// The pattern's panels stiffen where those of the search did.
FlattenOptions laid_as_found(const FindSeamsOptions& find) {
  FlattenOptions options;
  options.panel.even = stiffening_of(find.stretch);
  return options;
}

TEST(FindSeams, ConeAndTubeNeedNoMoreThanASeam) {
  Mesh mesh = fixtures::tube(32, 10, 0.6);
  mesh.vertices.col(0) *= 0.2;
  mesh.vertices.col(2) *= 0.2;
  FindSeamsOptions options;
  options.front_and_back = false;
  const FoundSeams found = find_seams(mesh, no_cut(topology(mesh)), options);
  EXPECT_TRUE(found.reached);
  EXPECT_EQ(found.added, 0);
  const FlatPattern pattern = flatten_surface(mesh, found.cut);
  EXPECT_EQ(pattern.cut.panel_count, 1);
}

TEST(FindSeams, FrontAndBackOfATubeAreItsHalves) {
  Mesh mesh = fixtures::tube(32, 10, 0.6);
  mesh.vertices.col(0) *= 0.2;
  mesh.vertices.col(2) *= 0.2;
  const FoundSeams found = find_seams(mesh, no_cut(topology(mesh)));
  EXPECT_TRUE(found.reached);
  const FlatPattern pattern = flatten_surface(mesh, found.cut);
  EXPECT_EQ(pattern.cut.panel_count, 2);
  EXPECT_NEAR(measure_flat(mesh, pattern).seam_length, 1.2, 0.05);
}

TEST(FindSeams, AHalfSphereIsCutUntilTheStretchIsWithinBounds) {
  Mesh sphere = fixtures::sphere(3);
  Mesh half;
  half.vertices = sphere.vertices * 0.12;
  half.faces.resize(0, 3);
  for (Index f = 0; f < sphere.faces.rows(); ++f) {
    if (sphere.vertices(sphere.faces(f, 0), 1) + sphere.vertices(sphere.faces(f, 1), 1) +
            sphere.vertices(sphere.faces(f, 2), 1) >
        0) {
      half.faces.conservativeResize(half.faces.rows() + 1, 3);
      half.faces.row(half.faces.rows() - 1) = sphere.faces.row(f);
    }
  }
  FindSeamsOptions options;
  options.stretch = 0.06;
  options.front_and_back = false;
  const FoundSeams found = find_seams(half, no_cut(topology(half)), options);
  EXPECT_TRUE(found.reached);
  EXPECT_GT(found.added, 0);
  const FlatPattern pattern = flatten_surface(half, found.cut, laid_as_found(options));
  const FlatMeasures measures = measure_flat(half, pattern);
  EXPECT_LT(measures.strain_p99, 0.066);
  EXPECT_EQ(measures.inverted, 0);
  EXPECT_EQ(measures.overlaps, 0);
}

TEST(FindSeams, GivenSeamsStayAndNeedlessOnesAreSewnAgain) {
  // A tube's side is all it needs; a ring that was given stays.
  Mesh mesh = fixtures::tube(32, 10, 0.6);
  mesh.vertices.col(0) *= 0.2;
  mesh.vertices.col(2) *= 0.2;
  const Topology whole = topology(mesh);
  std::vector<int> upper;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    upper.push_back(mesh.vertices.col(1)(mesh.faces.row(f)).maxCoeff() > 0.301 ? 1 : 0);
  }
  const std::vector<char> ring = cut_between_labels(whole, upper);
  FindSeamsOptions options;
  options.front_and_back = false;
  const FoundSeams found = find_seams(mesh, ring, options);
  EXPECT_TRUE(found.reached);
  for (std::size_t e = 0; e < ring.size(); ++e) {
    EXPECT_TRUE(ring[e] == 0 || found.cut[e] != 0);
  }
  EXPECT_EQ(flatten_surface(mesh, found.cut).cut.panel_count, 2);
}

TEST(FindSeams, SewingAgainKeepsTheBoundAndTakesSeamsAway) {
  // A ball, whose greedy cuts are more than it needs.
  Mesh ball = fixtures::sphere(3);
  ball.vertices *= 0.12;
  FindSeamsOptions options;
  options.stretch = 0.05;
  options.join = false;
  const FoundSeams cut = find_seams(ball, no_cut(topology(ball)), options);
  options.join = true;
  const FoundSeams sewn = find_seams(ball, no_cut(topology(ball)), options);
  EXPECT_TRUE(cut.reached);
  EXPECT_TRUE(sewn.reached);
  EXPECT_GT(sewn.joined, 0);
  EXPECT_EQ(sewn.added, cut.added);
  const FlatPattern before = flatten_surface(ball, cut.cut, laid_as_found(options));
  const FlatPattern after = flatten_surface(ball, sewn.cut, laid_as_found(options));
  EXPECT_LT(measure_flat(ball, after).seam_length, measure_flat(ball, before).seam_length);
  EXPECT_LT(measure_flat(ball, after).strain_p99, 1.1 * options.stretch);
  EXPECT_EQ(measure_flat(ball, after).overlaps, 0);
}

TEST(FindSeams, RefusesOtherFlagsAndBadSurfaces) {
  const Mesh mesh = fixtures::grid(3, 3);
  EXPECT_THROW(find_seams(mesh, {}), LogicError);
  expect_refused([] { find_seams(Mesh{}, {}); }, "no triangle");
}

TEST(OffsetOutline, KeepsItsDistance) {
  Points2 square(4, 2);
  square << 0, 0, 1, 0, 1, 1, 0, 1;
  const Points2 offset = offset_outline(square, 0.1);
  EXPECT_DOUBLE_EQ(offset.col(0).minCoeff(), -0.1);
  EXPECT_DOUBLE_EQ(offset.col(1).maxCoeff(), 1.1);
  EXPECT_FALSE(crosses_itself(offset));
  Points2 star(40, 2);
  for (int i = 0; i < 40; ++i) {
    const double angle = 2 * std::numbers::pi * i / 40;
    const double r = i % 2 == 0 ? 1 : 0.6;
    star.row(i) << r * std::cos(angle), r * std::sin(angle);
  }
  const Points2 round = offset_outline(star, 0.08);
  EXPECT_FALSE(crosses_itself(round));
  for (Index i = 0; i < round.rows(); ++i) {
    double nearest = 10;
    for (Index j = 0; j < 40; ++j) {
      const Eigen::Vector2d a = star.row(j);
      const Eigen::Vector2d b = star.row((j + 1) % 40);
      const Eigen::Vector2d p = round.row(i);
      const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
      nearest = std::min(nearest, (a + t * (b - a) - p).norm());
    }
    EXPECT_GT(nearest, 0.08 - 1e-9);
    EXPECT_LT(nearest, 0.17);
  }
}

TEST(OffsetOutline, RefusesWhatIsNoOutlineOrDistance) {
  Points2 two(2, 2);
  two << 0, 0, 1, 0;
  EXPECT_THROW(offset_outline(two, 0.1), LogicError);
  Points2 square(4, 2);
  square << 0, 0, 1, 0, 1, 1, 0, 1;
  EXPECT_THROW(offset_outline(square, -1), LogicError);
  EXPECT_THROW(offset_outline(square, std::nan("")), LogicError);
}

/// A dress's panels as bent for the body, flat again and laid out.
PatternLayout dress_layout() {
  const Garment garment = garment_from_pattern(dress_pattern({}), {.edge_length = 0.04});
  FlatPattern flat = flatten_surface(garment.mesh, no_cut(topology(garment.mesh)));
  flat.panel_names = garment.panel_names;
  return lay_out_pattern(flat);
}

TEST(LayOutPattern, PiecesLieOnTheFabricApart) {
  const PatternLayout layout = dress_layout();
  EXPECT_EQ(layout.pieces.size(), dress_pattern({}).panels.size());
  for (std::size_t i = 0; i < layout.pieces.size(); ++i) {
    const Points2& a = layout.pieces[i].cut_line;
    EXPECT_GE(a.col(0).minCoeff(), -1e-9);
    EXPECT_LE(a.col(0).maxCoeff(), layout.width + 1e-9);
    EXPECT_GE(a.col(1).minCoeff(), -1e-9);
    EXPECT_FALSE(crosses_itself(a));
    // Vertices of the others are outside of it.
    for (std::size_t j = 0; j < layout.pieces.size(); ++j) {
      if (j == i) {
        continue;
      }
      const Points2& b = layout.pieces[j].cut_line;
      for (Index v = 0; v < b.rows(); ++v) {
        bool inside = false;
        for (Index k = 0, l = a.rows() - 1; k < a.rows(); l = k++) {
          if ((a(k, 1) > b(v, 1)) != (a(l, 1) > b(v, 1)) &&
              b(v, 0) < (a(l, 0) - a(k, 0)) * (b(v, 1) - a(k, 1)) / (a(l, 1) - a(k, 1)) + a(k, 0)) {
            inside = !inside;
          }
        }
        EXPECT_FALSE(inside);
      }
    }
  }
}

TEST(PatternSvg, IsAtTrueScale) {
  const PatternLayout layout = dress_layout();
  const fixtures::ReadSvg svg = fixtures::read_svg(pattern_svg(layout, "a <dress> & \"more\""));
  EXPECT_THAT(svg.layers, ElementsAre("cut", "sew", "grain", "notches", "text", "scale"));
  EXPECT_NEAR(svg.width, 1000 * layout.width + 40, 1e-3);
  EXPECT_NEAR(std::abs(fixtures::area_of(svg.paths.at("square-100mm"))), 1e4, 1e-2);
  for (const PatternPiece& piece : layout.pieces) {
    fixtures::Loop line;
    for (Index i = 0; i < piece.sew_line.rows(); ++i) {
      line.emplace_back(piece.sew_line(i, 0), piece.sew_line(i, 1));
    }
    const double area = 1e6 * fixtures::area_of(line);
    // y runs down: clockwise.
    EXPECT_NEAR(fixtures::area_of(svg.paths.at("sew-" + piece.name)), -area, 1e-4 * area);
    EXPECT_LT(fixtures::area_of(svg.paths.at("cut-" + piece.name)), -area);
  }
}

TEST(PatternDxf, IsReadByAnotherReaderAtTrueScale) {
  const PatternLayout layout = dress_layout();
  const fixtures::ReadDxf dxf = fixtures::read_dxf(pattern_dxf(layout, "dress"));
  EXPECT_EQ(dxf.version, "AC1009");
  EXPECT_EQ(dxf.inserted.size(), layout.pieces.size());
  EXPECT_THAT(dxf.texts, ::testing::Contains("UNITS: METRIC"));
  std::vector<double> areas;
  for (const PatternPiece& piece : layout.pieces) {
    fixtures::Loop line;
    for (Index i = 0; i < piece.sew_line.rows(); ++i) {
      line.emplace_back(1000 * piece.sew_line(i, 0), 1000 * piece.sew_line(i, 1));
    }
    areas.push_back(fixtures::area_of(line));
  }
  for (std::size_t i = 0; i < dxf.inserted.size(); ++i) {
    const auto& block = dxf.closed.at(dxf.inserted[i]);
    ASSERT_EQ(block.at("1").size(), 1U);
    ASSERT_EQ(block.at("14").size(), 1U);
    EXPECT_NEAR(fixtures::area_of(block.at("14").front()), areas[i], 1e-4 * areas[i]);
    EXPECT_GT(fixtures::area_of(block.at("1").front()), areas[i]);
    EXPECT_EQ(dxf.lines.at(dxf.inserted[i]).at("7"), 1);
  }
}

TEST(LayOutPattern, SewnSidesHaveNotchesAtTheSameLengths) {
  const Mesh tube = fixtures::tube(24, 8, 2);
  const PatternLayout layout = lay_out_pattern(flatten_surface(tube, opened(tube)));
  ASSERT_EQ(layout.pieces.size(), 1U);
  EXPECT_GT(layout.width, 6);  // wider than the fabric that was asked for
  const auto& notches = layout.pieces[0].notches;
  ASSERT_GE(notches.size(), 2U);
  EXPECT_EQ(notches.size() % 2, 0U);
  EXPECT_NEAR(notches[0].position.y(), notches[1].position.y(), 1e-3);
  EXPECT_LT(notches[0].outwards.dot(notches[1].outwards), -0.9);
  EXPECT_LT(layout.seam_mismatch, 0.003);
}

}  // namespace
}  // namespace atelier
