#include "core/store/flag_command.h"

#include <algorithm>
#include <vector>

namespace atelier {
namespace {

constexpr std::string_view kFlagLetters = "abcdefghijklmnopqrstuvwxyz0123456789.-";
constexpr std::string_view kCaptureOptions = "capture.";
constexpr std::string_view kProgram = "atelier ";

std::string exchanged(std::string text, char from, char to) {
  std::replace(text.begin(), text.end(), from, to);
  return text;
}

/// The option that a flag without its dashes means; "" if none, or several.
std::string option_named(const std::string& flag, const OptionTable& table) {
  const std::string name = exchanged(flag, '-', '_');
  std::string found;
  for (const OptionField& field : table.fields) {
    if (field.name == name) {
      return name;
    }
    if (field.name.ends_with("." + name)) {
      if (!found.empty()) {
        return "";
      }
      found = field.name;
    }
  }
  return found;
}

/// Whether the text before a flag says which command takes it, "atelier template --frame 3".
bool has_command(std::string_view before) {
  const std::size_t command = before.rfind(kProgram);
  return command != std::string_view::npos &&
         before.find_first_of(",;:.", command) == std::string_view::npos;
}

}  // namespace

std::string with_command(const std::string& message, std::string_view stage,
                         const OptionTable& table) {
  std::string text;
  std::vector<std::string> flags;
  std::size_t at = 0;
  for (std::size_t next = 0; (next = message.find("--", at)) != std::string::npos;) {
    text += message.substr(at, next - at);
    std::size_t end = message.find_first_not_of(kFlagLetters, next);
    end = end == std::string::npos ? message.size() : end;
    while (end > next && (message[end - 1] == '.' || message[end - 1] == '-')) {
      --end;  // the end of a sentence
    }
    end = std::max(end, next + 2);
    std::string flag = message.substr(next + 2, end - next - 2);
    const std::string option = flag.empty() ? "" : option_named(flag, table);
    if (!option.empty() && !option.starts_with(kCaptureOptions) && !has_command(text)) {
      flag = exchanged(option, '_', '-');
      if (std::find(flags.begin(), flags.end(), flag) == flags.end()) {
        flags.push_back(flag);
      }
    }
    text += "--" + flag;
    at = end;
  }
  text += message.substr(at);
  if (flags.empty()) {
    return text;
  }
  std::string in_run;
  for (const std::string& flag : flags) {
    const std::size_t capture = flag.find("." + std::string(kCaptureOptions));
    in_run += std::string(in_run.empty() ? "--" : ", --") +
              (capture == std::string::npos ? std::string(stage) + "." + flag
                                            : flag.substr(capture + 1));  // run takes it for all
  }
  return text + " (atelier " + std::string(stage) + "; in atelier run " + in_run + ")";
}

}  // namespace atelier
