#include <ctime>
#include <iostream>
#include <memory>

#include "apps/commands/opened_workspace.h"
#include "apps/console/arguments.h"
#include "apps/console/failure.h"
#include "apps/console/interrupt.h"
#include "apps/console/stage_command.h"
#include "apps/console/stage_console.h"
#include "apps/console/stand_alone.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/printable.h"
#include "core/seal/sealed_file.h"
#include "core/store/output_place.h"
#include "core/store/result.h"
#include "core/store/unfinished_folder.h"
#include "core/store/utc_time.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/animation/animation_input.h"
#include "pipeline/animation/animation_signer.h"
#include "pipeline/chain/outdated_results.h"
#include "pipeline/sealing/access_log.h"
#include "pipeline/sealing/seal_folder.h"
#include "pipeline/sealing/sealed_subject.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kAnimateStage = "animate";

/// Flags for a sealed WORKSPACE, into which nothing can be written.
struct SealedAnimation {
  KeyArguments keys;
  std::string out;
  std::vector<std::string> to;

  std::string first() const {
    return !keys.identities.empty()        ? "--identity"
           : !keys.passphrase_file.empty() ? "--passphrase-file"
           : keys.passphrase               ? "--passphrase"
           : !out.empty()                  ? "--out"
           : !to.empty()                   ? "--to"
                                           : "";
  }
};

void require_places(const SealedAnimation& arguments, const StandAloneRequest& request) {
  if (!is_sealed_file(request.workspace)) {
    const std::string flag = arguments.first();
    const bool folder = fs::is_directory(request.workspace);
    throw UsageError(!folder || flag.empty()
                         ? "WORKSPACE cannot be '" + request.workspace +
                               "': neither a folder nor a sealed file"
                         : flag + " is for a sealed WORKSPACE, and '" + request.workspace +
                               "' is not sealed: its results lie in it; leave it out");
  }
  if (arguments.out.empty()) {
    throw UsageError(
        "of a sealed WORKSPACE animate takes --out: a new folder, or with --to age1... a new "
        "sealed file");
  }
  require_new_place(arguments.out, "--out");
  require_outside_captures(arguments.out, "--out");
  arguments.to.empty() ? require_folder_place(arguments.out) : require_file_place(arguments.out);
}

/// Refuses a workspace of people who have not consented to the use, also where the animation is
/// there already. Throws ConsentRefused.
void require_consent_of(const fs::path& workspace, const ConsentUse& use) {
  std::vector<Consent> all;
  for (const StageStatus& status : workspace_status(all_stages(), workspace)) {
    add_consent(all, consent_of(status));
  }
  for (const std::string& doubt : require_consent(all, use)) {
    std::cout << "warning: " << printable(doubt) << std::endl;
  }
}

/// ", mark 0123456789abcdef"; "" of an animation without images or without a mark.
std::string mark_of_animation(const fs::path& result) {
  const fs::path statement = result / kAnimationStatement;
  if (!fs::exists(statement)) {
    return "";
  }
  const std::string text = read_file_text(statement, Limits{}.text_file_bytes);
  return ", mark " + mark_text(mark_of(parse_render_statement(text, statement.string())));
}

/// A workspace that holds the animation alone.
void write_animation(const fs::path& result, const fs::path& out, const std::string& log) {
  const UnfinishedFolder folder(out);
  const fs::path stage = folder.content() / kAnimateStage;
  const fs::path copy = stage / result.filename();
  make_private_directory(copy);
  for (const auto& entry : fs::recursive_directory_iterator(result)) {
    if (interrupted()) {
      return;
    }
    const fs::path place = copy / entry.path().lexically_relative(result);
    if (entry.is_directory()) {
      make_private_directory(place);
    } else {
      fs::copy_file(entry.path(), place);
    }
  }
  set_current(stage, result.filename().string());
  log_access(folder.content(), std::string(kAnimateStage), log);
  folder.finish();
}

/// The workspace with the animation in it, sealed again.
void seal_animation(const fs::path& workspace, const SealedAnimation& arguments,
                    const AgeRecipients& to, const ConsentUse& use) {
  const fs::path before = workspace / kSealingNote;
  SealingNote note = sealed_subject(workspace, all_stages());
  note.sealed = utc_text(static_cast<double>(std::time(nullptr)));
  note.purpose = use.purpose;
  const SealingNote was =
      parse_sealing_note(read_file_text(before, Limits{}.text_file_bytes), before.string());
  note.none_needed = note.consent.empty() ? was.none_needed : "";
  note.digests_checked = was.digests_checked;
  log_access(workspace, std::string(kAnimateStage), sealed_to_text(to, use.purpose));
  seal_folder(workspace, note, to, arguments.out, interrupted, [] {});
}

/// Animates what is sealed. False if it was told to stop: of that nothing is kept.
bool animate_opened(const SealedAnimation& arguments, const StandAloneRequest& request) {
  AgeRecipients to;
  for (const std::string& text : arguments.to) {
    to.recipients.push_back(parse_recipient(text, "--to"));
  }
  const OpenedWorkspace opened(request.workspace, arguments.keys);
  const ConsentUse& use = options_of<AnimateOptions>(request.options).use;
  const Stage& stage = *find_stage(all_stages(), kAnimateStage);
  StageRequest work;
  work.input = request.input;
  work.workspace = opened.path();
  work.options = request.options;
  work.device = request.device;
  work.jobs = request.jobs;
  require_stage_places(work.input, work.workspace);
  require_consent_of(work.workspace, use);
  catch_interrupts();
  StageConsole console(stage, request.json);
  for (const std::string& outdated : outdated_inputs(stage, work)) {
    console.say("warning: " + as_called(outdated));
  }
  StageEvents events;
  events.progress = [&](const StageProgress& progress) { console.show_progress(progress); };
  events.say = [&](const std::string& line) { console.say(line); };
  events.stop = interrupted;
  StageReport report = run_stage(all_stages(), stage, work, events);
  if (report.end == StageReport::End::Stopped) {
    return false;
  }
  const std::string where = fs::path(arguments.out).filename().string();
  const std::string mark = mark_of_animation(report.plan.result_folder);
  if (arguments.to.empty()) {
    write_animation(report.plan.result_folder, arguments.out,
                    request.workspace + " to " + where + ", for " + use.purpose + mark);
  } else {
    seal_animation(work.workspace, arguments, to, use);
  }
  if (interrupted()) {
    return false;
  }
  opened.log(std::string(kAnimateStage),
             arguments.out + ", " +
                 (arguments.to.empty() ? "for " + use.purpose : sealed_to_text(to, use.purpose)) +
                 mark);
  report.plan.result_folder = arguments.out;
  console.show_report(report);
  return true;
}

int run(const SealedAnimation& arguments, const StandAloneRequest& request) {
  require_places(arguments, request);
  if (!animate_opened(arguments, request)) {
    std::cout << "animate stopped: of a sealed WORKSPACE nothing is kept" << std::endl;
    end_by_signal();
  }
  return kExitDone;
}

}  // namespace

StandAloneWork add_animate_sealed(CLI::App& parser) {
  auto arguments = std::make_shared<SealedAnimation>();
  add_key_arguments(parser, arguments->keys);
  add_option(
      parser, "--out", arguments->out,
      "New workspace for the animation of a sealed WORKSPACE, or with --to a new sealed file")
      .type_name("FOLDER|FILE");
  add_option(parser, "--to", arguments->to,
             "Public keys of those who may open --out: a sealed WORKSPACE with its animation")
      .type_name("age1...");
  return {[arguments] { return arguments->first(); },
          [arguments](const StandAloneRequest& request) { return run(*arguments, request); }};
}

}  // namespace atelier
