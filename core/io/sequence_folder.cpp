#include "core/io/sequence_folder.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_file.h"
#include "core/regular_file.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

bool is_mesh_name(const std::filesystem::path& path) {
  constexpr std::array<std::string_view, 4> kExtensions = {".obj", ".ply", ".glb", ".gltf"};
  return std::find(kExtensions.begin(), kExtensions.end(), lower_extension(path)) !=
         kExtensions.end();
}

/// The digits at the end of a name as a number.
std::optional<int> frame_number(const std::string& stem) {
  std::size_t begin = stem.size();
  while (begin > 0 && stem[begin - 1] >= '0' && stem[begin - 1] <= '9') {
    --begin;
  }
  int number = 0;
  const auto result = std::from_chars(stem.data() + begin, stem.data() + stem.size(), number);
  return result.ec == std::errc() && begin < stem.size() ? std::optional<int>(number)
                                                         : std::nullopt;
}

/// The files by their frames; a single file is frame 0.
std::map<int, std::filesystem::path> mesh_files(const std::filesystem::path& path,
                                                const Limits& limits) {
  std::error_code error;
  std::map<int, std::filesystem::path> files;
  if (std::filesystem::is_regular_file(path, error)) {
    files[0] = path;
  } else {
    auto walk = std::filesystem::directory_iterator(path, error);
    for (; !error && walk != std::filesystem::directory_iterator(); walk.increment(error)) {
      const std::filesystem::path& file = walk->path();
      if (file.filename().string().starts_with(".") || !is_mesh_name(file) ||
          walk->symlink_status(error).type() == std::filesystem::file_type::directory) {
        continue;
      }
      if (!walk->is_regular_file(error)) {
        throw DataError(file.string(), "", "a name that leads to no file",
                        "a mesh; remove it, or put a dot before its name to leave it out");
      }
      const auto frame_id = frame_number(file.stem().string());
      if (!frame_id) {
        throw DataError(file.string(), "name", "no frame number at its end",
                        "a name like frame_000012" + file.extension().string() +
                            " (digits, at most 2147483647); rename it, or put a dot before its "
                            "name to leave it out");
      }
      const auto [other, fresh] = files.emplace(*frame_id, file);
      if (!fresh) {
        throw DataError(std::max(file.string(), other->second.string()), "name",
                        "frame " + std::to_string(*frame_id) + ", which " +
                            std::min(file.string(), other->second.string()) + " has too",
                        "one file for each frame");
      }
      if (static_cast<std::int64_t>(files.size()) > limits.frames) {
        throw DataError(path.string(), "", "more than " + std::to_string(limits.frames) + " frames",
                        "fewer");
      }
    }
    if (error) {
      if (error == std::errc::permission_denied) {
        throw EnvironmentError(path.string(),
                               "cannot list the folder: " + system_reason(error.value()));
      }
      throw DataError(path.string(), "", error.message(), "a mesh or a folder of meshes");
    }
  }
  for (const auto& [frame_id, file] : files) {  // before anybody reads gigabytes of it for nothing
    const std::uintmax_t bytes = std::filesystem::file_size(file, error);
    if (!error && std::cmp_greater(bytes, limits.mesh_file_bytes)) {
      RegularFile(file).check_size(limits.mesh_file_bytes, file);
    }
  }
  if (files.empty()) {
    throw DataError(path.string(), "", "no .obj, .ply, .glb or .gltf", "a folder of meshes");
  }
  return files;
}

}  // namespace

Sequence read_sequence_folder(const std::filesystem::path& path, const MeshConvention& otherwise,
                              const Limits& limits) {
  std::map<int, std::filesystem::path> files = mesh_files(path, limits);
  Sequence sequence;
  std::vector<std::filesystem::path> paths;
  for (auto& [frame_id, file] : files) {
    sequence.frame_ids.push_back(frame_id);
    paths.push_back(std::move(file));
  }
  sequence.load = [paths = std::move(paths), otherwise, limits](Index frame_idx) {
    return read_mesh(paths[static_cast<std::size_t>(frame_idx)], otherwise, limits);
  };
  return sequence;
}

std::optional<Finding> gap_finding(const std::vector<int>& frame_ids, const std::string& place) {
  constexpr std::size_t kNamed = 3;
  const std::int64_t span = std::int64_t{frame_ids.back()} - frame_ids.front() + 1;
  const std::int64_t missing = span - std::ssize(frame_ids);
  if (missing == 0) {
    return std::nullopt;
  }
  std::string named;
  std::size_t count = 0;
  std::size_t next = 0;  // in `frame_ids`
  for (int id = frame_ids.front(); std::cmp_less(count, missing) && count < kNamed; ++id) {
    if (frame_ids[next] == id) {
      ++next;
    } else {
      named += (count == 0 ? "" : ", ") + std::to_string(id);
      ++count;
    }
  }
  const std::int64_t more = missing - static_cast<std::int64_t>(count);
  return Finding{Severity::Note, "frame-numbers-missing", place,
                 "numbers without a mesh: " + named +
                     (more > 0 ? " and " + std::to_string(more) + " more" : ""),
                 "copy what is missing, unless it was left out on purpose"};
}

MeshFile read_first_mesh(const std::filesystem::path& path, const MeshConvention& otherwise,
                         const Limits& limits) {
  return read_mesh_file(mesh_files(path, limits).begin()->second, otherwise, limits);
}

}  // namespace atelier
