#pragma once

#include <exception>
#include <string>

namespace atelier {

/// An error in the words and with the exit code that the program ends with because of it.
struct Failure {
  std::string text;   ///< one sentence; of a UsageError several lines
  int exit_code = 0;  ///< exit_code.h
  std::string file;   ///< of exit code 5 also the device or program that failed
  std::string where;
  std::string found;
  std::string expected;
};

/// From now on errors call a place by another name: what was opened in memory by the file that it
/// was opened from.
void call_place(const std::string& place, const std::string& name);

/// A text with such a place by its other name, for warnings.
std::string as_called(std::string text);

/// Meaning of an exception for the user of the program.
Failure failure_of(const std::exception& error);

}  // namespace atelier
