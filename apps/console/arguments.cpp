#include "apps/console/arguments.h"

#include <CLI/CLI.hpp>

namespace atelier {

Argument& Argument::required() {
  option_->required();
  return *this;
}

Argument& Argument::type_name(const std::string& name) {
  option_->type_name(name);
  return *this;
}

Argument& Argument::check(TextCheck problem) {
  option_->check(std::move(problem), "");
  return *this;
}

Argument& Argument::once_a_flag() {
  option_->allow_extra_args(false);
  return *this;
}

Argument& Argument::delimiter(char separator) {
  option_->delimiter(separator);
  return *this;
}

Argument add_option(CLI::App& parser, const std::string& name, std::string& value,
                    const std::string& help) {
  return Argument(*parser.add_option(name, value, help));
}

Argument add_option(CLI::App& parser, const std::string& name, int& value,
                    const std::string& help) {
  return Argument(*parser.add_option(name, value, help));
}

Argument add_option(CLI::App& parser, const std::string& name, std::vector<std::string>& values,
                    const std::string& help) {
  return Argument(*parser.add_option(name, values, help));
}

Argument add_option(CLI::App& parser, const std::string& name,
                    const std::function<void(const std::string&)>& take, const std::string& help) {
  return Argument(*parser.add_option_function<std::string>(name, take, help));
}

void add_flag(CLI::App& parser, const std::string& name, bool& value, const std::string& help) {
  parser.add_flag(name, value, help);
}

void add_flag(CLI::App& parser, const std::string& name, const std::function<void()>& take,
              const std::string& help) {
  parser.add_flag_function(
      name,
      [take](std::int64_t times) {
        if (times > 0) {  // "--flag=false"
          take();
        }
      },
      help);
}

}  // namespace atelier
