#include "apps/option_flags.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "apps/usage_error.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/store/options_file.h"

namespace atelier {
namespace {

struct OptionTexts {
  std::vector<std::string> config_files;
  std::vector<std::pair<std::string, std::string>> flags;  ///< option name and text
};

void set_options(OptionTable& table, const OptionTexts& texts) {
  std::string problems;
  const auto note = [&](const std::string& problem) {
    if (!problem.empty()) {
      problems += (problems.empty() ? "" : "\n") + problem;
    }
  };
  for (const std::string& file : texts.config_files) {
    const std::string text = read_file_text(file, Limits{}.text_file_bytes);
    for (const std::string& problem : set_options_from_toml(table, text, file)) {
      note(problem);
    }
  }
  for (const auto& [name, text] : texts.flags) {
    note(set_option(table, name, text));
  }
  if (!problems.empty()) {
    throw UsageError(problems);
  }
}

void add_flag(CLI::App& parser, const OptionField& field,
              const std::shared_ptr<OptionTexts>& texts) {
  const std::string value = option_text(field);
  const std::string help = field.help + " [" + (value.empty() ? "none" : value) + "]";
  const auto note = [texts, name = field.name](const std::string& text) {
    texts->flags.emplace_back(name, text);
  };
  // "--truth_maps" as files write it, and "--truth-maps" as command lines do.
  std::string names = "--" + field.name;
  if (field.name.find('_') != std::string::npos) {
    std::string dashed = field.name;
    std::replace(dashed.begin(), dashed.end(), '_', '-');
    names += ",--" + dashed;
  }
  parser.add_option_function<std::string>(names, note, help)
      ->type_name(option_range(field) + (field.unit.empty() ? "" : " " + field.unit))
      ->group("Options")
      ->take_last();
}

constexpr const char* kSwitch = "true|false";  // as option_range has it

bool is_switch(const CLI::App& parser, const std::string& argument) {
  const auto options = parser.get_options();
  return std::any_of(options.begin(), options.end(), [&](const CLI::Option* option) {
    return option->check_name(argument) && option->get_type_name() == kSwitch;
  });
}

}  // namespace

std::vector<std::string> with_switches(const CLI::App& parser,
                                       const std::vector<std::string>& arguments) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == "--") {  // all that follows are no flags
      out.insert(out.end(), arguments.begin() + static_cast<std::ptrdiff_t>(i), arguments.end());
      break;
    }
    out.push_back(arguments[i]);
    if (is_switch(parser, arguments[i])) {
      const bool told =
          i + 1 < arguments.size() && (arguments[i + 1] == "true" || arguments[i + 1] == "false");
      out.back() += "=" + (told ? arguments[++i] : "true");
    }
  }
  return out;
}

OptionReader add_option_flags(CLI::App& parser, const OptionSet& defaults) {
  const auto texts = std::make_shared<OptionTexts>();
  parser.add_option("--config", texts->config_files, "TOML file of options; flags win over it")
      ->type_name("FILE")
      ->allow_extra_args(false);
  for (const OptionField& field : defaults.table.fields) {
    add_flag(parser, field, texts);
  }
  return [texts, set = defaults]() mutable {
    set_options(set.table, *texts);
    return set;
  };
}

}  // namespace atelier
