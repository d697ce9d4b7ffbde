#include "core/store/made_of.h"

#include <iterator>
#include <sstream>
#include <system_error>

#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/store/manifest.h"
#include "core/store/result.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// A path as its file system has it, without links, dots and a slash at its end; the end of it may
/// be gone.
fs::path resolved(const fs::path& path) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(path, error);
  const fs::path known = error ? path.lexically_normal() : whole;
  return known.has_filename() ? known : known.parent_path();
}

/// Of a note, whose other lines say nothing of results.
std::vector<ResultName> named_in(const std::string& note) {
  std::vector<ResultName> names;
  std::istringstream lines(note);
  std::string line;
  std::getline(lines, line);  // the version
  while (std::getline(lines, line)) {
    const std::size_t space = line.find(' ');
    if (space == std::string::npos || !is_safe_output_path(line.substr(0, space)) ||
        !is_folder_name(line.substr(space + 1))) {
      break;
    }
    names.push_back({line.substr(0, space), line.substr(space + 1)});
  }
  return names;
}

/// Whether a folder was made of results by a run.
bool has_note(const fs::path& folder) {
  return link_kind(folder / kMadeOfFile) == fs::file_type::regular;
}

}  // namespace

fs::path place_now(const fs::path& workspace, const fs::path& input) {
  std::error_code error;
  const fs::path root = fs::canonical(workspace, error);
  if (error) {
    return input;
  }
  try {
    const fs::path place = resolved(input);
    if (*place.lexically_relative(root).begin() != "..") {
      return input;
    }
    const bool gone = link_kind(place) == fs::file_type::not_found;
    const fs::path folder = place.parent_path();
    if (is_folder_name(place.filename().string())) {  // the result of a stage
      const fs::path result = root / folder.filename() / place.filename();
      return link_kind(result) == fs::file_type::directory ? result : input;
    }
    if (has_note(root / place.filename()) && (gone || has_note(place))) {
      return root / place.filename();
    }
    if (has_note(root / folder.filename()) && (gone || has_note(folder))) {
      return root / folder.filename() / place.filename();
    }
  } catch (const EnvironmentError&) {  // what cannot be looked at is left as it is
  }
  return input;
}

std::vector<ResultName> results_behind(const fs::path& workspace, const fs::path& named) {
  std::error_code error;
  const fs::path root = fs::canonical(workspace, error);
  if (error) {
    return {};
  }
  try {
    const fs::path place = resolved(place_now(root, named));
    if (const fs::path result = result_around(place); !result.empty()) {
      const fs::path stage = result.parent_path();
      return stage.parent_path() == root
                 ? std::vector<ResultName>{{stage.filename().string(), result.filename().string()}}
                 : std::vector<ResultName>{};
    }
    const fs::path inside = place.lexically_relative(root);
    const std::ptrdiff_t depth = std::distance(inside.begin(), inside.end());
    if (depth >= 2 && is_folder_name(std::next(inside.begin())->string())) {  // removed since
      return {{inside.begin()->string(), std::next(inside.begin())->string()}};
    }
    const fs::path note = (depth == 2 ? place.parent_path() : place) / kMadeOfFile;
    if (depth >= 1 && depth <= 2 && link_kind(note) == fs::file_type::regular) {
      const std::string text = read_file_text(note, Limits{}.text_file_bytes);
      const bool made =
          depth == 1 || text.find("\n" + place.filename().string() + " ") != text.npos;
      return made ? named_in(text) : std::vector<ResultName>{};
    }
  } catch (const DataError&) {  // what cannot be read says nothing
  } catch (const EnvironmentError&) {
  }
  return {};
}

}  // namespace atelier
