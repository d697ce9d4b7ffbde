#include "pipeline/person/tracked_take.h"

#include <algorithm>

#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "core/unknown_value.h"

namespace atelier {

namespace fs = std::filesystem;

fs::path tracked_take(const fs::path& tracked, const fs::path& capture, const std::string& name) {
  const fs::path folder = tracked / "tracked";
  if (!name.empty()) {
    fs::path file = folder / (name + ".h5");
    if (!fs::exists(file)) {
      throw UnknownValue(folder.string(), "sequence", name, "a sequence that is tracked");
    }
    return file;
  }
  fs::path first;
  for (const CaptureSequence& sequence : open_dataset(capture).info.sequences) {
    fs::path file = folder / (sequence.name + ".h5");
    if (!fs::exists(file)) {
      continue;
    }
    if (sequence.kind != "minimal") {
      return file;
    }
    first = first.empty() ? file : first;
  }
  if (first.empty()) {
    throw DataError(folder.string(), "", "no sequence of this capture",
                    "tracked ones; run 'atelier track' again");
  }
  return first;
}

std::vector<TrackedTake> tracked_takes(const fs::path& tracked) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(tracked / "tracked")) {
    if (entry.path().extension() == ".h5") {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  std::vector<TrackedTake> takes;
  takes.reserve(files.size());
  for (const fs::path& file : files) {
    takes.push_back({file.stem().string(), read_tracked_motion(file)});
  }
  std::sort(takes.begin(), takes.end(), [](const TrackedTake& a, const TrackedTake& b) {
    const auto& x = a.tracked.motion.frame_ids;
    const auto& y = b.tracked.motion.frame_ids;
    return x.empty() || y.empty() ? x.size() < y.size() : x.front() < y.front();
  });
  return takes;
}

}  // namespace atelier
