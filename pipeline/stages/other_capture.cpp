#include "pipeline/stages/other_capture.h"

#include <algorithm>
#include <cerrno>
#include <system_error>

#include <unistd.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/store/file_lock.h"
#include "core/store/input_digest.h"
#include "core/store/made_of.h"
#include "core/store/manifest.h"
#include "core/store/result.h"
#include "core/system_reason.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kCapture = "capture";

/// A capture as an input of today; digested once, and only when it has to be.
class CaptureNow {
 public:
  CaptureNow(const fs::path& capture, const StageEvents& events) : events_(events) {
    std::error_code ignored;
    input_.kind = kCapture;
    input_.path = fs::weakly_canonical(capture, ignored).string();
  }
  const ManifestInput& digested(ConsentPart consent) {
    if (consent_ != consent) {
      const InputDigest now = digest_of_input(input_.path, events_, consent);
      input_ = {input_.kind, input_.path, now.digest, now.files,
                now.bytes,   "",          now.stamp,  now.sketch};
      consent_ = consent;
    }
    return input_;
  }
  bool is_other(const ManifestInput& input, const Stage& stage) {
    return input.stage.empty() && input.kind == kCapture && input.path != input_.path &&
           !is_same_input(input, digested(consent_part(stage)));
  }

 private:
  const StageEvents& events_;
  ManifestInput input_;
  std::optional<ConsentPart> consent_;
};

}  // namespace

std::optional<OtherCapture> other_capture(const fs::path& workspace, const fs::path& capture,
                                          const StageEvents& events) {
  CaptureNow now(capture, events);
  OtherCapture other;
  const auto is_named = [&](const std::string& stage) {
    return std::find(other.stages.begin(), other.stages.end(), stage) != other.stages.end();
  };
  for (const Stage& stage : all_stages()) {
    const fs::path folder = results_of_stage(workspace, stage.name);
    const auto name = current_name(folder);
    if (!name) {
      continue;
    }
    Manifest manifest;
    try {
      manifest = read_manifest(folder / *name, stage.name);
    } catch (const DataError&) {  // damaged, or a newer program's, which the stage itself refuses
      continue;
    }
    bool found = false;
    for (const ManifestInput& input : manifest.inputs) {
      if (now.is_other(input, stage)) {
        if (other.path.empty()) {
          other.path = input.path;
          other.difference = input_difference(input, now.digested(consent_part(stage)));
        }
        found = true;
      }
      const std::vector<ResultName> behind =
          input.stage.empty() ? results_behind(workspace, input.path) : std::vector<ResultName>{};
      found = found || is_named(input.stage) ||
              std::any_of(behind.begin(), behind.end(),
                          [&](const ResultName& made_of) { return is_named(made_of.stage); });
    }
    if (found) {
      other.stages.emplace_back(stage.name);
    }
  }
  return other.stages.empty() ? std::nullopt : std::optional<OtherCapture>(std::move(other));
}

void set_aside(const fs::path& workspace, const std::vector<std::string>& stages) {
  std::vector<FileLock> locks;  // all, before the first is touched
  for (const std::string& stage : stages) {
    const fs::path folder = results_of_stage(workspace, stage);
    auto lock = FileLock::try_lock(folder / ".lock", FileLock::Mode::Exclusive);
    if (!lock) {
      throw EnvironmentError(folder.string(), "another run is working on '" + stage + "'");
    }
    locks.push_back(std::move(*lock));
    locks.push_back(FileLock::wait(folder / ".commit-lock", FileLock::Mode::Exclusive));
  }
  for (auto stage = stages.rbegin(); stage != stages.rend(); ++stage) {  // what reads goes first
    const fs::path folder = results_of_stage(workspace, *stage);
    const fs::path link = folder / "current";
    if (unlink(link.c_str()) != 0) {
      throw EnvironmentError(link.string(), system_reason(errno));
    }
    sync_directory(folder);
  }
}

}  // namespace atelier
