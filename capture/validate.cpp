#include "capture/validate.h"

#include <algorithm>

#include "capture/check_cameras.h"
#include "capture/check_consent.h"
#include "capture/check_keypoints.h"
#include "capture/check_labels.h"
#include "capture/sentence.h"
#include "capture/settle_advice.h"
#include "core/printable.h"
#include "core/seal/minisign.h"
#include "core/split_text.h"

namespace atelier {
namespace {

std::vector<Finding> check_consent(const Dataset& dataset) {
  if (dataset.info.consent.empty()) {
    return {{Severity::Warning, "consent-none", dataset.root.string(), "no consent is recorded",
             "state who, scope and until in a [[consent]] of capture.toml"}};
  }
  std::vector<Finding> findings = check_ended_consent(dataset);
  for (const Consent& one : dataset.info.consent) {
    if (one.key.empty() && one.signature.empty()) {
      continue;
    }
    const std::string problem = signature_problem(consent_statement(one), one.signature, one.key);
    if (!problem.empty()) {
      findings.push_back({Severity::Error, "consent-signature", dataset.root.string(),
                          "the consent of " + one.who + " (" + one.scope + ") " + problem,
                          "sign it as it stands now (atelier sign), or put back what was signed"});
    }
  }
  return findings;
}

/// What no check of single cameras and frames sees: too few cameras, nothing to look at, frame
/// rates of no recording.
std::vector<Finding> check_rig(const Dataset& dataset) {
  std::vector<Finding> findings;
  const std::string root = dataset.root.string();
  const std::vector<std::string>& held = dataset.info.held_out_cameras;
  const auto open =
      std::count_if(dataset.cameras.begin(), dataset.cameras.end(), [&](const Camera& camera) {
        return std::find(held.begin(), held.end(), camera.id) == held.end();
      });
  const std::string all = std::to_string(dataset.cameras.size());
  if (open == 0) {
    findings.push_back({Severity::Error, "cameras-held-out", root,
                        "all " + all + " cameras are held out, so that no stage may open an image",
                        "take some from held_out_cameras in capture.toml"});
  } else if (open == 1) {
    findings.push_back(
        {dataset.calibrated ? Severity::Error : Severity::Warning, "cameras-few", root,
         dataset.cameras.size() == 1 ? "there is one camera alone"
                                     : "all but one of " + all + " cameras are held out",
         "two cameras at least must see each part of the person"});
  }
  const std::vector<int>& held_frames = dataset.info.held_out_frames;
  const std::vector<int> all_frames = frame_ids(dataset);
  if (!all_frames.empty() && std::all_of(all_frames.begin(), all_frames.end(), [&](int frame) {
        return std::find(held_frames.begin(), held_frames.end(), frame) != held_frames.end();
      })) {
    findings.push_back({Severity::Error, "frames-held-out", root,
                        "all " + counted(std::ssize(all_frames), "frame") +
                            " are held out, so that no stage may open an image",
                        "take some from held_out_frames in capture.toml"});
  }
  const bool any =
      std::any_of(dataset.frames.begin(), dataset.frames.end(), [](const CameraFrames& frames) {
        return !frames.images.empty() || !frames.keypoints.empty();
      });
  if (!any) {
    findings.push_back({Severity::Error, "no-frames", root,
                        "there is no image and no detection of any camera",
                        "put images where the layout has them (docs/reference/formats.md)"});
  }
  constexpr double kSlow = 0.5;
  constexpr double kFast = 1000;
  for (const CaptureSequence& sequence : dataset.info.sequences) {
    if (sequence.frame_ids.size() > 1 && !(sequence.fps >= kSlow && sequence.fps <= kFast)) {
      findings.push_back(
          {Severity::Error, "fps-odd", root,
           sentence("sequence %.60s has %g frames a second", sequence.name.c_str(), sequence.fps),
           "no person is recorded so; --capture.fps says how many there are"});
    }
  }
  return findings;
}

/// Joins findings of two checks on one place; a camera that the keypoints explain is not judged by
/// its direction of view as well.
void merge(std::vector<Finding>& findings) {
  const auto explained = [&](const std::string& place) {
    return std::any_of(findings.begin(), findings.end(), [&](const Finding& finding) {
      return finding.place == place &&
             (finding.code.starts_with("extrinsic-") || finding.code == "camera-unit" ||
              finding.code == "intrinsics-scale" || finding.code == "principal-point-swapped");
    });
  };
  std::vector<Finding> kept;
  for (const Finding& finding : findings) {
    const bool guess = finding.code == "camera-looks-away" || finding.code == "cameras-apart" ||
                       finding.code == "camera-focal" || finding.code == "camera-principal-point";
    const bool twice = std::any_of(kept.begin(), kept.end(), [&](const Finding& other) {
      return other.code == finding.code &&
             (other.place == finding.place || other.place.starts_with(finding.place + " "));
    });
    if (!twice && !(guess && (explained(finding.place) || explained("")))) {
      kept.push_back(finding);
    }
  }
  findings = std::move(kept);
}

/// Takes away what was a guess and what detections refute: masks taken for inverted by their rim,
/// as in a close view, and turns taken for wrong because views stand on their head.
void settle_doubts(std::vector<Finding>& findings, const KeypointCheck& keypoints,
                   const LabelCheck& labels) {
  std::erase_if(findings, [&](const Finding& finding) {
    if (finding.code == "mask-inverted") {
      return std::any_of(
          labels.sound_masks.begin(), labels.sound_masks.end(),
          [&](const std::string& id) { return finding.place.starts_with(id + " "); });
    }
    return finding.code == "image-upside-down" && keypoints.calibration_fits &&
           std::none_of(keypoints.findings.begin(), keypoints.findings.end(),
                        [&](const Finding& other) {
                          return other.severity != Severity::Note && other.place == finding.place;
                        });
  });
}

}  // namespace

std::vector<std::string> settings_of(const std::vector<Finding>& findings) {
  // "--capture.sync cam3=2" and "--capture.sync cam5=1" are one setting of two cameras.
  const auto join = [](std::string& all, const std::string& more) {
    const std::vector<std::string> there = split_text(all, ',');
    for (const std::string& part : split_text(more, ',')) {
      if (std::find(there.begin(), there.end(), part) == there.end()) {
        all += "," + part;
      }
    }
  };
  std::vector<std::pair<std::string, std::string>> settings;
  for (const Finding& finding : findings) {
    const std::size_t space = finding.setting.find(' ');
    if (space == std::string::npos) {
      continue;
    }
    const std::string option = finding.setting.substr(0, space);
    const std::string value = finding.setting.substr(space + 1);
    const auto same = std::find_if(settings.begin(), settings.end(),
                                   [&](const auto& setting) { return setting.first == option; });
    const bool listed = value.find('=') != std::string::npos || option == "--capture.leave-out";
    if (same == settings.end()) {
      settings.emplace_back(option, value);
    } else if (listed) {
      join(same->second, value);
    }
  }
  std::vector<std::string> lines;
  lines.reserve(settings.size());
  for (const auto& [option, value] : settings) {
    lines.emplace_back(option).append(" ").append(value);
  }
  return lines;
}

OptionTable describe(ValidateOptions& options) {
  OptionTable table;
  table.add("frames", describe(options.frames));
  table.add("keypoints", describe(options.keypoints));
  return table;
}

Validation validate(FrameReader& reader, const ValidateOptions& options,
                    const std::function<void(int done, int total)>& told) {
  const Dataset& dataset = reader.dataset();
  Validation validation;
  std::vector<Finding>& findings = validation.findings;
  findings = check_rig(dataset);
  const auto add = [&](const std::vector<Finding>& more) {
    findings.insert(findings.end(), more.begin(), more.end());
  };
  add(dataset.findings);
  add(check_consent(dataset));
  if (dataset.calibrated) {
    add(check_cameras(dataset));
  }
  add(check_frames(reader, options.frames, told));
  validation.keypoints = check_keypoints(reader, options.keypoints);
  add(validation.keypoints.findings);
  const LabelCheck labels = check_labels(reader, validation.keypoints);
  settle_doubts(findings, validation.keypoints, labels);
  add(labels.findings);
  merge(findings);
  findings = settle_advice(std::move(findings), dataset);
  std::stable_sort(findings.begin(), findings.end(), [](const Finding& a, const Finding& b) {
    return static_cast<int>(a.severity) > static_cast<int>(b.severity);
  });
  return validation;
}

}  // namespace atelier
