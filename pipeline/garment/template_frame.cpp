#include <algorithm>
#include <vector>

#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "core/unknown_value.h"
#include "pipeline/garment/template_stage.h"

namespace atelier {
namespace {

/// "0 to 11, 20": increasing numbers, as ranges.
std::string ranges_text(const std::vector<int>& ids) {
  std::string text;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const std::size_t begin = i;
    while (i + 1 < ids.size() && ids[i + 1] == ids[i] + 1) {
      ++i;
    }
    text += (text.empty() ? "" : ", ") + std::to_string(ids[begin]) +
            (i > begin ? " to " + std::to_string(ids[i]) : "");
  }
  return text;
}

}  // namespace

void require_template_frame(const TemplateStageOptions& options,
                            const std::filesystem::path& capture) {
  if (options.fit.frame < 0) {
    return;
  }
  std::vector<int> ids;
  try {
    for (const CaptureSequence& sequence : open_dataset(capture).info.sequences) {
      if (sequence.kind != "minimal") {  // of little clothing: no garment is made of it
        ids.insert(ids.end(), sequence.frame_ids.begin(), sequence.frame_ids.end());
      }
    }
  } catch (const DataError&) {  // one that opens by options alone, which this stage does not take
  }
  std::sort(ids.begin(), ids.end());
  if (!ids.empty() && !std::binary_search(ids.begin(), ids.end(), options.fit.frame)) {
    throw UnknownValue(capture.string(), "template.frame", std::to_string(options.fit.frame),
                       "one of the capture's clothed frames, " + ranges_text(ids) + "; or -1");
  }
}

}  // namespace atelier
