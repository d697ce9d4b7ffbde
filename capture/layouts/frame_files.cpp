#include "capture/layouts/frame_files.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <set>

#include "capture/frame_number.h"
#include "capture/keypoints2d.h"
#include "capture/layouts/number_by_time.h"
#include "capture/time_stamp.h"
#include "capture/video_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/file_bytes.h"
#include "core/io/lower_extension.h"
#include "core/io/zip_archive.h"
#include "core/system_reason.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

constexpr std::array kVideos = {".mp4", ".mov", ".avi", ".mkv", ".m4v", ".webm"};

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

/// Names in a folder, sorted; none if there is no such folder. Not paths, which keep each of their
/// parts: some 700 bytes of a file.
std::vector<std::string> entries(const fs::path& folder, const Limits& limits) {
  std::vector<std::string> names;
  std::error_code error;
  const fs::file_type kind = fs::status(folder, error).type();
  if (error && kind != fs::file_type::not_found) {  // what may not be looked at is not absent
    throw EnvironmentError(denied_place(folder, error.value()).string(),
                           system_reason(error.value()));
  }
  if (kind != fs::file_type::directory) {
    return names;
  }
  error.clear();
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (std::ssize(names) >= limits.frames) {
      throw DataError(folder.string(), "", "more files than " + std::to_string(limits.frames),
                      "fewer");
    }
    std::string name = entry.path().filename().string();
    if (name.front() != '.') {
      names.push_back(std::move(name));
    }
  }
  if (error) {
    throw EnvironmentError(folder.string(), system_reason(error.value()));
  }
  std::sort(names.begin(), names.end());
  return names;
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

/// Places by the numbers of their names.
/// @param place_of  of a name
template <class PlaceOf>
FrameLocations numbered(const std::vector<std::string>& names, const PlaceOf& place_of) {
  const std::size_t run = frame_run(names);
  const std::vector<std::optional<std::int64_t>> stamps = time_stamps(names);
  std::vector<std::pair<int, std::uint32_t>> order;  // so that places are added by frame
  order.reserve(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::optional<int> number = stamps[i] ? std::nullopt : frame_number(names[i], run);
    if (number) {
      order.emplace_back(*number, static_cast<std::uint32_t>(i));
    }
  }
  std::sort(order.begin(), order.end());
  std::size_t digits = 0;
  for (const std::string& name : names) {
    digits = std::max(digits, number_digits(name, run));
  }
  continue_counter(order, digits);
  FrameLocations frames;
  for (const auto& [number, i] : order) {
    const DataLocation place = place_of(names[i]);
    if (!frames.add(number, place)) {
      const DataLocation there = *frames.find(number);
      throw DataError(place.file.string(), place.member,
                      "a second image of frame " + std::to_string(number) + " beside " +
                          (there.member.empty() ? there.file.filename().string() : there.member),
                      "one file for each frame number (the last number of the name that differs)");
    }
  }
  return frames;
}

/// Names of the files of a folder that frames may be in, sorted.
std::vector<std::string> files_of_frames(const fs::path& folder,
                                         const std::vector<std::string>& extensions,
                                         const Limits& limits) {
  refuse_file_for_folder(folder);
  std::vector<std::string> files;
  for (std::string& name : entries(folder, limits)) {
    const std::string extension = lower_extension(name);
    const bool wanted = extensions.empty() ? is_picture(extension)
                                           : std::find(extensions.begin(), extensions.end(),
                                                       extension) != extensions.end();
    if (!wanted) {
      continue;
    }
    const fs::path path = folder / name;
    if (fs::is_directory(path) && !digit_runs(name).empty()) {
      throw DataError(path.string(), "", "a folder", "a file");
    }
    if (fs::is_regular_file(path)) {
      files.push_back(std::move(name));
    }
  }
  return files;
}

/// The last number without leading zeros, in its text.
std::string_view number_key(std::string_view name) {
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

std::size_t frame_run(const std::vector<std::string>& names) {
  std::size_t runs = names.empty() ? 0 : SIZE_MAX;
  bool camera_last = !names.empty();
  for (const std::string& name : names) {
    const std::vector<std::string_view> of_name = digit_runs(name);
    runs = std::min(runs, of_name.size());
    camera_last = camera_last && !of_name.empty() && is_camera_number(name, of_name.back());
  }
  if (runs >= 2 && camera_last) {
    return 1;
  }
  for (std::size_t k = 0; k < runs; ++k) {
    std::vector<std::string_view> values;
    values.reserve(names.size());
    for (const std::string& name : names) {
      const std::vector<std::string_view> of_name = digit_runs(name);
      values.push_back(number_key(of_name[of_name.size() - 1 - k]));
    }
    std::sort(values.begin(), values.end());
    if (std::adjacent_find(values.begin(), values.end()) == values.end()) {
      return k;
    }
  }
  return 0;
}

FrameLocations numbered_files(const fs::path& folder, const std::vector<std::string>& extensions,
                              const Limits& limits) {
  return numbered(files_of_frames(folder, extensions, limits), [&](const std::string& name) {
    return DataLocation{folder / name, "", -1};
  });
}

StampedFiles stamped_files(const fs::path& folder, const std::vector<std::string>& extensions,
                           const Limits& limits) {
  StampedFiles stamped;
  stamped.folder = folder;
  constexpr std::size_t kShortest = 10;  // digits: seconds since 1970
  std::vector<std::string> names = files_of_frames(folder, extensions, limits);
  const std::vector<std::optional<std::int64_t>> times = time_stamps(names);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::vector<std::string_view> runs = digit_runs(names[i]);
    const auto stamp = times[i]                                         ? times[i]
                       : runs.empty() || runs.back().size() < kShortest ? std::nullopt
                                                                        : long_number(runs.back());
    if (stamp) {
      stamped.files.push_back({*stamp, std::move(names[i])});
    }
  }
  // Of two files of one stamp the first counts.
  std::stable_sort(stamped.files.begin(), stamped.files.end(),
                   [](const auto& a, const auto& b) { return a.stamp < b.stamp; });
  const auto same = std::unique(stamped.files.begin(), stamped.files.end(),
                                [](const auto& a, const auto& b) { return a.stamp == b.stamp; });
  stamped.files.erase(same, stamped.files.end());
  return stamped;
}

namespace {

/// The file of a folder that is called so and has the first of these extensions that there is, in
/// any case, as cameras write GX010001.MP4; "": none.
fs::path file_called(const fs::path& base, const std::string& name,
                     const std::vector<std::string>& extensions, const Limits& limits) {
  for (const std::string& extension : extensions) {
    if (const fs::path path = base / (name + extension); fs::exists(path)) {
      return path;
    }
  }
  const std::vector<std::string> names = entries(base, limits);
  for (const std::string& extension : extensions) {
    for (const std::string& entry : names) {
      if (fs::path(entry).stem() == name && lower_extension(entry) == extension &&
          !fs::is_directory(base / entry)) {
        return base / entry;
      }
    }
  }
  return {};
}

}  // namespace

FrameLocations camera_pictures(const fs::path& base, const std::string& name,
                               const Limits& limits) {
  if (name.empty()) {
    return {};
  }
  FrameLocations frames = numbered_files(base / name, {}, limits);
  if (!frames.empty()) {
    return frames;
  }
  if (const fs::path zip = file_called(base, name, {".zip"}, limits); !zip.empty()) {
    const ZipArchive archive(zip, limits);
    std::vector<std::string> members;
    for (const std::string& member : archive.names()) {
      if (is_picture(lower_extension(member))) {
        members.push_back(member);
      }
    }
    return numbered(members, [&](const std::string& member) {
      return DataLocation{zip, member, -1};
    });
  }
  const fs::path video = file_called(base, name, {kVideos.begin(), kVideos.end()}, limits);
  if (!video.empty()) {
    const int count = VideoFile(video, limits).frames();
    for (int i = 0; i < count; ++i) {
      frames.add(i, {video, "", i});
    }
  }
  return frames;
}

std::vector<std::string> camera_names(const fs::path& base, const Limits& limits) {
  std::set<std::string> names;
  for (const std::string& name : entries(base, limits)) {
    const std::string extension = lower_extension(name);
    if (fs::is_directory(base / name)) {
      if (name != "lost+found") {  // of a disk's root, and its owner's alone
        names.insert(name);
      }
    } else if (extension == ".zip" || is_video(extension)) {
      names.insert(fs::path(name).stem().string());
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
  for (const std::string& name : entries(folder, limits)) {
    if (lower(name).ends_with(lower(std::string(suffix))) && fs::is_regular_file(folder / name)) {
      found.push_back(folder / name);
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
    by_number[std::string(number_key(name))].push_back(name);
  }
  std::map<std::string, int> ids_of_number;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (result.names[i].empty()) {
      ++ids_of_number[std::string(number_key(ids[i]))];
    }
  }
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const std::string key(number_key(ids[i]));
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
std::vector<std::string> names_in(Dataset& dataset, FrameLocations CameraFrames::*kind,
                                  const fs::path& base, const Limits& limits) {
  std::vector<std::string> ids;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    ids.push_back(dataset.cameras[c].id);
  }
  refuse_file_for_folder(base);
  std::vector<std::string> names = camera_names(base, limits);
  if (kind == &CameraFrames::keypoints && names.empty()) {  // a file of all frames for each camera
    for (const fs::path& file : files_ending(base, ".json", limits)) {
      names.push_back(file.stem().string());
    }
  }
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

Dataset with_pictures(Dataset dataset, FrameLocations CameraFrames::*kind, const fs::path& base,
                      const Limits& limits) {
  const std::vector<std::string> names = names_in(dataset, kind, base, limits);
  std::vector<StampedFiles> stamped(names.size());
  for (std::size_t c = 0; c < names.size(); ++c) {
    if (!names[c].empty()) {
      dataset.frames[c].*kind = camera_pictures(base, names[c], limits);
      if ((dataset.frames[c].*kind).empty()) {
        stamped[c] = stamped_files(base / names[c], {}, limits);
      }
    }
  }
  number_by_time(dataset, kind, stamped, base.string());
  return dataset;
}

namespace {

/// The file that holds all frames of a camera: the only JSON of its folder, or `base`/`name`.json.
fs::path one_detection_file(const fs::path& base, const std::string& name, const Limits& limits) {
  const std::vector<fs::path> inside = files_ending(base / name, ".json", limits);
  const fs::path beside = base / (name + ".json");
  return inside.size() == 1 ? inside.front() : fs::is_regular_file(beside) ? beside : fs::path();
}

/// Frames of such a file; none if it is another one or of one frame. One that cannot be read is
/// told of where its frames are read.
FrameLocations frames_of_file(const fs::path& file, const Limits& limits) {
  FrameLocations frames;
  try {
    const std::string text = read_file_text(file, limits.text_file_bytes);
    for (const auto& [frame, people] : parse_detection_frames(text, file.string(), 0, limits)) {
      frames.add(frame, {file, "", frame});
    }
  } catch (const DataError&) {
    frames.clear();
  }
  return frames;
}

/// Some programs count frames from 1 where a video's begin at 0.
FrameLocations beside_images(FrameLocations frames, const FrameLocations& images) {
  if (frames.empty() || images.empty() || images.begin()->first != 0 ||
      frames.begin()->first == 0 || frames.last_frame() != images.last_frame() + 1) {
    return frames;
  }
  return frames.shifted(-1);
}

}  // namespace

Dataset with_keypoints(Dataset dataset, const fs::path& base, const Limits& limits) {
  const std::vector<std::string> names = names_in(dataset, &CameraFrames::keypoints, base, limits);
  std::vector<StampedFiles> stamped(names.size());
  for (std::size_t c = 0; c < names.size(); ++c) {
    if (!names[c].empty()) {
      CameraFrames& frames = dataset.frames[c];
      frames.keypoints = numbered_files(base / names[c], {".json"}, limits);
      const fs::path file =
          frames.keypoints.size() <= 1 ? one_detection_file(base, names[c], limits) : fs::path();
      if (!file.empty()) {
        FrameLocations of_file = frames_of_file(file, limits);
        if (of_file.size() > 1) {
          frames.keypoints = beside_images(std::move(of_file), frames.images);
        }
      }
      if (frames.keypoints.empty()) {
        stamped[c] = stamped_files(base / names[c], {".json"}, limits);
      }
    }
  }
  number_by_time(dataset, &CameraFrames::keypoints, stamped, base.string());
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
