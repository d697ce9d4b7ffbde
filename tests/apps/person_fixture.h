#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bodymodel/formats/tracked_motion.h"
#include "core/io/ground_truth_archive.h"
#include "core/sequence_archive.h"
#include "core/sha256.h"
#include "core/store/manifest.h"
#include "core/store/result.h"
#include "tests/support/child_process.h"
#include "tests/support/flags.h"
#include "tests/support/places.h"
#include "tests/support/read_text.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {

/// synthesize: three frames in a dress and three without, by eight small cameras.
inline std::vector<std::string> person_capture(const std::string& capture,
                                               const std::vector<std::string>& more) {
  std::vector<std::string> command = {"synthesize", capture};
  const std::vector<std::string> flags =
      with_usual({"--dome.cameras",   "8", "--dome.width",     "180",  "--dome.height",      "240",
                  "--frames",         "3", "--minimal_frames", "3",    "--held_out_cameras", "0",
                  "--held_out_share", "0", "--edge_length",    "0.05", "--substeps",         "6",
                  "--light-samples",  "6"},
                 more);
  command.insert(command.end(), flags.begin(), flags.end());
  return command;
}

/// reconstruct, as coarsely as such cameras see.
inline std::vector<std::string> person_scans(const std::string& capture,
                                             const std::string& workspace) {
  return {"reconstruct",
          capture,
          workspace,
          "--surface.octree_depth",
          "6",
          "--surface.edge_length",
          "0.03",
          "--stereo.iterations",
          "2",
          "--stereo.refinements",
          "1"};
}

/// A capture with its scans, keypoints, person and motion, made once for all suites of this
/// fixture; a copy of the workspace for each test, which has what `run_stage("track")` asks for
/// until something is changed.
class Person : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (folder_ != nullptr) {
      return;
    }
    folder_ = new TemporaryDirectory;  // in the program's own folder, which is gone at its end
    const std::string capture = (folder_->path() / "capture").string();
    const std::string made = (folder_->path() / "made").string();
    const std::vector<std::vector<std::string>> steps = {
        person_capture(
            capture, {"--fabric.resolution", "256", "--skin_resolution", "256", "--samples", "2"}),
        person_scans(capture, made),
        {"personalize", capture, made, "--samples", "800", "--shape-rounds", "2",
         "--surface-rounds", "1"},
        {"track", capture, made, "--samples", kSamples, "--rounds", kRounds}};
    for (std::vector<std::string> step : steps) {
      step.insert(step.begin(), program_path());
      made_ = run_child(step);
      if (made_.exit_code != 0) {
        return;
      }
    }
  }

  void SetUp() override {
    ASSERT_EQ(made_.exit_code, 0) << made_.err;
    std::filesystem::copy(
        folder_->path() / "made", workspace_,
        std::filesystem::copy_options::recursive | std::filesystem::copy_options::copy_symlinks);
  }
  static std::filesystem::path capture() { return folder_->path() / "capture"; }
  std::filesystem::path reconstructed(const std::string& file) const {
    return workspace_ / "reconstruct" / "current" / file;
  }
  /// The manifest says what the changed files of `reconstruct` are now: as if that stage had made
  /// them so.
  void sign_reconstruct() const {
    const std::filesystem::path folder =
        std::filesystem::canonical(workspace_ / "reconstruct" / "current");
    Manifest manifest = read_manifest(folder, "reconstruct");
    std::erase_if(manifest.outputs, [&](const ManifestOutput& output) {
      return !std::filesystem::exists(folder / output.path);
    });
    for (ManifestOutput& output : manifest.outputs) {
      const std::string bytes = read_text(folder / output.path);
      output.size = static_cast<std::int64_t>(bytes.size());
      output.digest = sha256(bytes);
    }
    std::ofstream(folder / "manifest.json") << manifest_text(manifest);
  }
  ChildResult run_stage(const std::string& stage, std::vector<std::string> more = {}) const {
    sign_reconstruct();
    std::vector<std::string> command = {program_path(), stage, capture().string(),
                                        workspace_.string()};
    if (stage == "track") {
      more = fixtures::with_usual({"--samples", kSamples, "--rounds", kRounds}, more);
    }
    if (stage == "body") {
      more = fixtures::with_usual({"--iterations", "2", "--gap-frames", "1"}, more);
    }
    command.insert(command.end(), more.begin(), more.end());
    return run_child(command);
  }
  ChildResult evaluate(std::vector<std::string> more) const {
    std::vector<std::string> command = {program_path(), "evaluate", workspace_.string(),
                                        "--ground-truth", capture().string()};
    command.insert(command.end(), more.begin(), more.end());
    return run_child(command);
  }
  TrackedMotion tracked() const {
    return read_tracked_motion(workspace_ / "track" / "current" / "tracked" / "clothed.h5");
  }
  nlohmann::json certificates() const {
    return nlohmann::json::parse(read_text(workspace_ / "body" / "current" / "certificates.json"));
  }
  /// A frame of the clothed sequence, as its files are named.
  static std::string clothed_frame(std::size_t f) { return frame_name(static_cast<int>(f)); }
  void change_scan(const std::string& frame, const std::function<void(Mesh&)>& change) const {
    const std::filesystem::path file = reconstructed("scans/" + frame + ".h5");
    Mesh scan = read_mesh_archive(file);
    change(scan);
    std::filesystem::remove(file);
    write_mesh_archive(file, scan);
  }

  static constexpr const char* kSamples = "600";
  static constexpr const char* kRounds = "3";
  inline static TemporaryDirectory* folder_ = nullptr;
  inline static ChildResult made_;
  TemporaryDirectory own_;
  std::filesystem::path workspace_ = own_.path() / "workspace";
};

}  // namespace atelier::fixtures
