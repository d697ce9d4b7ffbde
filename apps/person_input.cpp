#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)

#include "apps/person_input.h"

#include <algorithm>
#include <map>

#include "apps/truth_scan.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints3d_file.h"
#include "capture/truth_archive.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/parallel.h"
#include "core/sequence_archive.h"

namespace atelier {
namespace {

constexpr double kNoise = 0.004;  // m, of a keypoint of full confidence
constexpr std::size_t kMostText = 1 << 24;

void read_keypoints(const std::filesystem::path& file, const PersonInputOptions& options,
                    Index count, TrackFrame& frame) {
  if (!std::filesystem::exists(file)) {
    return;
  }
  const std::string text = read_file_text(file, kMostText);
  const std::vector<PersonPoints> people = parse_keypoints3d(text, file.string());
  const std::map<int, std::vector<double>> deviations =
      parse_keypoint_deviations(text, file.string());
  const auto who = std::find_if(people.begin(), people.end(), [&](const PersonPoints& one) {
    return one.id == options.person || (one.id < 0 && options.person == 0);
  });
  if (who == people.end()) {
    return;
  }
  if (who->points.rows() != count) {
    throw DataError(file.string(), "keypoints3d", std::to_string(who->points.rows()) + " points",
                    std::to_string(count) + ", as the capture's keypoint schema has");
  }
  frame.keypoints = who->points.leftCols<3>();
  frame.deviations = Eigen::VectorXd::Zero(count);
  const auto stated = deviations.find(who->id);
  for (Index k = 0; k < count; ++k) {
    const double confidence = std::clamp(who->points(k, 3), 0.0, 1.0);
    if (confidence > 0) {
      const double own = stated != deviations.end() ? stated->second[static_cast<std::size_t>(k)]
                                                    : kNoise / std::max(0.1, confidence);
      frame.deviations[k] = std::max(1e-4, own) + options.keypoint_noise;
    }
  }
}

}  // namespace

OptionTable describe(PersonInputOptions& options) {
  OptionTable table;
  table.add("capture", describe(options.capture));
  table.add("scans", options.scans,
            {{"reconstructed", ScanSource::Reconstructed},
             {"truth", ScanSource::Truth},
             {"none", ScanSource::None}},
            "surfaces of reconstruct, the true ones of a synthetic capture, or keypoints alone");
  table.add("person", options.person, 0, 1000, "",
            "number of the person where keypoints have several");
  table.add("keypoint_noise", options.keypoint_noise, 0, 1, "m",
            "of a keypoint, on top of what the fit expects");
  table.add("excluded", options.excluded, std::vector<std::string>{},
            "labels whose clothing exclude = labels leaves out, with commas between");
  return table;
}

PersonFiles person_files(const StageRun& run) {
  return {run.input("capture"), run.input("scans"), run.input("keypoints3d")};
}

CaptureInfo person_capture(const PersonFiles& files, const PersonInputOptions& options) {
  return open_dataset(files.capture, options.capture).info;
}

ScanPart part_of(Label label, const std::vector<Label>& excluded) {
  if (std::find(excluded.begin(), excluded.end(), label) != excluded.end()) {
    return ScanPart::Ignored;
  }
  switch (label) {
    case Label::Skin:
      return ScanPart::Skin;
    case Label::Background:
    case Label::Hair:
    case Label::Other:
      return ScanPart::Ignored;
    case Label::Upper:
    case Label::Lower:
    case Label::Dress:
    case Label::Outer:
    case Label::Shoes:
    case Label::Unknown:
      return ScanPart::Cloth;
  }
  return ScanPart::Cloth;
}

std::vector<Label> labels_of(const std::string& list) {
  std::vector<Label> labels;
  std::string rest = list;
  while (!rest.empty()) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const std::string name = rest.substr(0, comma);
    rest = comma < rest.size() ? rest.substr(comma + 1) : "";
    const std::optional<Label> label = label_of(name);
    if (!label) {
      throw DataError("", "excluded", "'" + name.substr(0, 40) + "'",
                      "names of labels: skin, hair, upper, lower, dress, outer, shoes, other");
    }
    labels.push_back(*label);
  }
  return labels;
}

TrackInput person_input(const PersonFiles& files, const CaptureInfo& info,
                        const CaptureSequence& sequence, const PersonInputOptions& options,
                        const std::vector<Label>& excluded) {
  TrackInput input;
  input.keypoint_names = keypoint_schema(info.keypoint_schema).points;
  input.fps = sequence.fps > 0 ? sequence.fps : 1;
  input.frame_ids = sequence.frame_ids;
  const bool minimal = sequence.kind == "minimal";
  CaptureTruth truth;
  if (options.scans == ScanSource::Truth) {
    truth = read_capture_truth(files.capture);
  }
  input.frames.resize(sequence.frame_ids.size());
  parallel_for(static_cast<Index>(input.frames.size()), 1, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f) {
      const int id = sequence.frame_ids[static_cast<std::size_t>(f)];
      TrackFrame& frame = input.frames[static_cast<std::size_t>(f)];
      read_keypoints(files.keypoints / "keypoints3d" / (frame_name(id) + ".json"), options,
                     static_cast<Index>(input.keypoint_names.size()), frame);
      Mesh scan;
      const std::filesystem::path file = files.scans / "scans" / (frame_name(id) + ".h5");
      if (options.scans == ScanSource::Truth) {
        scan = truth_scan(truth, read_truth_frame(files.capture, truth, id));
      } else if (options.scans == ScanSource::Reconstructed && std::filesystem::exists(file)) {
        scan = read_mesh_archive(file);
      }
      if (scan.vertices.rows() == 0 || scan.faces.rows() == 0) {
        continue;
      }
      std::vector<ScanPart> parts;
      for (const std::uint8_t label : scan.labels) {
        ScanPart part = part_of(static_cast<Label>(label), excluded);
        if (minimal && part == ScanPart::Cloth) {
          part = ScanPart::Skin;
        }
        parts.push_back(part);
      }
      if (parts.empty() && minimal) {
        parts.assign(static_cast<std::size_t>(scan.vertices.rows()), ScanPart::Skin);
      }
      frame.scan = scan_points(scan, parts);
    }
  });
  return input;
}

}  // namespace atelier

#endif
