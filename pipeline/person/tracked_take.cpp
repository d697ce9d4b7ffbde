#include "pipeline/person/tracked_take.h"

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

}  // namespace atelier
