#include "apps/console/option_flags.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "apps/console/standard_streams.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/nearest_name.h"
#include "core/printable.h"
#include "core/renamed_options.h"
#include "core/store/options_file.h"
#include "core/usage_error.h"
#include "core/utf8.h"
#include "pipeline/stages/option_rules.h"

namespace atelier {
namespace {

struct OptionTexts {
  std::vector<std::string> config_files;
  std::vector<std::pair<std::string, std::string>> flags;  ///< option name and text
};

/// A flag of this command line as it was typed.
struct TypedFlag {
  std::string flag;
  std::string value;
};

/// By the names that they are declared with: "--fps" by "--capture.fps".
std::map<std::string, TypedFlag>& typed_flags() {
  static std::map<std::string, TypedFlag> flags;
  return flags;
}

/// A problem with an option in which the option, at the start and behind "with", is called as its
/// flag was typed.
std::string with_flag(std::string problem, const std::string& option) {
  const std::string declared = flag_of(option);
  const auto typed = typed_flags().find(declared);
  const std::string& flag = typed == typed_flags().end() ? declared : typed->second.flag;
  const auto called = [&](std::size_t at) {
    if (problem.compare(at, option.size() + 1, option + " ") == 0) {
      problem.replace(at, option.size(), flag);
    }
  };
  called(0);
  constexpr std::string_view kWith = " with ";
  for (std::size_t at = 0; (at = problem.find(kWith, at)) != std::string::npos;) {
    at += kWith.size();
    called(at);
  }
  return problem;
}

void set_options(OptionTable& table, const OptionTexts& texts) {
  std::vector<std::string> problems;
  const auto note = [&](const std::string& problem) {
    if (!problem.empty()) {
      problems.push_back(problem);
    }
  };
  for (const std::string& file : texts.config_files) {
    if (file.empty()) {
      throw UsageError("--config cannot be '': it takes a TOML file");
    }
    if (!is_printable_utf8(file)) {  // manifests name it as where options came from
      throw UsageError(
          "--config cannot be '" + file +
          "': the name is not printable UTF-8, which results store it as; rename the file");
    }
    try {
      const std::string text = read_file_text(file, Limits{}.text_file_bytes);
      for (const std::string& problem : set_options_from_toml(table, text, file)) {
        note(problem);
      }
    } catch (const DataError& error) {  // part of the command line: a wrong one is wrong usage
      note(std::string("--config ") + error.what());
    }
  }
  for (const auto& [name, text] : texts.flags) {
    note(with_flag(set_option(table, name, text), name));
  }
  for (const std::string& notice : table.notices) {
    standard_error() << "warning: " << printable(notice) << "\n";
  }
  table.notices.clear();
  if (problems.empty()) {  // each is in its range: do they go together?
    problems = broken_rules(table);
    for (std::string& problem : problems) {
      for (const auto& [name, text] : texts.flags) {
        problem = with_flag(std::move(problem), name);
      }
    }
  }
  if (!problems.empty()) {
    throw UsageError(problems);
  }
}

void add_flag(CLI::App& parser, const OptionField& field, const std::shared_ptr<OptionTexts>& texts,
              const std::string& group) {
  const std::string value = option_text(field);
  const std::string help = field.help + " [" + (value.empty() ? "none" : value) + "]";
  const auto note = [texts, name = field.name](const std::string& text) {
    texts->flags.emplace_back(name, text);
  };
  parser.add_option_function<std::string>(flag_of(field.name), note, help)
      ->type_name(option_range(field) + (field.unit.empty() ? "" : " " + field.unit))
      ->group(group);
}

constexpr const char* kSwitch = "true|false";  // as option_range has it

/// The option that an argument names, null if it names none.
const CLI::Option* option_named(const CLI::App& parser, const std::string& argument) {
  const auto options = parser.get_options();
  const auto found = std::find_if(options.begin(), options.end(), [&](const CLI::Option* option) {
    return argument.starts_with("-") && option->check_name(argument);
  });
  return found == options.end() ? nullptr : *found;
}

constexpr std::string_view kCaptureSection = "capture.";

/// "held_out_cameras" of "--held-out-cameras".
std::string option_of_flag(std::string flag) {
  flag.erase(0, flag.starts_with("--") ? 2 : 0);
  std::replace(flag.begin(), flag.end(), '-', '_');
  return flag;
}

/// The first text in quotes of "capture.sync cannot be 'cam9': ..."; "" if there is none.
std::string quoted_in(const std::string& problem) {
  const std::size_t begin = problem.find('\'');
  const std::size_t end = begin == std::string::npos ? begin : problem.find('\'', begin + 1);
  return end == std::string::npos ? "" : problem.substr(begin + 1, end - begin - 1);
}

/// The flag of this parser that an option was renamed to; "" if it was not.
std::string renamed_flag(const CLI::App& parser, const std::string& flag) {
  std::vector<std::string> known;
  for (const CLI::Option* option : parser.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      known.push_back(option_of_flag(name));
    }
  }
  const std::string now = renamed_option(option_of_flag(flag), known);
  return now.empty() ? "" : flag_of(now);
}

/// The name that this parser has for a flag: with dashes, as flags are shown, or with underscores,
/// as files have it; with or without "capture.", so that what one command finds wrong with a
/// capture can be told to every other; and the present name of what was renamed.
std::string as_declared(const CLI::App& parser, const std::string& argument) {
  if (!argument.starts_with("--")) {
    return argument;
  }
  const std::string flag = flag_of(argument.substr(2));
  constexpr std::string_view kSection = "--capture.";
  const std::string other = flag.starts_with(kSection) ? "--" + flag.substr(kSection.size())
                                                       : std::string(kSection) + flag.substr(2);
  for (const std::string& candidate : {flag, other}) {
    if (option_named(parser, candidate) != nullptr) {
      return candidate;
    }
  }
  const std::string now = renamed_flag(parser, flag);
  return now.empty() ? argument : now;
}

bool is_switch(const CLI::Option* option) {
  return option->get_type_name() == kSwitch;
}

bool takes_value(const CLI::Option* option) {
  return option->get_items_expected_min() > 0;
}

bool is_boolean(const std::string& text) {
  return text == "true" || text == "false";
}

/// Not so lists (--garment, --config).
bool is_given_once(const CLI::Option* option) {
  return option->get_items_expected_max() <= 1;
}

}  // namespace

std::vector<std::string> with_switches(const CLI::App& parser,
                                       const std::vector<std::string>& arguments) {
  std::vector<std::string> out;
  std::set<const CLI::Option*> seen;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == "--") {  // all that follows are no flags
      out.insert(out.end(), arguments.begin() + static_cast<std::ptrdiff_t>(i), arguments.end());
      break;
    }
    const std::string as_typed = arguments[i].substr(0, arguments[i].find('='));
    const std::string name = as_declared(parser, as_typed);
    const CLI::Option* option = option_named(parser, name);
    if (option == nullptr) {  // INPUT, or a flag that is refused later
      out.push_back(arguments[i]);
      continue;
    }
    if (as_typed.starts_with("--") && name == renamed_flag(parser, flag_of(as_typed.substr(2)))) {
      standard_error() << "warning: " << printable(as_typed) << " is now " << name << "\n";
    }
    std::optional<std::string> value;
    if (as_typed.size() < arguments[i].size()) {
      value = arguments[i].substr(as_typed.size() + 1);
    }
    if (is_given_once(option) && !seen.insert(option).second) {
      throw UsageError(as_typed + " is given twice");
    }
    const bool more = i + 1 < arguments.size() && arguments[i + 1] != "--";
    const bool told = more && is_boolean(arguments[i + 1]);
    if (!value && is_switch(option)) {
      value = told ? arguments[++i] : "true";
    } else if (!value && told && !takes_value(option) && option != parser.get_help_ptr()) {
      value = arguments[++i];
    } else if (!value && takes_value(option)) {
      if (!more) {
        throw UsageError(as_typed + " needs a value behind it: " + option->get_type_name() +
                         "; see atelier " + parser.get_name() + " --help");
      }
      value = arguments[++i];
    }
    if (!takes_value(option) && value && !is_boolean(*value)) {
      throw UsageError(as_typed + " cannot be '" + value->substr(0, 60) +
                       "': it takes true or false, or nothing");
    }
    typed_flags()[name] = {as_typed, value.value_or("")};
    if (takes_value(option)) {
      out.insert(out.end(), {name, *value});
    } else {
      out.push_back(name + (value ? "=" + *value : ""));
    }
  }
  return out;
}

std::vector<std::string> given_flags(const OptionTable& options) {
  std::vector<std::string> words;
  for (const OptionField& field : options.fields) {
    if (field.source != "default") {
      words.push_back(flag_of(field.name) + "=" + option_text(field));
    }
  }
  return words;
}

std::string with_typed_flags(std::string problem) {
  for (const auto& [declared, typed] : typed_flags()) {
    problem = with_flag(std::move(problem), option_of_flag(declared));
  }
  if (!problem.starts_with(kCaptureSection)) {
    return problem;
  }
  // Found in a capture, whatever the command calls its options.
  const std::string option = problem.substr(0, problem.find(' '));
  const std::string flag = flag_of_value(option, quoted_in(problem));
  return (flag.empty() ? flag_of(option) : flag) + problem.substr(option.size());
}

std::string flag_of_value(const std::string& option, const std::string& value) {
  std::string found;
  for (const auto& [declared, typed] : typed_flags()) {
    const std::string name = option_of_flag(declared);
    const bool same = name == option || std::string(kCaptureSection) + name == option ||
                      name.ends_with("." + option);
    if (same && (found.empty() || typed.value.find(value) != std::string::npos)) {
      found = typed.flag;
    }
  }
  return found;
}

std::string switch_before(const CLI::App& parser, const std::vector<std::string>& arguments,
                          const std::string& word) {
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    const CLI::Option* option = option_named(parser, as_declared(parser, arguments[i - 1]));
    if (arguments[i] == word && !is_boolean(word) && option != nullptr &&
        (is_switch(option) || !takes_value(option))) {
      return arguments[i - 1];
    }
  }
  return "";
}

std::string flag_of(const std::string& option) {
  std::string flag = "--" + option;
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

TextCheck one_of(std::vector<std::string> choices) {
  return [choices = std::move(choices)](const std::string& text) {
    if (std::find(choices.begin(), choices.end(), text) != choices.end()) {
      return std::string();
    }
    std::string all;
    for (const std::string& choice : choices) {
      all += (all.empty() ? "" : ", ") + choice;
    }
    return "'" + text.substr(0, 60) + "' is none of " + all + did_you_mean(text, choices);
  };
}

OptionReader add_option_flags(CLI::App& parser, const OptionSet& defaults,
                              const std::string& group) {
  const auto texts = std::make_shared<OptionTexts>();
  parser.add_option("--config", texts->config_files, "TOML file with options; flags override it")
      ->type_name("FILE")
      ->allow_extra_args(false);
  for (const OptionField& field : defaults.table.fields) {
    add_flag(parser, field, texts, group);
  }
  return [texts, set = defaults]() mutable {
    set_options(set.table, *texts);
    return set;
  };
}

}  // namespace atelier
