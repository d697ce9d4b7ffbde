#include "bodymodel/measure.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/mhclo.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "core/error.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

// A closed tube of elliptic section along y from 0 to 1 round (cx, 0).
Mesh tube(double a, double b, double cx, int sides = 720) {
  Mesh mesh;
  mesh.vertices.resize(2 * sides + 2, 3);
  mesh.faces.resize(4 * sides, 3);
  for (int i = 0; i < sides; ++i) {
    const double t = 2 * M_PI * i / sides;
    mesh.vertices.row(i) << cx + a * std::cos(t), 0, b * std::sin(t);
    mesh.vertices.row(sides + i) << cx + a * std::cos(t), 1, b * std::sin(t);
    const int n = (i + 1) % sides;
    mesh.faces.row(4 * i) << i, sides + i, n;
    mesh.faces.row(4 * i + 1) << n, sides + i, sides + n;
    mesh.faces.row(4 * i + 2) << 2 * sides, i, n;
    mesh.faces.row(4 * i + 3) << 2 * sides + 1, sides + n, sides + i;
  }
  mesh.vertices.row(2 * sides) << cx, 0, 0;
  mesh.vertices.row(2 * sides + 1) << cx, 1, 0;
  return mesh;
}

BodyModel measured_human() {
  DefaultHumanOptions options;
  options.shape_basis = false;
  options.correctives = false;
  return default_human(options);
}

TEST(MeshVolume, TubeAndDistantTube_HaveTheirVolume) {
  Mesh mesh = tube(0.2, 0.1, 0);
  const double volume = mesh_volume(mesh.vertices, mesh.faces);
  EXPECT_NEAR(volume, M_PI * 0.2 * 0.1, 1e-5);
  mesh.vertices.rowwise() += Eigen::RowVector3d(1e4, -1e4, 1e4);
  EXPECT_NEAR(mesh_volume(mesh.vertices, mesh.faces), volume, 1e-9);
}

TEST(GirthAt, Girth_IsTheCircumferenceOfTheCut) {
  const Mesh mesh = tube(0.1, 0.1, 0);
  EXPECT_NEAR(girth_at(mesh.vertices, mesh.faces, {0.02, 0.5, 0.01}, {0, 1, 0}), 2 * M_PI * 0.1,
              1e-5);
  // Aslant by 60 degrees: an ellipse of half-axes 0.1 and 0.2.
  const Eigen::Vector3d normal(0, 0.5, std::sqrt(0.75));
  const double h = std::pow((0.2 - 0.1) / (0.2 + 0.1), 2);  // Ramanujan 1914
  const double ellipse = M_PI * 0.3 * (1 + 3 * h / (10 + std::sqrt(4 - 3 * h)));
  EXPECT_NEAR(girth_at(mesh.vertices, mesh.faces, {0, 0.5, 0}, normal), ellipse, 1e-4);
}

TEST(GirthAt, SeveralPieces_GiveTheConvexOutlineAroundTheBone) {
  Mesh mesh = tube(0.1, 0.1, 0);
  const Mesh other = tube(0.05, 0.05, 0.4);
  const Index n = mesh.vertices.rows();
  Points both(n + other.vertices.rows(), 3);
  both << mesh.vertices, other.vertices;
  Triangles faces(mesh.faces.rows() + other.faces.rows(), 3);
  faces << mesh.faces, other.faces.array() + static_cast<int>(n);
  EXPECT_NEAR(girth_at(both, faces, {0, 0.5, 0}, {0, 1, 0}), 0.2 * M_PI, 1e-4);
  EXPECT_NEAR(girth_at(both, faces, {0.4, 0.5, 0}, {0, 1, 0}), 0.1 * M_PI, 1e-4);
  EXPECT_EQ(girth_at(both, faces, {0.25, 0.5, 0}, {0, 1, 0}), 0);
  EXPECT_EQ(girth_at(both, faces, {0, 1.5, 0}, {0, 1, 0}), 0);
}

TEST(MeasureBody, TranslatedBody_HasTheSameMeasures) {
  BodyModel model = measured_human();
  const BodyMeasurements here = measure_body(model.mesh, model.skeleton);
  const Eigen::RowVector3d move(3, -1, 7);
  model.mesh.vertices.rowwise() += move;
  model.skeleton.offsets.row(0) += move;
  const BodyMeasurements there = measure_body(model.mesh, model.skeleton);
  for (const NamedMeasurement& name : measurement_names()) {
    EXPECT_NEAR(here.*name.value, there.*name.value, 1e-9 * std::max(1.0, here.*name.value))
        << name.name;
  }
}

// A copy of some faces' surface inside or beside the body, as eyes, teeth and hair are.
void add_piece(BodyModel& model, const Mesh& piece, const Eigen::RowVector3d& place) {
  const Index n = model.mesh.vertices.rows();
  Points vertices(n + piece.vertices.rows(), 3);
  vertices << model.mesh.vertices, piece.vertices.rowwise() + place;
  Triangles faces(model.mesh.faces.rows() + piece.faces.rows(), 3);
  faces << model.mesh.faces, piece.faces.array() + static_cast<int>(n);
  model.mesh.vertices = vertices;
  model.mesh.faces = faces;
  const Index slots = model.skin.joints.cols();
  model.skin.joints.conservativeResize(vertices.rows(), slots);
  model.skin.weights.conservativeResize(vertices.rows(), slots);
  model.skin.joints.bottomRows(piece.vertices.rows()).setZero();
  model.skin.weights.bottomRows(piece.vertices.rows()).setZero();
  model.skin.weights.col(0).tail(piece.vertices.rows()).setOnes();
}

TEST(MeasureBody, EyesTeethAndHair_AreNotMeasured) {
  BodyModel model = measured_human();
  model.shape.clear();
  const BodyMeasurements plain = measure_body(model);
  const double top = model.mesh.vertices.col(1).maxCoeff();
  const double neck = rest_positions(model.skeleton)(find_joint(model.skeleton, "neck"), 1);
  Mesh ball = tube(0.012, 0.012, 0, 24);
  ball.vertices.col(1) *= 0.024;
  add_piece(model, ball, {0.03, top - 0.12, 0.07});  // an eye
  add_piece(model, ball, {0, neck + 0.04, -0.01});   // something round the bone of the neck
  Mesh hair = tube(0.09, 0.1, 0, 24);                // above the head and down to the neck
  hair.vertices.col(1) *= 0.2;
  add_piece(model, hair, {0, top - 0.1, 0});
  const BodyMeasurements found = measure_body(model);
  for (const NamedMeasurement& name : measurement_names()) {
    EXPECT_DOUBLE_EQ(found.*name.value, plain.*name.value) << name.name;
  }
}

// MakeHuman's body with the eyes that hang on its base mesh: measured as the body alone.
TEST(MeasureBody, MakeHumanWithEyes_IsMeasuredAsItsSkin) {
  ATELIER_TEST_FILE(base, "makehuman/base/base.obj");
  ATELIER_TEST_FILE(eyes, "makehuman/eyes/high-poly.mhclo");
  const MakeHumanBody body = read_makehuman({base,
                                             base.parent_path() / "default.mhskel",
                                             base.parent_path() / "default_weights.mhw",
                                             {},
                                             {}});
  BodyModel model = body.model;
  model.skeleton = with_smpl_names(model.skeleton, recognised_humanoid(model.skeleton));
  const BodyMeasurements skin = measure_body(model);
  add_piece(model, read_makehuman_garment(eyes, body).mesh, Eigen::RowVector3d::Zero());
  const BodyMeasurements found = measure_body(model);
  for (const NamedMeasurement& name : measurement_names()) {
    EXPECT_DOUBLE_EQ(found.*name.value, skin.*name.value) << name.name;
  }
}

TEST(MeasureBody, ScaledBody_HasScaledMeasures) {
  BodyModel model = measured_human();
  const BodyMeasurements one = measure_body(model.mesh, model.skeleton);
  model.mesh.vertices *= 1.1;
  model.skeleton.offsets *= 1.1;
  const BodyMeasurements more = measure_body(model.mesh, model.skeleton);
  for (const NamedMeasurement& name : measurement_names()) {
    const double power = name.unit == "kg" ? 3 : 1;
    EXPECT_NEAR(more.*name.value / (one.*name.value), std::pow(1.1, power), 1e-9) << name.name;
  }
}

TEST(MeasureBody, Names_AreUniqueAndHaveUnits) {
  std::vector<std::string> names;
  for (const NamedMeasurement& name : measurement_names()) {
    EXPECT_THAT(name.unit, ::testing::AnyOf("m", "kg"));
    EXPECT_THAT(names, ::testing::Not(::testing::Contains(name.name)));
    names.push_back(name.name);
  }
  EXPECT_EQ(names.size(), 14u);
}

TEST(MeasureBody, SkeletonWithoutItsJoints_IsRefused) {
  BodyModel model = measured_human();
  model.skeleton.names[find_joint(model.skeleton, "left_knee")] = "knee";
  try {
    measure_body(model.mesh, model.skeleton);
    FAIL() << "no left_knee";
  } catch (const LogicError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("left_knee"));
  }
  EXPECT_THROW(measure_body(Mesh{}, model.skeleton), LogicError);
}

TEST(MeasureBody, BonesOutsideTheSkin_AreRefused) {
  BodyModel model = measured_human();
  model.skeleton.offsets(0, 2) += 2;  // the skeleton stands beside its body
  try {
    measure_body(model.mesh, model.skeleton);
    FAIL() << "no outline encloses these bones";
  } catch (const DataError& error) {
    EXPECT_EQ(error.where, "neck");
    EXPECT_THAT(error.expected, ::testing::HasSubstr("joints inside"));
  }
}

TEST(MeasureBody, TrunkGirths_DoNotDependOnTheSpine) {
  BodyModel model = measured_human();
  const BodyMeasurements inside = measure_body(model.mesh, model.skeleton);
  // MakeHuman's pelvis and neck joints lie so far back that the line between them leaves the small
  // of the back; here by 12 cm.
  Skeleton& skeleton = model.skeleton;
  const int pelvis = find_joint(skeleton, "pelvis");
  skeleton.offsets(pelvis, 2) -= 0.12;
  for (std::size_t i = 0; i < skeleton.parents.size(); ++i) {
    if (skeleton.parents[i] == pelvis) {
      skeleton.offsets(static_cast<Index>(i), 2) += 0.12;
    }
  }
  const BodyMeasurements behind = measure_body(model.mesh, skeleton);
  EXPECT_DOUBLE_EQ(behind.waist_girth, inside.waist_girth);
  EXPECT_DOUBLE_EQ(behind.chest_girth, inside.chest_girth);
  EXPECT_DOUBLE_EQ(behind.hip_girth, inside.hip_girth);
}

TEST(MeasureBody, OpenSkin_IsRefused) {
  BodyModel model = measured_human();
  // Half of the triangles: no cut closes.
  const Triangles left = model.mesh.faces.topRows(model.mesh.faces.rows() / 2);
  model.mesh.faces = left;
  EXPECT_THROW(measure_body(model.mesh, model.skeleton), DataError);
}

template <class Spoil>
void expect_refused_measure(const char* words, const Spoil& spoil) {
  BodyModel model = measured_human();
  spoil(model);
  EXPECT_THAT([&] { measure_body(model); },
              ::testing::ThrowsMessage<DataError>(::testing::HasSubstr(words)));
}

TEST(MeasureBody, SkinWithoutVolume_IsRefused) {
  expect_refused_measure("an opening of 0.", [](BodyModel& m) {  // without a foot
    const double ankle = rest_positions(m.skeleton)(find_joint(m.skeleton, "left_ankle"), 1);
    Triangles kept(m.mesh.faces.rows(), 3);
    Index count = 0;
    for (Index f = 0; f < m.mesh.faces.rows(); ++f) {
      const int v = m.mesh.faces(f, 0);
      if (m.mesh.vertices(v, 1) > ankle || m.mesh.vertices(v, 0) < 0) {
        kept.row(count++) = m.mesh.faces.row(f);
      }
    }
    m.mesh.faces = kept.topRows(count);
    m.mesh.uv_faces.resize(0, 3);
    m.mesh.uvs.resize(0, 2);
  });
  expect_refused_measure("counter-clockwise from outside",
                         [](BodyModel& m) { m.mesh.faces.col(1).swap(m.mesh.faces.col(2)); });
}

TEST(MeasureBody, BodyNotStandingUpright_IsRefused) {
  expect_refused_measure("legs that do not stand upright", [](BodyModel& m) {
    m.skeleton.offsets.row(find_joint(m.skeleton, "left_knee")) << 0, 0, 0.4;
    m.skeleton.offsets.row(find_joint(m.skeleton, "left_ankle")) << 0, 0, 0.4;
  });
  expect_refused_measure("hips and neck that do not stand upright",
                         [](BodyModel& m) {  // a trunk level
                           for (const char* name : {"spine1", "spine2", "spine3", "neck"}) {
                             m.skeleton.offsets.row(find_joint(m.skeleton, name)) << 0, 0, 0.15;
                           }
                         });
}

TEST(Measure, SplitSeams_AreJoined) {
  DefaultHumanOptions options;
  options.shape_basis = false;
  BodyModel model = default_human(options);
  const BodyMeasurements whole = measure_body(model);
  // Every triangle with vertices of its own, as a file with an atlas may have them.
  const Triangles faces = model.mesh.faces;
  Points vertices(3 * faces.rows(), 3);
  for (Index i = 0; i < faces.size(); ++i) {
    vertices.row(i) = model.mesh.vertices.row(faces.data()[i]);
    model.mesh.faces.data()[i] = static_cast<int>(i);
  }
  model.mesh.vertices = vertices;
  const BodyMeasurements split = measure_body(model);
  for (const NamedMeasurement& name : measurement_names()) {
    EXPECT_NEAR(split.*name.value, whole.*name.value, 1e-9) << name.name;
  }
}

}  // namespace
}  // namespace atelier
