#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace atelier {

/// Reads a text in memory line by line and word by word, and knows where it is, so that every error
/// names the line. Numbers do not depend on the locale. CRLF, CR alone, a UTF-8 byte order mark and
/// a missing last newline are fine; a NUL byte or a line longer than the limit is refused with
/// DataError. The text must outlive the scanner.
class TextScanner {
 public:
  /// @param file            name for errors
  /// @param max_line_bytes  limit of one line (Limits::line_bytes)
  /// @param continuation    a backslash at the end of a line joins it with the next (OBJ)
  TextScanner(std::string_view text, std::string file, std::int64_t max_line_bytes,
              bool continuation = false);

  /// Goes to the next line. False at the end of the text.
  bool next_line();

  /// The next word of this line, "" at its end. A word that begins with '#' ends the line.
  std::string_view next_word();

  /// The comment that ended this line, with its '#'; "" if none did.
  std::string_view comment() const { return comment_; }

  /// The rest of this line, without blanks at both ends.
  std::string_view rest();

  /// The next word as a finite number; `what` names it in the error.
  double number(const char* what);

  /// The next word as a whole number.
  std::int64_t integer(const char* what);

  /// Lines begun so far; the first is 1.
  std::int64_t line() const { return line_; }

  /// Bytes behind this line.
  std::size_t bytes_left() const { return text_.size() - next_; }

  /// Throws DataError at this line.
  [[noreturn]] void fail(const std::string& found, const std::string& expected) const;

 private:
  std::string_view text_;
  std::string file_;
  std::size_t max_line_bytes_;
  bool continuation_;
  char line_end_;
  std::size_t next_ = 0;    // first byte behind this line
  std::size_t cursor_ = 0;  // first byte of this line that is not read yet
  std::size_t end_ = 0;     // behind the last byte of this line, without its newline
  std::string_view comment_;
  std::int64_t line_ = 0;  // number of the line's first row
  std::int64_t rows_ = 0;  // rows behind us, joined ones counted
};

/// A word as a finite number: true if all of it is one. Reads "+1", "1.", ".5", "1e-3"; refuses
/// "nan", "inf", "0x10", and what overflows a double.
bool parse_number(std::string_view word, double& value);

/// A word as a whole number that fits 64 bits: true if all of it is one.
bool parse_integer(std::string_view word, std::int64_t& value);

/// What ends the lines of a text: CR where it has no LF but at its very end, as old programs of
/// Macs write, else LF.
char line_end_of(std::string_view text);

/// What stands in the place of a number, as an error message says it: "'left'", "'0,033' (a decimal
/// comma)", "the line ends" of nothing.
std::string no_number(std::string_view word);

/// `word` as an error message shows it: in quotes, cut after 40 bytes, control bytes as '?'.
std::string in_quotes(std::string_view word);

/// Bytes as characters, without a copy.
inline std::string_view as_text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace atelier
