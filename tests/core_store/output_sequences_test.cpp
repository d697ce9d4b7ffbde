// Stages that write several files for each frame: all of them or none, and none twice.

#include "core/store/output_sequences.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/store/frame_log.h"
#include "core/store/frame_memory.h"
#include "core/store/result.h"
#include "core/store/run_stage.h"
#include "tests/core_store/test_stages.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::ElementsAre;
using End = StageReport::End;

/// What the stage under test makes of its frames.
struct SequenceStage {
  int fails_at = -1;
  std::vector<int> made;  ///< in this run
  std::vector<int> read;  ///< for want of memory
  std::vector<int> other_frames;
  std::size_t archives = 2;
};

SequenceStage& sequence_stage() {
  static SequenceStage stage;
  return stage;
}

Mesh triangle_at(int frame_id) {
  Mesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, frame_id, 0, 1, frame_id, 0, 0, frame_id, 1;
  return mesh;
}

void run_sequences(StageRun& run) {
  const std::vector<int> ids{1, 2, 5};
  SequenceHeader header;
  header.fps = 30;
  header.frame_ids = sequence_stage().other_frames.empty() ? ids : sequence_stage().other_frames;
  header.shared.faces.resize(1, 3);
  header.shared.faces << 0, 1, 2;
  FrameMemory<double> memory;
  if (!output_sequences(run, {{"states", std::nullopt}, {"cloth/frames", header}}, ids,
                        [&](int frame_id) {
                          if (frame_id == sequence_stage().fails_at) {
                            throw EnvironmentError("disk", "gone");
                          }
                          sequence_stage().made.push_back(frame_id);
                          Archive state;
                          state.schema = "atelier.test";
                          state.numbers["height"] = frame_id;
                          memory.keep(frame_id, frame_id);
                          std::vector<Archive> archives{state, archive_of(triangle_at(frame_id))};
                          archives.resize(sequence_stage().archives);
                          return archives;
                        })) {
    return;
  }
  double sum = 0;
  for (const int id : ids) {
    sum += memory.take(id, [&] {
      sequence_stage().read.push_back(id);
      return read_archive(run.frame_file(id), "atelier.test", 1).numbers.at("height");
    });
  }
  run.output_text("sum.txt", std::to_string(sum));
}

class OutputSequences : public ::testing::Test {
 protected:
  OutputSequences() {
    sequence_stage() = {};
    std::filesystem::create_directories(root_ / "in");
    std::ofstream(root_ / "in/a.txt") << "3";
    stage_.run = run_sequences;
  }
  StageRequest request() {
    StageRequest result;
    result.input = root_ / "in";
    result.workspace = root_ / "work";
    result.options = stage_.options();
    result.jobs = 1;
    return result;
  }
  StageReport run() { return run_stage(kTestStages, stage_, request()); }
  void fail_at(int frame_id) {
    sequence_stage().fails_at = frame_id;
    EXPECT_THROW(run(), EnvironmentError);
    sequence_stage() = {};
  }
  std::filesystem::path staging() {
    return plan_stage(kTestStages, stage_, request()).staging_folder;
  }
  std::filesystem::path result() {
    return root_ / "work/frames" / current_name(root_ / "work/frames").value();
  }

  Stage stage_ = *find_stage(kTestStages, "frames");
  TemporaryDirectory root_;
};

TEST_F(OutputSequences, EveryFileOfAFrame_IsInTheResult) {
  const StageReport report = run();
  EXPECT_EQ(report.end, End::Done);
  EXPECT_EQ(report.frames_total, 3);
  std::vector<std::string> paths;
  for (const ManifestOutput& output : report.manifest.outputs) {
    paths.push_back(output.path);
  }
  EXPECT_THAT(paths, ElementsAre("cloth/frames/000001.h5", "cloth/frames/000002.h5",
                                 "cloth/frames/000005.h5", "cloth/sequence.h5", "states/000001.h5",
                                 "states/000002.h5", "states/000005.h5", "sum.txt"));
  const Sequence cloth = open_sequence(result() / "cloth");
  EXPECT_EQ(cloth.fps, 30);
  ASSERT_THAT(cloth.frame_ids, ElementsAre(1, 2, 5));
  EXPECT_EQ(frame(cloth, 2).vertices, triangle_at(5).vertices);
  EXPECT_EQ(frame(cloth, 2).faces.rows(), 1);
}

TEST_F(OutputSequences, Files_MatchASequenceWrittenAlone) {
  run();
  const std::filesystem::path alone = root_ / "alone";
  const SequenceHeader header = read_sequence_header(result() / "cloth");
  write_sequence_header(alone, header);
  for (const int id : header.frame_ids) {
    Mesh mesh = triangle_at(id);
    mesh.faces = header.shared.faces;
    write_sequence_frame(alone, header, id, mesh);
    EXPECT_EQ(read_file_text(sequence_frame_path(result() / "cloth", id), 100000),
              read_file_text(sequence_frame_path(alone, id), 100000));
  }
  EXPECT_EQ(read_file_text(result() / "cloth/sequence.h5", 100000),
            read_file_text(alone / "sequence.h5", 100000));
}

TEST_F(OutputSequences, FramesOfAnEarlierRun_AreReadBackAndNoOthers) {
  run();
  EXPECT_THAT(sequence_stage().read, ElementsAre());
  std::filesystem::remove_all(root_ / "work");
  fail_at(5);
  EXPECT_EQ(run().end, End::Done);
  EXPECT_THAT(sequence_stage().made, ElementsAre(5));
  EXPECT_THAT(sequence_stage().read, ElementsAre(1, 2));
}

TEST_F(OutputSequences, FrameLackingAFile_IsRecomputed) {
  fail_at(5);
  EXPECT_EQ(read_frame_logs(staging()).size(), 2u);
  std::filesystem::remove(staging() / "cloth/frames/000002.h5");
  EXPECT_EQ(run().end, End::Done);
  EXPECT_THAT(sequence_stage().made, ElementsAre(2, 5));
  EXPECT_EQ(frame(open_sequence(result() / "cloth"), 1).vertices, triangle_at(2).vertices);
}

TEST_F(OutputSequences, FrameWithoutAllItsFiles_IsUnfinished) {
  fail_at(2);
  EXPECT_TRUE(std::filesystem::exists(staging() / "cloth/frames/000001.h5"));
  EXPECT_FALSE(std::filesystem::exists(staging() / "states/000002.h5"));
  // A run of a stage that wrote fewer files of a frame is no start for one that writes more.
  Stage fewer = stage_;
  fewer.run = [](StageRun& run) {
    run.each_frame("states", ".h5", {1, 2, 5},
                   [](int, const std::filesystem::path& file) { std::ofstream(file) << "state"; });
  };
  std::filesystem::remove_all(root_ / "work");
  StageRequest partly = request();
  partly.selection.begin = 0;
  partly.selection.end = 2;
  EXPECT_EQ(run_stage(kTestStages, fewer, partly).end, End::Partial);
  EXPECT_EQ(run().end, End::Done);
  EXPECT_THAT(sequence_stage().made, ElementsAre(1, 2, 5));
}

TEST_F(OutputSequences, HeaderOfOtherFrames_IsRefused) {
  sequence_stage().other_frames = {1, 2};
  EXPECT_THROW(run(), LogicError);
}

TEST_F(OutputSequences, FewerArchivesThanSequences_AreRefused) {
  sequence_stage().archives = 1;
  EXPECT_THROW(run(), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
