// Stages that write one file for each frame: resume, --frames, --shard, --jobs, runs side by side.

#include <fstream>
#include <numeric>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/store/file_lock.h"
#include "core/store/frame_log.h"
#include "core/store/manifest_limits.h"
#include "core/store/result.h"
#include "core/store/run_stage.h"
#include "core/store/workspace_status.h"
#include "tests/core_store/test_stages.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;
using End = StageReport::End;

const std::string kAll = "frame 0\nframe 1\nframe 2\nframe 3\nframe 5\nframe 8\n";

class Frames : public ::testing::Test {
 protected:
  Frames() {
    behaviour() = {};
    std::filesystem::create_directories(root_ / "in");
    std::ofstream(root_ / "in/a.txt") << "3";
  }
  StageRequest request(const FrameSelection& selection = {}) {
    StageRequest result;
    result.input = root_ / "in";
    result.workspace = root_ / "work";
    result.options = stage_.options();
    result.jobs = 1;
    result.selection = selection;
    return result;
  }
  static FrameSelection shard(int i, int n) {
    FrameSelection selection;
    selection.shard = i;
    selection.shards = n;
    return selection;
  }
  static FrameSelection range(int begin, int end) {
    FrameSelection selection;
    selection.begin = begin;
    selection.end = end;
    return selection;
  }
  StageReport run(const StageRequest& what, const StageEvents& events = {}) {
    return run_stage(kTestStages, stage_, what, events);
  }
  StagePlan plan() { return plan_stage(kTestStages, stage_, request()); }
  /// Runs until `frame_id`, whose writing fails as if the program had died there.
  void die_at(int frame_id) {
    behaviour().before_frame = [frame_id](int at) {
      if (at == frame_id) {
        throw EnvironmentError("disk", "gone");
      }
    };
    EXPECT_THROW(run(request()), EnvironmentError);
    behaviour() = {};
  }
  std::string result() {
    const auto name = current_name(root_ / "work/frames");
    return name ? read_file_text(root_ / "work/frames" / *name / "all.txt", 1000) : "none";
  }

  const Stage& stage_ = *find_stage(kTestStages, "frames");
  TemporaryDirectory root_;
};

TEST_F(Frames, InputWithoutFrames_IsDone) {
  behaviour().frame_ids = {};
  EXPECT_EQ(run(request()).end, End::Done);
  EXPECT_EQ(result(), "");
}

TEST_F(Frames, EveryFrame_BecomesAFile) {
  const StageReport report = run(request());
  EXPECT_EQ(report.end, End::Done);
  EXPECT_EQ(report.frames_total, 6);
  EXPECT_EQ(result(), kAll);
  std::vector<std::string> paths;
  for (const ManifestOutput& output : report.manifest.outputs) {
    paths.push_back(output.path);
  }
  EXPECT_THAT(paths,
              ElementsAre("all.txt", "frames/000000.txt", "frames/000001.txt", "frames/000002.txt",
                          "frames/000003.txt", "frames/000005.txt", "frames/000008.txt"));
}

TEST_F(Frames, WarningsOfInterruptedRun_AreKept) {
  behaviour().warned_frames = {1, 2, 5};
  behaviour().before_frame = [](int at) {
    if (at == 3) {
      throw EnvironmentError("disk", "gone");
    }
  };
  EXPECT_THROW(run(request()), EnvironmentError);
  behaviour() = {};
  behaviour().warned_frames = {5, 8};
  std::vector<std::string> said;
  StageEvents events;
  events.say = [&](const std::string& line) { said.push_back(line); };
  const StageReport report = run(request(), events);
  EXPECT_THAT(report.manifest.warnings, ElementsAre("frame 1 is doubtful", "frame 2 is doubtful",
                                                    "frame 5 is doubtful", "frame 8 is doubtful"));
  EXPECT_THAT(said, ElementsAre("3 of 6 frames are done already", "frame 5 is doubtful",
                                "frame 8 is doubtful"));
  const auto name = current_name(root_ / "work/frames");
  ASSERT_TRUE(name.has_value());
  EXPECT_EQ(read_manifest(root_ / "work/frames" / *name, "frames").warnings,
            report.manifest.warnings);
}

TEST_F(Frames, LeftOutFrame_IsFinishedWithoutFiles) {
  behaviour().left_out_frames = {2, 3};
  behaviour().warned_frames = {2};
  const StageReport report = run(request());
  EXPECT_EQ(report.end, End::Done);
  EXPECT_EQ(report.frames_done, 6);
  EXPECT_EQ(result(), "frame 0\nframe 1\nframe 5\nframe 8\n");
  EXPECT_EQ(report.manifest.outputs.size(), 5U);
  EXPECT_THAT(report.manifest.warnings, ElementsAre("frame 2 is doubtful"));
  EXPECT_EQ(
      status_of(workspace_status(kTestStages, root_ / "work", Check::Digests), "frames").state,
      StageStatus::State::Done);
  EXPECT_EQ(run(request()).end, End::AlreadyDone);
}

TEST_F(Frames, LeftOutFrameOfInterruptedRun_IsNotTriedAgain) {
  behaviour().left_out_frames = {1};
  behaviour().warned_frames = {1};
  behaviour().before_frame = [](int at) {
    if (at == 3) {
      throw EnvironmentError("disk", "gone");
    }
  };
  EXPECT_THROW(run(request()), EnvironmentError);
  behaviour() = {};
  const StageReport report = run(request());
  EXPECT_THAT(behaviour().written, ElementsAre(3, 5, 8));
  EXPECT_EQ(result(), "frame 0\nframe 2\nframe 3\nframe 5\nframe 8\n");
  EXPECT_THAT(report.manifest.warnings, ElementsAre("frame 1 is doubtful"));
}

TEST_F(Frames, ShardWithLeftOutFrame_IsKnownToTheOthers) {
  behaviour().left_out_frames = {1, 8};
  EXPECT_EQ(run(request(shard(0, 2))).end, End::Partial);
  EXPECT_EQ(run(request(shard(1, 2))).end, End::Done);
  EXPECT_EQ(result(), "frame 0\nframe 2\nframe 3\nframe 5\n");
}

TEST_F(Frames, TooManyWarnings_EndWithACount) {
  behaviour().frame_ids.resize(1003);
  std::iota(behaviour().frame_ids.begin(), behaviour().frame_ids.end(), 0);
  behaviour().warned_frames = behaviour().frame_ids;
  const std::vector<std::string> warnings = run(request()).manifest.warnings;
  ASSERT_EQ(warnings.size(), kMaxWarnings);
  EXPECT_EQ(warnings.back(), "and 4 more");
  EXPECT_EQ(warnings.front(), "frame 0 is doubtful");
}

TEST_F(Frames, InterruptedRun_ResumesAtTheFrame) {
  die_at(3);
  EXPECT_EQ(plan().state, StagePlan::State::Resume);
  EXPECT_EQ(plan().frames_kept, 3);
  EXPECT_EQ(run(request()).end, End::Done);
  EXPECT_THAT(behaviour().written, ElementsAre(3, 5, 8));
  EXPECT_EQ(result(), kAll);
}

TEST_F(Frames, FailureAfterLastFrame_KeepsEveryFrame) {
  die_at(8);
  std::filesystem::create_directories(plan().staging_folder / "all.txt");  // in the way
  std::ofstream(plan().staging_folder / "all.txt/x") << "x";
  EXPECT_THROW(run(request()), EnvironmentError);
  std::filesystem::remove_all(plan().staging_folder / "all.txt");
  behaviour() = {};
  EXPECT_EQ(run(request()).end, End::Done);
  EXPECT_THAT(behaviour().written, IsEmpty());
}

TEST_F(Frames, DamagedFrame_IsRedone) {
  die_at(3);
  std::ofstream(plan().staging_folder / "frames/000001.txt") << "frame x";
  run(request());
  EXPECT_THAT(behaviour().written, ElementsAre(1, 3, 5, 8));
  EXPECT_EQ(result(), kAll);
}

TEST_F(Frames, TruncatedFrame_IsRedone) {
  die_at(3);
  std::filesystem::resize_file(plan().staging_folder / "frames/000000.txt", 3);
  run(request());
  EXPECT_THAT(behaviour().written, ElementsAre(0, 3, 5, 8));
  EXPECT_EQ(result(), kAll);
}

TEST_F(Frames, MissingFrame_IsRedone) {
  die_at(3);
  std::filesystem::remove(plan().staging_folder / "frames/000002.txt");
  run(request());
  EXPECT_THAT(behaviour().written, ElementsAre(2, 3, 5, 8));
}

TEST_F(Frames, FrameThatIsALink_IsRedone) {
  die_at(3);
  const std::filesystem::path frame = plan().staging_folder / "frames/000002.txt";
  std::filesystem::rename(frame, root_ / "elsewhere");
  std::filesystem::create_symlink(root_ / "elsewhere", frame);
  run(request());
  EXPECT_THAT(behaviour().written, ElementsAre(2, 3, 5, 8));
}

TEST_F(Frames, UnloggedFrame_IsRedone) {
  die_at(1);
  std::ofstream(plan().staging_folder / "frames/000005.txt") << "frame 5";
  run(request());
  EXPECT_THAT(behaviour().written, ElementsAre(1, 2, 3, 5, 8));
}

TEST_F(Frames, TornLog_LosesOneFrame) {
  die_at(3);
  for (const auto& entry : std::filesystem::directory_iterator(plan().staging_folder)) {
    if (is_frame_log_name(entry.path().filename().string())) {
      std::filesystem::resize_file(entry.path(), entry.file_size() - 5);
    }
  }
  run(request());
  EXPECT_THAT(behaviour().written, ElementsAre(2, 3, 5, 8));
  EXPECT_EQ(result(), kAll);
}

TEST_F(Frames, NonRecordLogLines_AreIgnored) {
  die_at(2);
  const std::string digest = hex(sha256("frame 5"));
  std::ofstream log(plan().staging_folder / ".frames-abcdef.jsonl");
  log << "\n{}\n[]\nnull\n{\"frame\":5}\nframe 5\n\xff\n"
      << R"({"frame":-5,"path":"frames/000005.txt","size":7,"sha256":")" << digest
      << R"(","seconds":0,"peak":0})"
      << "\n"
      << R"({"frame":5,"path":"../000005.txt","size":7,"sha256":")" << digest
      << R"(","seconds":0,"peak":0})"
      << "\n"
      << R"({"frame":5,"path":"frames/000005.txt","size":7,"sha256":"00","seconds":0,"peak":0})"
      << "\n"
      << R"({"frame":99999999999,"path":"frames/000005.txt","size":7,"sha256":")" << digest
      << R"(","seconds":0,"peak":0})"
      << "\n";
  log.close();
  EXPECT_EQ(read_frame_logs(plan().staging_folder).size(), 2u);
  run(request());
  EXPECT_THAT(behaviour().written, ElementsAre(2, 3, 5, 8));
}

TEST_F(Frames, LogNamingForeignFrames_IsNotTrusted) {
  die_at(2);
  std::ofstream(plan().staging_folder / "frames/000004.txt") << "frame 4";
  std::ofstream(plan().staging_folder / ".frames-abcdef.jsonl")
      << R"({"frame":4,"path":"frames/000004.txt","size":7,"sha256":")" << hex(sha256("frame 4"))
      << R"(","seconds":0,"peak":0})"
      << "\n";
  EXPECT_EQ(run(request()).end, End::Done);
  EXPECT_EQ(read_manifest(run(request()).plan.result_folder, "frames").outputs.size(), 7u);
}

TEST_F(Frames, FinishedResult_CountsAllFramesDone) {
  run(request());
  const StageReport again = run(request());
  EXPECT_EQ(again.end, End::AlreadyDone);
  EXPECT_EQ(again.frames_done, 6);
  EXPECT_EQ(again.frames_total, 6);
}

TEST_F(Frames, TemporaryFiles_AreRemoved) {
  die_at(3);
  std::ofstream(plan().staging_folder / "frames/.atelier-abcdef.tmp") << "half";
  const StageReport report = run(request());
  EXPECT_FALSE(std::filesystem::exists(report.plan.result_folder / "frames/.atelier-abcdef.tmp"));
  EXPECT_EQ(run(request()).end, End::AlreadyDone);
}

TEST_F(Frames, Force_StartsOver) {
  die_at(3);
  StageRequest what = request();
  what.force = true;
  run(what);
  EXPECT_THAT(behaviour().written, ElementsAre(0, 1, 2, 3, 5, 8));
}

TEST_F(Frames, ForceWithRange_RedoesOnlyTheRange) {
  die_at(5);
  StageRequest what = request(range(0, 2));
  what.force = true;
  EXPECT_EQ(run(what).end, End::Partial);
  EXPECT_THAT(behaviour().written, ElementsAre(0, 1));
  behaviour() = {};
  EXPECT_EQ(run(request()).end, End::Done);
  EXPECT_THAT(behaviour().written, ElementsAre(5, 8));
}

TEST_F(Frames, ForceWithShards_IsPartialUntilTheLastShard) {
  run(request());
  behaviour() = {};
  StageRequest first = request(shard(0, 2));
  first.force = true;
  const StageReport report = run(first);
  EXPECT_EQ(report.end, End::Partial);
  EXPECT_TRUE(report.again);
  EXPECT_EQ(report.frames_done, 3);
  EXPECT_EQ(report.frames_total, 6);
  EXPECT_EQ(result(), kAll) << "the older result stays";
  const StageReport plain = run(request());
  EXPECT_EQ(plain.end, End::AlreadyDone);
  EXPECT_EQ(plain.plan.frames_kept, 3) << "what is not finished is mentioned";
  StageRequest second = request(shard(1, 2));
  second.force = true;
  EXPECT_EQ(run(second).end, End::Done);
  EXPECT_EQ(behaviour().written.size(), 6u);
  EXPECT_EQ(run(request()).plan.frames_kept, 0);
}

TEST_F(Frames, InterruptedRunOfOtherOptions_IsNotMixedIn) {
  die_at(3);
  StageRequest what = request();
  ASSERT_EQ(set_option(what.options.table, "scale", "2"), "");
  run(what);
  EXPECT_THAT(behaviour().written, ElementsAre(0, 1, 2, 3, 5, 8));
  EXPECT_EQ(plan().frames_kept, 3) << "that of the first is kept";
}

TEST_F(Frames, FrameRanges_AddUp) {
  StageReport report = run(request(range(0, 3)));
  EXPECT_EQ(report.end, End::Partial);
  EXPECT_EQ(report.frames_done, 3);
  EXPECT_EQ(report.frames_total, 6);
  EXPECT_EQ(result(), "none");
  EXPECT_EQ(run(request(range(5, 100))).end, End::Partial);
  EXPECT_EQ(run(request(range(3, 4))).end, End::Done);
  EXPECT_EQ(result(), kAll);
  EXPECT_THAT(behaviour().written, ElementsAre(0, 1, 2, 5, 8, 3));
}

TEST_F(Frames, Shards_AddUpToTheSameResult) {
  run(request());
  const auto whole = read_manifest(run(request()).plan.result_folder, "frames").outputs;
  std::filesystem::remove_all(root_ / "work");
  EXPECT_EQ(run(request(shard(1, 3))).end, End::Partial);
  EXPECT_EQ(run(request(shard(0, 3))).end, End::Partial);
  const StageReport last = run(request(shard(2, 3)));
  EXPECT_EQ(last.end, End::Done);
  ASSERT_EQ(last.manifest.outputs.size(), whole.size());
  for (std::size_t i = 0; i < whole.size(); ++i) {
    EXPECT_EQ(last.manifest.outputs[i].digest, whole[i].digest);
  }
}

TEST_F(Frames, ShardAfterCommit_IsAlreadyDone) {
  run(request());
  EXPECT_EQ(run(request(shard(1, 3))).end, End::AlreadyDone);
}

TEST_F(Frames, ManyJobs_GiveTheSameResult) {
  behaviour().frame_ids.clear();
  for (int i = 0; i < 50; ++i) {
    behaviour().frame_ids.push_back(3 * i);
  }
  StageRequest what = request();
  what.jobs = 8;
  const StageReport report = run(what);
  EXPECT_EQ(report.end, End::Done);
  EXPECT_EQ(behaviour().written.size(), 50u);
  EXPECT_EQ(report.manifest.outputs.size(), 51u);
}

TEST_F(Frames, SeveralErrors_ReportFirstFrameAndKeepTheRest) {
  behaviour().before_frame = [](int at) {
    if (at == 2 || at == 5) {
      throw DataError("frame " + std::to_string(at), "", "bad", "good");
    }
  };
  StageRequest what = request();
  what.jobs = 1;
  try {
    run(what);
    FAIL() << "it ran";
  } catch (const DataError& error) {
    EXPECT_EQ(error.file, "frame 2");
  }
  EXPECT_EQ(plan().frames_kept, 2);
}

TEST_F(Frames, RunWithoutFinishedFrame_LeavesNothing) {
  die_at(0);
  EXPECT_FALSE(std::filesystem::exists(root_ / "work"));
}

TEST_F(Frames, ShardWithoutFinishedFrame_LeavesNothing) {
  behaviour().before_frame = [](int) { throw DataError("frame", "", "bad", "good"); };
  EXPECT_THROW(run(request(range(0, 3))), DataError);
  EXPECT_FALSE(std::filesystem::exists(root_ / "work"));
}

TEST_F(Frames, DiskError_NamesTheFrameAndWhatIsKept) {
  Stage clumsy = stage_;
  clumsy.run = [](StageRun& run) {
    run.each_frame("f", ".t", {0, 1, 2}, [](int frame_id, const std::filesystem::path& file) {
      if (frame_id == 2) {
        throw EnvironmentError(file.string(), "No space left on device; free space and run again");
      }
    });
  };
  try {
    run_stage(kTestStages, clumsy, request());
    FAIL() << "it ran";
  } catch (const EnvironmentError& error) {
    EXPECT_EQ(error.place, (plan().staging_folder / "f/000002.t").string());
    EXPECT_EQ(error.reason,
              "No space left on device; free space and run again; 2 finished frames are kept");
  }
}

TEST_F(Frames, StopBetweenFrames_CanBeResumed) {
  StageEvents events;
  events.stop = [] { return behaviour().written.size() == 3; };
  const StageReport report = run(request(), events);
  EXPECT_EQ(report.end, End::Stopped);
  EXPECT_EQ(report.frames_done, 3);
  EXPECT_EQ(run(request()).end, End::Done);
  EXPECT_THAT(behaviour().written, ElementsAre(0, 1, 2, 3, 5, 8));
}

TEST_F(Frames, Progress_CountsEarlierFrames) {
  die_at(3);
  std::vector<std::int64_t> done;
  StageEvents events;
  events.progress = [&](const StageProgress& progress) {
    EXPECT_EQ(progress.total, 6);
    EXPECT_GT(progress.per_second, 0);
    EXPECT_GE(progress.seconds_left, 0);
    done.push_back(progress.done);
  };
  run(request(), events);
  EXPECT_THAT(done, ElementsAre(4, 5, 6));
}

TEST_F(Frames, WorkBeforeFirstFrame_IsNotInFrameTime) {
  behaviour().reports = [](StageRun& run) {
    run.progress(0, 1, "steps");
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    run.progress(1, 1, "steps");
  };
  double seconds = 0;
  StageEvents events;
  events.progress = [&](const StageProgress& progress) {
    if (progress.unit == "frames" && progress.done == 1) {
      seconds = 1 / progress.per_second;
    }
  };
  StageRequest one_by_one = request();
  one_by_one.jobs = 1;
  run(one_by_one, events);
  EXPECT_GT(seconds, 0);
  EXPECT_LT(seconds, 0.05);
}

TEST_F(Frames, SelectionWithoutFrame_IsRefused) {
  EXPECT_THROW(run(request(range(100, 200))), DataError);
  EXPECT_FALSE(std::filesystem::exists(root_ / "work"));
}

TEST_F(Frames, ShardWithoutFrame_LeavesTheRestToOthers) {
  std::vector<std::string> said;
  StageEvents events;
  events.say = [&](const std::string& line) { said.push_back(line); };
  const StageReport report = run(request(shard(9, 10)), events);
  EXPECT_EQ(report.end, End::Partial);
  EXPECT_EQ(report.frames_done, 0);
  EXPECT_THAT(said, ElementsAre("there is nothing for this shard: --shard 9/10 of 6 frames"));
  EXPECT_FALSE(std::filesystem::exists(root_ / "work"));
}

TEST_F(Frames, TooLittleDiskSpace_IsRefused) {
  Stage greedy = stage_;
  greedy.run = [](StageRun& run) {
    run.each_frame(
        "f", ".t", {0, 1}, [](int, const auto&) {}, std::int64_t{1} << 60);
  };
  EXPECT_THROW(run_stage(kTestStages, greedy, request()), EnvironmentError);
}

TEST_F(Frames, MoreFramesThanManifestHolds_IsRefused) {
  std::vector<int>& frame_ids = behaviour().frame_ids;
  frame_ids.resize(static_cast<std::size_t>(kMaxFiles) + 1);
  std::iota(frame_ids.begin(), frame_ids.end(), 0);
  try {
    run(request(shard(0, 100'000)));
    FAIL() << "it ran";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("a result of 4000001 files or more"));
    EXPECT_THAT(error.what(), HasSubstr("fewer frames"));
  }
  EXPECT_THAT(behaviour().written, IsEmpty());
}

TEST_F(Frames, UnfinishedFrameFile_IsRefused) {
  Stage hasty = stage_;
  hasty.run = [](StageRun& run) { run.frame_file(7); };
  EXPECT_THROW(run_stage(kTestStages, hasty, request()), LogicError);
}

TEST_F(Frames, FramewiseStageWithoutFrames_IsRefused) {
  Stage hasty = stage_;
  hasty.run = [](StageRun&) {};
  EXPECT_THROW(run_stage(kTestStages, hasty, request()), LogicError);
}

// --- runs side by side: a second one enters while the first is in the middle of a frame

class SideBySide : public Frames {
 protected:
  /// Calls `inside` in the middle of a frame of a run of `first`.
  StageReport run_around(const StageRequest& first, int frame_id,
                         const std::function<void()>& inside) {
    std::atomic<bool> entered = false;
    behaviour().before_frame = [&, frame_id](int at) {
      if (at == frame_id && !entered.exchange(true)) {
        inside();
      }
    };
    return run(first);
  }
  std::string refusal(const StageRequest& what) {
    try {
      run(what);
    } catch (const EnvironmentError& error) {
      return error.what();
    }
    return "it ran";
  }
};

TEST_F(SideBySide, SameWorkTwice_IsRefused) {
  std::string message;
  EXPECT_EQ(run_around(request(), 2, [&] { message = refusal(request()); }).end, End::Done);
  EXPECT_THAT(message, HasSubstr("another run is working on 'frames' here"));
  EXPECT_THAT(message, HasSubstr("--shard"));
  EXPECT_EQ(result(), kAll);
}

TEST_F(SideBySide, ShardBesideWholeRun_IsRefused) {
  std::string message;
  run_around(request(), 2, [&] { message = refusal(request(shard(0, 2))); });
  EXPECT_THAT(message, HasSubstr("another run is working on 'frames' here"));
}

TEST_F(SideBySide, WholeRunBesideShard_IsRefused) {
  std::string message;
  run_around(request(shard(0, 2)), 2, [&] { message = refusal(request()); });
  EXPECT_THAT(message, HasSubstr("another run is working on 'frames' here"));
}

TEST_F(SideBySide, SameShardTwice_IsRefused) {
  std::string message;
  run_around(request(shard(0, 2)), 2, [&] { message = refusal(request(shard(0, 2))); });
  EXPECT_THAT(message, HasSubstr("another run is working on some of these frames"));
}

TEST_F(SideBySide, OverlappingShards_AreRefused) {
  std::string message;
  run_around(request(shard(0, 2)), 2, [&] { message = refusal(request(shard(0, 3))); });
  EXPECT_THAT(message, HasSubstr("another run is working on some of these frames"));
}

TEST_F(SideBySide, OverlappingRanges_AreRefused) {
  std::string message;
  run_around(request(range(0, 3)), 2, [&] { message = refusal(request(range(2, 6))); });
  EXPECT_THAT(message, HasSubstr("another run is working on some of these frames"));
}

TEST_F(SideBySide, DisjointShards_RunTogetherAndLastCommits) {
  End inner = End::Stopped;
  const StageReport outer =
      run_around(request(shard(0, 2)), 2, [&] { inner = run(request(shard(1, 2))).end; });
  EXPECT_EQ(inner, End::Partial);
  EXPECT_EQ(outer.end, End::Done);
  EXPECT_EQ(result(), kAll);
}

TEST_F(SideBySide, FailingShard_KeepsFramesOfOthers) {
  behaviour().before_frame = [this](int at) {
    if (at == 1) {
      throw DataError("frame", "", "bad", "good");
    }
    if (at == 0) {
      EXPECT_THROW(run(request(shard(1, 2))), DataError);
    }
  };
  const StageReport outer = run(request(shard(0, 2)));
  EXPECT_EQ(outer.end, End::Partial);
  EXPECT_EQ(outer.frames_done, 3);
  behaviour().before_frame = nullptr;
  EXPECT_EQ(run(request(shard(1, 2))).end, End::Done);
  EXPECT_EQ(result(), kAll);
}

TEST_F(SideBySide, DisjointRanges_RunTogether) {
  End inner = End::Stopped;
  const StageReport outer =
      run_around(request(range(0, 3)), 2, [&] { inner = run(request(range(3, 9))).end; });
  EXPECT_EQ(inner, End::Partial);
  EXPECT_EQ(outer.end, End::Done);
  EXPECT_EQ(result(), kAll);
}

TEST_F(SideBySide, ManyShardsInThreads_CommitOnce) {
  behaviour().frame_ids.clear();
  for (int i = 0; i < 40; ++i) {
    behaviour().frame_ids.push_back(i);
  }
  constexpr int kShards = 5;
  std::vector<End> ends(kShards);
  std::vector<std::thread> threads;
  for (int i = 0; i < kShards; ++i) {
    threads.emplace_back(
        [&, i] { ends[static_cast<std::size_t>(i)] = run(request(shard(i, kShards))).end; });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  EXPECT_GE(std::count(ends.begin(), ends.end(), End::Done), 1);
  EXPECT_EQ(std::count(ends.begin(), ends.end(), End::Stopped), 0);
  EXPECT_EQ(behaviour().written.size(), 40u);
  EXPECT_EQ(run(request()).end, End::AlreadyDone);
  EXPECT_EQ(
      status_of(workspace_status(kTestStages, root_ / "work", Check::Digests), "frames").state,
      StageStatus::State::Done);
}

TEST_F(SideBySide, ShardsOfNoFrames_CommitOnce) {
  behaviour().frame_ids.clear();
  constexpr int kShards = 4;
  for (int round = 0; round < 25; ++round) {
    SCOPED_TRACE(round);
    std::vector<std::string> problems(kShards);
    std::vector<std::thread> threads;
    for (int i = 0; i < kShards; ++i) {
      threads.emplace_back([&, i] {
        try {
          run(request(shard(i, kShards)));
        } catch (const std::exception& error) {
          problems[static_cast<std::size_t>(i)] = error.what();
        }
      });
    }
    for (std::thread& thread : threads) {
      thread.join();
    }
    EXPECT_THAT(problems, Each(IsEmpty()));
    EXPECT_EQ(run(request()).end, End::AlreadyDone);
    std::filesystem::remove_all(root_ / "work");
  }
}

TEST_F(SideBySide, Status_ShowsRunningStageAndItsFrames) {
  StageStatus status;
  run_around(request(), 2,
             [&] { status = status_of(workspace_status(kTestStages, root_ / "work"), "frames"); });
  EXPECT_TRUE(status.running);
  ASSERT_EQ(status.unfinished.size(), 1u);
  EXPECT_EQ(status.unfinished[0].frames, 2);
  EXPECT_FALSE(status_of(workspace_status(kTestStages, root_ / "work"), "frames").running);
}

}  // namespace
}  // namespace atelier::fixtures
