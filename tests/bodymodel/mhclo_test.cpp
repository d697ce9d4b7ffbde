#include "bodymodel/formats/mhclo.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/skinning.h"
#include "core/error.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const std::string kGarment =
    "# a comment\nbasemesh hm08\nname shirt\nobj_file shirt.obj\nx_scale 0 1 2.0\nverts 0\n"
    "material shirt.mhmat\n2\n0 1 2 0.5 0.25 0.25 1 0 0\nuuid 12\ndelete_verts\n4 6 - 8 3\n";

Mhclo parse(const std::string& text) {
  return read_mhclo(std::as_bytes(std::span(text)), "a.mhclo", 10);
}

TEST(Mhclo, BothKindsOfRows_AreRead) {
  const Mhclo garment = parse(kGarment);
  EXPECT_EQ(garment.name, "shirt");
  EXPECT_EQ(garment.obj_file, "shirt.obj");
  ASSERT_EQ(garment.vertices.size(), 2u);
  EXPECT_EQ(garment.vertices[0].base[0], 2);
  EXPECT_EQ(garment.vertices[1].weights, Eigen::Vector3d(0.5, 0.25, 0.25));
  EXPECT_EQ(garment.deleted, (std::vector<int>{3, 4, 6, 7, 8}));
}

TEST(Mhclo, Offsets_ScaleWithTheBody) {
  const Mhclo garment = parse(kGarment);
  Points base = Points::Zero(10, 3);
  base.row(1) << 0.4, 0, 0;  // the two ends of x_scale are 4 dm apart, 2 when it was made
  base.row(2) << 0, 1, 0;
  const Points vertices = fitted_vertices(garment, base);
  EXPECT_NEAR((vertices.row(0) - Eigen::RowVector3d(0, 1, 0)).norm(), 0, 1e-15);
  EXPECT_NEAR((vertices.row(1) - Eigen::RowVector3d(0.1 + 0.2, 0.25, 0)).norm(), 0, 1e-15);
}

TEST(Mhclo, MalformedFiles_AreRefused) {
  const auto refused = [](const char* from, const char* to, const char* message) {
    std::string text = kGarment;
    text.replace(text.find(from), std::string(from).size(), to);
    EXPECT_THAT([&] { parse(text); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("a.mhclo: line"), HasSubstr(message))));
  };
  refused("hm08", "alpha_7", "hm08");
  refused("0 1 2.0", "0 10 2.0", "[0, 10)");
  refused("0 1 2.0", "0 1 0", "more than 0");
  refused("0 1 2.0", "0 1", "a length");
  refused("\n2\n", "\n10\n", "[0, 10)");
  refused("\n2\n", "\n2 3\n", "a vertex");
  refused("0.5 0.25", "nan 0.25", "'nan'");
  refused("1 0 0\nuuid", "1 0 0 0\nuuid", "more than nine words");
  refused("0 1 2 0.5", "0 -1 2 0.5", "vertex -1");
  refused("6 - 8", "8 - 6", "an increasing one");
  refused("6 - 8", "6 - 99", "[0, 10)");
  refused("6 - 8", "6 x 8", "'x'");
  EXPECT_THAT([] { parse("basemesh hm08\nverts 0\n"); },
              ThrowsMessage<DataError>(HasSubstr("no vertices")));
}

MakeHumanBody real_body(double gender) {
  const std::filesystem::path root = fixtures::test_data_root() / "makehuman";
  MakeHumanFiles files;
  files.base = root / "base/base.obj";
  files.rig = root / "base/default.mhskel";
  files.weights = root / "base/default_weights.mhw";
  files.macros = root / "targets/macrodetails";
  MakeHumanOptions options;
  options.macros.gender = gender;
  return read_makehuman(files, options);
}

TEST(Mhclo, RealGarments_FitAnyBody) {
  ATELIER_TEST_FILE(clothes, "makehuman/clothes");
  for (const double gender : {0.0, 1.0}) {
    const MakeHumanBody body = real_body(gender);
    const double top = body.model.mesh.vertices.col(1).maxCoeff();
    int garments = 0;
    for (const auto& folder : std::filesystem::directory_iterator(clothes)) {
      const std::string name = folder.path().filename();
      const BodyModel garment = read_makehuman_garment(folder.path() / (name + ".mhclo"), body);
      ++garments;
      EXPECT_GT(garment.mesh.vertices.col(1).minCoeff(), -0.03) << name;
      EXPECT_LT(garment.mesh.vertices.col(1).maxCoeff(), top) << name;
      EXPECT_LT(garment.mesh.vertices.col(0).cwiseAbs().maxCoeff(), 0.7) << name;
    }
    EXPECT_EQ(garments, 6);
  }
}

TEST(Mhclo, Garment_MovesWithItsBody) {
  ATELIER_TEST_FILE(file, "makehuman/clothes/male_casualsuit03/male_casualsuit03.mhclo");
  const MakeHumanBody body = real_body(1);
  const BodyModel garment = read_makehuman_garment(file, body);
  Pose pose = rest_pose(body.model.skeleton);
  pose.rotations.row(find_joint(body.model.skeleton, "upperarm01.L")) << 0, 0, 0.6;
  const Points moved = skin_vertices(garment, pose) - garment.mesh.vertices;
  EXPECT_GT(moved.rowwise().norm().maxCoeff(), 0.05);
  EXPECT_TRUE(moved.allFinite());
}

TEST(Mhclo, ObjOutsideTheFolder_IsRefused) {
  ATELIER_TEST_FILE(file, "makehuman/base/base.obj");
  const MakeHumanBody body = real_body(0.5);
  const fixtures::TemporaryDirectory folder;
  for (const std::string obj : {"../shirt.obj", "/etc/shirt.obj", "sub/shirt.obj", ""}) {
    std::ofstream(folder / "a.mhclo") << "basemesh hm08\nobj_file " << obj << "\nverts 0\n1\n";
    EXPECT_THAT([&] { read_makehuman_garment(folder / "a.mhclo", body); },
                ThrowsMessage<DataError>(HasSubstr("an OBJ beside the .mhclo")))
        << obj;
  }
}

TEST(Mhclo, ObjOfAnotherGarment_IsRefused) {
  ATELIER_TEST_FILE(file, "makehuman/base/base.obj");
  const MakeHumanBody body = real_body(0.5);
  const fixtures::TemporaryDirectory folder;
  std::ofstream(folder / "s.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  std::ofstream(folder / "a.mhclo") << "basemesh hm08\nobj_file s.obj\nverts 0\n1\n";
  EXPECT_THAT([&] { read_makehuman_garment(folder / "a.mhclo", body); },
              ThrowsMessage<DataError>(HasSubstr("as its OBJ has vertices")));
}

}  // namespace
}  // namespace atelier
