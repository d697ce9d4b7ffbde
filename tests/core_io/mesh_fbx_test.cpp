#include "core/io/mesh_fbx.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/fbx_shapes.h"
#include "core/io/file_bytes.h"
#include "core/io/mesh_file.h"
#include "tests/support/needs_fbx.h"
#include "tests/support/places.h"

namespace atelier {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const std::filesystem::path kCorpus = fixtures::source_directory() / "fuzz" / "corpus" / "fbx";

GltfScene scene_of(const std::string& text) {
  return read_fbx(std::as_bytes(std::span(text)), "a.fbx");
}

std::string scene_text(const std::string& objects, const std::string& connections) {
  return "; FBX 7.4.0 project file\nFBXHeaderExtension: {\nFBXVersion: 7400\n}\nObjects: {\n" +
         objects + "}\nConnections: {\n" + connections + "}\n";
}

// A square of 2 by 2 units in the plane z = 1, as one polygon.
constexpr const char* kSquare =
    "Geometry: 10,\"Geometry::g\",\"Mesh\" {\nVertices: *12 {\na: -1,-1,1,1,-1,1,1,1,1,-1,1,1\n}\n"
    "PolygonVertexIndex: *4 {\na: 0,1,2,-4\n}\n}\n";

// A tetrahedron on two bones with texture coordinates, a blend shape and an animation: as text and
// in binary, where every second array is deflated.
TEST(MeshFbx, TextAndBinary_GiveTheSameScene) {
  ATELIER_NEEDS_FBX();
  for (const char* name : {"small.fbx", "binary.fbx"}) {
    const GltfScene scene = read_fbx(kCorpus / name);
    ASSERT_EQ(scene.skins.size(), 1u) << name;
    ASSERT_EQ(scene.skins[0].joints.size(), 2u) << name;
    EXPECT_EQ(scene.nodes[static_cast<std::size_t>(scene.skins[0].joints[1])].name, "high");
    EXPECT_NEAR(scene.skins[0].inverse_binds[1](1, 3), -10, 1e-6) << name;
    const GltfMesh& mesh = scene.meshes.at(0);
    ASSERT_EQ(mesh.primitives.size(), 1u);
    EXPECT_EQ(mesh.primitives[0].mesh.faces.rows(), 4) << name;
    EXPECT_THAT(mesh.target_names, ElementsAre("tall")) << name;
    EXPECT_NEAR(mesh.primitives[0].targets[0].positions.cwiseAbs().maxCoeff(), 5, 1e-6) << name;
    ASSERT_EQ(scene.animations.size(), 1u) << name;
    EXPECT_EQ(scene.animations[0].name, "turn");
    EXPECT_DOUBLE_EQ(scene.animations[0].channels.at(0).times.back(), 1) << name;
    const Mesh shown = rest_mesh(scene);
    EXPECT_NEAR(shown.vertices.col(1).maxCoeff(), 0.2, 1e-7) << name;
    EXPECT_NEAR(shown.uvs.maxCoeff(), 1, 1e-7) << name;
  }
}

TEST(MeshFbx, Polygons_AreTriangulatedWithSharedVertices) {
  ATELIER_NEEDS_FBX();
  const std::string text =
      scene_text(std::string(kSquare) + "Model: 20,\"Model::sheet\",\"Mesh\" {\n}\n",
                 "C: \"OO\",20,0\nC: \"OO\",10,20\n");
  const Mesh mesh = rest_mesh(scene_of(text));
  EXPECT_EQ(mesh.vertices.rows(), 4);
  EXPECT_EQ(mesh.faces.rows(), 2);
  EXPECT_NEAR(mesh.vertices.col(0).maxCoeff(), 0.01, 1e-9);  // centimetres where nothing says
}

TEST(MeshFbx, NodeTransforms_PlaceTheirMeshes) {
  ATELIER_NEEDS_FBX();
  const std::string placed =
      "Properties70: {\nP: \"Lcl Translation\",\"Lcl Translation\",\"\",\"A\",100,0,0\n"
      "P: \"Lcl Rotation\",\"Lcl Rotation\",\"\",\"A\",0,90,0\n"
      "P: \"Lcl Scaling\",\"Lcl Scaling\",\"\",\"A\",2,2,2\n}\n";
  const std::string text =
      scene_text(std::string(kSquare) + "Model: 20,\"Model::sheet\",\"Mesh\" {\n" + placed + "}\n",
                 "C: \"OO\",20,0\nC: \"OO\",10,20\n");
  const Mesh mesh = rest_mesh(scene_of(text));
  EXPECT_LT((mesh.vertices.col(0).array() - 1.02).abs().maxCoeff(), 1e-7);
  EXPECT_NEAR(mesh.vertices.col(2).maxCoeff(), 0.02, 1e-7);
}

// As 3ds Max writes moved pivots: the place of a mesh in its node, which its children do not have.
TEST(MeshFbx, GeometricTransforms_PlaceMeshesAndNotTheirChildren) {
  ATELIER_NEEDS_FBX();
  const auto model = [](const char* id, const char* name, const char* properties) {
    return std::string("Model: ") + id + ",\"Model::" + name + "\",\"Mesh\" {\nProperties70: {\n" +
           properties + "}\n}\n";
  };
  const std::string text = scene_text(
      std::string(kSquare) +
          model("20", "above",
                "P: \"Lcl Translation\",\"Lcl Translation\",\"\",\"A\",100,0,0\n"
                "P: \"GeometricTranslation\",\"Vector3D\",\"Vector\",\"\",0,0,4\n"
                "P: \"GeometricRotation\",\"Vector3D\",\"Vector\",\"\",90,0,0\n"
                "P: \"GeometricScaling\",\"Vector3D\",\"Vector\",\"\",3,1,1\n") +
          model("21", "below", "P: \"Lcl Translation\",\"Lcl Translation\",\"\",\"A\",0,50,0\n"),
      "C: \"OO\",20,0\nC: \"OO\",21,20\nC: \"OO\",10,20\nC: \"OO\",10,21\n");
  const Mesh mesh = rest_mesh(scene_of(text));
  ASSERT_EQ(mesh.vertices.rows(), 8);
  // (x, y, 1) is scaled (3x, y, 1), turned about x (3x, -1, y), moved by 4 along z and by the node.
  const Points above = mesh.vertices.topRows(4);
  EXPECT_NEAR(above.col(0).maxCoeff(), 1.03, 1e-7);
  EXPECT_LT((above.col(1).array() + 0.01).abs().maxCoeff(), 1e-7);
  EXPECT_NEAR(above.col(2).minCoeff(), 0.03, 1e-7);
  const Points below = mesh.vertices.bottomRows(4);
  EXPECT_NEAR(below.col(0).maxCoeff(), 1.01, 1e-7);
  EXPECT_NEAR(below.col(1).minCoeff(), 0.49, 1e-7);
  EXPECT_NEAR(below.col(2).maxCoeff(), 0.01, 1e-7);
}

// x first, whatever order the node's own rotation has.
TEST(MeshFbx, GeometricRotation_IsInItsOwnOrder) {
  ATELIER_NEEDS_FBX();
  const Mesh mesh = rest_mesh(scene_of(scene_text(
      std::string(kSquare) +
          "Model: 20,\"Model::sheet\",\"Mesh\" {\nProperties70: {\n"
          "P: \"RotationOrder\",\"enum\",\"\",\"\",5\nP: \"RotationActive\",\"bool\",\"\",\"\",1\n"
          "P: \"GeometricRotation\",\"Vector3D\",\"Vector\",\"\",90,0,90\n}\n}\n",
      "C: \"OO\",20,0\nC: \"OO\",10,20\n")));
  // (x, y, 1) is turned about x (x, -1, y), then about z (1, x, y).
  EXPECT_LT((mesh.vertices.row(0) - Eigen::RowVector3d(0.01, -0.01, -0.01)).norm(), 1e-7);
  EXPECT_LT((mesh.vertices.row(1) - Eigen::RowVector3d(0.01, 0.01, -0.01)).norm(), 1e-7);
}

TEST(MeshFbx, PostRotation_TurnsBack) {
  ATELIER_NEEDS_FBX();
  const auto placed = [](const std::string& more) {
    return rest_mesh(scene_of(scene_text(
        std::string(kSquare) + "Model: 20,\"Model::sheet\",\"Mesh\" {\nProperties70: {\n" + more +
            "P: \"Lcl Rotation\",\"Lcl Rotation\",\"\",\"A\",0,0,90\n"
            "P: \"RotationActive\",\"bool\",\"\",\"\",1\n}\n}\n",
        "C: \"OO\",20,0\nC: \"OO\",10,20\n")));
  };
  // A quarter turn about z, after the inverse of one about x: (x, y, 1) is (x, 1, -y), then
  // (-1, x, -y).
  const Mesh mesh = placed("P: \"PostRotation\",\"Vector3D\",\"Vector\",\"\",90,0,0\n");
  EXPECT_LT((mesh.vertices.col(0).array() + 0.01).abs().maxCoeff(), 1e-7);
  EXPECT_LT((mesh.vertices.row(0) - Eigen::RowVector3d(-0.01, -0.01, 0.01)).norm(), 1e-7);
}

std::string model_text(const std::string& id, const std::string& name,
                       const std::string& properties) {
  return "Model: " + id + ",\"Model::" + name + "\",\"Mesh\" {\nProperties70: {\n" + properties +
         "}\n}\n";
}

std::string inherit_type(int type) {
  return "P: \"InheritType\",\"enum\",\"\",\"\"," + std::to_string(type) + "\n";
}

// A square below a node of this scale.
Mesh scaled_below(const std::string& scale, const std::string& below) {
  return rest_mesh(scene_of(scene_text(
      std::string(kSquare) +
          model_text("20", "above",
                     "P: \"Lcl Translation\",\"Lcl Translation\",\"\",\"A\",100,0,0\n"
                     "P: \"Lcl Scaling\",\"Lcl Scaling\",\"\",\"A\"," +
                         scale + "\n") +
          model_text("21", "below",
                     "P: \"Lcl Translation\",\"Lcl Translation\",\"\",\"A\",0,50,0\n" + below),
      "C: \"OO\",20,0\nC: \"OO\",21,20\nC: \"OO\",10,21\n")));
}

// Maya's segment scale compensation: the parent's scale moves the child and does not scale it.
TEST(MeshFbx, ScaleThatIsNotInherited_MovesTheChildAlone) {
  ATELIER_NEEDS_FBX();
  for (const auto& [type, half] : {std::pair(2, 0.01), std::pair(1, 0.02), std::pair(0, 0.02)}) {
    const Mesh mesh = scaled_below("2,2,2", inherit_type(type));
    EXPECT_NEAR(mesh.vertices.col(0).minCoeff(), 1 - half, 1e-7) << type;
    EXPECT_NEAR(mesh.vertices.col(1).minCoeff(), 1 - half, 1e-7) << type;
    EXPECT_NEAR(mesh.vertices.col(1).maxCoeff(), 1 + half, 1e-7) << type;
  }
}

TEST(MeshFbx, UnevenScale_IsBeforeTheChildsRotationWhereItSaysSo) {
  ATELIER_NEEDS_FBX();
  const std::string turned = "P: \"Lcl Rotation\",\"Lcl Rotation\",\"\",\"A\",0,0,90\n";
  for (const auto& [type, wide, high] :
       {std::tuple(0, 0.01, 0.03), std::tuple(1, 0.03, 0.01), std::tuple(2, 0.01, 0.01)}) {
    const Mesh mesh = scaled_below("3,1,1", turned + inherit_type(type));
    EXPECT_NEAR(mesh.vertices.col(0).maxCoeff(), 1 + wide, 1e-7) << type;
    EXPECT_NEAR(mesh.vertices.col(1).maxCoeff(), 0.5 + high, 1e-7) << type;
  }
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string small_text() {
  return read_file_text(kCorpus / "small.fbx", 1 << 20);
}

// The tetrahedron's upper bone turns about x, below a lower one of another scale.
std::string scaled_bones(const std::string& scale, const std::string& of_high) {
  std::string text = replaced(small_text(), "Model: 21,\"Model::low\",\"LimbNode\" {\n",
                              "Model: 21,\"Model::low\",\"LimbNode\" {\nProperties70: {\n"
                              "P: \"Lcl Scaling\",\"Lcl Scaling\",\"\",\"A\"," +
                                  scale + "\n}\n");
  return replaced(std::move(text), "\"A\",0,10,0\n", "\"A\",0,10,0\n" + of_high);
}

TEST(MeshFbx, AnimatedChildOfAnEvenScale_KeepsItsOwn) {
  ATELIER_NEEDS_FBX();
  for (const auto& [type, kept] : {std::pair(2, 0.5), std::pair(1, 1.0), std::pair(0, 1.0)}) {
    const GltfScene scene = scene_of(scaled_bones("2,2,2", inherit_type(type)));
    ASSERT_EQ(scene.animations.size(), 1u) << type;
    for (const GltfChannel& channel : scene.animations[0].channels) {
      if (channel.path == GltfPath::Scale &&
          scene.nodes[static_cast<std::size_t>(channel.node)].name == "high") {
        EXPECT_LT((channel.values.array() - kept).abs().maxCoeff(), 1e-6) << type;
      }
    }
  }
}

TEST(MeshFbx, AnimatedChildOfAnUnevenScale_IsSaidAndLeftOut) {
  ATELIER_NEEDS_FBX();
  for (const int type : {0, 2}) {
    const GltfScene scene = scene_of(scaled_bones("2,1,1", inherit_type(type)));
    EXPECT_TRUE(scene.animations.empty()) << type;
    EXPECT_THAT(scene.findings, Contains(Field(&Finding::code, "fbx-scales"))) << type;
  }
  EXPECT_EQ(scene_of(scaled_bones("2,1,1", inherit_type(1))).animations.size(), 1u);
}

TEST(MeshFbx, BlendShapes_StandAsTheyWereSaved) {
  ATELIER_NEEDS_FBX();
  const std::string field = "DeformPercent: 0\n";
  for (const std::string& saved :
       {std::string("DeformPercent: 30\n"),
        "Properties70: {\nP: \"DeformPercent\",\"Number\",\"\",\"A\",30\n}\n" + field}) {
    const GltfScene scene = scene_of(replaced(small_text(), field, saved));
    EXPECT_THAT(scene.meshes.at(0).weights, ElementsAre(0.3));
    EXPECT_NEAR(rest_mesh(scene).vertices.col(1).maxCoeff(), 0.215, 1e-7);
  }
}

TEST(MeshFbx, ShapesOfOneChannel_AreBlendedBetweenTheirFullWeights) {
  const auto parts = [](double percent) { return fbx_shape_parts(percent, {50, 100}); };
  EXPECT_THAT(parts(0), ElementsAre(0, 0));
  EXPECT_THAT(parts(25), ElementsAre(0.5, 0));
  EXPECT_THAT(parts(50), ElementsAre(1, 0));
  EXPECT_THAT(parts(75), ElementsAre(0.5, 0.5));
  EXPECT_THAT(parts(100), ElementsAre(0, 1));
  EXPECT_THAT(parts(150), ElementsAre(-1, 2));
  EXPECT_THAT(parts(-25), ElementsAre(-0.5, 0));
  EXPECT_THAT(fbx_shape_parts(-30, {100, -20, -40}), ElementsAre(0, 0.5, 0.5));
  EXPECT_THAT(fbx_shape_parts(80, {80}), ElementsAre(1));
}

TEST(MeshFbxRefused, BlendShapesOfOneNameAtOtherWeights_AreRefused) {
  ATELIER_NEEDS_FBX();
  std::string text =
      replaced(small_text(), "Geometry: 42,",
               "Deformer: 43,\"SubDeformer::tall\",\"BlendShapeChannel\" {\nDeformPercent: 50\n}\n"
               "Geometry: 44,\"Geometry::tall\",\"Shape\" {\nIndexes: *1 {\na: 0\n}\n"
               "Vertices: *3 {\na: 0,5,0\n}\nNormals: *3 {\na: 0,0,0\n}\n}\nGeometry: 42,");
  text = replaced(text, "C: \"OO\",42,41\n", "C: \"OO\",42,41\nC: \"OO\",43,40\nC: \"OO\",44,43\n");
  EXPECT_THAT([&] { scene_of(text); }, ThrowsMessage<DataError>(HasSubstr("blend shape 'tall'")));
}

TEST(MeshFbxRefused, DualQuaternionsOutOfTheBindPose_AreRefused) {
  ATELIER_NEEDS_FBX();
  const auto saved = [](const std::string& type, const std::string& turn) {
    std::string text =
        replaced(small_text(), "\"Skin\" {\n", "\"Skin\" {\nSkinningType: " + type + "\n");
    return scene_of(replaced(std::move(text), "\"A\",0,10,0\n", "\"A\",0,10,0\n" + turn));
  };
  const std::string turn = "P: \"Lcl Rotation\",\"Lcl Rotation\",\"\",\"A\",40,0,0\n";
  const std::string mixed = "\"Blend\"\nIndexes: *2 {\na: 0,1\n}\nBlendWeights: *2 {\na: ";
  for (const std::string& type : {std::string("\"DualQuaternion\""), mixed + "0,0.5\n}"}) {
    EXPECT_NEAR(rest_mesh(saved(type, "")).vertices.col(1).maxCoeff(), 0.2, 1e-7) << type;
    const GltfScene bent = saved(type, turn);
    EXPECT_EQ(bent.animations.size(), 1u) << "a motion all the same";
    EXPECT_THAT([&] { rest_mesh(bent); }, ThrowsMessage<DataError>(HasSubstr("dual quaternions")))
        << type;
  }
  // 3ds Max writes all of its skins as mixed.
  for (const std::string& type : {std::string("\"Linear\""), mixed + "0,0\n}"}) {
    EXPECT_LT(rest_mesh(saved(type, turn)).vertices.col(1).maxCoeff(), 0.2) << type;
  }
}

// Two skinned meshes on one skeleton, each a node of its own that stands elsewhere.
TEST(MeshFbx, SkinnedMeshesOfOneSkeleton_AreMerged) {
  ATELIER_NEEDS_FBX();
  const auto mesh = [](int id, int x) {
    const std::string n = std::to_string(id);
    const std::string tx = std::to_string(x);
    return "Geometry: 1" + n +
           ",\"Geometry::g\",\"Mesh\" {\nVertices: *9 {\na: 0,0,0,1,0,0,0,1,0\n}\n"
           "PolygonVertexIndex: *3 {\na: 0,1,-3\n}\n}\nModel: 2" +
           n + ",\"Model::part" + n +
           "\",\"Mesh\" {\nProperties70: {\nP: \"Lcl Translation\",\"Lcl "
           "Translation\",\"\",\"A\"," +
           tx + ",0,0\n}\n}\nDeformer: 3" + n + ",\"Deformer::\",\"Skin\" {\n}\nDeformer: 4" + n +
           ",\"SubDeformer::\",\"Cluster\" {\nIndexes: *3 {\na: 0,1,2\n}\nWeights: *3 {\na: "
           "1,1,1\n}\nTransform: *16 {\na: 1,0,0,0,0,1,0,0,0,0,1,0," +
           tx + "," + (id == 0 ? "0" : "-50") +
           ",0,1\n}\nTransformLink: *16 {\na: 1,0,0,0,0,1,0,0,0,0,1,0,0," + (id == 0 ? "0" : "50") +
           ",0,1\n}\n}\n";
  };
  const std::string text = scene_text(
      mesh(0, 7) + mesh(1, -7) +
          "Model: 90,\"Model::low\",\"LimbNode\" {\n}\nModel: 91,\"Model::high\",\"LimbNode\" {\n"
          "Properties70: {\nP: \"Lcl Translation\",\"Lcl Translation\",\"\",\"A\",0,50,0\n}\n}\n",
      "C: \"OO\",20,0\nC: \"OO\",10,20\nC: \"OO\",21,0\nC: \"OO\",11,21\nC: \"OO\",90,0\n"
      "C: \"OO\",91,90\nC: \"OO\",30,10\nC: \"OO\",40,30\nC: \"OO\",90,40\nC: \"OO\",31,11\n"
      "C: \"OO\",41,31\nC: \"OO\",91,41\n");
  const GltfScene scene = scene_of(text);
  EXPECT_THAT(scene.findings, Contains(Field(&Finding::code, "fbx-meshes")));
  ASSERT_EQ(scene.meshes.size(), 1u);
  ASSERT_EQ(scene.meshes[0].primitives.size(), 2u);
  ASSERT_EQ(scene.skins.at(0).joints.size(), 2u);
  const Mesh shown = rest_mesh(scene);
  EXPECT_NEAR(shown.vertices.col(0).maxCoeff(), 0.08, 1e-7);
  EXPECT_NEAR(shown.vertices.col(0).minCoeff(), -0.07, 1e-7);
  EXPECT_NEAR(shown.vertices.col(1).maxCoeff(), 0.01, 1e-7);
}

TEST(MeshFbx, NonUtf8Name_IsReplaced) {
  ATELIER_NEEDS_FBX();
  const std::string text =
      scene_text(std::string(kSquare) + "Model: 20,\"Model::T\xFF\xFEy\",\"Mesh\" {\n}\n",
                 "C: \"OO\",20,0\nC: \"OO\",10,20\n");
  EXPECT_EQ(scene_of(text).nodes.at(1).name, "T??y");
}

TEST(MeshFbxRefused, FileBeyondLimits_Throws) {
  ATELIER_NEEDS_FBX();
  Limits limits;
  limits.mesh_file_bytes = 1'000;
  EXPECT_THAT([&] { read_fbx(kCorpus / "small.fbx", limits); },
              ThrowsMessage<DataError>(HasSubstr("at most 1000")));
  limits = {};
  limits.joints = 1;
  EXPECT_THAT([&] { read_fbx(kCorpus / "small.fbx", limits); },
              ThrowsMessage<DataError>(HasSubstr("2 joints")));
  limits = {};
  limits.mesh_vertices = 3;
  EXPECT_THAT([&] { read_fbx(kCorpus / "small.fbx", limits); }, ::testing::Throws<DataError>());
}

TEST(MeshFbxRefused, LeftHandedAxes_Throw) {
  ATELIER_NEEDS_FBX();
  std::string text = scene_text(kSquare, "");
  text.insert(text.find("Objects"),
              "GlobalSettings: {\nProperties70: {\nP: \"CoordAxisSign\",\"int\",\"Integer\",\"\","
              "-1\n}\n}\n");
  EXPECT_THAT([&] { scene_of(text); }, ThrowsMessage<DataError>(HasSubstr("not right-handed")));
}

}  // namespace
}  // namespace atelier
