#include "capture/layouts/write_layout.h"

#include <algorithm>

#include "capture/layouts/layout_table.h"
#include "capture/layouts/open_dataset.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/listed_frames.h"
#include "core/store/consent_file.h"

namespace atelier {
namespace fs = std::filesystem;

const std::vector<std::string>& layout_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const Layout& layout : all_layouts()) {
      result.emplace_back(layout.name);
    }
    return result;
  }();
  return names;
}

namespace {

/// What becomes of held-out cameras and frames that the capture has; "" where there are none.
std::string held_out_sentence(const Dataset& dataset, const Layout& target) {
  std::string cameras;
  for (const std::string& id : dataset.info.held_out_cameras) {
    if (camera_index(dataset, id) >= 0) {
      cameras += (cameras.empty() ? "" : ",") + id;
    }
  }
  std::vector<int> frames = dataset.info.held_out_frames;
  const std::vector<int> all = frame_ids(dataset);
  std::erase_if(frames, [&](int id) { return !std::binary_search(all.begin(), all.end(), id); });
  if (cameras.empty() && frames.empty()) {
    return "";
  }
  std::string what = cameras.empty() ? "" : "held-out cameras " + cameras;
  what += what.empty() || frames.empty() ? "" : " and ";
  what += frames.empty() ? "" : "held-out frames " + listed_frames(frames);
  if (target.held_out != nullptr) {
    return what + " are named in " + target.held_out +
           "; programs that do not read it open them in training";
  }
  return what + " are written like the rest, which has no place to tell them apart: a training " +
         "opens them" +
         (cameras.empty() ? "" : "; --leave-out " + cameras + " leaves the cameras out");
}

}  // namespace

LayoutReport write_layout(const Dataset& dataset, const std::string& layout, const fs::path& out,
                          const std::function<bool()>& stop) {
  const Layout& target = find_layout(layout);
  if (!dataset.calibrated && layout != "images") {
    throw DataError(dataset.root.string(), "", "a capture without calibration",
                    "cameras; calibrate it first, or write the layout images");
  }
  if (fs::exists(out)) {
    throw EnvironmentError(out.string(), "it is there already; name a new folder");
  }
  FrameReader reader(dataset);
  LayoutReport report;
  const auto write = [&](const CaptureSequence& sequence, const fs::path& folder) {
    make_private_directory(folder);
    for (const std::string& sentence : target.write({&reader, sequence, stop}, folder)) {
      if (std::find(report.lost.begin(), report.lost.end(), sentence) == report.lost.end()) {
        report.lost.push_back(sentence);
      }
    }
    report.folders.push_back(folder);
  };
  if (layout == "native" || dataset.info.sequences.empty()) {
    CaptureSequence all;
    all.name = "all";
    all.frame_ids = frame_ids(dataset);
    write(all, out);
  } else {
    for (const CaptureSequence& sequence : dataset.info.sequences) {
      write(sequence, out / sequence.name);
    }
  }
  if (std::string held = held_out_sentence(dataset, target); layout != "native" && !held.empty()) {
    report.lost.push_back(std::move(held));
  }
  if (layout != "native" && !dataset.info.consent.empty()) {
    report.consent = out / kConsentFile;
    write_file_atomically(report.consent, consent_toml(dataset.info.consent));
  }
  return report;
}

LayoutReport write_layout(const fs::path& capture, const std::string& layout, const fs::path& out) {
  DatasetOptions options;
  options.layout = "native";
  return write_layout(open_dataset(capture, options), layout, out);
}

}  // namespace atelier
