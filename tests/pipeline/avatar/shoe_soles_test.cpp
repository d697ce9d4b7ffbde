#include "pipeline/avatar/shoe_soles.h"

#include <gtest/gtest.h>

#include "bodymodel/formats/personal_body.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "core/label.h"
#include "core/normals.h"

namespace atelier {
namespace {

/// A person who leans, and the scan of them: below the ankles shoes, of which nothing that looks
/// down is seen.
struct ScannedPerson {
  BodyModel model = plain_person(default_human(female_human())).model;
  Points body;
  ClothedScan scan;
  Eigen::Vector3d down;

  explicit ScannedPerson(Label below) {
    Pose pose = rest_pose(model.skeleton);
    pose.rotations.row(0) << 0.3, 0.7, 0.1;
    body = skin_vertices(model, pose);
    const Eigen::Vector3d turn = pose.rotations.row(0).transpose();
    down = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * -Eigen::Vector3d::UnitY();
    const Points& rest = model.mesh.vertices;
    const double ankle = rest.col(1).minCoeff() + 0.09;
    const Points normals = face_normals(body, model.mesh.faces);
    scan.mesh.vertices = body;
    std::vector<int> seen;
    for (Index f = 0; f < model.mesh.faces.rows(); ++f) {
      if (normals.row(f).dot(down) < 0.5) {
        seen.push_back(static_cast<int>(f));
      }
    }
    scan.mesh.faces = model.mesh.faces(seen, Eigen::all);
    for (Index v = 0; v < rest.rows(); ++v) {
      const bool shoe = rest(v, 1) < ankle;
      scan.mesh.labels.push_back(static_cast<std::uint8_t>(shoe ? below : Label::Skin));
      scan.roles.push_back(shoe ? ScanRole::Cover : ScanRole::Skin);
    }
  }
};

TEST(ShoeSoles, BothShoes_AreClosedBelow) {
  ScannedPerson person(Label::Shoes);
  const Index vertices = person.scan.mesh.vertices.rows();
  const Index faces = person.scan.mesh.faces.rows();
  add_soles(person.scan, person.model, person.body);
  const Mesh& mesh = person.scan.mesh;
  ASSERT_GT(mesh.faces.rows(), faces + 200);
  EXPECT_EQ(person.scan.roles.size(), static_cast<std::size_t>(mesh.vertices.rows()));
  EXPECT_EQ(person.scan.roles.back(), ScanRole::Cover);
  const Points normals = face_normals(mesh.vertices, mesh.faces);
  for (Index f = faces; f < mesh.faces.rows(); ++f) {
    EXPECT_GT(normals.row(f).dot(person.down), 0.6);
  }
  const double lowest = (person.body * person.down).maxCoeff();
  const Points soles = mesh.vertices.bottomRows(mesh.vertices.rows() - vertices);
  EXPECT_NEAR((soles * person.down).maxCoeff(), lowest, 0.005);
  EXPECT_NO_THROW(scan_surface(person.scan));
}

TEST(ShoeSoles, BareFeet_StayAsTheyAre) {
  ScannedPerson person(Label::Skin);
  const Index vertices = person.scan.mesh.vertices.rows();
  add_soles(person.scan, person.model, person.body);
  EXPECT_EQ(person.scan.mesh.vertices.rows(), vertices);
}

}  // namespace
}  // namespace atelier
