#include <ctime>
#include <iostream>
#include <memory>

#include "apps/commands/seal_keys.h"
#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/interrupt.h"
#include "apps/console/option_flags.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/file_kind.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/store/output_place.h"
#include "core/store/utc_time.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/sealing/access_log.h"
#include "pipeline/sealing/consent_check.h"
#include "pipeline/sealing/seal_folder.h"
#include "pipeline/sealing/sealed_subject.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct SealArguments {
  std::string folder;
  std::string out;
  std::vector<std::string> to;
  std::string recipients_file;
  std::string passphrase_file;
  bool passphrase = false;
  std::vector<std::string> consent;  ///< none-needed and why
};

AgeRecipients recipients_of(const SealArguments& arguments) {
  AgeRecipients to;
  for (const std::string& text : arguments.to) {
    if (file_kind(text) == fs::file_type::regular) {
      throw UsageError(
          "--to takes a public key, age1..., not a file; one of several keys goes to "
          "--recipients-file");
    }
    to.recipients.push_back(parse_recipient(text, "--to"));
  }
  if (!arguments.recipients_file.empty()) {
    const std::string text = read_file_text(arguments.recipients_file, Limits{}.text_file_bytes);
    for (const Recipient& one : parse_recipients(text, arguments.recipients_file)) {
      to.recipients.push_back(one);
    }
  }
  const bool passphrase = arguments.passphrase || !arguments.passphrase_file.empty();
  if (passphrase == !to.recipients.empty()) {
    throw UsageError(passphrase ? "a file is sealed to recipients or by a passphrase, not both"
                                : "seal takes recipients: --to age1..., --recipients-file FILE, or "
                                  "--passphrase");
  }
  if (passphrase) {
    to.passphrase = passphrase_of(arguments.passphrase_file, true);
  }
  return to;
}

/// Why no consent is needed, where --consent says so; "" where it is not given.
std::string none_needed(const SealArguments& arguments) {
  if (arguments.consent.empty()) {
    return "";
  }
  if (arguments.consent.size() != 2 || arguments.consent[0] != "none-needed" ||
      arguments.consent[1].empty()) {
    throw UsageError(
        "--consent takes none-needed and why: --consent none-needed \"a synthetic "
        "person\"");
  }
  return arguments.consent[1];
}

/// What the archive begins with. Refuses what is not consented to.
SealingNote note_of(const SealArguments& arguments, const ConsentUse& use) {
  SealingNote note = sealed_subject(arguments.folder, all_stages());
  if (note.kind.empty()) {
    throw DataError(arguments.folder, "", "neither a workspace nor an export",
                    "a folder of results, or one that atelier export made");
  }
  note.sealed = utc_text(static_cast<double>(std::time(nullptr)));
  note.purpose = use.purpose;
  note.none_needed = none_needed(arguments);
  if (note.consent.empty() && note.none_needed.empty()) {
    throw UsageError(
        "no consent is recorded: state it where the capture is and run the stages "
        "again, or seal with --consent none-needed \"why\"");
  }
  if (!note.consent.empty() && !note.none_needed.empty()) {
    throw UsageError("--consent none-needed: there is one, " + to_string(note.consent) +
                     "; leave it out");
  }
  for (const std::string& doubt : require_consent(note.consent, use)) {
    std::cout << "warning: " << printable(doubt) << "\n";
  }
  return note;
}

int run(const SealArguments& arguments, const ConsentUse& use) {
  if (arguments.folder.empty() || arguments.out.empty()) {
    throw UsageError(
        "seal takes a WORKSPACE or an export, and --out: atelier seal WORKSPACE --to age1... --out "
        "FILE");
  }
  const fs::path out = arguments.out;
  require_new_place(out, "--out");
  require_file_place(out);
  if (is_inside(out, arguments.folder)) {
    throw UsageError("--out lies in what is sealed; name a file outside of it");
  }
  forbid_dumps();
  const AgeRecipients to = recipients_of(arguments);
  SealingNote note = note_of(arguments, use);
  if (note.kind == "workspace") {
    require_sound_files(arguments.folder, all_stages());
    note.digests_checked = true;
  }
  catch_interrupts();
  const SealedFolder sealed = seal_folder(arguments.folder, note, to, out, interrupted, [&] {
    if (note.kind == "workspace") {
      log_access(arguments.folder, "seal", sealed_to_text(to, use.purpose));
    }
  });
  if (interrupted()) {
    end_by_signal();
  }
  std::cout << printable(out.string()) << ", " << bytes_text(static_cast<double>(sealed.bytes))
            << ": " << counted(sealed.packed.files, "file") << " of " << printable(arguments.folder)
            << ", "
            << (to.recipients.empty() ? std::string("by a passphrase")
                                      : "to " + counted(std::ssize(to.recipients), "recipient"))
            << "\n  consent: "
            << printable(note.none_needed.empty() ? to_string(note.consent)
                                                  : "none needed: " + note.none_needed)
            << "\n";
  return kExitDone;
}

}  // namespace

OptionSet seal_options() {
  return option_set<ConsentUse>();
}

Action add_seal(CLI::App& parser) {
  auto arguments = std::make_shared<SealArguments>();
  add_option(parser, "FOLDER", arguments->folder, "Workspace, or what export wrote").required();
  add_option(parser, "--to", arguments->to, "Public keys of those who may open it")
      .type_name("age1...");
  add_option(parser, "--recipients-file", arguments->recipients_file,
             "File with public keys, one a line")
      .type_name("FILE");
  add_option(parser, "--passphrase-file", arguments->passphrase_file,
             "File whose first line is a passphrase, which opens it instead of keys")
      .type_name("FILE");
  add_flag(parser, "--passphrase", arguments->passphrase,
           "Passphrase asked for on the terminal, which opens it instead of keys");
  add_option(parser, "--consent", arguments->consent,
             "Statement that no consent is needed, and why, where none is recorded")
      .type_name("none-needed WHY");
  add_option(parser, "--out", arguments->out, "New sealed file").type_name("FILE").required();
  const OptionReader options = add_option_flags(parser, seal_options());
  return [arguments, options] { return run(*arguments, options_of<ConsentUse>(options())); };
}

}  // namespace atelier
