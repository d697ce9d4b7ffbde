#include "registration/template/garment_template.h"

#include <Eigen/Geometry>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/intersection.h"
#include "core/median.h"
#include "core/normals.h"
#include "core/topology.h"
#include "core/tree.h"
#include "registration/attach_to_body.h"
#include "registration/part_crossings.h"
#include "registration/remove_slivers.h"
#include "registration/template/garment_boundaries.h"
#include "registration/template/garment_cover.h"
#include "registration/template/surface_through_points.h"
#include "registration/template/trim_surface.h"
#include "registration/tracking/cut_rim_folds.h"
#include "tests/registration/mannequin.h"
#include "tests/support/shapes.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

/// Coarse, so that tests are quick.
GarmentTemplateOptions quick() {
  GarmentTemplateOptions options;
  options.edge_length = 0.03;
  return options;
}

ClothedFrames standing(const Wears& wears, double noise = 0,
                       const std::vector<std::pair<Eigen::Vector3d, double>>& holes = {}) {
  const std::vector<Capsule> pose = capsules();
  return frames_of({pose},
                   [=](std::size_t) { return clothed_scan(pose, wears, noise, holes, 0.012); });
}

/// Distances of vertices to the blown-up capsules.
double mean_distance(const Points& vertices, const std::vector<Capsule>& pose) {
  double sum = 0;
  for (Index v = 0; v < vertices.rows(); ++v) {
    double nearest = 1e9;
    for (const Capsule& capsule : pose) {
      nearest = std::min(nearest, distance_to(capsule, vertices.row(v).transpose()));
    }
    sum += std::abs(nearest - kGap);
  }
  return sum / static_cast<double>(vertices.rows());
}

void expect_clean(const Mesh& mesh, double edge_length) {
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  EXPECT_TRUE(is_manifold(manifold_defects(topology)));
  EXPECT_EQ(connected_components(topology).count, 1);
  EXPECT_TRUE(self_intersections(mesh.vertices, mesh.faces).empty());
  EXPECT_EQ(cut_rim_folds(mesh).faces, mesh.faces);
  Index even = 0;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const double length =
        (mesh.vertices.row(topology.edges(e, 0)) - mesh.vertices.row(topology.edges(e, 1))).norm();
    even += length > 0.5 * edge_length && length < 1.6 * edge_length ? 1 : 0;
  }
  EXPECT_GT(even, 0.95 * topology.edges.rows());
  EXPECT_GT(min_corners(mesh.vertices, mesh.faces).minCoeff(), 8);  // pushing out may narrow some
}

template <class Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

TEST(GarmentTemplate, NoisyTeeWithHoles_HasItsFourOpenings) {
  const GarmentTemplate made = garment_template(
      standing(wears_tee, 0.002, {{{0, 1.2, 0.152}, 0.035}, {{-0.152, 1.15, 0}, 0.03}}),
      kClothLabel, "upper", quick());
  EXPECT_THAT(made.garment.boundary_names,
              UnorderedElementsAre("neck", "hem", "cuff left", "cuff right"));
  expect_clean(made.garment.mesh, 0.03);
  EXPECT_LT(mean_distance(made.garment.mesh.vertices, capsules()), 0.003);
  EXPECT_GE(made.holes_closed, 1);
  EXPECT_EQ(made.garment.name, "upper");
  EXPECT_EQ(made.garment.attachments.size(),
            static_cast<std::size_t>(made.garment.mesh.vertices.rows()));
  const AtlasMeasures atlas = measure_atlas(made.garment.mesh);
  EXPECT_EQ(atlas.flipped, 0);
  EXPECT_EQ(atlas.overlapping, 0);
  EXPECT_LT(atlas.stretch_p99, 0.35);
  EXPECT_GE(made.garment.mesh.uvs.minCoeff(), 0);
  EXPECT_LE(made.garment.mesh.uvs.maxCoeff(), 1);
  for (std::size_t b = 0; b < 4; ++b) {  // where they lie
    double height = 0;
    double x = 0;
    for (const int v : made.garment.boundaries[b]) {
      height +=
          made.garment.mesh.vertices(v, 1) / static_cast<double>(made.garment.boundaries[b].size());
      x +=
          made.garment.mesh.vertices(v, 0) / static_cast<double>(made.garment.boundaries[b].size());
    }
    const std::string& name = made.garment.boundary_names[b];
    EXPECT_NEAR(height, name == "neck" ? 1.45 : name == "hem" ? 1.0 : 1.27, 0.02) << name;
    EXPECT_EQ(x > 0.1, name == "cuff left") << name;
  }
}

/// Median height of the lowest rim.
double hem_of(const GarmentTemplate& made) {
  double lowest = 1e9;
  for (const std::vector<int>& rim : made.garment.boundaries) {
    std::vector<double> heights;
    for (const int v : rim) {
      heights.push_back(made.garment.mesh.vertices(v, 1));
    }
    lowest = std::min(lowest, median(heights));
  }
  return lowest;
}

// It went on by more than half an edge beyond that, and by all that scans go on beyond their
// points.
TEST(GarmentTemplate, TemplateHem_LiesWhereTheScanWasSeenToEnd) {
  const std::vector<Capsule> pose = capsules();
  const auto made_of = [&](bool unsure) {
    return garment_template(
        frames_of({pose},
                  [&](std::size_t) {
                    Mesh scan = clothed_scan(pose, wears_tee, 0, {}, 0.012);
                    scan.confidence = Eigen::VectorXf::Ones(scan.vertices.rows());
                    for (Index v = 0; unsure && v < scan.vertices.rows(); ++v) {
                      scan.confidence[v] = scan.vertices(v, 1) < 1.05 ? 0.0F : 1.0F;
                    }
                    return scan;
                  }),
        kClothLabel, "upper", quick());
  };
  EXPECT_NEAR(hem_of(made_of(false)), 1.0, 0.4 * quick().edge_length);
  EXPECT_NEAR(hem_of(made_of(true)), 1.05, 0.6 * quick().edge_length);
}

TEST(GarmentTemplate, Trousers_HaveAWaistAndTwoAnkles) {
  const GarmentTemplate made =
      garment_template(standing(wears_trousers), kClothLabel, "lower", quick());
  EXPECT_THAT(made.garment.boundary_names,
              UnorderedElementsAre("waist", "ankle left", "ankle right"));
  expect_clean(made.garment.mesh, 0.03);
  EXPECT_EQ(
      euler_characteristic(topology_of(made.garment.mesh.faces, made.garment.mesh.vertices.rows())),
      -1);  // a pair of trousers
}

TEST(GarmentTemplate, OpeningsTooSmallForTheTriangles_AreReported) {
  GarmentTemplateOptions options;
  options.edge_length = 0.038;  // a dozen round a cuff of 0.47 m
  const GarmentTemplate kept = garment_template(standing(wears_tee), kClothLabel, "upper", options);
  EXPECT_EQ(kept.garment.boundaries.size(), 4U);
  EXPECT_THAT(kept.findings, Not(Contains(Field(&Finding::code, "opening-lost"))));
  options.edge_length = 0.06;
  const GarmentTemplate lost = garment_template(standing(wears_tee), kClothLabel, "upper", options);
  ASSERT_LT(lost.garment.boundaries.size(), 4U);
  EXPECT_THAT(lost.findings,
              Contains(AllOf(Field(&Finding::code, "opening-lost"),
                             Field(&Finding::what, HasSubstr("lost: cuff")),
                             Field(&Finding::advice, HasSubstr("--edge-length 0.030 or less")))));
}

TEST(GarmentTemplate, FrameWithArmsAwayFromTheTrunk_IsChosen) {
  const std::vector<std::vector<Capsule>> poses = {capsules(0.12), capsules(0.9), capsules(0.1)};
  const ClothedFrames frames = frames_of(
      poses, [poses](std::size_t i) { return clothed_scan(poses[i], wears_tee, 0, {}, 0.012); });
  const GarmentTemplate made = garment_template(frames, kClothLabel, "upper", quick());
  EXPECT_EQ(made.frame_id, 10);
}

TEST(GarmentTemplate, HiddenRegions_AreFilledFromOtherFrames) {
  // The whole of one sleeve's inner half is hidden in the frame that is asked for.
  const std::vector<Capsule> pose = capsules();
  const std::vector<std::pair<Eigen::Vector3d, double>> hidden = {{{0.17, 1.30, 0}, 0.07}};
  const ClothedFrames frames = frames_of({pose, pose}, [=](std::size_t i) {
    return clothed_scan(pose, wears_tee, 0, i == 0 ? hidden : decltype(hidden){}, 0.012);
  });
  GarmentTemplateOptions options = quick();
  options.frame = 0;
  const GarmentTemplate made = garment_template(frames, kClothLabel, "upper", options);
  EXPECT_THAT(made.garment.boundary_names,
              UnorderedElementsAre("neck", "hem", "cuff left", "cuff right"));
  EXPECT_GT(made.area_unseen, 0.002);
  EXPECT_EQ(made.frame_id, 0);
}

// Its left cuff and its hem were one loop.
TEST(GarmentTemplate, GapUnseenFromCuffToHem_IsClosed) {
  std::vector<std::pair<Eigen::Vector3d, double>> hidden;
  for (double t = 0; t <= 1; t += 0.05) {
    hidden.push_back({{0.27 - 0.11 * t, 1.22 + 0.09 * t, 0}, 0.05});  // below the arm
    hidden.push_back({{0.152, 0.97 + 0.32 * t, 0}, 0.05});            // down the side
  }
  const GarmentTemplate made =
      garment_template(standing(wears_tee, 0, hidden), kClothLabel, "upper", quick());
  EXPECT_THAT(made.garment.boundary_names,
              UnorderedElementsAre("neck", "hem", "cuff left", "cuff right"));
  expect_clean(made.garment.mesh, 0.03);
  EXPECT_GT(made.area_unseen, 0.02);
}

TEST(GarmentTemplate, Template_LiesOutsideTheBodyAndFollowsIt) {
  const ClothedFrames frames = standing(wears_tee, 0.004);
  const GarmentTemplate made = garment_template(frames, kClothLabel, "upper", quick());
  const Points body = frames.load(0).body;
  for (const ClosestPoint& nearest :
       closest_points(build_tree(body, frames.body_faces), made.garment.mesh.vertices)) {
    EXPECT_GT(std::sqrt(nearest.squared_distance), 0.0019);
  }
  const Points there = body_driven(made.garment.attachments, body, frames.body_faces);
  EXPECT_LT((there - made.garment.mesh.vertices).rowwise().norm().maxCoeff(), 1e-9);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Points moved = (body * turn.transpose()).rowwise() + Eigen::RowVector3d(1, -2, 3);
  const Points expected =
      (made.garment.mesh.vertices * turn.transpose()).rowwise() + Eigen::RowVector3d(1, -2, 3);
  EXPECT_LT((body_driven(made.garment.attachments, moved, frames.body_faces) - expected)
                .rowwise()
                .norm()
                .maxCoeff(),
            1e-8);
}

TEST(GarmentTemplateRefused, LabelsCoveringNothing_AreRefused) {
  EXPECT_THAT(refusal([] { garment_template(standing(wears_tee), 5, "dress", quick()); }),
              HasSubstr("dress: 0 cm2 of its label"));
  const auto patch = [](const Eigen::Vector3d& middle, int lump) {
    return lump == Chest && (middle - Eigen::Vector3d(0, 1.25, 0.15)).norm() < 0.04;
  };
  EXPECT_THAT(refusal([&] { garment_template(standing(patch), kClothLabel, "upper", quick()); }),
              HasSubstr("100 cm2"));
}

TEST(GarmentTemplateRefused, MissingFrames_AreRefused) {
  GarmentTemplateOptions options = quick();
  options.frame = 7;
  EXPECT_THAT(
      refusal([&] { garment_template(standing(wears_tee), kClothLabel, "upper", options); }),
      HasSubstr("frame: 7"));
  EXPECT_THAT(refusal([&] { garment_template({}, kClothLabel, "upper", options); }),
              HasSubstr("no frame"));
}

TEST(GarmentTemplate, Skirt_BridgesTheLegsAndHangsFree) {
  // The hem swings to and fro, which the body does not.
  const std::vector<Capsule> pose = capsules();
  const auto skin = [](const Eigen::Vector3d& m, int lump) {
    return lump != Pelvis && (lump < LeftThigh || m.y() < 0.5);
  };
  const ClothedFrames frames = frames_of({pose, pose, pose}, [=](std::size_t i) {
    Mesh cloth = cone(1.05, 0.17, 0.5, 0.34, 0.014);
    for (Index v = 0; v < cloth.vertices.rows(); ++v) {
      cloth.vertices(v, 2) += 0.3 * (static_cast<double>(i) - 1) * (1.05 - cloth.vertices(v, 1));
    }
    return over_skin(cloth, capsule_surface(pose, 0, 0.014, skin));
  });
  const GarmentTemplate made = garment_template(frames, kClothLabel, "lower", quick());
  EXPECT_THAT(made.garment.boundary_names, UnorderedElementsAre("waist", "hem"));
  expect_clean(made.garment.mesh, 0.03);
  EXPECT_EQ(
      euler_characteristic(topology_of(made.garment.mesh.faces, made.garment.mesh.vertices.rows())),
      0);  // a tube
  double free_low = 0;
  double low = 0;
  double free_high = 0;
  for (Index v = 0; v < made.garment.mesh.vertices.rows(); ++v) {
    const bool is_free = made.dynamic[static_cast<std::size_t>(v)] != 0;
    if (made.garment.mesh.vertices(v, 1) < 0.6) {
      low += 1;
      free_low += is_free ? 1 : 0;
    } else if (made.garment.mesh.vertices(v, 1) > 1.01) {
      free_high += is_free ? 1 : 0;
    }
  }
  EXPECT_GT(free_low, 0.9 * low);
  EXPECT_EQ(free_high, 0);
}

TEST(GarmentTemplate, GarmentHalfUnseen_IsReportedOrRefused) {
  const auto front = [](const Eigen::Vector3d& middle, int lump) {
    return wears_tee(middle, lump) && middle.z() > 0.02;
  };
  const std::vector<Capsule> pose = capsules();
  const ClothedFrames frames = frames_of({pose}, [=](std::size_t) {
    return over_skin(capsule_surface(pose, kGap, 0.012, front),
                     capsule_surface(pose, 0, 0.012, [](const Eigen::Vector3d& m, int lump) {
                       return !wears_tee(m, lump) && m.z() > 0;
                     }));
  });
  const std::string refused = refusal([&] {
    const GarmentTemplate made = garment_template(frames, kClothLabel, "upper", quick());
    ASSERT_FALSE(made.findings.empty());
    EXPECT_THAT(made.findings.front().code, AnyOf("much-unseen", "opening-unnamed"));
  });
  EXPECT_TRUE(refused.empty() || refused.find("unseen") != std::string::npos) << refused;
}

/// A tube round the chest: what an artist could have made.
Mesh artists_top() {
  return cone(1.34, 0.17, 1.0, 0.17, 0.03);
}

TEST(ImportedTemplate, ImportedMesh_IsKeptAndItsOpeningsNamed) {
  const Mesh mesh = artists_top();
  const GarmentTemplate made =
      imported_template(mesh, standing(wears_tee), kClothLabel, "upper", quick());
  EXPECT_EQ(made.garment.mesh.vertices, mesh.vertices);
  EXPECT_EQ(made.garment.mesh.faces, mesh.faces);
  EXPECT_EQ(made.garment.mesh.uv_faces.rows(), mesh.faces.rows());
  EXPECT_EQ(made.garment.attachments.size(), static_cast<std::size_t>(mesh.vertices.rows()));
  EXPECT_THAT(made.garment.boundary_names, UnorderedElementsAre("neck", "hem"));
}

TEST(ImportedTemplate, InsideOutMesh_IsFlipped) {
  const Mesh mesh = artists_top();
  Mesh inwards = mesh;
  inwards.faces.col(1).swap(inwards.faces.col(2));
  inwards.uvs = Points2::Random(3, 2);
  inwards.uv_faces = Triangles(mesh.faces.rows(), 3);
  inwards.uv_faces.rowwise() = Eigen::RowVector3i(0, 1, 2);
  const GarmentTemplate made =
      imported_template(inwards, standing(wears_tee), kClothLabel, "upper", quick(), "top.obj");
  EXPECT_EQ(made.garment.mesh.faces, mesh.faces);
  EXPECT_EQ(made.garment.mesh.uv_faces.row(0), Eigen::RowVector3i(0, 2, 1));
  EXPECT_THAT(made.garment.boundary_names, UnorderedElementsAre("neck", "hem"));
  EXPECT_THAT(made.findings, Contains(AllOf(Field(&Finding::code, "import-turned"),
                                            Field(&Finding::severity, Severity::Note))));
  EXPECT_THAT(imported_template(mesh, standing(wears_tee), kClothLabel, "upper", quick()).findings,
              Not(Contains(Field(&Finding::code, "import-turned"))));
}

TEST(GarmentBoundaries, LimbClosedOverByCloth_IsNamed) {
  const Mesh body = body_surface(capsules());
  const BodyAnatomy anatomy = anatomy_of(body);
  const auto closed_over = [&](const Mesh& cloth) {
    return limbs_closed_over(cloth.vertices, cloth.faces, anatomy, body.vertices, body.faces);
  };
  Mesh top = artists_top();
  EXPECT_THAT(closed_over(top), UnorderedElementsAre("left hand", "right hand"));  // no sleeves
  const Mesh tee = capsule_surface(capsules(), kGap, 0.012, wears_tee);
  EXPECT_THAT(closed_over(tee), ::testing::IsEmpty());
  // A lid on the neck: a fan round its middle.
  const Index count = top.vertices.rows();
  const auto around = static_cast<int>(2 * M_PI * 0.17 / 0.03);
  top.vertices.conservativeResize(count + 1, 3);
  top.vertices.bottomRows(1) << 0, 1.34, 0;
  const Index faces = top.faces.rows();
  top.faces.conservativeResize(faces + around, 3);
  for (int k = 0; k < around; ++k) {
    const int ring = static_cast<int>(count) - around;
    top.faces.row(faces + k) << ring + k, static_cast<int>(count), ring + (k + 1) % around;
  }
  EXPECT_THAT(closed_over(top), UnorderedElementsAre("head", "left hand", "right hand"));
}

/// A square sheet, so large and so far in front of the middle of the trunk, m.
Mesh sheet_before_the_chest(double side, double forwards) {
  Mesh sheet = fixtures::grid(6, 6);
  const Points flat = sheet.vertices;
  for (Index v = 0; v < flat.rows(); ++v) {
    sheet.vertices.row(v) << side * (flat(v, 0) - 0.5), 1.1 + side * (0.5 - flat(v, 2)), forwards;
  }
  return sheet;
}

TEST(ImportedTemplate, MisplacedMesh_IsReported) {
  const ClothedFrames frames = standing(wears_tee);
  EXPECT_THAT(
      imported_template(artists_top(), frames, kClothLabel, "upper", quick(), "top.obj").findings,
      Not(Contains(Field(&Finding::code, "import-far"))));
  // A patch on the chest.
  const GarmentTemplate made = imported_template(sheet_before_the_chest(0.17, 0.17), frames,
                                                 kClothLabel, "upper", quick(), "patch.obj");
  ASSERT_THAT(made.findings, Contains(AllOf(Field(&Finding::code, "import-far"),
                                            Field(&Finding::place, "patch.obj"))));
}

TEST(ImportedTemplateRefused, SheetUnlikeTheGarment_IsRefused) {
  const ClothedFrames frames = standing(wears_tee);
  for (const auto& [side, forwards] : {std::pair(0.3, 0.35), std::pair(1.0, 0.0)}) {
    EXPECT_THAT(refusal([&, side = side, forwards = forwards] {
                  imported_template(sheet_before_the_chest(side, forwards), frames, kClothLabel,
                                    "upper", quick(), "sheet.obj");
                }),
                AllOf(HasSubstr("sheet.obj: place: half its vertices farther than 0."),
                      HasSubstr("from what the scan shows of this garment"),
                      HasSubstr("placed on the body of frame 0 (--frame): within 0."),
                      HasSubstr("a twentieth of the garment's size")));
  }
}

TEST(ImportedTemplateRefused, MeshOfSeveralLayersOrOffTheBody_IsRefused) {
  const Mesh good = artists_top();
  const ClothedFrames frames = standing(wears_tee);
  const auto refuse = [&](const std::function<void(Mesh&)>& change) {
    Mesh mesh = good;
    mesh.uvs.resize(0, 2);
    mesh.uv_faces.resize(0, 3);
    mesh.normals.resize(0, 3);
    change(mesh);
    return refusal(
        [&] { imported_template(mesh, frames, kClothLabel, "upper", quick(), "artist.obj"); });
  };
  EXPECT_EQ(refuse([](Mesh&) {}), "");
  EXPECT_THAT(refuse([](Mesh& mesh) {
                mesh.faces.conservativeResize(mesh.faces.rows() + 1, 3);
                mesh.faces.bottomRows(1) << mesh.faces(0, 0), mesh.faces(0, 1),
                    mesh.faces(mesh.faces.rows() / 2, 2);
              }),
              AllOf(HasSubstr("artist.obj: vertex"), HasSubstr("three faces")));
  EXPECT_THAT(refuse([](Mesh& mesh) { std::swap(mesh.faces(3, 0), mesh.faces(3, 1)); }),
              HasSubstr("opposite orientation"));
  EXPECT_THAT(refuse([](Mesh& mesh) { mesh.vertices *= 100; }), HasSubstr("metres"));
  EXPECT_THAT(refuse([](Mesh& mesh) { mesh.vertices.col(0).array() += 1.5; }),
              HasSubstr("placed on the body of frame 0"));
  EXPECT_THAT(refuse([](Mesh& mesh) {
                mesh.vertices.conservativeResize(mesh.vertices.rows() + 1, 3);
                mesh.vertices.bottomRows(1).setZero();
              }),
              HasSubstr("pieces: 2"));
  EXPECT_THAT(refuse([](Mesh& mesh) { mesh.faces.resize(0, 3); }), HasSubstr("faces: none"));
  EXPECT_THAT(refuse([](Mesh& mesh) {
                mesh.vertices.resize(4, 3);
                mesh.vertices << 0, 1, 0, 0.3, 1, 0, 0, 1.3, 0, 0, 1, 0.3;
                mesh.faces.resize(4, 3);
                mesh.faces << 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3;
              }),
              HasSubstr("a closed surface"));
}

/// A ring round the y axis; counter-clockwise seen from above where `up`.
Points ring(const Eigen::Vector3d& middle, double radius, bool up) {
  Points points(16, 3);
  for (int i = 0; i < 16; ++i) {
    const double angle = (up ? -1 : 1) * 2 * M_PI * i / 16;
    points.row(i) << middle.x() + radius * std::cos(angle), middle.y(),
        middle.z() + radius * std::sin(angle);
  }
  return points;
}

TEST(Crossings, Crossings_AreCountedWithTheirDirection) {
  Points up(3, 3);
  up << 0, -1, 0, 0, 0.5, 0, 0, 1, 0;
  Points down(3, 3);
  down << 0, 1, 0, 0, 0.5, 0, 0, -1, 0;
  Points beside(2, 3);
  beside << 2, -1, 0, 2, 1, 0;
  Points there_and_back(3, 3);
  there_and_back << 0.1, -1, 0, 0.1, 1, 0, 0.2, -1, 0;
  EXPECT_EQ(crossings(ring({0, 0, 0}, 1, true), up), 1);
  EXPECT_EQ(crossings(ring({0, 0, 0}, 1, false), up), -1);
  EXPECT_EQ(crossings(ring({0, 0, 0}, 1, true), down), -1);
  EXPECT_EQ(crossings(ring({0, 0, 0}, 1, true), beside), 0);
  EXPECT_EQ(crossings(ring({0, 0, 0}, 1, true), there_and_back), 0);
}

/// A wide tube, of which points say where it is but for an end of 0.1 m on either side and a gap
/// from end to end, over a thin body that is covered between the ends, and below the gap if
/// `covered`.
TrimmedSurface tube_with_gap(double width, bool covered) {
  const Mesh tube = cone(0.6, 0.15, 0, 0.15, 0.008);
  const Mesh body = cone(0.6, 0.08, 0, 0.08, 0.02);
  const auto in_gap = [&](const Eigen::RowVector3d& point) {
    return std::abs(std::atan2(point.z(), point.x())) * 0.15 < width / 2;
  };
  GarmentPoints points;
  const Points normals = vertex_normals(tube.vertices, tube.faces);
  points.points.resize(tube.vertices.rows(), 3);
  points.normals.resize(tube.vertices.rows(), 3);
  for (Index v = 0; v < tube.vertices.rows(); ++v) {
    const double y = tube.vertices(v, 1);
    if (y > 0.1 && y < 0.5 && !in_gap(tube.vertices.row(v))) {
      points.points.row(points.seen) = tube.vertices.row(v);
      points.normals.row(points.seen++) = normals.row(v);
    }
  }
  points.points.conservativeResize(points.seen, 3);
  points.normals.conservativeResize(points.seen, 3);
  points.observed = points.seen;
  points.weights = Eigen::VectorXd::Ones(points.seen);
  GarmentCover cover{Eigen::VectorXd::Zero(body.vertices.rows()),
                     Eigen::VectorXd::Zero(body.vertices.rows())};
  for (Index v = 0; v < body.vertices.rows(); ++v) {
    const Eigen::RowVector3d place = body.vertices.row(v);
    cover.share[v] = place.y() > 0.1 && place.y() < 0.5 &&
                             (covered || std::abs(std::atan2(place.z(), place.x())) > M_PI / 4)
                         ? 1
                         : 0;
  }
  return trim_surface(tube, points, 0.01, body.vertices, body.faces, cover);
}

TEST(TrimSurface, GapOverCoveredSkin_IsClosed) {
  const TrimmedSurface trimmed = tube_with_gap(0.08, true);
  const std::vector<std::vector<int>> rims =
      boundary_loops(topology_of(trimmed.mesh.faces, trimmed.mesh.vertices.rows()));
  ASSERT_EQ(rims.size(), 2U);
  for (const std::vector<int>& rim : rims) {
    const double end = trimmed.mesh.vertices(rim.front(), 1) < 0.3 ? 0.1 : 0.5;
    for (const int v : rim) {
      EXPECT_NEAR(trimmed.mesh.vertices(v, 1), end, 0.015);
    }
  }
  EXPECT_EQ(trimmed.holes_closed, 1);
  // Points reach 1 cm into it from either side.
  EXPECT_NEAR(trimmed.area_closed, 0.06 * 0.4, 0.2 * 0.06 * 0.4);
}

TEST(TrimSurface, GapOverBareSkin_StaysOpenUnlessNarrow) {
  const auto rims = [](const TrimmedSurface& trimmed) {
    return boundary_loops(topology_of(trimmed.mesh.faces, trimmed.mesh.vertices.rows())).size();
  };
  EXPECT_EQ(rims(tube_with_gap(0.08, false)), 1U);
  EXPECT_EQ(rims(tube_with_gap(0.035, false)), 2U);
}

TEST(SurfaceThroughPoints, BallWithAHole_GivesAClosedBall) {
  const Mesh ball = capsule_surface({{{0, 0, 0}, {0, 0.001, 0}, 0.1, 0}}, 0, 0.006,
                                    [](const Eigen::Vector3d& m, int) { return m.z() < 0.092; });
  std::vector<char> used(static_cast<std::size_t>(ball.vertices.rows()), 0);
  for (Index f = 0; f < ball.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      used[static_cast<std::size_t>(ball.faces(f, k))] = 1;
    }
  }
  Points points(ball.vertices.rows(), 3);
  Index count = 0;
  for (Index v = 0; v < ball.vertices.rows(); ++v) {
    if (used[static_cast<std::size_t>(v)] != 0) {
      points.row(count++) = ball.vertices.row(v);
    }
  }
  points.conservativeResize(count, 3);
  const Points normals = points.rowwise().normalized();
  const Mesh surface = surface_through_points(points, normals, Eigen::VectorXd::Ones(count),
                                              {.cell = 0.01, .reach = 0.05});
  const Topology topology = topology_of(surface.faces, surface.vertices.rows());
  EXPECT_TRUE(is_manifold(manifold_defects(topology)));
  EXPECT_TRUE(is_closed(topology));
  const Eigen::VectorXd radii = surface.vertices.rowwise().norm();
  EXPECT_NEAR(radii.minCoeff(), 0.1, 0.003);
  EXPECT_NEAR(radii.maxCoeff(), 0.1, 0.003);
  const Points outwards = vertex_normals(surface.vertices, surface.faces);
  EXPECT_GT((outwards.array() * surface.vertices.array()).rowwise().sum().minCoeff(), 0);
}

TEST(SurfaceThroughPointsRefused, MismatchedArraysOrHugeGrids_AreRefused) {
  EXPECT_THROW(
      surface_through_points(Points::Zero(2, 3), Points::Zero(1, 3), Eigen::VectorXd::Ones(2)),
      LogicError);
  Points far = Points::Zero(2, 3);
  far(1, 0) = far(1, 1) = far(1, 2) = 1e5;
  EXPECT_THROW(surface_through_points(far, far, Eigen::VectorXd::Ones(2)), DataError);
  EXPECT_EQ(surface_through_points({}, {}, {}).faces.rows(), 0);
}

TEST(GarmentCover, Cover_GivesWhereTheBodyIsCoveredAndTheGap) {
  const std::vector<Capsule> pose = capsules();
  const Mesh body = body_surface(pose);
  const Mesh scan = clothed_scan(pose, wears_tee, 0, {}, 0.014);
  const GarmentVotes votes = garment_votes(scan, kClothLabel, body.vertices, body.faces);
  const GarmentCover cover = garment_cover(votes, body.vertices, body.faces);
  for (Index v = 0; v < body.vertices.rows(); ++v) {
    const int lump = body.labels[static_cast<std::size_t>(v)];
    if (lump == Chest && body.vertices(v, 1) > 1.18 && body.vertices(v, 1) < 1.32 &&
        std::abs(body.vertices(v, 0)) < 0.1) {
      EXPECT_GT(cover.share[v], 0.9);
      EXPECT_NEAR(cover.gap[v], kGap, 0.004);
    } else if (lump == LeftShin || (lump == Head && body.vertices(v, 1) > 1.52)) {
      EXPECT_LT(cover.share[v], 0.1);
    }
  }
  EXPECT_THROW(garment_cover(votes, body.vertices.topRows(3), body.faces), LogicError);
}

TEST(GarmentCover, RegionsFarFromAnythingSeen_AreUncovered) {
  const Mesh tube = cone(2, 0.1, 0, 0.1, 0.02);
  const Index count = tube.vertices.rows();
  GarmentVotes votes{Eigen::VectorXd::Zero(count), Eigen::VectorXd::Zero(count),
                     Eigen::VectorXd::Zero(count)};
  for (Index v = 0; v < count; ++v) {
    votes.covered[v] = tube.vertices(v, 1) > 1.5 ? 1 : 0;
  }
  const GarmentCover cover = garment_cover(votes, tube.vertices, tube.faces, 0.3);
  for (Index v = 0; v < count; ++v) {
    if (tube.vertices(v, 1) > 1.25) {
      EXPECT_GT(cover.share[v], 0.9);
    } else if (tube.vertices(v, 1) < 1.15) {
      EXPECT_EQ(cover.share[v], 0);
    }
  }
}

TEST(PartCrossings, SelfIntersections_AreSmoothedAndNothingElse) {
  Mesh tube = cone(1, 0.1, 0.7, 0.1, 0.02);
  EXPECT_EQ(part_crossings(tube).mesh.vertices, tube.vertices);
  const Mesh good = tube;
  Index pulled = 0;  // through the other side
  (tube.vertices.rowwise() - Eigen::RowVector3d(0.1, 0.85, 0)).rowwise().norm().minCoeff(&pulled);
  tube.vertices(pulled, 0) = -0.12;
  ASSERT_FALSE(self_intersections(tube.vertices, tube.faces).empty());
  const PartedMesh parted = part_crossings(tube);
  EXPECT_EQ(parted.crossings, 0);
  EXPECT_TRUE(self_intersections(parted.mesh.vertices, parted.mesh.faces).empty());
  EXPECT_LT((parted.mesh.vertices - good.vertices).rowwise().norm().maxCoeff(), 0.15);
  EXPECT_EQ(part_crossings(tube, 0).mesh.vertices, tube.vertices);
  EXPECT_GT(part_crossings(tube, 0).crossings, 0);
}

TEST(BodyFacing, TurnedBody_GivesItsFacing) {
  const Mesh body = body_surface(capsules());
  const BodyAnatomy anatomy = anatomy_of(body);
  for (const double degrees : {0.0, 40.0, 90.0, 180.0, 250.0}) {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitY())
            .toRotationMatrix();
    const Eigen::Vector3d facing = body_facing(anatomy, body.vertices * turn.transpose());
    EXPECT_LT((facing - turn.col(2)).norm(), 0.01) << degrees;
  }
  // On its side it looks nowhere along the ground that hips could tell.
  const Eigen::Matrix3d lying =
      Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_EQ(body_facing(anatomy, body.vertices * lying.transpose()), Eigen::Vector3d::Zero());
  EXPECT_THROW(body_facing(anatomy, body.vertices.topRows(4)), LogicError);
}

TEST(LimbAxisRefused, AnatomyNotFittingTheBody_IsRefused) {
  const Mesh body = body_surface(capsules());
  BodyAnatomy anatomy = anatomy_of(body);
  anatomy.limbs[0] = {Pelvis, 99};
  EXPECT_THROW(limb_axis(anatomy, Extremity::Head, body.vertices, body.faces), LogicError);
  anatomy = anatomy_of(body);
  EXPECT_THROW(limb_axis(anatomy, Extremity::Head, body.vertices.topRows(4), body.faces),
               LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
