#pragma once

#include <string>
#include <vector>

#include "core/seal/age_header.h"

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11 has that name
class App;
}

namespace atelier {

/// Arguments by which whoever opens a sealed file says with which keys.
struct KeyArguments {
  std::vector<std::string> identities;
  std::string passphrase_file;
  bool passphrase = false;

  bool any() const { return !identities.empty() || !passphrase_file.empty() || passphrase; }
};

/// Declares --identity, --passphrase-file and --passphrase.
void add_key_arguments(CLI::App& parser, KeyArguments& arguments);

/// The keys that they name, asked for on the terminal with --passphrase. Secrets are in files or
/// typed, never in arguments, which every user of a machine sees. Forbids core dumps first. Throws
/// UsageError where there are none.
AgeKeys read_keys(const KeyArguments& arguments);

/// A passphrase of a file or, without one, of the terminal: twice with `confirm`; nothing is shown.
/// Throws UsageError where there is no terminal, nothing was typed or the two differ.
Secret passphrase_of(const std::string& file, bool confirm);

}  // namespace atelier
