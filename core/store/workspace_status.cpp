#include "core/store/workspace_status.h"

#include <algorithm>
#include <map>

#include "core/error.h"
#include "core/file_kind.h"
#include "core/printable.h"
#include "core/store/file_lock.h"
#include "core/store/frame_log.h"
#include "core/store/input_digest.h"
#include "core/store/made_of.h"
#include "core/store/result.h"
#include "core/store/stage_plan.h"

namespace atelier {
namespace {

using std::filesystem::file_type;

void judge_result(StageStatus& status, const std::filesystem::path& folder, Check check) {
  status.state = StageStatus::State::Damaged;
  try {
    status.manifest = read_manifest(folder, status.stage);
  } catch (const NewerManifestError& error) {
    status.state = StageStatus::State::Newer;
    status.findings.push_back({Severity::Error, "manifest-newer", folder.string(), error.what(),
                               "it is not damaged: a newer atelier reads it"});
    return;
  } catch (const DataError& error) {
    status.findings.push_back({Severity::Error, "manifest-damaged", folder.string(), error.what(),
                               "run the stage again"});
    return;
  }
  status.findings = check_outputs(folder, *status.manifest, check);
  if (!has_errors(status.findings)) {
    status.state = StageStatus::State::Done;
  }
}

/// Compares what came from outside with what is there now. Files are read only if names, sizes or
/// times differ from those that the stage saw, or if every byte is to be compared.
void judge_outside_input(StageStatus& status, const Stage& stage, const ManifestInput& input,
                         Check check) {
  try {
    if (check == Check::Sizes && stamp_of_input(input.path, consent_part(stage)) == input.stamp) {
      return;
    }
    const InputDigest now = digest_of_input(input.path, {}, consent_part(stage));
    if (now.digest != input.digest) {
      status.inputs_changed = true;
      status.reasons.push_back(input_change(
          input, {input.kind, input.path, now.digest, now.files, now.bytes, "", now.stamp}));
    }
  } catch (const DataError& error) {  // moved or removed: the result is as sound as it was
    status.findings.push_back({Severity::Warning, "input-gone", input.path,
                               "input " + input.kind + " cannot be compared: " + error.found,
                               "whether it has changed is not known"});
  } catch (const EnvironmentError& error) {
    status.findings.push_back({Severity::Warning, "input-unreadable", input.path,
                               "input " + input.kind + " cannot be compared: " + error.what(),
                               "whether it has changed is not known"});
  }
}

const StageStatus* status_of(const std::vector<StageStatus>& all, const std::string& stage) {
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const StageStatus& one) { return one.stage == stage; });
  return found == all.end() ? nullptr : &*found;
}

/// The files of a kind in a result: what lies in the folder of that name.
std::map<std::string, Digest> files_of(const Manifest& manifest, std::string_view kind) {
  std::map<std::string, Digest> files;
  for (const ManifestOutput& output : manifest.outputs) {
    if (output.path.starts_with(std::string(kind) + "/")) {
      files[output.path] = output.digest;
    }
  }
  return files;
}

/// Whether an input of a result that has changed is the same all the same: where the older result
/// is still there, and has a folder of the input's kind.
bool is_the_same(const ManifestInput& input, const StageStatus& maker) {
  try {
    const Manifest before = read_manifest(input.path, input.stage);
    const std::map<std::string, Digest> files = files_of(before, input.kind);
    return outputs_digest(before) == input.digest && !files.empty() && maker.manifest &&
           files == files_of(*maker.manifest, input.kind);
  } catch (const DataError&) {
    return false;
  } catch (const EnvironmentError&) {
    return false;
  }
}

/// One sentence on the inputs of a result that has changed, those that are not the same. Where that
/// cannot be told of several, all are of it.
std::string changed_inputs(const Manifest& manifest, const StageStatus& maker) {
  std::vector<std::string> kinds;
  std::vector<std::string> others;
  for (const ManifestInput& input : manifest.inputs) {
    if (input.stage == maker.stage) {
      (is_the_same(input, maker) ? others : kinds).push_back(input.kind);
    }
  }
  if (kinds.size() == 1) {
    return "its input " + kinds.front() + " of '" + maker.stage + "' has changed since";
  }
  std::string names;
  for (const std::string& kind : kinds.empty() ? others : kinds) {
    names += (names.empty() ? "" : ", ") + kind;
  }
  return "the result of '" + maker.stage + "', which its inputs " + names +
         " are of, has changed since";
}

/// Changes since a sound result was made.
void judge_age(StageStatus& status, const Stage& stage, const std::vector<StageStatus>& earlier,
               const std::filesystem::path& workspace, Check check) {
  if (status.state != StageStatus::State::Done) {
    return;
  }
  if (status.manifest->stage_version != stage.version) {
    status.reasons.push_back("made by version " + std::to_string(status.manifest->stage_version) +
                             " of the stage, now " + std::to_string(stage.version));
  }
  const auto outdated_by = [&](std::string reason) {  // several inputs may be of one stage
    if (std::find(status.reasons.begin(), status.reasons.end(), reason) == status.reasons.end()) {
      status.reasons.push_back(std::move(reason));
    }
  };
  const auto follow = [&](const StageStatus& maker) {
    if (maker.state == StageStatus::State::Outdated) {
      status.inputs_changed = status.inputs_changed || maker.inputs_changed;
      outdated_by("'" + maker.stage + "' before it is outdated");
    }
  };
  for (const ManifestInput& input : status.manifest->inputs) {
    if (input.stage.empty()) {
      judge_outside_input(status, stage, input, check);
      for (const ResultName& made_of : results_behind(workspace, input.path)) {
        const StageStatus* maker = status_of(earlier, made_of.stage);
        if (maker == nullptr) {
          continue;
        }
        if (!maker->manifest || folder_name(maker->manifest->key) != made_of.key16) {
          status.inputs_changed = true;
          outdated_by("its input " + input.kind + " is made from a result of '" + made_of.stage +
                      "' that is no longer the current one");
        } else {
          follow(*maker);
        }
      }
      continue;
    }
    const StageStatus* maker = status_of(earlier, input.stage);
    if (maker == nullptr) {
      continue;
    }
    if (!maker->manifest || outputs_digest(*maker->manifest) != input.digest) {
      status.inputs_changed = true;
      outdated_by(changed_inputs(*status.manifest, *maker));
    } else {
      follow(*maker);
    }
  }
  for (const std::string_view kind : stage.optional_inputs) {
    const auto is_read = [&](const ManifestInput& input) { return input.kind == kind; };
    if (kind.empty() ||
        std::any_of(status.manifest->inputs.begin(), status.manifest->inputs.end(), is_read)) {
      continue;
    }
    for (const StageStatus& other : earlier) {
      const auto& made = other.row->outputs;
      if (other.manifest && std::find(made.begin(), made.end(), kind) != made.end()) {
        outdated_by("'" + other.stage + "' has a result now, which it could use");
      }
    }
  }
  if (!status.reasons.empty()) {
    status.state = StageStatus::State::Outdated;
  }
}

}  // namespace

const char* state_name(StageStatus::State state) {
  switch (state) {
    case StageStatus::State::None:
      return "none";
    case StageStatus::State::Unfinished:
      return "unfinished";
    case StageStatus::State::Done:
      return "done";
    case StageStatus::State::Outdated:
      return "outdated";
    case StageStatus::State::Newer:
      return "newer";
    case StageStatus::State::Damaged:
      return "damaged";
  }
  return "none";
}

std::vector<StageStatus> workspace_status(std::span<const Stage> stages,
                                          const std::filesystem::path& workspace, Check check) {
  require_workspace(stages, workspace);
  std::vector<StageStatus> all;
  for (const Stage& stage : stages) {
    StageStatus status;
    status.stage = stage.name;
    status.row = &stage;
    const std::filesystem::path folder = results_of_stage(workspace, stage.name);
    if (link_kind(folder) != file_type::not_found) {
      require_folder(folder);
      status.running = FileLock::is_held(folder / ".lock");
      const auto current = current_name(folder);
      status.unlinked_results = unlinked_results(folder);
      for (const std::filesystem::path& entry : list_folder(folder)) {
        const std::string name = entry.filename().string();
        if (link_kind(entry) != file_type::directory) {
          continue;
        }
        if (const std::string_view key = key_behind(".staging-", name); !key.empty()) {
          status.unfinished.push_back(
              {std::string(key), static_cast<std::int64_t>(read_frame_logs(entry).size())});
        } else if (current && is_folder_name(name) && name != *current) {
          ++status.older_results;
          status.older_kept += is_of_newer_program(entry, stage.name) ? 1 : 0;
        }
      }
      std::sort(status.unfinished.begin(), status.unfinished.end(),
                [](const UnfinishedWork& a, const UnfinishedWork& b) { return a.key16 < b.key16; });
      if (current) {
        judge_result(status, folder / *current, check);
        if (status.state != StageStatus::State::Done) {  // they may be the last sound ones
          status.older_kept = status.older_results;
        }
        judge_age(status, stage, all, workspace, check);
      } else if (const std::optional<Finding> problem = current_folder_finding(folder)) {
        status.state = StageStatus::State::Damaged;
        status.findings.push_back(*problem);
      } else if (!status.unfinished.empty()) {
        status.state = StageStatus::State::Unfinished;
      }
    }
    all.push_back(std::move(status));
  }
  return all;
}

std::string unlinked_text(std::int64_t results) {
  return counted(results, "result") +
         " without a current link; the stage's command with the same arguments links " +
         (results == 1 ? "it" : "one of them") + " again without recomputing it";
}

}  // namespace atelier
