#include <iostream>
#include <memory>

#include "apps/commands/seal_keys.h"
#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/file_kind.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/printable.h"
#include "core/seal/minisign.h"
#include "core/store/consent_file.h"
#include "core/store/input_digest.h"
#include "core/usage_error.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct SignArguments {
  std::string input;
  std::string key;
  std::string passphrase_file;
  std::string who;
};

/// The file with other consents in the place of those that it states.
std::string with_consent(const fs::path& file, const std::vector<Consent>& consent) {
  if (file.filename() == kConsentFile) {
    return consent_toml(consent);
  }
  const std::string text = read_file_text(file, Limits{}.text_file_bytes);
  const std::string rest = without_consent(text);
  if (rest == text) {
    throw DataError(file.string(), "consent", "a consent that is no [[consent]] of its own",
                    "tables [[consent]]");
  }
  return rest + "\n" + consent_toml(consent);
}

SigningKey read_signing_key(const SignArguments& arguments) {
  const Secret text = read_secret_file(arguments.key);
  const Secret passphrase =
      asks_for_passphrase(text.text()) ? passphrase_of(arguments.passphrase_file, false) : Secret();
  return parse_signing_key(text.text(), passphrase, arguments.key);
}

int run(const SignArguments& arguments) {
  if (arguments.input.empty() || arguments.key.empty()) {
    throw UsageError("sign takes a CAPTURE and --key: atelier sign CAPTURE --key FILE");
  }
  if (file_kind(arguments.input) == fs::file_type::not_found) {
    throw DataError(arguments.input, "", "nothing there", "a capture or its consent.toml");
  }
  const fs::path file = consent_file(arguments.input);
  if (file.empty()) {
    throw DataError(arguments.input, "", "no consent is recorded",
                    "who, scope and until in a [[consent]] of capture.toml or consent.toml");
  }
  forbid_dumps();
  const SigningKey key = read_signing_key(arguments);
  std::vector<Consent> all = read_consent(arguments.input);
  bool any = false;
  for (Consent& one : all) {
    if (!arguments.who.empty() && one.who != arguments.who) {
      continue;
    }
    one.key = signature_key_text(key.key);
    one.signature = signature_line(sign_text(consent_statement(one), key, "consent of " + one.who),
                                   arguments.key);
    any = true;
  }
  if (!any) {
    throw DataError(file.string(), "consent", "none of " + arguments.who, "one of those it states");
  }
  write_file_atomically(file, with_consent(file, all));
  std::cout << printable(file.string()) << ": " << printable(to_string(all)) << "\n";
  return kExitDone;
}

}  // namespace

Action add_sign(CLI::App& parser) {
  auto arguments = std::make_shared<SignArguments>();
  add_option(parser, "CAPTURE", arguments->input, "Capture, or its consent.toml").required();
  add_option(parser, "--key", arguments->key,
             "Secret key of whoever consents, as atelier key --signing or minisign -G writes it")
      .type_name("FILE")
      .required();
  add_option(parser, "--passphrase-file", arguments->passphrase_file,
             "File whose first line is the passphrase of the key [asked for on the terminal]")
      .type_name("FILE");
  add_option(parser, "--who", arguments->who, "Person whose consent is signed [everybody's]")
      .type_name("NAME");
  return [arguments] { return run(*arguments); };
}

}  // namespace atelier
