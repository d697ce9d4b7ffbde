#include "tests/build/dependency_law.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include "tests/support/read_text.h"

namespace atelier::fixtures {
namespace {

constexpr int kHighest = 4;
constexpr const char* kPrecompiled = "pipeline/precompiled.h";

/// By level: each may include those of lower levels. The highest are not read.
const std::map<std::string, int>& law_levels() {
  static const std::map<std::string, int> levels = {
      {"core", 0},       {"capture", 1},  {"bodymodel", 1}, {"registration", 1}, {"simulation", 1},
      {"appearance", 1}, {"pipeline", 2}, {"apps", 3},      {"python", 3},       {"tests", 4},
      {"bench", 4},      {"examples", 4}, {"fuzz", 4}};
  return levels;
}

std::optional<int> level_of(const std::string& top) {
  const auto found = law_levels().find(top);
  return found == law_levels().end() ? std::nullopt : std::optional(found->second);
}

std::string top_of(const std::string& path) {
  return path.substr(0, path.find('/'));
}

std::string folder_of(const std::string& path) {
  const std::size_t end = path.rfind('/');
  return end == std::string::npos ? "" : path.substr(0, end);
}

std::string room_of(const std::string& path) {
  std::string room = folder_of(path);
  while (room.ends_with("/late")) {
    room = folder_of(room);
  }
  return room;
}

bool is_header(const std::string& path) {
  return path.ends_with(".h") || path.ends_with(".cuh");
}

struct Include {
  std::string path;
  bool quoted = false;
};

/// A source with its lines taken apart once.
struct ReadSource {
  const LawSource* source = nullptr;
  std::string top;
  std::vector<std::string> lines;  ///< a directive that goes on after a backslash is one line
  std::vector<Include> includes;
};

/// "include", "if" and so on with what follows it, of a line that is a preprocessor's.
std::optional<std::pair<std::string, std::string>> directive_of(const std::string& line) {
  std::size_t at = line.find_first_not_of(" \t");
  if (at == std::string::npos || line[at] != '#') {
    return std::nullopt;
  }
  at = std::min(line.find_first_not_of(" \t", at + 1), line.size());
  const std::size_t end =
      std::min(line.find_first_not_of("abcdefghijklmnopqrstuvwxyz", at), line.size());
  return std::pair(line.substr(at, end - at), line.substr(end));
}

std::optional<Include> include_of(const std::string& line) {
  const auto directive = directive_of(line);
  if (!directive || directive->first != "include") {
    return std::nullopt;
  }
  const std::string& rest = directive->second;
  const std::size_t open = rest.find_first_of("\"<");
  if (open == std::string::npos) {
    return std::nullopt;
  }
  const std::size_t close = rest.find(rest[open] == '"' ? '"' : '>', open + 1);
  return Include{rest.substr(open + 1, close - open - 1), rest[open] == '"'};
}

ReadSource read_source(const LawSource& source) {
  ReadSource read{&source, top_of(source.path), {}, {}};
  std::istringstream text(source.text);
  for (std::string line; std::getline(text, line);) {
    for (std::string next; line.ends_with('\\') && std::getline(text, next);) {
      line.pop_back();
      line += next;
    }
    if (auto include = include_of(line)) {
      read.includes.push_back(*std::move(include));
    }
    read.lines.push_back(std::move(line));
  }
  return read;
}

using Sources = std::vector<ReadSource>;
using Lines = std::vector<std::string>;

std::string said(const std::string& file, const std::string& included) {
  return file + " includes " + included;
}

void check_levels(const Sources& sources, Lines& lines) {
  for (const ReadSource& file : sources) {
    const int level = *level_of(file.top);
    for (const Include& include : file.includes) {
      const std::string top = top_of(include.path);
      const auto included = level_of(top);
      const std::string what = said(file.source->path, include.path);
      if (!included) {
        if (include.quoted) {
          lines.push_back(what + ": not by its full path");
        }
      } else if (top != file.top && *included >= level) {
        lines.push_back(what + ": " + file.top + " may not include " + top);
      }
    }
  }
}

/// Of each two rooms the includes of the second in the first.
using RoomIncludes = std::map<std::string, std::map<std::string, Lines>>;

/// Within top folders: between these levels are in order, or said to be out of it.
RoomIncludes includes_between_rooms(const Sources& sources) {
  RoomIncludes between;
  for (const ReadSource& file : sources) {
    const std::string from = room_of(file.source->path);
    for (const Include& include : file.includes) {
      const std::string to = room_of(include.path);
      if (top_of(include.path) == file.top && from != to) {
        between[from][to].push_back(said(file.source->path, include.path));
      }
    }
  }
  return between;
}

/// The rooms of a shortest cycle through one, which comes first; empty if there is none.
Lines shortest_cycle(const RoomIncludes& between, const std::string& start) {
  std::map<std::string, std::string> reached_from;
  Lines reached = {start};
  for (std::size_t i = 0; i < reached.size(); ++i) {
    const std::string room = reached[i];
    const auto includes = between.find(room);
    if (includes == between.end()) {
      continue;
    }
    for (const auto& [next, lines] : includes->second) {
      if (next == start) {
        Lines cycle;
        for (std::string at = room; at != start; at = reached_from.at(at)) {
          cycle.push_back(at);
        }
        cycle.push_back(start);
        std::reverse(cycle.begin(), cycle.end());
        return cycle;
      }
      if (reached_from.emplace(next, room).second) {
        reached.push_back(next);
      }
    }
  }
  return {};
}

void check_cycles(const Sources& sources, Lines& lines) {
  const RoomIncludes between = includes_between_rooms(sources);
  std::set<Lines> seen;
  for (const auto& [room, includes] : between) {
    Lines cycle = shortest_cycle(between, room);
    std::rotate(cycle.begin(), std::min_element(cycle.begin(), cycle.end()), cycle.end());
    if (cycle.empty() || !seen.insert(cycle).second) {
      continue;
    }
    std::string path = cycle.front();
    std::string why;
    for (std::size_t i = 0; i < cycle.size(); ++i) {
      const std::string& next = cycle[(i + 1) % cycle.size()];
      path += " -> " + next;
      const Lines& made_by = between.at(cycle[i]).at(next);
      why += (i == 0 ? "" : "; ") + made_by.front();
      if (made_by.size() > 1) {
        why += " and " + std::to_string(made_by.size() - 1) + " more";
      }
    }
    lines.push_back("rooms in a cycle, " + path + ": " + why);
  }
}

void check_order_of_core(const Sources& sources, Lines& lines) {
  static const std::map<std::string, std::set<std::string>> allowed = {
      {"core", {}},        {"core/io", {}},
      {"core/remesh", {}}, {"core/render", {"core/io"}},
      {"core/seal", {}},   {"core/store", {"core/io"}}};
  for (const ReadSource& file : sources) {
    const std::string room = room_of(file.source->path);
    const auto may = allowed.find(room);
    for (const Include& include : file.includes) {
      const std::string to = room_of(include.path);
      if (may != allowed.end() && to != room && to != "core" && allowed.contains(to) &&
          !may->second.contains(to)) {
        lines.push_back(said(file.source->path, include.path) + ": " + room + " may not use " + to);
      }
    }
  }
}

void check_pipeline(const Sources& sources, Lines& lines) {
  for (const ReadSource& file : sources) {
    for (const Include& include : file.includes) {
      if (file.top == "pipeline" &&
          (include.path.starts_with("CLI/") || include.path.ends_with("stream"))) {
        lines.push_back(said(file.source->path, include.path) +
                        ": pipeline knows neither the command line nor streams");
      }
    }
  }
}

bool is_heavy(const Include& include) {
  static constexpr std::array<std::string_view, 9> kFolders = {
      "torch/", "pcl/", "CGAL/", "ceres/", "opencv2/", "embree3/", "CLI/", "spdlog/", "toml++/"};
  static constexpr std::array<std::string_view, 5> kOthers = {"tbb/", "oneapi/", "hdf5.h",
                                                              "nlohmann/json.hpp", "tiny_gltf.h"};
  const auto begins = [&](std::string_view with) { return include.path.starts_with(with); };
  return !include.quoted && (std::any_of(kFolders.begin(), kFolders.end(), begins) ||
                             std::any_of(kOthers.begin(), kOthers.end(), begins));
}

void check_heavy_packages(const Sources& sources, Lines& lines) {
  std::set<std::string> parsed_once;
  for (const ReadSource& file : sources) {
    for (const Include& include : file.includes) {
      if (file.source->path == kPrecompiled) {
        parsed_once.insert(include.path);
      }
    }
  }
  std::set<std::string> private_headers;
  for (const ReadSource& file : sources) {
    const std::string& path = file.source->path;
    if (!is_header(path) || file.top == "apps" || path == kPrecompiled) {
      continue;
    }
    for (const Include& include : file.includes) {
      const bool parsed = file.top == "pipeline" && parsed_once.contains(include.path);
      if (is_heavy(include) && !parsed) {
        private_headers.insert(path);
        if (file.source->text.find("Private to " + folder_of(path)) == std::string::npos) {
          lines.push_back(said(path, include.path) + ": a heavy package in a header");
        }
      }
    }
  }
  for (const ReadSource& file : sources) {
    for (const Include& include : file.includes) {
      const std::string owner = folder_of(include.path);
      if (private_headers.contains(include.path) && folder_of(file.source->path) != owner) {
        lines.push_back(said(file.source->path, include.path) + ": it is private to " + owner);
      }
    }
  }
}

void check_guards(const Sources& sources, Lines& lines) {
  for (const ReadSource& file : sources) {
    if (is_header(file.source->path) &&
        (file.lines.empty() || file.lines.front() != "#pragma once")) {
      lines.push_back(file.source->path + ": its first line is not #pragma once");
    }
  }
}

bool may_know_stages_and_commands(const ReadSource& file) {
  return file.top == "pipeline" || file.top == "apps";
}

/// Where rules between options are, which name them: cloth_rules.cpp of a room, option_rules.h.
bool has_option_rules(const std::string& path) {
  return path.ends_with("_rules.h") || path.ends_with("_rules.cpp");
}

void check_names_of_solvers(const Sources& sources, Lines& lines) {
  static const std::regex solver("xpbd", std::regex::icase);
  static const std::regex option(R"re((["\- ])xpbd\.(?=[a-z"]))re");
  for (const ReadSource& file : sources) {
    const std::string& path = file.source->path;
    if (!may_know_stages_and_commands(file)) {
      continue;
    }
    if (std::regex_search(path, solver)) {
      lines.push_back(path + ": its name has that of a solver");
    }
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string& line = file.lines[i];
      const std::string text =
          has_option_rules(path) ? std::regex_replace(line, option, "$1") : line;
      if (std::regex_search(text, solver)) {
        lines.push_back(path + " names a solver: " + line);
      }
    }
  }
}

void check_conditions(const Sources& sources, Lines& lines) {
  for (const ReadSource& file : sources) {
    if (!may_know_stages_and_commands(file)) {
      continue;
    }
    for (const std::string& line : file.lines) {
      const auto directive = directive_of(line);
      if (!directive ||
          (!directive->first.starts_with("if") && !directive->first.starts_with("elif"))) {
        continue;
      }
      const bool of_command = directive->second.find("ATELIER_COMMAND_") != std::string::npos;
      if (directive->second.find("ATELIER_HAS_") != std::string::npos ||
          (of_command && file.source->path != "apps/console/commands.cpp")) {
        lines.push_back(file.source->path + ": " + line);
      }
    }
  }
}

/// A stage that writes a sequence by itself would have it read back for its figures.
void check_sequences_of_stages(const Sources& sources, Lines& lines) {
  for (const ReadSource& file : sources) {
    const std::string& text = file.source->text;
    if (file.top == "pipeline" && text.find("StageRun") != std::string::npos &&
        text.find("write_sequence(") != std::string::npos) {
      lines.push_back(file.source->path +
                      " has a stage write a sequence: output_sequences is the one way to");
    }
  }
}

void check_size_of_apps(const Sources& sources, Lines& lines) {
  constexpr std::ptrdiff_t kMostLines = 10000;
  std::ptrdiff_t all = 0;
  for (const ReadSource& one : sources) {
    const std::string& text = one.source->text;
    all += one.top == "apps" ? std::count(text.begin(), text.end(), '\n') : 0;
  }
  if (all > kMostLines) {
    lines.push_back(
        "apps has " + std::to_string(all) + " lines of at most " + std::to_string(kMostLines) +
        ": what computes, reads or writes belongs in a room of pipeline or in a domain");
  }
}

}  // namespace

std::vector<std::string> law_violations(const std::vector<LawSource>& sources) {
  Sources read;
  for (const LawSource& source : sources) {
    const auto level = level_of(top_of(source.path));
    if (level && *level < kHighest) {
      read.push_back(read_source(source));
    }
  }
  Lines lines;
  check_levels(read, lines);
  check_cycles(read, lines);
  check_order_of_core(read, lines);
  check_pipeline(read, lines);
  check_heavy_packages(read, lines);
  check_guards(read, lines);
  check_names_of_solvers(read, lines);
  check_conditions(read, lines);
  check_sequences_of_stages(read, lines);
  check_size_of_apps(read, lines);
  return lines;
}

std::vector<LawSource> read_law_sources(const std::filesystem::path& project) {
  namespace fs = std::filesystem;
  std::vector<LawSource> sources;
  for (const auto& [top, level] : law_levels()) {
    if (level == kHighest || !fs::exists(project / top)) {
      continue;
    }
    for (const auto& entry : fs::recursive_directory_iterator(project / top)) {
      const std::string extension = entry.path().extension().string();
      if (extension == ".h" || extension == ".cpp" || extension == ".cu" || extension == ".cuh") {
        sources.push_back(
            {fs::relative(entry.path(), project).generic_string(), read_text(entry.path())});
      }
    }
  }
  std::sort(sources.begin(), sources.end(),
            [](const LawSource& a, const LawSource& b) { return a.path < b.path; });
  return sources;
}

}  // namespace atelier::fixtures
