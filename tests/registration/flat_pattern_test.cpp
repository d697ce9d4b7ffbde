#include "registration/flattening/flat_pattern.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/sewing/garment_pattern_json.h"
#include "registration/sewing/parametric_patterns.h"
#include "registration/sewing/pattern_garment.h"
#include "tests/registration/cut_fixtures.h"
#include "tests/registration/edge_runs.h"
#include "tests/registration/pattern_files.h"
#include "tests/support/shapes.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::no_cut;
using fixtures::opened;
using fixtures::topology;
using ::testing::HasSubstr;

TEST(FlattenSurface, Tube_BecomesARectangle) {
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

TEST(FlattenSurface, SphereSeams_HaveEqualSides) {
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

TEST(FlattenSurface, EarlierPattern_IsGoneOnFrom) {
  const Mesh mesh = fixtures::tube(16, 6, 1);
  const FlatPattern pattern = flatten_surface(mesh, opened(mesh));
  const FlatPattern again = flatten_surface(mesh, opened(mesh), {}, pattern.vertices);
  EXPECT_LT((again.vertices - pattern.vertices).rowwise().norm().maxCoeff(), 1e-4);
  // What turns faces over is no start.
  const FlatPattern anew =
      flatten_surface(mesh, opened(mesh), {}, -pattern.vertices.rowwise().reverse());
  EXPECT_EQ(measure_flat(mesh, anew).inverted, 0);
  EXPECT_THROW(flatten_surface(mesh, opened(mesh), {}, pattern.vertices.topRows(3)), LogicError);
}

TEST(FlattenSurface, GarmentRestShape_IsThePattern) {
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

/// Cut along their seams, the panels of a pattern are laid flat as they wait round the body, each
/// bent but not stretched: every side of a seam, and what each has of an opening, within 1%.
void expect_every_edge_back(const SewingPattern& sewing) {
  SCOPED_TRACE(sewing.name);
  const Garment garment = garment_from_pattern(sewing, {.edge_length = 0.03});
  const FlatPattern flat = flatten_surface(garment.mesh, no_cut(topology(garment.mesh)));
  EXPECT_EQ(flat.cut.panel_count, static_cast<int>(sewing.panels.size()));
  const auto runs = fixtures::edge_runs(garment, garment.seams, flat);
  const auto count = [&](const std::string& what) {
    return std::count_if(runs.begin(), runs.end(), [&](const auto& one) {
      return one.first.find(what) != std::string::npos;
    });
  };
  EXPECT_EQ(count(", seam "), 2 * std::ssize(garment.seams));
  EXPECT_GE(std::ssize(runs) - count(", seam "), std::ssize(garment.boundaries));
  EXPECT_EQ(count(", of nothing"), 0);
  for (const auto& [name, run] : runs) {
    EXPECT_NEAR(run.is, run.was, 0.01 * run.was) << name;
  }
}

TEST(FlattenSurface, OwnPatterns_GiveEveryEdgeBack) {
  const TailorMeasures measures;
  expect_every_edge_back(skirt_pattern(measures));
  expect_every_edge_back(tee_pattern(measures));
  expect_every_edge_back(trousers_pattern(measures));
  expect_every_edge_back(dress_pattern(measures));
}

TEST(FlattenSurface, RealPatterns_GiveEveryEdgeBack) {
  for (const char* name :
       {"basic tee/tee.json", "skirts/skirt_4_panels.json", "pants/pants_straight_sides.json"}) {
    ATELIER_TEST_FILE(file, std::string("garments/pattern_generator/Patterns/") + name);
    std::ifstream stream(file);
    const std::string text((std::istreambuf_iterator<char>(stream)), {});
    expect_every_edge_back(garment_pattern_from_json(text, name));
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

TEST(FlattenSurface, SewnPanels_AreRecoveredThroughTheirSeams) {
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
  const std::vector<Seam> seams = garment.seams;  // of the rest shape, which is not welded
  garment.mesh = mesh;
  for (std::vector<int>& loop : garment.boundaries) {
    for (int& v : loop) {
      v = joined[static_cast<std::size_t>(v)];
    }
  }
  const auto runs = fixtures::edge_runs(garment, seams, flat);
  EXPECT_EQ(runs.size(), 8U);  // of front and back two sides, a waist and a hem
  for (const auto& [name, run] : runs) {
    EXPECT_NEAR(run.is, run.was, 0.01 * run.was) << name;
  }
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

TEST(CheckFlattenable, BadSurface_IsRefused) {
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

TEST(FlattenSurface, NonDiskPanel_IsRefusedByName) {
  const Mesh tube = fixtures::tube(8, 3);
  expect_refused([&] { flatten_surface(tube, no_cut(topology(tube))); }, "panel 0");
  const Mesh sphere = fixtures::sphere(1);
  expect_refused([&] { flatten_surface(sphere, no_cut(topology(sphere))); }, "closed surface");
  EXPECT_THROW(flatten_surface(tube, {}), LogicError);
}

TEST(FlattenSurface, ZeroAreaTriangle_IsRefused) {
  Mesh mesh = fixtures::grid(3, 3);
  mesh.vertices.row(5) = mesh.vertices.row(4);
  expect_refused([&] { flatten_surface(mesh, no_cut(topology(mesh))); }, "no area");
}

}  // namespace
}  // namespace atelier
