#include "capture/try_corrections.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "capture/check_cameras.h"
#include "capture/explain_rig.h"
#include "capture/seen_person.h"
#include "capture/sentence.h"
#include "capture/validate.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/split_text.h"
#include "core/usage_error.h"

namespace atelier {
namespace {

using Corrections = std::map<std::string, std::string>;

constexpr std::size_t kTriedFrames = 24;  // of which detections are held against the calibration
constexpr std::size_t kMostTries = 24;    // beyond, options are taken away as a whole

/// Corrections without one of them, or with another value of it.
struct Try {
  std::string without;  ///< "--capture.sync cam3=-4"
  std::string camera;   ///< that it is of; "" of all or several
  bool other_value = false;
  std::string rest;  ///< the option as it is then: "--capture.sync cam5=2"; "" without it
  Corrections corrections;
};

std::string typed_option(std::string option) {
  std::replace(option.begin(), option.end(), '_', '-');
  return "--capture." + option;
}

std::string comma_joined(const std::vector<std::string>& parts) {
  std::string text;
  for (const std::string& part : parts) {
    text += (text.empty() ? "" : ",") + part;
  }
  return text;
}

/// Parts of both lists, of one camera the later: "cam3=-4,cam5=2".
std::string joined_parts(const std::string& set, const std::string& more) {
  std::vector<std::string> parts = split_text(more, ',');
  const auto camera_of = [](const std::string& part) { return part.substr(0, part.find('=')); };
  for (const std::string& part : split_text(set, ',')) {
    if (!part.empty() && std::none_of(parts.begin(), parts.end(), [&](const std::string& other) {
          return camera_of(other) == camera_of(part);
        })) {
      parts.push_back(part);
    }
  }
  return comma_joined(parts);
}

Try try_of(const Corrections& set, const std::string& option, std::vector<std::string> parts,
           std::size_t at, const std::string& instead) {
  const std::string typed = typed_option(option) + " ";
  Try result;
  result.without = typed + parts[at];
  const std::string camera = parts[at].substr(0, parts[at].find('='));
  result.camera = camera == "all" ? "" : camera;
  if (instead.empty()) {
    parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(at));
  } else {
    parts[at] = camera + "=" + instead;
    result.other_value = true;
  }
  result.corrections = set;
  const std::string now = comma_joined(parts);
  if (now.empty()) {
    result.corrections.erase(option);
  } else {
    result.corrections[option] = now;
    result.rest = typed + now;
  }
  return result;
}

/// Every correction taken away by itself; of images that are turned also each other turn. Cameras
/// that are left out are nothing that could fit.
std::vector<Try> tries_of(const Corrections& set) {
  std::vector<Try> tries;
  for (const auto& [option, text] : set) {
    if (option == "leave_out") {
      continue;
    }
    const std::vector<std::string> parts = split_text(text, ',');
    if (tries.size() + parts.size() > kMostTries) {
      tries.push_back(try_of(set, option, {text}, 0, ""));
      tries.back().camera.clear();
      continue;
    }
    for (std::size_t at = 0; at < parts.size(); ++at) {
      tries.push_back(try_of(set, option, parts, at, ""));
      for (const char* turn : {"90", "180", "270"}) {
        if (option == "turned" && !parts[at].ends_with(std::string("=") + turn)) {
          tries.push_back(try_of(set, option, parts, at, turn));
        }
      }
    }
  }
  return tries;
}

/// How well a capture fits.
struct Sound {
  std::ptrdiff_t errors = 0;  ///< found in its files and cameras
  std::optional<RigFit> fit;  ///< where there are detections
};

std::vector<int> frames_to_try(const Dataset& dataset) {
  std::vector<int> frames = frame_ids(dataset);
  std::erase_if(frames, [&](int frame) {
    return std::none_of(
        dataset.frames.begin(), dataset.frames.end(),
        [&](const CameraFrames& camera) { return camera.keypoints.contains(frame); });
  });
  const std::size_t step = std::max<std::size_t>(1, frames.size() / kTriedFrames);
  std::vector<int> some;
  for (std::size_t f = 0; f < frames.size() && some.size() < kTriedFrames; f += step) {
    some.push_back(frames[f]);
  }
  return some;
}

Sound soundness(const Dataset& dataset, const std::vector<int>& frames,
                const TriangulationOptions& options) {
  Sound sound;
  std::vector<Finding> findings = dataset.findings;
  if (dataset.calibrated) {
    const std::vector<Finding> cameras = check_cameras(dataset);
    findings.insert(findings.end(), cameras.begin(), cameras.end());
  }
  sound.errors = std::count_if(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.severity == Severity::Error;
  });
  if (!dataset.calibrated || dataset.info.keypoint_schema.empty() || dataset.cameras.size() < 2 ||
      frames.empty()) {
    return sound;
  }
  FrameReader reader(dataset);
  std::vector<Finding> ignored;
  const SeenPerson seen = read_person(reader, frames, options, ignored);
  sound.fit = rig_fit(seen, options);
  return sound;
}

/// @param less  share of the error below which it is less
bool fits_better(const RigFit& then, const RigFit& now, double less) {
  constexpr double kAsMany = 0.02;
  return then.unsupported.size() == now.unsupported.size() &&
         (surely_less(then.unsupported, now.unsupported) ||
          (then.share > now.share - kAsMany && then.error < less * now.error &&
           surely_less(then.points, now.points)));
}

/// Wrong readings of lenses shift pixels by less than detectors err.
double share_of_less(const Try& tried) {
  return tried.without.starts_with("--capture.distortion ") ? 0.98 : 0.9;
}

bool mends(const Sound& then, const Sound& now, double less) {
  const bool both = then.fit && now.fit;
  if (both && fits_better(*then.fit, *now.fit, less)) {
    return then.errors <= now.errors;
  }
  return then.errors < now.errors && !(both && fits_better(*now.fit, *then.fit, less));
}

/// Of two that mend: the one that fits better, then the plainer one, which comes first.
bool is_better(const Sound& a, const Sound& b) {
  if (a.fit && b.fit) {
    constexpr double kMore = 0.03;
    constexpr double kLess = 0.9;
    if (a.fit->share > b.fit->share + kMore) {
      return true;
    }
    if (a.fit->share > b.fit->share - kMore && a.fit->error < kLess * b.fit->error) {
      return true;
    }
  }
  return a.errors < b.errors;
}

Finding wrong_correction(const Try& tried, const Sound& now, const Sound& then) {
  const std::string otherwise = tried.other_value ? "with " + tried.rest + " " : "without it ";
  const bool by_fit = then.fit && now.fit && fits_better(*then.fit, *now.fit, share_of_less(tried));
  const std::string what = by_fit ? "of the detections " + fit_text(*now.fit) +
                                        ", agree with it, " + otherwise + fit_text(*then.fit)
                                  : "the calibration has " + counted(now.errors, "error") +
                                        " with it, " + otherwise +
                                        (then.errors > 0 ? std::to_string(then.errors) : "none");
  std::string advice = "leave it out";
  if (tried.other_value) {
    advice = "say " + tried.rest + " instead";
  } else if (!tried.rest.empty()) {
    advice += ", and give " + tried.rest + " alone";
  }
  return {Severity::Error, "correction-wrong",
          tried.camera,    tried.without + " makes it worse: " + what,
          advice,          ""};
}

/// Whether two captures that differ in corrections come to the same: cameras, and of what each
/// camera has the frames and how they are read.
bool read_alike(const Dataset& a, const Dataset& b) {
  if (a.cameras.size() != b.cameras.size()) {
    return false;
  }
  for (std::size_t c = 0; c < a.cameras.size(); ++c) {
    const Camera& camera = a.cameras[c];
    const Camera& other = b.cameras[c];
    const bool straight = camera.distortion == std::array<double, 8>{};
    const bool same = camera.id == other.id && camera.width == other.width &&
                      camera.height == other.height && camera.fx == other.fx &&
                      camera.fy == other.fy && camera.cx == other.cx && camera.cy == other.cy &&
                      camera.distortion == other.distortion &&
                      (straight || camera.distortion_model == other.distortion_model) &&
                      camera.camera_from_world_rotation == other.camera_from_world_rotation &&
                      camera.camera_from_world_translation == other.camera_from_world_translation;
    const CameraFrames& frames = a.frames[c];
    const CameraFrames& others = b.frames[c];
    const bool masks = frames.masks.empty() || frames.inverted_masks == others.inverted_masks;
    const bool rows = frames.keypoints.empty() || frames.reading == others.reading;
    if (!same || !masks || !rows) {
      return false;
    }
    for (const auto& kind : {&CameraFrames::images, &CameraFrames::masks, &CameraFrames::labels,
                             &CameraFrames::keypoints}) {
      if ((frames.*kind).frames() != (others.*kind).frames()) {
        return false;
      }
    }
  }
  return true;
}

Finding idle_correction(const Try& tried) {
  std::string why = "what it asks for is so already";
  if (tried.without.starts_with("--capture.masks ")) {
    why = "there are no masks; of labels the background is said by their numbers";
  } else if (tried.without.starts_with("--capture.distortion ")) {
    why = "the calibration has no such distortion";
  } else if (tried.without.starts_with("--capture.keypoints ")) {
    why = "there are no 2D keypoints";
  }
  return {Severity::Warning, "correction-idle",
          tried.camera,      tried.without + " changes nothing: " + why,
          "leave it out",    ""};
}

/// Corrections with those that findings advise.
Corrections advised_corrections(Corrections set, const std::vector<Finding>& findings) {
  constexpr std::string_view kPrefix = "--capture.";
  for (const std::string& setting : settings_of(findings)) {
    const std::size_t space = setting.find(' ');
    std::string option = setting.substr(0, space).substr(kPrefix.size());
    std::replace(option.begin(), option.end(), '-', '_');
    if (option == "leave_out" || setting.find('=') != std::string::npos) {  // of cameras
      set[option] = joined_parts(set[option], setting.substr(space + 1));
    }
  }
  return set;
}

}  // namespace

Dataset without_wrong_corrections(Dataset dataset, const Reopen& reopen,
                                  const TriangulationOptions& options) {
  std::vector<Finding> wrong;
  std::vector<Finding> idle;
  const std::vector<int> frames =
      dataset.corrections.empty() ? std::vector<int>() : frames_to_try(dataset);
  for (bool mended = true; mended && !dataset.corrections.empty() && wrong.size() < kMostTries;) {
    mended = false;
    const Sound now = soundness(dataset, frames, options);
    std::optional<std::pair<Try, Sound>> best;
    Dataset best_dataset;
    idle.clear();
    for (const Try& tried : tries_of(dataset.corrections)) {
      try {
        Dataset without = reopen(tried.corrections);
        // One that silences what the files say otherwise is not idle.
        if (!tried.other_value && read_alike(without, dataset) &&
            without.findings.size() <= dataset.findings.size()) {
          idle.push_back(idle_correction(tried));
          continue;
        }
        const Sound then = soundness(without, frames, options);
        if (mends(then, now, share_of_less(tried)) && (!best || is_better(then, best->second))) {
          best = {tried, then};
          best_dataset = std::move(without);
        }
      } catch (const DataError&) {  // so it cannot be meant
      } catch (const UsageError&) {
      }
    }
    if (best) {
      wrong.push_back(wrong_correction(best->first, now, best->second));
      dataset = std::move(best_dataset);
      mended = true;
    }
  }
  wrong.insert(wrong.end(), idle.begin(), idle.end());
  dataset.findings.insert(dataset.findings.begin(), wrong.begin(), wrong.end());
  return dataset;
}

std::vector<Finding> with_advice_that_joins(std::vector<Finding> findings, const Dataset& dataset,
                                            const Reopen& reopen,
                                            const TriangulationOptions& options) {
  const Corrections all = advised_corrections(dataset.corrections, findings);
  if (all == dataset.corrections) {
    return findings;
  }
  const std::vector<int> frames = frames_to_try(dataset);
  const Sound now = soundness(dataset, frames, options);
  const auto joins = [&](const Corrections& some) {
    try {
      const Sound then = soundness(reopen(some), frames, options);
      // Errors are of images 1000 rows high, which a turn changes: only the share tells of both.
      constexpr double kFewer = 0.1;
      return now.fit && then.fit ? then.fit->share >= now.fit->share - kFewer
                                 : then.errors <= now.errors;
    } catch (const DataError&) {
    } catch (const UsageError&) {
    }
    return false;
  };
  if (joins(all)) {
    return findings;
  }
  Corrections set = dataset.corrections;
  for (Finding& finding : findings) {
    const Corrections more = advised_corrections(set, {finding});
    if (more == set) {
      continue;
    }
    if (joins(more)) {
      set = more;
    } else {
      finding.advice += "; not beside the other settings: give those, and validate again";
      finding.setting.clear();
    }
  }
  return findings;
}

}  // namespace atelier
