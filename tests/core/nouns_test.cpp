// The small nouns: mesh, sequence, skeleton, garment, image, finding, errors.
#include <cmath>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/finding.h"
#include "core/garment.h"
#include "core/image.h"
#include "core/mesh.h"
#include "core/sequence.h"
#include "core/skeleton.h"

namespace atelier {
namespace {

Mesh one_triangle() {
  Mesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  mesh.faces.resize(1, 3);
  mesh.faces << 0, 1, 2;
  return mesh;
}

template <class Check>
std::string words_of_refusal(const Check& check) {
  try {
    check();
  } catch (const DataError& error) {
    return error.what();
  } catch (const LogicError& error) {
    return error.what();
  }
  return "accepted";
}

void expect_words(const std::string& text, const std::string& words) {
  EXPECT_NE(text.find(words), std::string::npos) << text;
}

TEST(Mesh, ValidAndEmptyMesh_AreAccepted) {
  EXPECT_NO_THROW(check_mesh(one_triangle()));
  EXPECT_NO_THROW(check_mesh(Mesh{}));
}

TEST(MeshRefused, FaceIndexOutOfRange_Throws) {
  for (const int bad : {-1, 3, 2147483647}) {
    Mesh mesh = one_triangle();
    mesh.faces(0, 1) = bad;
    expect_words(words_of_refusal([&] { check_mesh(mesh, "a.obj"); }),
                 "a.obj: face 0: index " + std::to_string(bad) + "; expected 0 to 2");
  }
}

TEST(MeshRefused, NonFiniteNumber_Throws) {
  for (const double bad : {double{NAN}, double{INFINITY}, -double{INFINITY}}) {
    Mesh mesh = one_triangle();
    mesh.vertices(2, 1) = bad;
    expect_words(words_of_refusal([&] { check_mesh(mesh); }), "vertex 2: not finite");
  }
  Mesh mesh = one_triangle();
  mesh.confidence = Eigen::VectorXf::Constant(3, NAN);
  expect_words(words_of_refusal([&] { check_mesh(mesh); }), "confidence 0");
}

TEST(MeshRefused, AttributeOfOtherLength_Throws) {
  Mesh mesh = one_triangle();
  mesh.normals = Points::Zero(2, 3);
  expect_words(words_of_refusal([&] { check_mesh(mesh); }), "normals: 2 rows; expected 3");
  mesh = one_triangle();
  mesh.labels = {1};
  expect_words(words_of_refusal([&] { check_mesh(mesh); }), "labels: 1 rows");
  mesh = one_triangle();
  mesh.uvs = Points2::Zero(1, 2);
  mesh.uv_faces = Triangles::Constant(1, 3, 1);
  expect_words(words_of_refusal([&] { check_mesh(mesh); }), "uv face 0: index 1; expected 0 to 0");
}

TEST(Sequence, MeshesOfSameFaces_ShareTopology) {
  Mesh moved = one_triangle();
  moved.vertices.array() += 1;
  const Sequence sequence = sequence_of({one_triangle(), moved}, 30, {5, 7});
  EXPECT_EQ(frame_count(sequence), 2);
  EXPECT_EQ(sequence.faces.rows(), 1);
  EXPECT_EQ(frame(sequence, 1).vertices, moved.vertices);
  EXPECT_EQ(sequence.frame_ids[1], 7);
}

TEST(Sequence, MeshesOfDifferentFaces_KeepOwnTopology) {
  Mesh other = one_triangle();
  other.faces << 2, 1, 0;
  const Sequence sequence = sequence_of({one_triangle(), other}, 30);
  EXPECT_EQ(sequence.faces.rows(), 0);
  EXPECT_EQ(frame(sequence, 1).faces, other.faces);
}

TEST(SequenceRefused, FrameOutOfRange_Throws) {
  const Sequence sequence = sequence_of({one_triangle()}, 30);
  EXPECT_THROW(frame(sequence, -1), LogicError);
  expect_words(words_of_refusal([&] { frame(sequence, 1); }), "frame 1 of 1");
  EXPECT_THROW(sequence_of({one_triangle()}, 30, {1, 2}), LogicError);
}

TEST(SequenceRefused, LoadedFrameWithOtherTopologyOrBadVertex_Throws) {
  Sequence sequence = sequence_of({one_triangle()}, 30, {4});
  sequence.load = [](Index) {
    Mesh mesh = one_triangle();
    mesh.faces << 2, 1, 0;
    return mesh;
  };
  expect_words(words_of_refusal([&] { frame(sequence, 0); }), "frame 4: faces: another topology");
  sequence.load = [](Index) {
    Mesh mesh = one_triangle();
    mesh.vertices(0, 0) = NAN;
    return mesh;
  };
  expect_words(words_of_refusal([&] { frame(sequence, 0); }), "frame 4: vertex 0: not finite");
  sequence.load = nullptr;
  EXPECT_THROW(frame(sequence, 0), LogicError);
}

Skeleton arm() {
  Skeleton skeleton;
  skeleton.names = {"root", "elbow", "wrist"};
  skeleton.parents = {-1, 0, 1};
  skeleton.offsets = Points::Zero(3, 3);
  return skeleton;
}

TEST(Skeleton, JointName_IsFound) {
  EXPECT_NO_THROW(check_skeleton(arm()));
  EXPECT_EQ(find_joint(arm(), "wrist"), 2);
  EXPECT_EQ(find_joint(arm(), "ankle"), -1);
}

TEST(SkeletonRefused, CyclicOrMultiRootTree_Throws) {
  Skeleton skeleton = arm();
  skeleton.parents = {-1, 2, 1};
  expect_words(words_of_refusal([&] { check_skeleton(skeleton); }), "no cycles");
  skeleton.parents = {-1, -1, 1};
  expect_words(words_of_refusal([&] { check_skeleton(skeleton); }), "second root");
  skeleton.parents = {0, 0, 1};
  expect_words(words_of_refusal([&] { check_skeleton(skeleton); }), "joint 0 is the root");
  skeleton.parents = {-1, 0};
  expect_words(words_of_refusal([&] { check_skeleton(skeleton); }), "2 parents");
  expect_words(words_of_refusal([] { check_skeleton(Skeleton{}); }), "no joints");
}

TEST(SkeletonRefused, BadNamesOrArraySizes_Throw) {
  Skeleton skeleton = arm();
  skeleton.names[2] = "elbow";
  expect_words(words_of_refusal([&] { check_skeleton(skeleton); }), "the name of joint 1");
  skeleton.names[2] = "";
  expect_words(words_of_refusal([&] { check_skeleton(skeleton); }), "empty name");
  skeleton = arm();
  skeleton.offsets = Points::Zero(2, 3);
  expect_words(words_of_refusal([&] { check_skeleton(skeleton); }), "offsets: 2 rows");
  skeleton = arm();
  skeleton.limits_min = Points::Constant(3, 3, NAN);
  expect_words(words_of_refusal([&] { check_skeleton(skeleton); }), "lower limits");
}

Garment patch() {
  Garment garment;
  garment.mesh = one_triangle();
  return garment;
}

TEST(Garment, ValidGarment_IsAccepted) {
  Garment garment = patch();
  garment.rest = Points2::Zero(3, 2);
  garment.rest_faces = garment.mesh.faces;
  garment.panels = {0};
  garment.panel_names = {"front"};
  garment.seams = {{"side", {0}, {1}}};
  garment.boundaries = {{0, 1, 2}};
  garment.boundary_names = {"hem"};
  garment.attachments = {{0, 5, {0.2, 0.3, 0.5}, 0.01}};
  EXPECT_NO_THROW(check_garment(garment));
}

TEST(GarmentRefused, BadRestShapeOrPanels_Throw) {
  Garment garment = patch();
  garment.rest_faces = Triangles::Zero(1, 3);
  expect_words(words_of_refusal([&] { check_garment(garment); }), "rest face 0");
  garment = patch();
  garment.rest_faces = Triangles::Zero(2, 3);
  expect_words(words_of_refusal([&] { check_garment(garment); }), "rest faces: 2 rows");
  garment = patch();
  garment.rest = Points2::Constant(1, 2, NAN);
  expect_words(words_of_refusal([&] { check_garment(garment); }), "rest: a number");
  garment = patch();
  garment.panels = {0};
  expect_words(words_of_refusal([&] { check_garment(garment); }), "panel 0");
  garment.panels = {0, 0};
  expect_words(words_of_refusal([&] { check_garment(garment); }), "panels: 2 entries");
}

TEST(GarmentRefused, BadSeamsOrBoundaries_Throw) {
  Garment garment = patch();
  garment.seams = {{"side", {0, 1}, {2}}};
  expect_words(words_of_refusal([&] { check_garment(garment); }), "as many on both sides");
  garment.seams = {{"side", {0}, {3}}};
  expect_words(words_of_refusal([&] { check_garment(garment); }), "seam 'side': vertex 3");
  garment = patch();
  garment.boundaries = {{0, 1}};
  expect_words(words_of_refusal([&] { check_garment(garment); }), "0 names");
  garment.boundary_names = {"neck"};
  garment.boundaries = {{0, 9}};
  expect_words(words_of_refusal([&] { check_garment(garment); }), "boundary: vertex 9");
}

TEST(GarmentRefused, BadAttachmentsOrMaterial_Throw) {
  Garment garment = patch();
  garment.attachments = {{0, 0, {0.5, 0.2, 0.2}, 0}};
  expect_words(words_of_refusal([&] { check_garment(garment); }), "do not sum to 1");
  garment.attachments = {{0, -1, {0.5, 0.3, 0.2}, 0}};
  expect_words(words_of_refusal([&] { check_garment(garment); }), "triangle -1");
  garment = patch();
  garment.material.density = 0;
  expect_words(words_of_refusal([&] { check_garment(garment); }), "material density");
  garment = patch();
  garment.material.bending = -1;
  expect_words(words_of_refusal([&] { check_garment(garment); }), "material bending");
  garment.material.bending = NAN;
  expect_words(words_of_refusal([&] { check_garment(garment); }), "material bending");
}

TEST(Image, EverySrgbByte_SurvivesRoundTrip) {
  ByteImage bytes(256, 1, 1);
  for (int i = 0; i < 256; ++i) {
    bytes.at(i, 0) = static_cast<std::uint8_t>(i);
  }
  EXPECT_EQ(srgb_from_linear(linear_from_srgb(bytes)).data, bytes.data);
}

TEST(Image, SrgbTransferCurve_MatchesKnownValues) {
  Image image(4, 1, 1);
  image.data = {0.0F, 0.21586F, 1.0F, 0.0031308F};
  const ByteImage bytes = srgb_from_linear(image);
  EXPECT_EQ(bytes.data[0], 0);
  EXPECT_EQ(bytes.data[1], 128);  // the linear value of byte 128
  EXPECT_EQ(bytes.data[2], 255);
  EXPECT_EQ(bytes.data[3], 10);
}

TEST(Image, OutOfRangeValue_IsClampedAndNanIsBlack) {
  Image image(3, 1, 1);
  image.data = {-1.0F, 7.0F, NAN};
  const ByteImage bytes = srgb_from_linear(image);
  EXPECT_EQ(bytes.data[0], 0);
  EXPECT_EQ(bytes.data[1], 255);
  EXPECT_EQ(bytes.data[2], 0);
}

TEST(Finding, FormattedFinding_IsOneLine) {
  const Finding finding{Severity::Error, "camera-rotation", "cam3", "the rotation mirrors",
                        "use --layout easymocap"};
  EXPECT_EQ(to_string(finding),
            "error camera-rotation [cam3]: the rotation mirrors; use --layout easymocap");
  EXPECT_TRUE(has_errors({Finding{}, finding}));
  EXPECT_FALSE(has_errors({Finding{}}));
  EXPECT_EQ(to_string(Finding{Severity::Warning, "a", "", "b", ""}), "warning a: b");
}

TEST(Error, DataErrorMessage_IsOneSentence) {
  const DataError error("a.obj", "line 3", "index 9", "1 to 8");
  EXPECT_STREQ(error.what(), "a.obj: line 3: index 9; expected 1 to 8");
  EXPECT_STREQ(DataError("", "", "", "a file").what(), "expected a file");
  EXPECT_STREQ(EnvironmentError("/out", "no space left on device").what(),
               "/out: no space left on device");
}

TEST(Error, FailedCheck_IsReportedInEveryBuild) {
  EXPECT_NO_THROW(ATELIER_CHECK(true, "fine"));
  expect_words(words_of_refusal([] { ATELIER_CHECK(1 == 2, "sums"); }), "sums (1 == 2)");
}

}  // namespace
}  // namespace atelier
