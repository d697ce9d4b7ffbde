#include "capture/layouts/frame_files.h"

#include <algorithm>
#include <array>
#include <set>

#include "capture/video_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/lower_extension.h"
#include "core/io/zip_archive.h"
#include "core/system_reason.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

constexpr std::array kVideos = {".mp4", ".mov", ".avi", ".mkv"};

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

bool is_picture(const std::string& extension) {
  static const std::set<std::string> known = {".png",  ".jpg",  ".jpeg", ".tif",
                                              ".tiff", ".webp", ".bmp",  ".avif"};
  return known.contains(extension);
}

bool is_video(const std::string& extension) {
  return std::find(kVideos.begin(), kVideos.end(), extension) != kVideos.end();
}

/// Entries of a folder, sorted; none if there is no such folder.
std::vector<fs::path> entries(const fs::path& folder, const Limits& limits) {
  std::vector<fs::path> paths;
  std::error_code error;
  const fs::file_type kind = fs::status(folder, error).type();
  if (error && kind != fs::file_type::not_found) {  // what may not be looked at is not absent
    throw EnvironmentError(denied_place(folder, error.value()).string(),
                           system_reason(error.value()));
  }
  if (kind != fs::file_type::directory) {
    return paths;
  }
  error.clear();
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (static_cast<std::int64_t>(paths.size()) >= limits.frames) {
      throw DataError(folder.string(), "", "more files than " + std::to_string(limits.frames),
                      "fewer");
    }
    if (entry.path().filename().string().front() != '.') {
      paths.push_back(entry.path());
    }
  }
  if (error) {
    throw EnvironmentError(folder.string(), system_reason(error.value()));
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

/// Refuses a file where a folder is looked for, or where one that is to hold it is.
void refuse_file_for_folder(fs::path folder) {
  std::error_code error;
  fs::file_type kind = fs::status(folder, error).type();
  while (kind == fs::file_type::not_found && folder.has_relative_path()) {
    folder = folder.parent_path();
    kind = folder.empty() ? fs::file_type::directory : fs::status(folder, error).type();
  }
  if (kind == fs::file_type::regular) {
    throw DataError(folder.string(), "", "a file", "a folder");
  }
}

void add(std::map<int, DataPlace>& frames, const std::string& name, const DataPlace& place) {
  const std::optional<int> number = frame_number(name);
  if (!number) {
    return;
  }
  const auto [at, is_new] = frames.emplace(*number, place);
  if (!is_new) {
    throw DataError(
        place.file.string(), place.member,
        "a second image of frame " + std::to_string(*number) + " beside " +
            (at->second.member.empty() ? at->second.file.filename().string() : at->second.member),
        "one file for each frame number (the last number of the name)");
  }
}

/// The last number without leading zeros, in its text.
std::string number_key(const std::string& name) {
  std::size_t end = name.size();
  while (end > 0 && !is_digit(name[end - 1])) {
    --end;
  }
  std::size_t begin = end;
  while (begin > 0 && is_digit(name[begin - 1])) {
    --begin;
  }
  while (begin + 1 < end && name[begin] == '0') {
    ++begin;
  }
  return name.substr(begin, end - begin);
}

}  // namespace

std::optional<int> frame_number(std::string_view file_name) {
  const std::size_t slash = file_name.rfind('/');
  if (slash != std::string_view::npos) {
    file_name.remove_prefix(slash + 1);
  }
  const std::size_t dot = file_name.rfind('.');
  if (dot != std::string_view::npos && dot > 0) {
    file_name = file_name.substr(0, dot);
  }
  std::size_t end = file_name.size();
  while (end > 0 && !is_digit(file_name[end - 1])) {
    --end;
  }
  std::size_t begin = end;
  while (begin > 0 && is_digit(file_name[begin - 1])) {
    --begin;
  }
  while (begin + 1 < end && file_name[begin] == '0') {
    ++begin;
  }
  constexpr std::size_t kDigits = 9;
  if (begin == end || end - begin > kDigits) {
    return std::nullopt;
  }
  int number = 0;
  for (const char c : file_name.substr(begin, end - begin)) {
    number = 10 * number + (c - '0');
  }
  return number;
}

std::map<int, DataPlace> numbered_files(const fs::path& folder,
                                        const std::vector<std::string>& extensions,
                                        const Limits& limits) {
  std::map<int, DataPlace> frames;
  refuse_file_for_folder(folder);
  for (const fs::path& path : entries(folder, limits)) {
    const std::string extension = lower_extension(path);
    const bool wanted = extensions.empty() ? is_picture(extension)
                                           : std::find(extensions.begin(), extensions.end(),
                                                       extension) != extensions.end();
    if (!wanted) {
      continue;
    }
    if (fs::is_directory(path) && frame_number(path.filename().string())) {
      throw DataError(path.string(), "", "a folder", "a file");
    }
    if (fs::is_regular_file(path)) {
      add(frames, path.filename().string(), {path, "", -1});
    }
  }
  return frames;
}

std::map<int, DataPlace> camera_pictures(const fs::path& base, const std::string& name,
                                         const Limits& limits) {
  if (name.empty()) {
    return {};
  }
  std::map<int, DataPlace> frames = numbered_files(base / name, {}, limits);
  if (!frames.empty()) {
    return frames;
  }
  const fs::path zip = base / (name + ".zip");
  if (fs::exists(zip)) {
    const ZipArchive archive(zip, limits);
    for (const std::string& member : archive.names()) {
      if (is_picture(lower_extension(member))) {
        add(frames, member, {zip, member, -1});
      }
    }
    return frames;
  }
  for (const char* extension : kVideos) {
    const fs::path path = base / (name + extension);
    if (fs::exists(path)) {
      const int count = VideoFile(path, limits).frames();
      for (int i = 0; i < count; ++i) {
        frames.emplace(i, DataPlace{path, "", i});
      }
      return frames;
    }
  }
  return frames;
}

std::vector<std::string> camera_names(const fs::path& base, const Limits& limits) {
  std::set<std::string> names;
  for (const fs::path& path : entries(base, limits)) {
    const std::string extension = lower_extension(path);
    if (fs::is_directory(path)) {
      if (path.filename() != "lost+found") {  // of a disk's root, and its owner's alone
        names.insert(path.filename().string());
      }
    } else if (extension == ".zip" || is_video(extension)) {
      names.insert(path.stem().string());
    }
  }
  return {names.begin(), names.end()};
}

std::vector<fs::path> files_ending(const fs::path& folder, std::string_view suffix,
                                   const Limits& limits) {
  const auto lower = [](std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](char c) {
      return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    return text;
  };
  std::vector<fs::path> found;
  for (const fs::path& path : entries(folder, limits)) {
    if (lower(path.filename().string()).ends_with(lower(std::string(suffix))) &&
        fs::is_regular_file(path)) {
      found.push_back(path);
    }
  }
  return found;
}

MatchedNames matched_names(const std::vector<std::string>& ids,
                           const std::vector<std::string>& names) {
  MatchedNames result;
  result.names.resize(ids.size());
  std::set<std::string> left(names.begin(), names.end());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (left.erase(ids[i]) > 0) {
      result.names[i] = ids[i];
    }
  }
  std::map<std::string, std::vector<std::string>> by_number;
  for (const std::string& name : left) {
    by_number[number_key(name)].push_back(name);
  }
  std::map<std::string, int> ids_of_number;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (result.names[i].empty()) {
      ++ids_of_number[number_key(ids[i])];
    }
  }
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const std::string key = number_key(ids[i]);
    // Only where one camera and one name have that number: "cam1_json" and "cam1_img" would tie.
    if (result.names[i].empty() && !key.empty() && ids_of_number[key] == 1 &&
        by_number[key].size() == 1) {
      result.names[i] = by_number[key].front();
      left.erase(result.names[i]);
      result.by_number = true;
    }
  }
  std::vector<std::size_t> unmatched;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (result.names[i].empty()) {
      unmatched.push_back(i);
    }
  }
  if (!unmatched.empty() && unmatched.size() == left.size()) {
    std::sort(unmatched.begin(), unmatched.end(),
              [&](std::size_t a, std::size_t b) { return ids[a] < ids[b]; });
    auto name = left.begin();
    for (const std::size_t i : unmatched) {
      result.names[i] = *name++;
    }
    result.by_order = true;
  }
  return result;
}

namespace {

/// The name in `base` of every camera that lacks `kind`, with findings on how they were matched.
std::vector<std::string> names_in(Dataset& dataset, std::map<int, DataPlace> CameraFrames::*kind,
                                  const fs::path& base, const Limits& limits) {
  std::vector<std::string> ids;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    ids.push_back(dataset.cameras[c].id);
  }
  refuse_file_for_folder(base);
  const std::vector<std::string> names = camera_names(base, limits);
  MatchedNames matched = matched_names(ids, names);
  if (names.empty()) {
    return matched.names;
  }
  if (matched.by_number || matched.by_order) {
    std::string pairs;
    for (std::size_t c = 0; c < ids.size(); ++c) {
      if (!matched.names[c].empty() && matched.names[c] != ids[c] && pairs.size() < 200) {
        pairs += (pairs.empty() ? "" : ", ") + ids[c] + " = " + matched.names[c];
      }
    }
    dataset.findings.push_back(
        {matched.by_order ? Severity::Warning : Severity::Note,
         matched.by_order ? "camera-names-by-order" : "camera-names-by-number", base.string(),
         "cameras of the calibration and of the files have other names: " + pairs,
         matched.by_order ? "give both the same names: sorted order alone put them together"
                          : "nothing, if that is right"});
  }
  for (std::size_t c = 0; c < ids.size(); ++c) {
    if (!(dataset.frames[c].*kind).empty()) {
      matched.names[c].clear();
    }
  }
  return matched.names;
}

}  // namespace

Dataset with_pictures(Dataset dataset, std::map<int, DataPlace> CameraFrames::*kind,
                      const fs::path& base, const Limits& limits) {
  const std::vector<std::string> names = names_in(dataset, kind, base, limits);
  for (std::size_t c = 0; c < names.size(); ++c) {
    if (!names[c].empty()) {
      dataset.frames[c].*kind = camera_pictures(base, names[c], limits);
    }
  }
  return dataset;
}

Dataset with_keypoints(Dataset dataset, const fs::path& base, const Limits& limits) {
  const std::vector<std::string> names = names_in(dataset, &CameraFrames::keypoints, base, limits);
  for (std::size_t c = 0; c < names.size(); ++c) {
    if (!names[c].empty()) {
      dataset.frames[c].keypoints = numbered_files(base / names[c], {".json"}, limits);
    }
  }
  return dataset;
}

Dataset with_pictured_cameras(Dataset dataset) {
  std::vector<Camera> cameras;
  std::vector<CameraFrames> frames;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    if (!dataset.frames[c].images.empty()) {
      cameras.push_back(dataset.cameras[c]);
      frames.push_back(dataset.frames[c]);
    }
  }
  if (cameras.empty() || cameras.size() == dataset.cameras.size()) {
    return dataset;
  }
  dataset.findings.push_back({Severity::Note, "cameras-without-pictures", dataset.root.string(),
                              std::to_string(dataset.cameras.size() - cameras.size()) +
                                  " cameras of the calibration have no images and are left out",
                              "nothing, if they were not downloaded"});
  dataset.cameras = std::move(cameras);
  dataset.frames = std::move(frames);
  return dataset;
}

fs::path path_under(const fs::path& root, const std::string& name, const std::string& file,
                    const std::string& where) {
  constexpr std::size_t kLongest = 1024;
  bool good = !name.empty() && name.size() <= kLongest && name.front() != '/' &&
              std::none_of(name.begin(), name.end(),
                           [](char c) { return static_cast<unsigned char>(c) < 0x20; });
  for (const fs::path& part : fs::path(name)) {
    good = good && part != ".." && !part.empty();
  }
  if (!good) {
    throw DataError(file, where, "the path '" + plain_name(name.substr(0, 80)) + "'",
                    "a relative path without '..', of at most 1024 bytes");
  }
  return root / fs::path(name).lexically_normal();
}

std::string plain_name(std::string_view name) {
  constexpr std::size_t kLongest = 100;
  std::string result(name.substr(0, kLongest));
  for (char& c : result) {
    if (!is_plain_name(std::string("a") + c)) {
      c = '_';
    }
  }
  return result.empty() || result.front() == '.' ? "_" + result : result;
}

}  // namespace atelier
