#include <ctime>
#include <iostream>
#include <memory>
#include <optional>

#include "apps/commands/seal_keys.h"
#include "apps/commands/verify_render.h"
#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/file_kind.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/seal/packed_folder.h"
#include "core/seal/sealed_file.h"
#include "core/store/consent_file.h"
#include "core/usage_error.h"
#include "pipeline/sealing/access_log.h"
#include "pipeline/sealing/consent_check.h"
#include "pipeline/sealing/sealed_subject.h"
#include "pipeline/sealing/use_log.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct VerifyArguments {
  std::string file;
  std::string head;
  bool log = false;
  KeyArguments keys;
};

/// Who consented to what, by id, and what that says to the use: two lines. True unless it is
/// refused.
bool show_consent(const std::vector<Consent>& consent, const std::string& none_needed,
                  const ConsentUse& use) {
  std::string said;
  for (const Consent& one : consent) {
    said += (said.empty() ? "" : "; ") + consent_id(one) + " " + to_string({one});
  }
  if (consent.empty()) {
    said = none_needed.empty() ? "none recorded" : "none needed: " + none_needed;
  }
  const ConsentAnswer answer = ask_consent(consent, use, static_cast<double>(std::time(nullptr)));
  const std::vector<std::string>& reasons =
      answer.refusals.empty() ? answer.doubts : answer.refusals;
  std::string why;
  for (const std::string& reason : reasons) {
    why += "; " + reason;
  }
  std::cout << "consent: " << printable(said) << "\n"
            << use.purpose << ": "
            << (!answer.refusals.empty()                 ? "refused"
                : consent.empty() && none_needed.empty() ? "nobody has consented"
                : answer.doubts.empty()                  ? "covered"
                                                         : "not refused")
            << printable(why) << "\n";
  return answer.refusals.empty() && (!consent.empty() || !none_needed.empty());
}

/// Reads a sealed file to its end; what it says of itself.
SealingNote read_whole(const VerifyArguments& arguments) {
  SealedFile sealed(arguments.file, read_keys(arguments.keys));
  TarReader archive([&](std::span<std::uint8_t> buffer) { return sealed.read(buffer); },
                    arguments.file);
  SealingNote note =
      parse_sealing_note(first_file(archive, kSealingNote, arguments.file), arguments.file);
  while (archive.next()) {
  }
  return note;
}

int verify_sealed(const VerifyArguments& arguments, const ConsentUse& use) {
  const AgeHeader header = read_age_header(arguments.file);
  const bool passphrase = header.stanzas[0].arguments[0] == "scrypt";
  std::cout << printable(arguments.file) << ": sealed (age v1), "
            << bytes_text(static_cast<double>(fs::file_size(arguments.file))) << ", "
            << (passphrase ? "by a passphrase"
                           : "to " + counted(std::ssize(header.stanzas), "recipient"))
            << "\n";
  if (!arguments.keys.any()) {
    std::cout << "content: not looked at; --identity FILE opens it\n";
    return kExitDone;
  }
  const SealingNote note = read_whole(arguments);
  std::cout << "content: whole; " << note.kind << ", sealed " << printable(note.sealed) << " for "
            << printable(note.purpose) << "\n";
  return show_consent(note.consent, note.none_needed, use) ? kExitDone : kExitCheckFailed;
}

/// The lines of a log, and whether its chain is unbroken; its head.
std::string show_log(const fs::path& path) {
  const AccessLog log =
      parse_access_log(read_file_text(path, Limits{}.text_file_bytes), path.string());
  for (const AccessEntry& entry : log.entries) {
    std::cout << printable(entry.time + "  " + entry.user + "  " + entry.action + "  " +
                           entry.detail)
              << "\n";
  }
  const std::string head = hex(log.head);
  std::cout << "unbroken: " << counted(std::ssize(log.entries), "line") << ", head " << head
            << "\n";
  return head;
}

int verify_log(const VerifyArguments& arguments) {
  std::vector<fs::path> logs;
  if (is_sealed_file(arguments.file)) {
    logs = use_logs(arguments.file);
  } else if (const fs::path path = fs::path(arguments.file) / kAccessLog;
             file_kind(path) != fs::file_type::not_found) {
    logs = {path};
  }
  if (logs.empty()) {
    throw DataError(arguments.file, "", "no log", "the one that export, seal and others write");
  }
  bool has_head = arguments.head.empty();
  for (const fs::path& log : logs) {
    if (logs.size() > 1) {
      std::cout << printable(log.string()) << ":\n";
    }
    has_head = show_log(log) == arguments.head || has_head;
  }
  if (!has_head) {
    std::cout << "another head than the one given: lines were added or taken out since\n";
    return kExitCheckFailed;
  }
  return kExitDone;
}

int run(const VerifyArguments& arguments, const ConsentUse& use) {
  if (arguments.file.empty()) {
    throw UsageError(
        "verify takes an image, a video, a sealed file, a workspace, an export or a capture: "
        "atelier "
        "verify FILE");
  }
  if (!arguments.head.empty() && !arguments.log) {
    throw UsageError("--head does nothing without --log");
  }
  if (arguments.log) {
    return verify_log(arguments);
  }
  if (is_sealed_file(arguments.file)) {
    return verify_sealed(arguments, use);
  }
  if (is_image_or_video(arguments.file)) {
    return verify_render(arguments.file, use);
  }
  if (file_kind(arguments.file) == fs::file_type::not_found) {
    throw DataError(arguments.file, "", "nothing there", "a file or a folder");
  }
  SealingNote note = sealed_subject(arguments.file, all_stages());
  if (note.kind.empty()) {
    const fs::path stated = consent_file(arguments.file);
    note.kind = stated.empty() ? "it says nothing of itself" : "consent of " + stated.string();
    note.consent = read_consent(arguments.file);
  }
  std::cout << printable(arguments.file) << ": not sealed; " << printable(note.kind) << "\n";
  return show_consent(note.consent, "", use) ? kExitDone : kExitCheckFailed;
}

}  // namespace

OptionSet verify_options() {
  return option_set<ConsentUse>();
}

Action add_verify(CLI::App& parser) {
  auto arguments = std::make_shared<VerifyArguments>();
  add_option(parser, "FILE", arguments->file,
             "Image, video, sealed file, workspace, export, capture or consent.toml")
      .required();
  add_key_arguments(parser, arguments->keys);
  add_flag(parser, "--log", arguments->log,
           "Log of a workspace or of a sealed file: its lines, and whether its chain is unbroken");
  add_option(parser, "--head", arguments->head, "Hash that the log's last line is expected to have")
      .type_name("HASH");
  const OptionReader options = add_option_flags(parser, verify_options());
  return [arguments, options] { return run(*arguments, options_of<ConsentUse>(options())); };
}

}  // namespace atelier
