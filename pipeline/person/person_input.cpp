#include "pipeline/person/person_input.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "capture/ground_truth_scan.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints3d_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/listed_frames.h"
#include "core/parallel.h"
#include "core/printable.h"
#include "core/sequence_archive.h"
#include "core/store/result.h"
#include "core/unknown_value.h"

namespace atelier {
namespace {

constexpr double kNoise = 0.004;  // m, of a keypoint of full confidence
constexpr std::size_t kMaxText = 1 << 24;

bool is_wanted(const PersonPoints& one, int person) {
  return one.id == person || (one.id < 0 && person == 0);
}

/// Returns how many of the keypoints are bridged. `people_shown`: how many people the file shows.
int read_keypoints(const std::filesystem::path& file, const PersonInputOptions& options,
                   Index count, TrackFrame& frame, std::size_t& people_shown) {
  if (!std::filesystem::exists(file)) {
    return 0;
  }
  const std::string text = read_file_text(file, kMaxText);
  const std::vector<PersonPoints> people = parse_keypoints3d(text, file.string());
  people_shown = people.size();
  const std::map<int, std::vector<double>> deviations =
      parse_keypoint_deviations(text, file.string());
  const std::map<int, std::vector<int>> bridged = parse_bridged_keypoints(text, file.string());
  const auto who = std::find_if(people.begin(), people.end(), [&](const PersonPoints& one) {
    return is_wanted(one, options.person);
  });
  if (who == people.end()) {
    return 0;
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
  // A straight line between neighbours says nothing that accelerations do not know better.
  const auto guessed = bridged.find(who->id);
  if (guessed == bridged.end()) {
    return 0;
  }
  for (const int k : guessed->second) {
    frame.deviations[k] = 0;
  }
  return static_cast<int>(guessed->second.size());
}

/// Throws DataError where files of keypoints show people, but in no frame the one of that number.
void check_person(const std::filesystem::path& folder, int person) {
  std::set<int> numbers;
  if (!std::filesystem::is_directory(folder)) {
    return;
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".json") {
      continue;
    }
    const std::string file = entry.path().string();
    for (const PersonPoints& one : parse_keypoints3d(read_file_text(file, kMaxText), file)) {
      if (is_wanted(one, person)) {
        return;
      }
      numbers.insert(std::max(0, one.id));
    }
  }
  if (numbers.empty()) {
    return;
  }
  constexpr std::size_t kShown = 8;
  std::string list;
  std::size_t shown = 0;
  for (const int number : numbers) {
    list += shown == 0 ? "" : ", ";
    if (shown++ == kShown) {
      list += "...";
      break;
    }
    list += std::to_string(number);
  }
  const std::string count =
      numbers.size() == 1 ? "1 person" : std::to_string(numbers.size()) + " people";
  throw UnknownValue(folder.string(), "person", std::to_string(person),
                     "a number that keypoints have; they show " + count + ": " + list);
}

/// Whether a label says anything: what is all background is a scan whose labels nobody filled in.
bool is_known(std::uint8_t label) {
  return static_cast<Label>(label) != Label::Background &&
         static_cast<Label>(label) != Label::Unknown;
}

/// A warning where labels are to be left out, but there is no scan or no point with one of them.
std::vector<Finding> absent_labels(const std::vector<Label>& excluded, bool scanned,
                                   const std::array<std::atomic<bool>, 256>& met) {
  std::string names;
  for (const Label label : excluded) {
    if (met[static_cast<std::uint8_t>(label)]) {
      return {};
    }
    names += (names.empty() ? "" : ", ") + label_name(label);
  }
  if (names.empty()) {
    return {};
  }
  if (!scanned) {
    return {{Severity::Warning, "no-scans", "scans",
             "there are no scans, so clothing cannot be left out by its labels",
             "nothing is left out; scans come from images with masks (atelier masks)"}};
  }
  return {{Severity::Warning, "label-nowhere", "scans", "no point is labelled " + names,
           "nothing is left out; name the garments that are worn with --input.excluded"}};
}

}  // namespace

OptionTable describe(PersonInputOptions& options) {
  OptionTable table;
  table.add("capture", describe(options.capture));
  table.add("scans", options.scans,
            {{"reconstructed", ScanSource::Reconstructed},
             {"ground_truth", ScanSource::Truth},
             {"none", ScanSource::None}},
            "Surfaces that are fitted: reconstructed (by atelier reconstruct), ground truth of a "
            "synthetic capture, or none (keypoints alone)");
  table.add("person", options.person, 0, 1000, "",
            "Number of the person where keypoints have several");
  table.add("keypoint_noise", options.keypoint_noise, 0, 1, "m",
            "Standard deviation of keypoints beyond what the fit expects");
  return table;
}

PersonFiles person_files(const StageRun& run) {
  return {run.input("capture"), run.input("scans"), run.input("keypoints3d")};
}

CaptureInfo person_capture(const PersonFiles& files, const PersonInputOptions& options) {
  CaptureInfo info = open_dataset(files.capture, options.capture).info;
  check_person(files.keypoints / "keypoints3d", options.person);
  return info;
}

void require_person(const std::filesystem::path& workspace, const PersonInputOptions& options) {
  if (options.person == PersonInputOptions{}.person) {
    return;  // whoever there is: nothing was asked for that may be missing
  }
  const std::filesystem::path stage = workspace / "reconstruct";
  const auto current = workspace.empty() ? std::nullopt : current_name(stage);
  if (current) {
    check_person(stage / *current / "keypoints3d", options.person);
  }
}

ScanPart part_of(Label label, const std::vector<Label>& excluded) {
  if (std::find(excluded.begin(), excluded.end(), label) != excluded.end()) {
    return ScanPart::LeftOut;
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

PersonEvidence person_input(const PersonFiles& files, const CaptureInfo& info,
                            const CaptureSequence& sequence, const PersonInputOptions& options,
                            const std::vector<Label>& excluded) {
  PersonEvidence evidence;
  TrackInput& input = evidence.input;
  input.keypoint_names = keypoint_schema(info.keypoint_schema).points;
  input.fps = sequence.fps > 0 ? sequence.fps : 1;
  input.frame_ids = sequence.frame_ids;
  const bool minimal = sequence.kind == "minimal";
  GroundTruth truth;
  if (options.scans == ScanSource::Truth) {
    truth = read_ground_truth(files.capture);
  }
  input.frames.resize(sequence.frame_ids.size());
  std::vector<int> bridged(input.frames.size(), 0);
  std::vector<std::size_t> people(input.frames.size(), 0);
  std::array<std::atomic<bool>, 256> met{};
  std::atomic<bool> unlabelled = false;
  std::atomic<bool> scanned = false;
  parallel_for(static_cast<Index>(input.frames.size()), 1, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f) {
      const int id = sequence.frame_ids[static_cast<std::size_t>(f)];
      TrackFrame& frame = input.frames[static_cast<std::size_t>(f)];
      bridged[static_cast<std::size_t>(f)] =
          read_keypoints(files.keypoints / "keypoints3d" / (frame_name(id) + ".json"), options,
                         static_cast<Index>(input.keypoint_names.size()), frame,
                         people[static_cast<std::size_t>(f)]);
      Mesh scan;
      const std::filesystem::path file = files.scans / "scans" / (frame_name(id) + ".h5");
      if (options.scans == ScanSource::Truth) {
        scan = ground_truth_scan(truth, read_ground_truth_frame(files.capture, truth, id));
      } else if (options.scans == ScanSource::Reconstructed && std::filesystem::exists(file)) {
        scan = read_mesh_archive(file);
      }
      if (scan.vertices.rows() == 0 || scan.faces.rows() == 0) {
        continue;
      }
      scanned = true;
      if (std::none_of(scan.labels.begin(), scan.labels.end(), is_known)) {
        scan.labels.clear();
      }
      std::vector<ScanPart> parts;
      for (const std::uint8_t label : scan.labels) {
        met[label] = true;
        ScanPart part = part_of(static_cast<Label>(label), excluded);
        if (minimal && part == ScanPart::Cloth) {
          part = ScanPart::Skin;
        }
        parts.push_back(part);
      }
      if (parts.empty() && minimal) {
        unlabelled = true;
        parts.assign(static_cast<std::size_t>(scan.vertices.rows()), ScanPart::Skin);
      }
      frame.scan = scan_points(scan, parts);
    }
  });
  std::vector<int> guessed;
  for (std::size_t f = 0; f < bridged.size(); ++f) {
    if (bridged[f] > 0) {
      guessed.push_back(input.frame_ids[f]);
    }
  }
  if (!guessed.empty()) {
    const int count = std::accumulate(bridged.begin(), bridged.end(), 0);
    evidence.findings.push_back(
        {Severity::Note, "keypoints-bridged", "frames " + listed_frames(guessed),
         counted(count, "keypoint") + " seen by no camera, interpolated over time",
         "they count as missing"});
  }
  std::vector<int> crowded;
  for (std::size_t f = 0; f < people.size(); ++f) {
    if (people[f] > 1) {
      crowded.push_back(input.frame_ids[f]);
    }
  }
  if (!crowded.empty() && options.person == 0) {  // as it is where nobody has said one
    evidence.findings.push_back(
        {Severity::Note, "people-several", "frames " + listed_frames(crowded),
         "keypoints show up to " + std::to_string(*std::max_element(people.begin(), people.end())) +
             " people",
         "the first of them, number 0, is taken; --input.person takes another"});
  }
  if (unlabelled) {
    evidence.findings.push_back(
        {Severity::Note, "labels-absent", "scans", "no point has a label",
         "every point is taken as skin, hair and carried objects too; label images "
         "tell them apart (docs/methods/surfaces.md)"});
  }
  for (const Finding& finding :
       minimal ? std::vector<Finding>{} : absent_labels(excluded, scanned, met)) {
    evidence.findings.push_back(finding);
  }
  return evidence;
}

}  // namespace atelier
