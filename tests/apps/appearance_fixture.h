#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/archive.h"
#include "core/store/run_stage.h"
#include "tests/apps/program_versions.h"
#include "tests/pipeline/appearance/waving_capture.h"
#include "tests/support/child_process.h"
#include "tests/support/flags.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {

struct NoWavingOptions {};
inline OptionTable describe(NoWavingOptions&) {
  return {};
}

/// Its ground truth, as if stages had found it.
inline constexpr std::array kWavingStages = {
    Stage{.name = "body",
          .summary = "the ball",
          .inputs = {"capture"},
          .outputs = {"bodies"},
          .options = option_set<NoWavingOptions>,
          .run =
              [](StageRun& run) {
                WavingCapture::write_found(run, "", WavingCapture::ball(),
                                           [](int) { return WavingCapture::ball().vertices; });
              }},
    Stage{.name = "register",
          .summary = "the cloth",
          .inputs = {"capture"},
          .outputs = {"registered"},
          .options = option_set<NoWavingOptions>,
          .run =
              [](StageRun& run) {
                WavingCapture::write_found(
                    run, "registered/dress", WavingCapture::waving_cloth(), [](int f) {
                      return WavingCapture::cloth_at(WavingCapture::waving_cloth(), f);
                    });
              }},
};

/// `oracle`, which is `appearance` on ground-truth garments, and `appearance` and `draw` on what
/// could be its registered garment and body.
class Appearance : public ::testing::Test, protected WavingCapture {
 protected:
  /// A network of a moment.
  static std::vector<std::string> small_network() {
    return {"--resolution",    "32",   "--channels",         "2", "--iterations",       "24",
            "--learning-rate", "0.01", "--occlusion.strata", "3", "--checkpoint-every", "4"};
  }

  void SetUp() override {
    if (!std::filesystem::exists(network_program())) {
      GTEST_SKIP() << "built without libtorch";
    }
    make_capture(capture_);
  }
  /// The call of `appearance` or `oracle`.
  static std::vector<std::string> learning(const std::string& stage,
                                           const std::filesystem::path& capture,
                                           const std::filesystem::path& workspace,
                                           std::vector<std::string> more) {
    std::vector<std::string> words = {program_path(), stage, capture.string(), workspace.string()};
    more = with_usual(small_network(), more);
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  static ChildResult learn(const std::string& stage, const std::filesystem::path& capture,
                           const std::filesystem::path& workspace,
                           const std::vector<std::string>& more) {
    return run_child(learning(stage, capture, workspace, more));
  }
  /// Below a folder that may not be there yet, as far as they stay while one looks.
  static std::vector<std::filesystem::path> all_files(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::error_code gone;
    auto walk = std::filesystem::recursive_directory_iterator(folder, gone);
    for (; !gone && walk != std::filesystem::recursive_directory_iterator(); walk.increment(gone)) {
      files.push_back(walk->path());
    }
    return files;
  }
  /// Makes a workspace in which `body` and `register` have found the truth.
  static void find(const std::filesystem::path& capture, const std::filesystem::path& workspace) {
    const std::vector<Stage> all = with_program_versions(kWavingStages);
    for (const Stage& stage : all) {
      StageRequest request;
      request.input = capture;
      request.workspace = workspace;
      request.options = stage.options();
      run_stage(all, stage, request);
    }
  }
  ChildResult oracle(const std::string& workspace,
                     const std::vector<std::string>& more = {}) const {
    return learn("oracle", capture_, folder_ / workspace, more);
  }
  ChildResult appearance(const std::filesystem::path& workspace,
                         const std::vector<std::string>& more = {}) const {
    return learn("appearance", capture_, workspace, more);
  }
  std::filesystem::path found() const {
    find(capture_, folder_ / "found");
    return folder_ / "found";
  }
  /// Nothing half done, and nothing that the next run would find.
  void expect_nothing_of_oracle(const std::string& workspace) const {
    EXPECT_FALSE(std::filesystem::exists(folder_ / workspace / "oracle")) << "nothing was made";
  }
  /// Moves images of a camera to another; labels go, without which nothing but the images says
  /// that they are of something else.
  void give_pictures(const std::vector<std::pair<int, int>>& from_to) const {
    std::filesystem::remove_all(capture_ / "labels");
    std::filesystem::rename(capture_ / "images", capture_ / "taken");
    std::filesystem::copy(capture_ / "taken", capture_ / "images",
                          std::filesystem::copy_options::recursive);
    for (const auto& [from, to] : from_to) {
      const std::filesystem::path place = capture_ / "images" / ("0" + std::to_string(to));
      std::filesystem::remove_all(place);
      std::filesystem::copy(capture_ / "taken" / ("0" + std::to_string(from)), place,
                            std::filesystem::copy_options::recursive);
    }
    std::filesystem::remove_all(capture_ / "taken");
  }
  std::filesystem::path result(const std::string& workspace, const char* file) const {
    return folder_ / workspace / "oracle" / "current" / "cloth" / file;
  }
  std::vector<std::string> train(const std::string& model, const std::string& checkpoint,
                                 const std::string& channels = "2") const {
    return {network_program().string(),
            "train",
            result("ws", "data.h5").string(),
            (folder_ / model).string(),
            "--resolution",
            "32",
            "--channels",
            channels,
            "--iterations",
            "60",
            "--checkpoint_every",
            "5",
            "--checkpoint",
            (folder_ / checkpoint).string(),
            "--log",
            (folder_ / (model + ".csv")).string()};
  }

  TemporaryDirectory folder_;
  std::filesystem::path capture_ = folder_ / "capture";
};

}  // namespace atelier::fixtures
