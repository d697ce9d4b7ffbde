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

}  // namespace

std::vector<ResultName> results_behind(const std::filesystem::path& workspace,
                                       const std::filesystem::path& input) {
  std::error_code error;
  const std::filesystem::path root = std::filesystem::canonical(workspace, error);
  if (error) {
    return {};
  }
  try {
    if (const std::filesystem::path result = result_around(input); !result.empty()) {
      const std::filesystem::path stage = result.parent_path();
      return stage.parent_path() == root
                 ? std::vector<ResultName>{{stage.filename().string(), result.filename().string()}}
                 : std::vector<ResultName>{};
    }
    if (const std::filesystem::path inside = input.lexically_relative(root);
        std::distance(inside.begin(), inside.end()) >= 2 &&
        is_folder_name(std::next(inside.begin())->string())) {  // removed since
      return {{inside.begin()->string(), std::next(inside.begin())->string()}};
    }
    const std::filesystem::path note = input / kMadeOfFile;
    if (input.parent_path() == root && link_kind(note) == std::filesystem::file_type::regular) {
      return named_in(read_file_text(note, Limits{}.text_file_bytes));
    }
  } catch (const DataError&) {  // what cannot be read says nothing
  } catch (const EnvironmentError&) {
  }
  return {};
}

}  // namespace atelier
