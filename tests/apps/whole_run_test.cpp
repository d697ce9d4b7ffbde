// Whole runs of the chain that are killed, that find the disk full, and whose files are damaged:
// never a crash, never a silently wrong result, always resumable to the same digests. The ordinary
// tests take few small images and keypoints of one person, and the stages that need no more;
// ATELIER_SOAK=1 takes the preset `tiny` and every stage, in full.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include "capture/capture_info.h"
#include "core/atomic_file.h"
#include "core/io/file_bytes.h"
#include "core/random.h"
#include "core/store/result.h"
#include "pipeline/pictures/run_account.h"
#include "tests/support/browser.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AnyOf;
using ::testing::HasSubstr;

using Digests = std::map<std::string, std::string>;

bool soak() {
  const char* value = std::getenv("ATELIER_SOAK");
  return value != nullptr && std::string(value) == "1";
}

/// A count from the environment, where it has one.
int number(const char* variable, int otherwise) {
  const char* value = std::getenv(variable);
  return value == nullptr ? otherwise : std::atoi(value);
}

void copy_folder(const fs::path& from, const fs::path& to) {
  fs::create_directories(to.parent_path());
  fs::copy(from, to, fs::copy_options::recursive | fs::copy_options::copy_symlinks);
}

std::vector<fs::path> files_below(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && !entry.is_symlink()) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// How a file can suffer without anyone writing to it on purpose.
enum class Damage { Truncated, BitFlipped };
constexpr Damage kDamages[] = {Damage::Truncated, Damage::BitFlipped};

void write_bytes(const fs::path& file, const std::vector<std::byte>& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

/// A file that is damaged at a random place to the end of the scope. It is not empty.
class DamagedFile {
 public:
  DamagedFile(fs::path file, Damage damage, Random& random)
      : file_(std::move(file)), sound_(read_file_bytes(file_, 1 << 28)) {
    std::vector<std::byte> bytes = sound_;
    const std::uint64_t at = uniform_index(random, bytes.size());
    if (damage == Damage::Truncated) {
      bytes.resize(at);
    } else {
      bytes[at] ^= std::byte{1} << uniform_index(random, 8);
    }
    write_bytes(file_, bytes);
    what_ = file_.string() +
            (damage == Damage::Truncated ? " cut at " : " with a bit flipped at ") +
            std::to_string(at);
  }
  ~DamagedFile() { write_bytes(file_, sound_); }
  DamagedFile(const DamagedFile&) = delete;
  DamagedFile& operator=(const DamagedFile&) = delete;
  const std::string& what() const { return what_; }

 private:
  fs::path file_;
  std::vector<std::byte> sound_;
  std::string what_;
};

/// Every file in full (of ATELIER_SOAK_PARTS, shares of the work, those of ATELIER_SOAK_PART, from
/// 0), else about `sampled` of them. Empty ones cannot suffer.
std::vector<fs::path> some_files(const fs::path& folder, std::size_t sampled) {
  std::vector<fs::path> files = files_below(folder);
  std::erase_if(files, [](const fs::path& file) { return fs::file_size(file) == 0; });
  const std::size_t stride = soak() ? static_cast<std::size_t>(number("ATELIER_SOAK_PARTS", 1))
                                    : std::max<std::size_t>(1, files.size() / sampled);
  const std::size_t first = soak() ? static_cast<std::size_t>(number("ATELIER_SOAK_PART", 0)) : 0;
  std::vector<fs::path> some;
  for (std::size_t i = first; i < files.size(); i += stride) {
    some.push_back(files[i]);
  }
  return some;
}

/// A capture and what an undisturbed run makes of it, for all tests of this file.
class WholeRun : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory;
    std::vector<std::string> capture = {program_path(), "synthesize", this_capture().string()};
    if (soak()) {
      capture.insert(capture.end(), {"--preset", "tiny"});
    } else {
      capture.insert(capture.end(), {"--dome.cameras",   "4",   "--dome.width",       "90",
                                     "--dome.height",    "120", "--frames",           "0",
                                     "--minimal_frames", "4",   "--held_out_cameras", "1",
                                     "--held_out_share", "0",   "--skin_resolution",  "128",
                                     "--samples",        "1",   "--light-samples",    "6"});
    }
    made_ = run_child(capture);
    if (made_.exit_code == 0) {
      make_real();
      made_ = run_child(chain(this_capture(), undisturbed()));
    }
  }
  static void TearDownTestSuite() { delete folder_; }

  /// Makes the capture one of a real studio, whose runs measure nothing against the ground truth;
  /// the small one without masks, of whose frames keypoints alone are reconstructed, in a moment.
  static void make_real() {
    fs::remove_all(this_capture() / "truth");
    if (!soak()) {
      fs::remove_all(this_capture() / "labels");
    }
    const fs::path file = this_capture() / "capture.toml";
    std::string text = read_file_text(file, 1 << 20);
    const std::string synthetic = "synthetic = true";
    text.replace(text.find(synthetic), synthetic.size(), "synthetic = false");
    std::ofstream(file) << text;
  }

  void SetUp() override {
    ASSERT_EQ(made_.exit_code, 0) << made_.err;
    const RunAccount account = read_run_account(undisturbed()).value();
    for (const RunStageAccount& one : account.stages) {
      // `export` writes into the workspace, but is no stage to end with.
      if (one.end == "done" && current_name(undisturbed() / one.stage)) {
        seconds_[one.stage] = one.seconds;
        stages_.push_back(one.stage);
      }
    }
    ASSERT_GE(stages_.size(), 4U) << made_.out;
    expected_ = digests(undisturbed());
  }

  static fs::path this_capture() { return folder_->path() / "capture"; }
  /// The one whose images nothing but `evaluate` opens.
  static std::string held_out_camera() {
    return read_capture_info(this_capture()).held_out_cameras.at(0);
  }
  static fs::path undisturbed() { return folder_->path() / "undisturbed"; }
  static std::vector<std::string> chain(const fs::path& capture, const fs::path& workspace,
                                        const std::vector<std::string>& more = {}) {
    std::vector<std::string> all = {program_path(), "run", capture.string(), workspace.string()};
    if (soak()) {
      // Trained as long as kills need to find it at work, no longer.
      all.insert(all.end(), {"--appearance.iterations", "20"});
    } else {
      all.insert(all.end(), {"--personalize.samples", "800", "--personalize.shape_rounds", "2",
                             "--personalize.surface_rounds", "1"});
      if (std::find(more.begin(), more.end(), "--to") == more.end()) {
        all.insert(all.end(), {"--to", "track"});
      }
    }
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  /// Every output of every current result, or of one stage's, by name.
  static Digests digests(const fs::path& workspace, const std::string& only = "") {
    Digests all;
    for (const auto& entry : fs::directory_iterator(workspace)) {
      const std::string stage = entry.path().filename().string();
      const auto current = current_name(entry.path());
      if (!current || (!only.empty() && stage != only)) {
        continue;
      }
      for (const ManifestOutput& output : read_manifest(entry.path() / *current, stage).outputs) {
        all[stage + "/" + output.path] = hex(output.digest);
      }
    }
    return all;
  }
  Digests expected_of(const std::string& stage) const {
    Digests some;
    for (const auto& [path, digest] : expected_) {
      if (path.starts_with(stage + "/")) {
        some[path] = digest;
      }
    }
    return some;
  }
  /// Nothing unfinished is left.
  static void expect_clean(const fs::path& workspace) {
    for (const fs::path& file : files_below(workspace)) {
      EXPECT_FALSE(is_temporary_name(file.filename().string())) << file;
      EXPECT_EQ(file.string().find(".staging-"), std::string::npos) << file;
    }
  }
  /// The undisturbed workspace as it was before that stage; with it if `with` says so.
  void copy_up_to(const std::string& stage, const fs::path& workspace, bool with) const {
    for (const std::string& one : stages_) {
      if (one == stage && !with) {
        return;
      }
      copy_folder(undisturbed() / one, workspace / one);
      if (one == stage) {
        return;
      }
    }
  }

  static TemporaryDirectory* folder_;
  static ChildResult made_;
  std::map<std::string, double> seconds_;  ///< that each stage took undisturbed
  std::vector<std::string> stages_;        ///< that the chain did, in their order
  Digests expected_;
  TemporaryDirectory root_;
};

TemporaryDirectory* WholeRun::folder_ = nullptr;
ChildResult WholeRun::made_;

TEST_F(WholeRun, KillsInEveryStage_LeadToTheSameDigests) {
  const int wanted = number("ATELIER_SOAK_KILLS", soak() ? 100 : 10);
  const int kills_in_a_stage = soak() ? 2 : 3;
  constexpr int kMaxRuns = 30;
  Random random{static_cast<std::uint64_t>(number("ATELIER_SOAK_SEED", 1)), 0, 0};
  int kills = 0;
  int runs = 0;
  for (; kills < wanted && runs < kMaxRuns; ++runs) {
    const fs::path workspace = root_ / ("work" + std::to_string(runs));
    for (const std::string& stage : stages_) {
      for (int kill = 0; kill < kills_in_a_stage && !current_name(workspace / stage); ++kill) {
        char seconds[32];
        std::snprintf(seconds, sizeof seconds, "%.3f",
                      uniform(random, 0.02, 0.3 + seconds_[stage]));
        std::vector<std::string> command = {"timeout", "--foreground", "-s", "KILL", seconds};
        const std::vector<std::string> run = chain(this_capture(), workspace);
        command.insert(command.end(), run.begin(), run.end());
        const ChildResult result = run_child(command);
        // 124: it ended by itself in the moment in which `timeout` meant to kill it.
        EXPECT_THAT(result.exit_code, AnyOf(0, 124, 128 + SIGKILL)) << result.err;
        kills += result.exit_code == 128 + SIGKILL ? 1 : 0;
      }
      const ChildResult rest = run_child(chain(this_capture(), workspace, {"--to", stage}));
      ASSERT_EQ(rest.exit_code, 0) << rest.err;
    }
    const ChildResult last = run_child(chain(this_capture(), workspace));
    ASSERT_EQ(last.exit_code, 0) << last.err;
    EXPECT_EQ(digests(workspace), expected_);
    expect_clean(workspace);
    fs::remove_all(workspace);
    std::printf("%d kills in %d runs\n", kills, runs + 1);
  }
  EXPECT_GE(kills, wanted);
  RecordProperty("kills", kills);
  RecordProperty("runs", runs);
}

TEST_F(WholeRun, FullDiskInEachStage_GivesOneLineAndResumes) {
  const fs::path disk = root_ / "disk";
  fs::create_directories(disk);
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=300m") != 0) {
    GTEST_SKIP() << "mounting is not allowed here: " << std::strerror(errno);
  }
  Random random{2, 0, 0};
  int full = 0;
  for (const std::string& stage : stages_) {
    const auto name = current_name(undisturbed() / stage);
    double needed = 0;
    for (const ManifestOutput& output :
         read_manifest(undisturbed() / stage / *name, stage).outputs) {
      needed += static_cast<double>(output.size);
    }
    for (int i = 0; i < (soak() ? 3 : 1); ++i) {
      const fs::path workspace = disk / "work";
      copy_up_to(stage, workspace, false);
      const double left = uniform(random, 0, 0.9 * needed);
      SCOPED_TRACE(stage + " with " + std::to_string(left) + " bytes left");
      const double ballast = static_cast<double>(fs::space(disk).available) - left;
      run_child({"fallocate", "-l", std::to_string(static_cast<std::int64_t>(ballast)),
                 (disk / "ballast").string()});
      const std::vector<std::string> command =
          chain(this_capture(), workspace, {"--from", stage, "--to", stage});
      const ChildResult failed = run_child(command);
      EXPECT_EQ(failed.exit_code, 5) << failed.out << failed.err;
      EXPECT_THAT(failed.err, HasSubstr("atelier: "));
      EXPECT_THAT(failed.err, AnyOf(HasSubstr("No space left on device"), HasSubstr("are free")));
      full += failed.exit_code == 5 ? 1 : 0;
      fs::remove(disk / "ballast");
      const ChildResult next = run_child(command);
      EXPECT_EQ(next.exit_code, 0) << next.err;
      EXPECT_EQ(digests(workspace, stage), expected_of(stage));
      expect_clean(workspace);
      fs::remove_all(workspace);
      if (next.exit_code != 0) {
        break;
      }
    }
  }
  umount2(disk.c_str(), MNT_DETACH);
  RecordProperty("full_disks", full);
}

TEST_F(WholeRun, FullDiskInExportAndReport_LeavesNothing) {
  const fs::path disk = root_ / "disk";
  fs::create_directories(disk);
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=64k") != 0) {
    GTEST_SKIP() << "mounting is not allowed here: " << std::strerror(errno);
  }
  const std::string workspace = undisturbed().string();
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"export", workspace, (disk / "out").string()},
        {"export", workspace, (disk / "out").string(), "--format", "usda"},
        {"report", workspace, "--out", (disk / "page.html").string()}}) {
    std::vector<std::string> all = {program_path()};
    all.insert(all.end(), command.begin(), command.end());
    const ChildResult failed = run_child(all);
    EXPECT_EQ(failed.exit_code, 5) << command[0] << failed.out << failed.err;
    EXPECT_THAT(failed.err, HasSubstr("No space left on device"));
    EXPECT_TRUE(files_below(disk).empty()) << files_below(disk).front();
    EXPECT_FALSE(fs::exists(disk / "out"));
  }
  umount2(disk.c_str(), MNT_DETACH);
  EXPECT_EQ(digests(undisturbed()), expected_);
}

TEST_F(WholeRun, Report_LoadsInABrowserWithEveryImage) {
  if (!has_browser()) {
    GTEST_SKIP() << "no program chromium (scripts/setup)";
  }
  const BrowsedPage found = browse(undisturbed() / "report" / "index.html", root_.path());
  EXPECT_GT(found.images, 0);
  EXPECT_EQ(found.broken, 0);
  for (const std::string& stage : stages_) {
    EXPECT_THAT(found.text, HasSubstr(stage));
  }
  EXPECT_THAT(found.messages, ::testing::Not(HasSubstr("CONSOLE")));
}

TEST_F(WholeRun, DamagedResultFile_IsRefusedByExportAndRecomputed) {
  const fs::path workspace = root_ / "work";
  copy_folder(undisturbed(), workspace);
  Random random{3, 0, 0};
  int damaged = 0;
  for (const std::string& stage : stages_) {
    const fs::path folder = fs::canonical(workspace / stage / "current");
    int made_anew = 0;
    for (const fs::path& file : some_files(folder, 2)) {
      for (const Damage damage : kDamages) {
        const DamagedFile hurt(file, damage, random);
        SCOPED_TRACE(hurt.what());
        const ChildResult refused = run_child({program_path(), "export", workspace.string(),
                                               (root_ / "out").string(), "--stage", stage});
        EXPECT_EQ(refused.exit_code, 3) << refused.err;
        EXPECT_FALSE(fs::exists(root_ / "out"));
        ++damaged;
        if (made_anew++ == 0) {  // once a stage: the work is the same
          const ChildResult again =
              run_child(chain(this_capture(), workspace, {"--from", stage, "--to", stage}));
          EXPECT_EQ(again.exit_code, 0) << again.err;
          EXPECT_EQ(digests(workspace, stage), expected_of(stage));
        }
      }
    }
  }
  const ChildResult end = run_child(chain(this_capture(), workspace));
  EXPECT_EQ(end.exit_code, 0) << end.err;
  EXPECT_EQ(digests(workspace), expected_);
  RecordProperty("damaged", damaged);
}

TEST_F(WholeRun, DamagedResult_IsRefusedByTheReadingStage) {
  // Stages whose only work before they refuse is to look at their inputs.
  const std::map<std::string, std::string> readers = {{"reconstruct", "personalize"},
                                                      {"personalize", "track"},
                                                      {"track", "body"},
                                                      {"body", "register"},
                                                      {"template", "register"},
                                                      {"register", "material"},
                                                      {"flatten", ""},
                                                      {"material", "animate"},
                                                      {"appearance", "animate"},
                                                      {"avatar", "animate"}};
  const fs::path workspace = root_ / "work";
  Random random{4, 0, 0};
  int refused = 0;
  for (const std::string& stage : stages_) {
    const auto reader = readers.find(stage);
    if (reader == readers.end() ||
        std::find(stages_.begin(), stages_.end(), reader->second) == stages_.end()) {
      continue;
    }
    fs::remove_all(workspace);
    copy_folder(undisturbed(), workspace);
    const fs::path folder = fs::canonical(workspace / stage / "current");
    for (const fs::path& file : some_files(folder, 2)) {
      const DamagedFile hurt(file, kDamages[refused % 2], random);
      SCOPED_TRACE(hurt.what());
      const ChildResult result = run_child(
          chain(this_capture(), workspace, {"--from", reader->second, "--to", reader->second}));
      EXPECT_EQ(result.exit_code, 3) << result.out;
      EXPECT_THAT(result.err, HasSubstr(stage));
      EXPECT_THAT(result.out, HasSubstr("report: "));
      ++refused;
    }
  }
  RecordProperty("refused", refused);
}

TEST_F(WholeRun, DamagedCaptureFile_IsFoundAndRestorable) {
  const fs::path capture = root_ / "capture";
  const fs::path workspace = root_ / "work";
  copy_folder(this_capture(), capture);
  ASSERT_EQ(run_child(chain(capture, workspace, {"--to", "validate"})).exit_code, 0);
  const Digests expected = digests(workspace, "validate");
  const auto errors = [&] {
    const auto name = current_name(workspace / "validate");
    return read_manifest(workspace / "validate" / *name, "validate").metrics.at("errors");
  };
  ASSERT_EQ(errors(), 0);
  Random random{5, 0, 0};
  int damaged = 0;
  int found = 0;
  for (const fs::path& file : some_files(capture, 8)) {
    const std::string path = fs::relative(file, capture).string();
    for (const Damage damage : kDamages) {
      const DamagedFile hurt(file, damage, random);
      SCOPED_TRACE(hurt.what());
      const ChildResult result = run_child(chain(capture, workspace, {"--to", "validate"}));
      EXPECT_EQ(result.signal, 0);
      EXPECT_THAT(result.exit_code, AnyOf(0, 3)) << result.err;
      ++damaged;
      found += result.exit_code == 3 ? 1 : 0;
      const bool held_out = path.find("/" + held_out_camera() + "/") != std::string::npos;
      if (path.ends_with(".png") && !held_out) {
        EXPECT_EQ(result.exit_code, 3) << "images have checksums";
      }
      if (result.exit_code == 0) {
        // What cannot be told from what it might have been is another capture: never the old
        // result.
        EXPECT_THAT(result.out, HasSubstr("validate is done,"));
      }
    }
  }
  const ChildResult back = run_child(chain(capture, workspace, {"--to", "validate"}));
  EXPECT_EQ(back.exit_code, 0) << back.err;
  EXPECT_THAT(back.out, HasSubstr("validate is done already"));
  EXPECT_EQ(digests(workspace, "validate"), expected);
  RecordProperty("damaged", damaged);
  RecordProperty("found_by_validate", found);
}

TEST_F(WholeRun, DamagedCaptureFile_IsRefusedOrChangesTheDigest) {
  const fs::path capture = root_ / "capture";
  const fs::path workspace = root_ / "work";
  copy_folder(this_capture(), capture);
  // Without validate, which would find most of it before.
  const std::vector<std::string> command =
      chain(capture, workspace, {"--from", "reconstruct", "--to", "reconstruct"});
  ASSERT_EQ(run_child(command).exit_code, 0);
  const Digests expected = digests(workspace);
  const auto sound = current_name(workspace / "reconstruct");
  Random random{7, 0, 0};
  int damaged = 0;
  int refused = 0;
  for (const fs::path& file : some_files(capture, 6)) {
    for (const Damage damage : kDamages) {
      const DamagedFile hurt(file, damage, random);
      SCOPED_TRACE(hurt.what());
      const ChildResult run = run_child(command);
      EXPECT_EQ(run.signal, 0);
      EXPECT_THAT(run.exit_code, AnyOf(0, 3)) << run.err;
      ++damaged;
      refused += run.exit_code == 3 ? 1 : 0;
      if (run.exit_code == 3) {
        EXPECT_THAT(run.err, HasSubstr("atelier: "));
      } else {
        // What may as well have been meant is another capture, of which the sound one's result is
        // none, even where the stage does not read that file.
        EXPECT_THAT(run.out, HasSubstr("reconstruct is done,"));
        EXPECT_NE(current_name(workspace / "reconstruct"), sound);
      }
    }
  }
  const ChildResult back = run_child(command);
  EXPECT_EQ(back.exit_code, 0) << back.err;
  EXPECT_THAT(back.out, HasSubstr("reconstruct is done already"));
  EXPECT_EQ(digests(workspace), expected);
  EXPECT_GT(refused, 0);
  RecordProperty("damaged", damaged);
  RecordProperty("refused_by_reconstruct", refused);
}

TEST_F(WholeRun, HeldOutImages_DoNotChangeTheResult) {
  const fs::path capture = root_ / "capture";
  copy_folder(this_capture(), capture);
  for (const char* kind : {"images", "labels"}) {
    fs::remove_all(capture / kind / held_out_camera());
  }
  const ChildResult result = run_child(chain(capture, root_ / "work"));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(digests(root_ / "work"), expected_);
}

TEST_F(WholeRun, DamagedDerivedInputs_AreRecomputed) {
  if (std::find(stages_.begin(), stages_.end(), "flatten") == stages_.end()) {
    GTEST_SKIP() << "the ordinary chain ends before";
  }
  const fs::path workspace = root_ / "work";
  copy_folder(undisturbed(), workspace);
  Random random{6, 0, 0};
  for (const char* folder : {"surfaces", "scene"}) {
    const std::string stage = std::string(folder) == "scene" ? "simulate" : "flatten";
    for (const fs::path& file : files_below(workspace / folder)) {
      for (const Damage damage : kDamages) {
        const DamagedFile hurt(file, damage, random);
        SCOPED_TRACE(hurt.what());
        const ChildResult result =
            run_child(chain(this_capture(), workspace, {"--from", stage, "--to", stage}));
        EXPECT_EQ(result.exit_code, 0) << result.err;
        EXPECT_THAT(result.out, HasSubstr(stage + " is done already"));
      }
    }
  }
  EXPECT_EQ(digests(workspace), expected_);
}

/// The jobs of `atelier plan` for the run.
nlohmann::json planned_jobs(const std::vector<std::string>& run, int parts) {
  std::vector<std::string> plan = run;
  plan.at(1) = "plan";
  plan.insert(plan.end(), {"--parts", std::to_string(parts), "--threads", "1", "--json"});
  const ChildResult planned = run_child(plan);
  EXPECT_EQ(planned.exit_code, 0) << planned.err;
  return nlohmann::json::parse(planned.out).at("jobs");
}

TEST_F(WholeRun, JobsOfThePlan_GiveTheSameDigestsInAnyOrderThatItAllows) {
  Random random{7, 0, 0};
  for (const int parts : {1, 3}) {
    const fs::path workspace = root_ / ("work" + std::to_string(parts));
    const nlohmann::json jobs = planned_jobs(chain(this_capture(), workspace), parts);
    std::set<std::string> left;
    std::set<std::string> done;
    int divided = 0;
    for (const nlohmann::json& job : jobs) {
      left.insert(job.at("id").get<std::string>());
      divided += job.contains("part") ? 1 : 0;
      EXPECT_GT(job.at("expected_seconds").get<double>(), 0) << job;
      EXPECT_GT(job.at("expected_megabytes").get<double>(), 0) << job;
    }
    EXPECT_EQ(left.size(), jobs.size());
    EXPECT_EQ(divided > 0, parts > 1);
    while (!left.empty()) {
      std::vector<nlohmann::json> ready;
      for (const nlohmann::json& job : jobs) {
        const auto needs = job.at("needs").get<std::vector<std::string>>();
        if (left.contains(job.at("id").get<std::string>()) &&
            std::all_of(needs.begin(), needs.end(),
                        [&](const std::string& need) { return done.contains(need); })) {
          ready.push_back(job);
        }
      }
      ASSERT_FALSE(ready.empty());
      const nlohmann::json& job = ready[uniform_index(random, ready.size())];
      auto command = job.at("command").get<std::vector<std::string>>();
      command.insert(command.begin(), program_path());
      const ChildResult result = run_child(command);
      ASSERT_EQ(result.exit_code, 0) << job << result.out << result.err;
      done.insert(job.at("id").get<std::string>());
      left.erase(job.at("id").get<std::string>());
      EXPECT_EQ(fs::exists(workspace / "report/index.html"), done.contains("report")) << job;
      EXPECT_EQ(result.out.find("report:") == std::string::npos, !done.contains("report"))
          << job << result.out;
    }
    EXPECT_EQ(digests(workspace), expected_);
    expect_clean(workspace);
  }
}

TEST_F(WholeRun, PlanWithAMaterial_HandsItToEveryJob) {
  std::vector<std::string> run = chain(this_capture(), root_ / "work");
  run.insert(run.end(), {"--material", "denim"});
  for (const nlohmann::json& job : planned_jobs(run, 2)) {
    const auto command = job.at("command").get<std::vector<std::string>>();
    const auto flag = std::find(command.begin(), command.end(), "--material");
    ASSERT_NE(flag, command.end()) << job;
    EXPECT_EQ(*(flag + 1), "denim") << job;
  }
  run.back() = "denimm";
  run.at(1) = "plan";
  const ChildResult result = run_child(run);
  EXPECT_EQ(result.exit_code, 2) << result.out;
  EXPECT_THAT(result.err, HasSubstr("denim"));
}

TEST_F(WholeRun, Workflow_GivesTheSameDigests) {
  const std::string snakefile = (source_directory() / "workflow/Snakefile").string();
  if (run_child({"snakemake", "--version"}).exit_code != 0) {
    GTEST_SKIP() << "Snakemake is not installed";
  }
  const fs::path workspace = root_ / "it's a work";
  const std::vector<std::string> run = chain(this_capture(), workspace);
  std::string options;
  for (std::size_t i = 4; i < run.size(); ++i) {
    options += (i == 4 ? "" : " ") + run[i];
  }
  const std::vector<std::string> command = {"snakemake",
                                            "--snakefile",
                                            snakefile,
                                            "--directory",
                                            root_.path().string(),
                                            "--cores",
                                            "2",
                                            "--config",
                                            "capture=" + this_capture().string(),
                                            "workspace=" + workspace.string(),
                                            "program=" + program_path(),
                                            "parts=3",
                                            "threads=1",
                                            "options=" + options};
  const ChildResult result = run_child(command);
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_EQ(digests(workspace), expected_);
  EXPECT_TRUE(fs::exists(workspace / "report/index.html"));
  const ChildResult again = run_child(command);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.out + again.err, HasSubstr("Nothing to be done"));
}

TEST_F(WholeRun, WorkflowOption_GivesTheSameDigests) {
  if (run_child({"snakemake", "--version"}).exit_code != 0) {
    GTEST_SKIP() << "Snakemake is not installed";
  }
  const fs::path workspace = root_ / "yes: a \"work\"";
  std::vector<std::string> run = chain(this_capture(), workspace);
  run.insert(run.end(), {"--workflow", "local", "--threads", "2"});
  const ChildResult result = run_child(run);
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_EQ(digests(workspace), expected_);
  EXPECT_TRUE(fs::exists(workspace / "report/index.html"));
}

TEST_F(WholeRun, WorkflowOptionWithPartOfTheWork_IsRefused) {
  for (const std::vector<std::string>& flags :
       {std::vector<std::string>{"--no-report"}, {"--json"}, {"--jobs", "2"}}) {
    std::vector<std::string> words = {"--workflow", "local"};
    words.insert(words.end(), flags.begin(), flags.end());
    const ChildResult result = run_child(chain(this_capture(), root_ / "work", words));
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_THAT(result.err, HasSubstr("--workflow"));
  }
}

TEST_F(WholeRun, BoardsBesideACalibratedCapture_AreSaidToBeUnused) {
  const ChildResult result =
      run_child(chain(this_capture(), root_ / "work", {"--dry-run", "--boards", "boards"}));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("--boards is not used"));
}

TEST_F(WholeRun, PartOfManyStages_IsRefused) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"--shard", "0/2"},
        {"--shard", "0/2", "--from", "track"},
        {"--shard", "0/2", "--from", "track", "--to", "track"},
        {"--shard", "2/2", "--from", "reconstruct", "--to", "reconstruct"}}) {
    const ChildResult result = run_child(chain(this_capture(), root_ / "work", words));
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_THAT(result.err, HasSubstr("shard"));
    EXPECT_FALSE(fs::exists(root_ / "work"));
  }
}

}  // namespace
}  // namespace atelier::fixtures

#endif
