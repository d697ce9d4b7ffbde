#include "core/store/stage_plan.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <system_error>

#include "core/error.h"
#include "core/file_kind.h"
#include "core/store/consent_file.h"
#include "core/store/frame_log.h"
#include "core/store/input_digest.h"
#include "core/store/named_files.h"
#include "core/store/result.h"
#include "core/store/workspace_folder.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

std::filesystem::path real_path(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::path real = std::filesystem::weakly_canonical(path, error);
  if (error == std::errc::too_many_symbolic_link_levels) {
    throw DataError(path.string(), "", "not a regular file: " + error.message(),
                    "a file or a folder");
  }
  if (error) {
    throw EnvironmentError(path.string(), system_reason(error.value()));
  }
  return real;
}

bool lies_inside(const std::filesystem::path& path, const std::filesystem::path& folder) {
  const auto [end, rest] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
  return end == folder.end();
}

/// Refuses results of another capture: each input of a kind, the plan's own and those of the
/// results that it reads, must be the same as one before it.
void require_one_source(std::vector<ManifestInput>& seen, const Manifest& manifest,
                        const std::string& stage) {
  for (const ManifestInput& input : manifest.inputs) {
    if (!input.stage.empty() || input.kind.starts_with("--")) {
      continue;
    }
    const ManifestInput* other = nullptr;
    bool known = false;
    for (const ManifestInput& before : seen) {
      if (before.kind == input.kind) {
        other = &before;
        known = known || is_same_input(before, input);
      }
    }
    if (other != nullptr && !known) {
      throw DataError(input.path, "",
                      "the " + input.kind + " that the result of '" + stage +
                          "' was made from, not " + other->path + ": " +
                          input_difference(input, *other),
                      "results of one " + input.kind + " in a workspace; run 'atelier " + stage +
                          "' with this one first, or take another workspace");
    }
    seen.push_back(input);
  }
}

/// The INPUT that the user named.
void add_outside_input(StagePlan& plan, std::string_view kind, const Stage& stage,
                       const StageRequest& request, const StageEvents& events,
                       std::vector<ManifestInput>& outside) {
  const std::filesystem::path path = real_path(request.input);
  if (is_inside_input(request)) {
    throw DataError(request.workspace.string(), "", "a workspace inside its own input",
                    "a folder elsewhere: what is written there would change the input");
  }
  if (stage.check_input != nullptr && file_kind(path) != std::filesystem::file_type::not_found) {
    stage.check_input(path, request.options.table);
  }
  const InputDigest digest = digest_of_input(path, events, consent_part(stage));
  plan.manifest.inputs.push_back({std::string(kind), path.string(), digest.digest, digest.files,
                                  digest.bytes, "", digest.stamp, digest.sketch});
  plan.input_paths.push_back(path);
  add_consent(plan.manifest.consent, read_consent(path));
  const std::filesystem::path result = result_around(path);
  if (result.empty()) {
    outside.push_back(plan.manifest.inputs.back());
  } else {  // handed over (`refine`): it brings what it was made from with it
    const Manifest manifest = read_manifest(result, result.parent_path().filename().string());
    require_one_source(outside, manifest, manifest.stage);
    add_consent(plan.manifest.consent, manifest.consent);
  }
}

/// Files that an option names: its text, or parts of it, as `files_named_in` finds them.
void add_named_files(StagePlan& plan, const OptionField& field, const Stage& stage,
                     const StageEvents& events) {
  const auto* const text = std::get_if<std::string*>(&field.target);
  if (text == nullptr || field.source == "default") {  // a word, whatever lies about by that name
    return;
  }
  for (const std::filesystem::path& name : files_named_in(**text)) {
    const std::filesystem::path path = real_path(name);
    const InputDigest digest = digest_of_input(path, events, consent_part(stage));
    plan.manifest.inputs.push_back({"--" + field.name, path.string(), digest.digest, digest.files,
                                    digest.bytes, "", digest.stamp});
    plan.input_paths.push_back(path);
  }
}

/// The result of an earlier stage.
void add_stage_input(StagePlan& plan, std::string_view kind, const Stage& maker,
                     const StageRequest& request, const StageEvents& events,
                     std::vector<ManifestInput>& outside) {
  const std::filesystem::path folder = request.workspace / maker.name;
  const std::string advice = "a sound result; run 'atelier " + std::string(maker.name) + "' first";
  const auto name = current_name(folder);
  if (!name) {
    throw DataError(folder.string(), "", "no result", advice);
  }
  const std::filesystem::path result = folder / *name;
  auto lock = FileLock::try_lock_folder(result, FileLock::Mode::Shared);
  if (!lock) {
    throw DataError(result.string(), "", "a result that is being removed", advice);
  }
  plan.input_locks.push_back(std::move(*lock));
  const Manifest manifest = read_manifest(result, maker.name);
  require_one_source(outside, manifest, std::string(maker.name));
  const std::vector<Finding> findings = check_outputs(result, manifest, Check::Digests, events);
  for (const Finding& finding : findings) {
    if (finding.severity == Severity::Error) {
      throw DataError(finding.place, "", finding.what, advice);
    }
  }
  ManifestInput input{std::string(kind),
                      result.string(),
                      outputs_digest(manifest),
                      static_cast<std::int64_t>(manifest.outputs.size()),
                      0,
                      std::string(maker.name),
                      stamp_of_input(result)};
  for (const ManifestOutput& output : manifest.outputs) {
    input.bytes += output.size;
  }
  plan.manifest.inputs.push_back(std::move(input));
  plan.input_paths.push_back(result);
  add_consent(plan.manifest.consent, manifest.consent);
}

std::string change(const std::string& what, const std::string& before, const std::string& now) {
  return what + ": " + before + " -> " + now;
}

/// The manifest of the stage's current result; nothing if there is none that can be read. What a
/// newer program wrote is refused, so that no older one replaces it.
std::optional<Manifest> current_manifest(const StagePlan& plan) {
  const auto name = current_name(plan.stage_folder);
  if (!name) {
    return std::nullopt;
  }
  try {
    return read_manifest(plan.stage_folder / *name, plan.manifest.stage);
  } catch (const NewerManifestError&) {
    throw;
  } catch (const DataError&) {
    return std::nullopt;
  }
}

/// "" if the folder holds the sound result of the plan's key, else what is wrong with it.
std::string result_problem(const std::filesystem::path& folder, const Manifest& planned,
                           const StageEvents& events) {
  try {
    const Manifest manifest = read_manifest(folder, planned.stage);
    if (manifest.key != planned.key) {
      return "it has another key";
    }
    for (const Finding& finding : check_outputs(folder, manifest, Check::Digests, events)) {
      if (finding.severity == Severity::Error) {
        return finding.place + ": " + finding.what;
      }
    }
    return "";
  } catch (const NewerManifestError&) {
    throw;
  } catch (const DataError& error) {
    return error.what();
  }
}

}  // namespace

std::vector<int> frames_of(const Manifest& manifest) {
  constexpr std::size_t kDigits = 6;
  constexpr std::size_t kMaxDigits = 9;
  std::set<int> frames;
  for (const ManifestOutput& output : manifest.outputs) {
    const std::string stem = std::filesystem::path(output.path).stem().string();
    if (stem.size() >= kDigits && stem.size() <= kMaxDigits &&
        stem.find_first_not_of("0123456789") == std::string::npos) {
      frames.insert(std::stoi(stem));
    }
  }
  return {frames.begin(), frames.end()};
}

std::string input_change(const ManifestInput& before, const ManifestInput& now) {
  return "input " + now.kind + " changed (" + amount_text(before.files, before.bytes) + " -> " +
         amount_text(now.files, now.bytes) + ")";
}

bool is_inside_input(const StageRequest& request) {
  const std::filesystem::path input = real_path(request.input);
  return file_kind(input) == std::filesystem::file_type::directory &&
         lies_inside(real_path(request.workspace), input);
}

StagePlan plan_stage(std::span<const Stage> stages, const Stage& stage, const StageRequest& request,
                     const StageEvents& events) {
  ATELIER_CHECK(check_options(request.options.table).empty(), "options were not checked");
  const std::string problem = workspace_problem(stages, request.workspace);
  if (!problem.empty() && !is_inside_input(request)) {  // which has a refusal of its own
    throw DataError(request.workspace.string(), "", "no workspace: " + problem,
                    "a workspace, or a new or empty folder");
  }
  require_usable_stage_folder(request.workspace / stage.name);
  StagePlan plan;
  if (std::string openness = openness_of(request.workspace); !openness.empty()) {
    plan.warnings.push_back(std::move(openness));
  }
  plan.manifest.stage = stage.name;
  plan.manifest.stage_version = stage.version;
  plan.manifest.device = stage.device_keyed ? device_name(request.device) : "";
  for (const OptionField& field : request.options.table.fields) {
    plan.manifest.options.push_back({field.name, option_json(field), field.source, field.keyed});
  }
  plan.manifest.canonical_options = canonical_json(request.options.table);
  std::vector<ManifestInput> outside;
  for (const std::string_view kind : stage.inputs) {
    if (kind.empty()) {
      continue;
    }
    const Stage* maker = stage_that_makes(stages, kind);
    if (maker == nullptr) {
      add_outside_input(plan, kind, stage, request, events, outside);
    } else {
      add_stage_input(plan, kind, *maker, request, events, outside);
    }
  }
  for (const std::string_view kind : stage.optional_inputs) {
    const Stage* maker = stage_that_makes(stages, kind);
    if (maker != nullptr && current_name(request.workspace / maker->name)) {
      add_stage_input(plan, kind, *maker, request, events, outside);
    }
  }
  for (const OptionField& field : request.options.table.fields) {
    if (std::find(stage.file_options.begin(), stage.file_options.end(), field.name) !=
        stage.file_options.end()) {
      add_named_files(plan, field, stage, events);
    }
  }
  plan.manifest.key = stage_key(stage.name, stage.version, plan.manifest.device,
                                plan.manifest.canonical_options, plan.manifest.inputs);
  plan.stage_folder = request.workspace / stage.name;
  plan.result_folder = plan.stage_folder / folder_name(plan.manifest.key);
  plan.staging_folder = plan.stage_folder / (".staging-" + folder_name(plan.manifest.key));
  judge_state(plan, request.force, events);
  if (plan.state == StagePlan::State::Done && !request.selection.everything()) {
    // Requests that the run would refuse are refused although there is nothing left to do.
    some_selected_frames(request.selection,
                         frames_of(read_manifest(plan.result_folder, stage.name)),
                         plan.input_paths.empty() ? "" : plan.input_paths.front().string());
  }
  return plan;
}

void judge_state(StagePlan& plan, bool force, const StageEvents& events) {
  plan.reasons.clear();
  plan.frames_kept = 0;
  // Asked even where the key's own result is there: making that one current would set aside what a
  // newer program wrote.
  const std::optional<Manifest> before = current_manifest(plan);
  const bool there = link_kind(plan.result_folder) != std::filesystem::file_type::not_found;
  const std::string problem =
      there ? result_problem(plan.result_folder, plan.manifest, events) : "";
  if (there && problem.empty() && !force) {
    plan.state = StagePlan::State::Done;
    return;
  }
  plan.state = StagePlan::State::Run;
  if (force) {
    plan.reasons.push_back("--force");
  }
  if (there && !problem.empty()) {
    plan.reasons.push_back("the result is damaged: " + problem);
  }
  if (!there) {
    if (before) {
      plan.reasons = request_changes(*before, plan.manifest);
    } else if (current_name(plan.stage_folder)) {
      plan.reasons.push_back("the current result is damaged");
    } else {
      plan.reasons.push_back("it has no result in this workspace");
    }
  }
  if (!force && link_kind(plan.staging_folder) == std::filesystem::file_type::directory) {
    plan.frames_kept = static_cast<std::int64_t>(read_frame_logs(plan.staging_folder).size());
    if (plan.frames_kept > 0 ||
        link_kind(plan.staging_folder / "manifest.json") != std::filesystem::file_type::not_found) {
      plan.state = StagePlan::State::Resume;
    }
  }
}

std::vector<std::string> request_changes(const Manifest& before, const Manifest& now) {
  std::vector<std::string> changes;
  if (before.stage_version != now.stage_version) {
    changes.push_back(change("stage version", std::to_string(before.stage_version),
                             std::to_string(now.stage_version)));
  }
  if (before.device != now.device) {
    changes.push_back(change("device", before.device, now.device));
  }
  std::map<std::string, std::string> old_options;
  for (const ManifestOption& option : before.options) {
    if (option.keyed) {
      old_options[option.name] = option.json;
    }
  }
  for (const ManifestOption& option : now.options) {
    if (!option.keyed) {
      continue;
    }
    const auto found = old_options.find(option.name);
    if (found == old_options.end()) {
      changes.push_back("option " + option.name + " is new: " + option.json);
      continue;
    }
    // Numbers may be written in two ways; only the key's own text decides.
    if (found->second != option.json &&
        before.canonical_options.find("\"" + option.name + "\":" + option.json) ==
            std::string::npos) {
      changes.push_back(change("option " + option.name, found->second, option.json));
    }
    old_options.erase(found);
  }
  for (const auto& [name, value] : old_options) {
    changes.push_back("option " + name + " is gone");
  }
  for (std::size_t i = 0; i < now.inputs.size(); ++i) {
    const ManifestInput& input = now.inputs[i];
    if (i >= before.inputs.size() || before.inputs[i].kind != input.kind) {
      changes.push_back("input " + input.kind + " is new");
    } else if (before.inputs[i].digest != input.digest) {
      changes.push_back(input_change(before.inputs[i], input));
    }
  }
  if (before.inputs.size() > now.inputs.size()) {
    changes.push_back("an input is gone");
  }
  if (changes.empty()) {
    changes.push_back("the current result is of another request");
  }
  return changes;
}

}  // namespace atelier
