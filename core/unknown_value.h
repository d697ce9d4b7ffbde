#pragma once

#include <string>

#include "core/error.h"

namespace atelier {

/// A value of an option asks for something that is not there: a garment, a frame, a subject. The
/// program exits with 2 and calls the option as it was typed.
struct UnknownValue : DataError {
  /// @param file_      in which it was looked for, "" if in none
  /// @param option_    the option's name, or the end of it: "garment", "capture.subject"
  /// @param value_     as it was given
  /// @param expected_  what the option takes
  UnknownValue(const std::string& file_, const std::string& option_, const std::string& value_,
               const std::string& expected_)
      : DataError(file_, option_, "'" + value_.substr(0, 80) + "'", expected_),
        option(option_),
        value(value_) {}

  std::string option;
  std::string value;
};

}  // namespace atelier
