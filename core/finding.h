#pragma once

#include <string>
#include <vector>

namespace atelier {

enum class Severity { Note, Warning, Error };

/// One thing that a validator found. Validators return findings; they do not throw.
struct Finding {
  Severity severity = Severity::Note;
  std::string code;    ///< stable short name, e.g. "camera-rotation"; what tests and scripts match
  std::string place;   ///< file, camera, frame, vertex: as precise as known
  std::string what;    ///< what was found, one sentence
  std::string advice;  ///< what to do about it
  /// The option that would put it right, as it is typed: "--capture.sync cam3=-4"; "" where there
  /// is none, or where the files themselves must be mended.
  std::string setting = {};
};

/// "error", "warning" or "note".
const char* severity_name(Severity severity);

/// True if any finding is an error.
bool has_errors(const std::vector<Finding>& findings);

/// One readable line: "error camera-rotation [cam3]: what; advice -> setting".
std::string to_string(const Finding& finding);

/// The same as what stands behind "warning: ": without the word, where that is all its severity.
std::string warning_text(const Finding& finding);

}  // namespace atelier
