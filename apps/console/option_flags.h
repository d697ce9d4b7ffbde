#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/console/arguments.h"
#include "core/options.h"

namespace atelier {

/// A check that takes one of these. CLI11's own repeats the choices in the help, where the type's
/// name says them.
TextCheck one_of(std::vector<std::string> choices);

/// Gives the options that the command line and its files say, once it is parsed. Throws UsageError
/// with a line for every mistake.
using OptionReader = std::function<OptionSet()>;

/// The flag of an option: "--held-out-cameras" of "held_out_cameras". Flags are shown with dashes,
/// TOML fields with underscores; whoever types a flag may use either (as_declared).
std::string flag_of(const std::string& option);

/// The options that somebody set, as words of a command: "--track.exclude=none".
std::vector<std::string> given_flags(const OptionTable& options);

/// A problem with options in which those that begin it or stand behind "with" are called as their
/// flags were typed: "fps cannot be 0" is "--capture.fps cannot be 0".
std::string with_typed_flags(std::string problem);

/// The flag of an option, as it was typed on this command line, that was given a value, perhaps
/// among others ("tee+cape"); "" if none was.
/// @param option  its name, or the end of it: "capture.subject" also of --track.capture.subject
std::string flag_of_value(const std::string& option, const std::string& value);

/// Declares `--config FILE` and a flag for every field of a table, for stages and commands alike:
/// "--section.the-field value"; what is true or false also as "--field" alone (with_switches).
/// Files count first, in their order, then flags: the later wins.
/// @param group  of the flags in the help; "": they are not listed there
OptionReader add_option_flags(CLI::App& parser, const OptionSet& defaults,
                              const std::string& group = "Options");

/// The flag that takes true or false, or nothing, right before a word in the arguments that is
/// neither: what was meant for its value. "" where another stands there.
std::string switch_before(const CLI::App& parser, const std::vector<std::string>& arguments,
                          const std::string& word);

/// The arguments as the parser wants them: flags as they are declared, each with its value behind
/// it, be it given with "=" or, of what is true or false, not at all ("--field" is "--field true").
/// Throws UsageError for an option without its value, one that is given twice, and a flag without
/// values that is given one.
std::vector<std::string> with_switches(const CLI::App& parser,
                                       const std::vector<std::string>& arguments);

}  // namespace atelier
