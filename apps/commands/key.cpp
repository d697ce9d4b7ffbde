#include <iostream>
#include <memory>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "core/atomic_file.h"
#include "core/exit_code.h"
#include "core/seal/age_keys.h"
#include "core/seal/minisign.h"
#include "core/store/output_place.h"
#include "core/usage_error.h"
#include "core/writable_place.h"

namespace atelier {
namespace {

struct KeyFileArguments {
  std::string out;
  bool signing = false;
};

int run(const KeyFileArguments& arguments) {
  if (arguments.out.empty()) {
    throw UsageError("key takes --out: atelier key --out FILE");
  }
  require_new_place(arguments.out, "--out");
  require_file_place(arguments.out);
  forbid_dumps();
  Secret secret;
  std::string open;
  if (arguments.signing) {
    const SigningKey key = new_signing_key();
    secret = signing_key_file(key);
    open = signature_key_text(key.key);
  } else {
    const Identity identity = new_identity();
    secret = identity_text(identity);
    open = recipient_text(identity.recipient);
  }
  AtomicFile file(arguments.out);
  file.write(secret.text());
  file.commit();
  std::cout << open << "\n";
  return kExitDone;
}

}  // namespace

Action add_key(CLI::App& parser) {
  auto arguments = std::make_shared<KeyFileArguments>();
  add_option(parser, "--out", arguments->out,
             "New file for the secret key, readable for its owner alone; the public key, which "
             "seal --to takes, is printed")
      .type_name("FILE")
      .required();
  add_flag(parser, "--signing", arguments->signing,
           "Key that signs consents (minisign's format), instead of one that opens sealed files");
  return [arguments] { return run(*arguments); };
}

}  // namespace atelier
