#pragma once

#include <functional>
#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): a library's own name
class App;
class Option;
}  // namespace CLI

namespace atelier {

/// Says what is wrong with a text, or "" where nothing is.
using TextCheck = std::function<std::string(const std::string&)>;

/// An argument as a command declares it. CLI11 does the work; without its headers, which take
/// longer to compile than most commands.
class Argument {
 public:
  explicit Argument(CLI::Option& option) : option_(&option) {}
  Argument& required();
  Argument& type_name(const std::string& name);  ///< as --help shows it
  Argument& check(TextCheck problem);            ///< is asked for every value
  Argument& once_a_flag();                       ///< "--a x y": y is not a second value
  Argument& delimiter(char separator);           ///< "--a x,y" are two values

 private:
  CLI::Option* option_;
};

/// Declares an argument of a command: positional ("IN") or a flag with a value ("--out"). The
/// argument is stored in `value`, which has to outlive the parsing.
Argument add_option(CLI::App& parser, const std::string& name, std::string& value,
                    const std::string& help);
Argument add_option(CLI::App& parser, const std::string& name, int& value, const std::string& help);
Argument add_option(CLI::App& parser, const std::string& name, std::vector<std::string>& values,
                    const std::string& help);
Argument add_option(CLI::App& parser, const std::string& name,
                    const std::function<void(const std::string&)>& take, const std::string& help);

/// Declares a flag without a value.
void add_flag(CLI::App& parser, const std::string& name, bool& value, const std::string& help);
void add_flag(CLI::App& parser, const std::string& name, const std::function<void()>& take,
              const std::string& help);

}  // namespace atelier
