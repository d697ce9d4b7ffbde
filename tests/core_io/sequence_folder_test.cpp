#include "core/io/sequence_folder.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class SequenceFolder : public ::testing::Test {
 protected:
  void write(const std::string& name,
             const std::string& text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n") {
    std::filesystem::create_directories((root_ / name).parent_path());
    std::ofstream(root_ / name) << text;
  }
  std::string refusal() {
    try {
      read_sequence_folder(root_.path());
    } catch (const DataError& error) {
      return error.what();
    }
    return "it was read";
  }
  TemporaryDirectory root_;
};

TEST_F(SequenceFolder, OversizedMesh_IsRefusedWhenListed) {
  write("b_1.obj");
  write("b_2.obj");
  std::filesystem::resize_file(root_ / "b_2.obj", 5000);
  Limits limits;
  limits.mesh_file_bytes = 4096;
  ATELIER_EXPECT_REFUSED(read_sequence_folder(root_.path(), {}, limits), DataError, "b_2.obj");
  ATELIER_EXPECT_REFUSED(read_sequence_folder(root_ / "b_2.obj", {}, limits), DataError, "4096");
  EXPECT_EQ(read_sequence_folder(root_ / "b_1.obj", {}, limits).frame_ids.size(), 1U);
}

TEST_F(SequenceFolder, Frames_AreOrderedByNumber) {
  write("b_10.obj");
  write("b_9.obj");
  write("scan-f00011.obj");
  const Sequence sequence = read_sequence_folder(root_.path());
  EXPECT_THAT(sequence.frame_ids, ElementsAre(9, 10, 11));
  EXPECT_EQ(frame_count(sequence), 3);
  EXPECT_EQ(frame(sequence, 2).vertices.rows(), 3);
  EXPECT_EQ(sequence.fps, 0);
}

TEST(GapFinding, MissingNumbers_AreListedBriefly) {
  EXPECT_FALSE(gap_finding({7}, "f"));
  EXPECT_FALSE(gap_finding({7, 8, 9}, "f"));
  const auto one = gap_finding({0, 2}, "f");
  ASSERT_TRUE(one);
  EXPECT_EQ(one->severity, Severity::Note);
  EXPECT_EQ(one->place, "f");
  EXPECT_EQ(one->what, "numbers without a mesh: 1");
  EXPECT_EQ(gap_finding({1, 2, 4, 8, 9}, "f")->what, "numbers without a mesh: 3, 5, 6 and 1 more");
  EXPECT_EQ(gap_finding({0, 2147483647}, "f")->what,
            "numbers without a mesh: 1, 2, 3 and 2147483643 more");
}

TEST_F(SequenceFolder, OtherFiles_AreIgnored) {
  write("f_1.obj");
  write("f_1.mtl", "x");
  write("notes.txt", "x");
  write(".hidden_2.obj");
  write("f_3.obj/inside.txt");
  EXPECT_THAT(read_sequence_folder(root_.path()).frame_ids, ElementsAre(1));
}

TEST_F(SequenceFolder, ExtensionCase_IsIgnored) {
  write("f_1.OBJ");
  EXPECT_THAT(read_sequence_folder(root_.path()).frame_ids, ElementsAre(1));
}

TEST_F(SequenceFolder, SingleFile_IsFrameZero) {
  write("shape.obj");
  const Sequence sequence = read_sequence_folder(root_ / "shape.obj");
  EXPECT_THAT(sequence.frame_ids, ElementsAre(0));
  EXPECT_EQ(frame(sequence, 0).faces.rows(), 1);
}

TEST_F(SequenceFolder, UnitlessFiles_UseTheGivenUnit) {
  write("f_1.obj");
  const Sequence sequence =
      read_sequence_folder(root_.path(), {.metres_per_unit = 0.01, .up = 'y'});
  EXPECT_DOUBLE_EQ(frame(sequence, 0).vertices(1, 0), 0.01);
}

TEST_F(SequenceFolder, Frames_AreReadLazily) {
  write("f_1.obj");
  write("f_2.obj", "v nan 0 0\n");
  const Sequence sequence = read_sequence_folder(root_.path());
  EXPECT_EQ(frame(sequence, 0).vertices.rows(), 3);
  EXPECT_THROW(frame(sequence, 1), DataError);
}

TEST_F(SequenceFolder, NameWithoutNumber_IsRefused) {
  write("shape.obj");
  EXPECT_THAT(refusal(),
              HasSubstr("no frame number at its end; expected a name like frame_000012.obj "
                        "(digits, at most 2147483647); rename it"));
}

TEST_F(SequenceFolder, NumberBeyondInt_IsRefused) {
  write("f_99999999999.obj");
  EXPECT_THAT(refusal(), HasSubstr("no frame number at its end"));
}

TEST_F(SequenceFolder, DuplicateNumber_IsRefused) {
  write("a_7.obj");
  write("b_007.obj");
  EXPECT_THAT(refusal(), HasSubstr("one file for each frame"));
}

TEST_F(SequenceFolder, FolderWithoutMeshes_IsRefused) {
  write("notes.txt", "x");
  EXPECT_THAT(refusal(), HasSubstr("no .obj, .ply, .glb or .gltf"));
}

TEST_F(SequenceFolder, MissingFolder_IsRefused) {
  EXPECT_THROW(read_sequence_folder(root_ / "nothing"), DataError);
}

TEST_F(SequenceFolder, TooManyFrames_AreRefused) {
  for (int i = 0; i < 4; ++i) {
    write("f_" + std::to_string(i) + ".obj");
  }
  Limits limits;
  limits.frames = 3;
  EXPECT_THROW(read_sequence_folder(root_.path(), {.metres_per_unit = 1, .up = 'y'}, limits),
               DataError);
}

}  // namespace
}  // namespace atelier::fixtures
