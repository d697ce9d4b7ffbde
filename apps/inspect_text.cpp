// Texts that other programs open and Atelier writes: what they begin with, not what they draw.

#include <algorithm>
#include <limits>
#include <optional>

#include "apps/inspection.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/limits.h"
#include "core/printable.h"

namespace atelier {
namespace {

/// Their headers stand within this; the rest may be gigabytes of points.
constexpr std::int64_t kStartBytes = 64LL << 10;

std::string start_of(const std::filesystem::path& path) {
  const FileStart start =
      read_file_start(path, kStartBytes, std::numeric_limits<std::int64_t>::max());
  return {reinterpret_cast<const char*>(start.bytes.data()), start.bytes.size()};
}

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& text,
                         const char* expected) {
  const std::string begin = printable(text.substr(0, 20));
  throw DataError(path.string(), "beginning", text.empty() ? "an empty file" : "'" + begin + "'",
                  expected);
}

/// What follows `before`, up to the first of `ends`; nothing where `before` is not there.
std::optional<std::string> between(std::string_view text, std::string_view before,
                                   std::string_view ends) {
  const auto at = text.find(before);
  if (at == std::string_view::npos) {
    return std::nullopt;
  }
  text.remove_prefix(at + before.size());
  return std::string(text.substr(0, std::min<std::size_t>(text.find_first_of(ends), 80)));
}

void add_if_said(const char* name, const std::optional<std::string>& value,
                 Inspection& inspection) {
  if (value) {
    inspection.add(name, *value);
  }
}

std::string_view without_space(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  return first == std::string_view::npos ? std::string_view() : text.substr(first);
}

}  // namespace

void inspect_svg(const std::filesystem::path& path, Inspection& inspection) {
  const std::string text = start_of(path);
  const auto tag = text.find("<svg");
  if (!without_space(text).starts_with("<") || tag == std::string::npos) {
    refuse(path, text, "a drawing, <svg ...>");
  }
  const std::string root = text.substr(tag, text.find('>', tag) - tag);
  inspection.add("kind", "drawing, SVG");
  add_if_said("width", between(root, " width=\"", "\""), inspection);
  add_if_said("height", between(root, " height=\"", "\""), inspection);
  add_if_said("view box", between(root, " viewBox=\"", "\""), inspection);
}

void inspect_dxf(const std::filesystem::path& path, Inspection& inspection) {
  const std::string text = start_of(path);
  std::string_view rest = without_space(text);
  while (rest.starts_with("999")) {  // comments, a line of code and one of words each
    for (int line = 0; line < 2; ++line) {
      rest.remove_prefix(std::min(rest.size(), rest.find('\n')));
      rest = without_space(rest);
    }
  }
  const bool code = rest.starts_with("0");
  if (!code || !without_space(rest.substr(1)).starts_with("SECTION")) {
    refuse(path, text, "a text DXF: 0, then SECTION");
  }
  inspection.add("kind", "drawing, DXF");
}

void inspect_usda(const std::filesystem::path& path, Inspection& inspection) {
  const std::string text = start_of(path);
  if (!text.starts_with("#usda ")) {
    refuse(path, text, "a scene as USD text, #usda 1.0");
  }
  // What is said of the whole scene stands in parentheses before its first prim.
  const std::string layer = text.substr(0, text.find("\ndef "));
  inspection.add("kind", "scene, USD text");
  inspection.add("metres per unit", between(layer, "metersPerUnit = ", "\n)")
                                        .value_or("0.01: the file does not say, and USD means so"));
  inspection.add(
      "up axis",
      between(layer, "upAxis = \"", "\"").value_or("Y: the file does not say, and USD means so"));
  add_if_said("fps", between(layer, "framesPerSecond = ", "\n)"), inspection);
  add_if_said("first frame", between(layer, "startTimeCode = ", "\n)"), inspection);
  add_if_said("last frame", between(layer, "endTimeCode = ", "\n)"), inspection);
}

void inspect_page(const std::filesystem::path& path, Inspection& inspection) {
  const std::string text = start_of(path);
  const std::string_view begin = without_space(text);
  if (!begin.starts_with("<!doctype html") && !begin.starts_with("<!DOCTYPE html")) {
    refuse(path, text, "a page, <!doctype html>");
  }
  inspection.add("kind", "page, HTML");
  add_if_said("title", between(text, "<title>", "<"), inspection);
}

void inspect_table(const std::filesystem::path& path, Inspection& inspection) {
  const std::string text = read_file_text(path, Limits{}.text_file_bytes);
  if (text.find('\0') != std::string::npos) {
    refuse(path, text, "text, without NUL bytes");
  }
  const std::string head = text.substr(0, text.find_first_of("\r\n"));
  if (head.empty()) {
    refuse(path, text, "columns' names in the first line");
  }
  std::int64_t rows = -1;  // but for their names
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    rows += without_space(std::string_view(text).substr(at, end - at)).empty() ? 0 : 1;
    at = end + 1;
  }
  std::vector<std::string> columns(1);
  for (const char c : head) {
    if (c == ',') {
      columns.emplace_back();
    } else {
      columns.back() += c;
    }
  }
  inspection.add("kind", "table, CSV");
  inspection.add("rows", rows);
  inspection.add("columns", columns);
}

void inspect_json_lines(const std::filesystem::path& path, Inspection& inspection) {
  const std::string text = read_file_text(path, Limits{}.text_file_bytes);
  std::int64_t lines = 0;
  std::size_t at = 0;
  for (std::size_t end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1) {
    ++lines;
    parse_json(std::string_view(text).substr(at, end - at),
               path.string() + ": line " + std::to_string(lines));
  }
  inspection.add("kind", "JSON, a value each line");
  inspection.add("lines", lines);
  if (at < text.size()) {
    inspection.findings.push_back({Severity::Warning, "torn-line",
                                   "line " + std::to_string(lines + 1), "it does not end",
                                   "a run that was killed leaves one; the next run leaves it out"});
  }
}

}  // namespace atelier
