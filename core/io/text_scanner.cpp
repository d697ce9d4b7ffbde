#include "core/io/text_scanner.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/error.h"

namespace atelier {
namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

}  // namespace

bool parse_number(std::string_view word, double& value) {
  if (!word.empty() && word.front() == '+') {
    word.remove_prefix(1);
    if (word.empty() || word.front() == '-' || word.front() == '+') {
      return false;
    }
  }
  double parsed = 0;
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, parsed);
  if (stop != end || word.empty()) {
    return false;
  }
  if (error == std::errc::result_out_of_range) {
    // Too small is zero; too large is no number. from_chars says the same of both.
    const std::size_t exponent = word.find_first_of("eE");
    if (exponent == std::string_view::npos || exponent + 1 >= word.size() ||
        word[exponent + 1] != '-') {
      return false;
    }
    parsed = 0;
  } else if (error != std::errc{} || !std::isfinite(parsed)) {
    return false;
  }
  value = parsed;
  return true;
}

bool parse_integer(std::string_view word, std::int64_t& value) {
  if (!word.empty() && word.front() == '+') {
    word.remove_prefix(1);
    if (!word.empty() && word.front() == '-') {
      return false;
    }
  }
  std::int64_t parsed = 0;
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, parsed);
  if (word.empty() || stop != end || error != std::errc{}) {
    return false;
  }
  value = parsed;
  return true;
}

char line_end_of(std::string_view text) {
  const std::size_t newline = text.find('\n');
  const bool none = newline == std::string_view::npos || newline + 1 == text.size();
  return none && text.substr(0, newline - 1).find('\r') != std::string_view::npos ? '\r' : '\n';
}

std::string no_number(std::string_view word) {
  const std::size_t comma = word.find(',');
  double value = 0;
  if (comma != std::string_view::npos) {
    std::string with_point(word);
    with_point[comma] = '.';
    if (parse_number(with_point, value)) {
      return in_quotes(word) + " (a decimal comma)";
    }
  }
  return word.empty() ? "the line ends" : in_quotes(word);
}

std::string in_quotes(std::string_view word) {
  constexpr std::size_t kShown = 40;
  std::string text(word.substr(0, kShown));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 32; }, '?');
  return "'" + text + (word.size() > kShown ? "...'" : "'");
}

TextScanner::TextScanner(std::string_view text, std::string file, std::int64_t max_line_bytes,
                         bool continuation)
    : text_(text),
      file_(std::move(file)),
      max_line_bytes_(static_cast<std::size_t>(max_line_bytes)),
      continuation_(continuation),
      line_end_(line_end_of(text)) {
  if (text_.substr(0, 3) == "\xEF\xBB\xBF") {
    next_ = 3;
  }
}

bool TextScanner::next_line() {
  line_ = rows_ + 1;
  comment_ = {};
  if (next_ >= text_.size()) {
    cursor_ = end_ = text_.size();
    return false;
  }
  cursor_ = next_;
  // A comment is never joined: it may end in a folder of Windows.
  const std::size_t first = text_.find_first_not_of(" \t", cursor_);
  const bool comment = first != std::string_view::npos && text_[first] == '#';
  while (true) {
    const std::size_t newline = text_.find(line_end_, next_);
    end_ = std::min(newline, text_.size());
    next_ = newline == std::string_view::npos ? text_.size() : newline + 1;
    ++rows_;
    if (end_ - cursor_ > max_line_bytes_) {
      fail("a line of " + std::to_string(end_ - cursor_) + " bytes",
           "at most " + std::to_string(max_line_bytes_));
    }
    std::size_t last = end_;
    while (last > cursor_ && text_[last - 1] == '\r') {
      --last;
    }
    const bool joined = continuation_ && !comment && last > cursor_ && text_[last - 1] == '\\';
    if (!joined || next_ >= text_.size()) {
      break;
    }
  }
  if (text_.substr(cursor_, end_ - cursor_).find('\0') != std::string_view::npos) {
    fail("a NUL byte", "text");
  }
  return true;
}

std::string_view TextScanner::next_word() {
  const auto joins = [this](std::size_t i) {
    // A backslash before the end of a row is a blank, so is that end.
    if (!continuation_ || text_[i] != '\\') {
      return false;
    }
    std::size_t j = i + 1;
    while (j < end_ && text_[j] == '\r') {
      ++j;
    }
    return j >= end_ || text_[j] == '\n' || (line_end_ == '\r' && j > i + 1);
  };
  const auto blank = [&](std::size_t i) {
    return is_blank(text_[i]) || text_[i] == '\n' || joins(i);
  };
  while (cursor_ < end_ && blank(cursor_)) {
    ++cursor_;
  }
  const std::size_t begin = cursor_;
  if (begin < end_ && text_[begin] == '#') {
    comment_ = text_.substr(begin, end_ - begin);
    cursor_ = end_;
    return {};
  }
  while (cursor_ < end_ && !blank(cursor_)) {
    ++cursor_;
  }
  return text_.substr(begin, cursor_ - begin);
}

std::string_view TextScanner::rest() {
  std::size_t last = end_;
  while (cursor_ < last && is_blank(text_[cursor_])) {
    ++cursor_;
  }
  while (last > cursor_ && is_blank(text_[last - 1])) {
    --last;
  }
  const std::string_view text = text_.substr(cursor_, last - cursor_);
  cursor_ = end_;
  return text;
}

double TextScanner::number(const char* what) {
  const std::string_view word = next_word();
  double value = 0;
  if (!parse_number(word, value)) {
    fail(no_number(word), std::string(what) + ", a finite number");
  }
  return value;
}

std::int64_t TextScanner::integer(const char* what) {
  const std::string_view word = next_word();
  std::int64_t value = 0;
  if (!parse_integer(word, value)) {
    fail(word.empty() ? "the line ends" : in_quotes(word), std::string(what) + ", a whole number");
  }
  return value;
}

void TextScanner::fail(const std::string& found, const std::string& expected) const {
  throw DataError(file_, "line " + std::to_string(line_), found, expected);
}

}  // namespace atelier
