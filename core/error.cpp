#include "core/error.h"

#include <filesystem>

namespace atelier {
namespace {

std::string sentence(const std::string& file, const std::string& where, const std::string& found,
                     const std::string& expected) {
  std::string text = file;
  if (!where.empty()) {
    text += (text.empty() ? "" : ": ") + where;
  }
  if (!found.empty()) {
    text += (text.empty() ? "" : ": ") + found;
  }
  if (!expected.empty()) {
    text += (text.empty() ? "expected " : "; expected ") + expected;
  }
  return text;
}

}  // namespace

DataError::DataError(std::string file_, std::string where_, std::string found_,
                     std::string expected_)
    : std::runtime_error(sentence(file_, where_, found_, expected_)),
      file(std::move(file_)),
      where(std::move(where_)),
      found(std::move(found_)),
      expected(std::move(expected_)) {}

EnvironmentError::EnvironmentError(std::string what, std::string reason_)
    : std::runtime_error(what + ": " + reason_),
      place(std::move(what)),
      reason(std::move(reason_)) {}

void fail_check(const char* condition, const char* file, int line, const std::string& message) {
  throw LogicError(std::filesystem::path(file).filename().string() + ":" + std::to_string(line) +
                   ": " + message + " (" + condition + ")");
}

}  // namespace atelier
