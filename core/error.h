#pragma once

#include <stdexcept>
#include <string>

namespace atelier {

/// A programming error: a broken precondition. Thrown in every build; the program exits with 70.
struct LogicError : std::logic_error {
  using std::logic_error::logic_error;
};

/// Data that cannot be used. The program exits with 3.
struct DataError : std::runtime_error {
  /// @param file      path or name of the data, "" if it has none
  /// @param where     place inside it: line, byte, field, frame, vertex
  /// @param found     what is there
  /// @param expected  what should be there, or what to do
  DataError(std::string file, std::string where, std::string found, std::string expected);

  std::string file;
  std::string where;
  std::string found;
  std::string expected;
};

/// The surroundings failed: disk, memory, device, a missing program. The program exits with 5.
struct EnvironmentError : std::runtime_error {
  /// @param what    the path, device or program that failed
  /// @param reason  why, as the system says it, and what to do: "...; free space and run again"
  EnvironmentError(std::string what, std::string reason);

  std::string place;  ///< what failed
  std::string reason;
};

/// Throws LogicError with the place of the call.
[[noreturn]] void fail_check(const char* condition, const char* file, int line,
                             const std::string& message);

}  // namespace atelier

/// Checks a precondition in every build. `message` is only evaluated on failure.
#define ATELIER_CHECK(condition, message)                               \
  do {                                                                  \
    if (!(condition)) {                                                 \
      ::atelier::fail_check(#condition, __FILE__, __LINE__, (message)); \
    }                                                                   \
  } while (false)
