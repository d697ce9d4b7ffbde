#include <iostream>
#include <memory>

#include "apps/commands/opened_workspace.h"
#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/interrupt.h"
#include "core/exit_code.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/seal/packed_folder.h"
#include "core/seal/sealed_file.h"
#include "core/store/output_place.h"
#include "core/store/unfinished_folder.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/sealing/access_log.h"
#include "pipeline/sealing/use_log.h"

namespace atelier {
namespace {

struct UnsealArguments {
  std::string file;
  std::string out;
  KeyArguments keys;
};

int run(const UnsealArguments& arguments) {
  if (arguments.file.empty() || arguments.out.empty()) {
    throw UsageError("unseal takes a sealed FILE and OUT: atelier unseal FILE OUT --identity KEY");
  }
  require_new_place(arguments.out, "OUT");
  require_folder_place(arguments.out);
  const AgeKeys keys = read_keys(arguments.keys);
  SealedFile sealed(arguments.file, keys);
  catch_interrupts();
  PackedFolder unpacked;
  {
    const UnfinishedFolder folder(arguments.out);
    unpacked = unpack_folder([&](std::span<std::uint8_t> buffer) { return sealed.read(buffer); },
                             folder.content(), arguments.file, interrupted);
    if (!interrupted()) {
      log_access(folder.content(), "unseal", arguments.file + " to " + arguments.out);
      write_log([&] {
        log_use({arguments.file, sealed.digest(), sealed.opened_by()}, "unseal",
                arguments.out + ", by " + sealed.opened_by());
      });
      folder.finish();
    }
  }
  if (interrupted()) {
    end_by_signal();
  }
  std::cout << printable(arguments.out) << ": " << counted(unpacked.files, "file") << ", "
            << bytes_text(static_cast<double>(unpacked.bytes)) << "\n";
  return kExitDone;
}

}  // namespace

Action add_unseal(CLI::App& parser) {
  auto arguments = std::make_shared<UnsealArguments>();
  add_option(parser, "FILE", arguments->file, "Sealed file").required();
  add_option(parser, "OUT", arguments->out, "New folder for what it holds").required();
  add_key_arguments(parser, arguments->keys);
  return [arguments] { return run(*arguments); };
}

}  // namespace atelier
