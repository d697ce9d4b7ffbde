#include "capture/validate.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "capture/camera_conventions.h"
#include "capture/check_cameras.h"
#include "capture/check_consent.h"
#include "capture/check_keypoints.h"
#include "capture/check_labels.h"
#include "capture/image_turns.h"
#include "capture/join_alike.h"
#include "capture/sentence.h"
#include "capture/settle_advice.h"
#include "capture/settle_convention.h"
#include "capture/stored_upright.h"
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

/// Cameras whose frames have numbers of their own: no frame is in two of them.
std::vector<Finding> check_common_frames(const Dataset& dataset) {
  std::vector<std::size_t> filmed;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    if (!dataset.frames[c].images.empty()) {
      filmed.push_back(c);
    }
  }
  std::set<int> seen;
  for (const std::size_t c : filmed) {
    for (const auto& [frame, place] : dataset.frames[c].images) {
      if (!seen.insert(frame).second) {
        return {};
      }
    }
  }
  if (filmed.size() < 2) {
    return {};
  }
  const auto first = [&](std::size_t c) { return dataset.frames[c].images.begin()->first; };
  std::string shifts;
  for (const std::size_t c : filmed) {
    if (c != filmed.front()) {
      shifts += (shifts.empty() ? "" : ",") + dataset.cameras[c].id + "=" +
                std::to_string(first(filmed.front()) - first(c));
    }
  }
  return {{Severity::Error, "frames-apart", dataset.root.string(),
           "no frame number is in two cameras: each counts its own",
           "number the images alike, or, if the cameras began together, move their numbers",
           "--capture.sync " + shifts}};
}

/// Sequences of which every frame is held out, beside others.
std::vector<Finding> check_held_out_sequences(const Dataset& dataset) {
  std::vector<Finding> findings;
  const std::set<int> held(dataset.info.held_out_frames.begin(),
                           dataset.info.held_out_frames.end());
  for (const CaptureSequence& sequence : dataset.info.sequences) {
    if (dataset.info.sequences.size() > 1 && !sequence.frame_ids.empty() &&
        std::all_of(sequence.frame_ids.begin(), sequence.frame_ids.end(),
                    [&](int frame) { return held.contains(frame); })) {
      findings.push_back({Severity::Warning, "sequence-held-out", dataset.root.string(),
                          "every frame of the sequence " + printable(sequence.name) +
                              " is held out: what is made of it has none to learn from",
                          "take some from held_out_frames in capture.toml"});
    }
  }
  return findings;
}

/// Images by which nobody is found: no frame that two open cameras have with a mask or labels, and
/// no 2D keypoints.
std::vector<Finding> check_evidence(const Dataset& dataset) {
  const std::vector<std::string>& held = dataset.info.held_out_cameras;
  std::map<int, int> masked;  // cameras, by frame
  bool pictures = false;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const CameraFrames& frames = dataset.frames[c];
    if (!frames.keypoints.empty()) {
      return {};
    }
    if (std::find(held.begin(), held.end(), dataset.cameras[c].id) != held.end()) {
      continue;
    }
    for (const auto& [frame, place] : frames.images) {
      pictures = true;
      if ((frames.masks.contains(frame) || frames.labels.contains(frame)) && ++masked[frame] > 1) {
        return {};
      }
    }
  }
  if (!pictures) {
    return {};
  }
  return {
      {Severity::Warning, "images-alone", dataset.root.string(),
       masked.empty()
           ? "there are images, and no masks, labels or 2D keypoints of any camera: every stage "
             "but validate is skipped"
           : "no frame has masks or labels of two cameras, and there are no 2D keypoints: every "
             "stage but validate is skipped",
       "atelier detect finds keypoints (and masks, with --masks), atelier masks tells people "
       "from the background"}};
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
  for (const auto& more :
       {check_common_frames(dataset), check_held_out_sequences(dataset), check_evidence(dataset)}) {
    findings.insert(findings.end(), more.begin(), more.end());
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
                       finding.code == "extrinsics-untold" ||
                       finding.code == "extrinsics-doubtful" || finding.code == "camera-focal" ||
                       finding.code == "camera-principal-point";
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

/// Whether a camera has detections, and none of them says anything against its calibration.
bool is_proven(const Dataset& dataset, const KeypointCheck& keypoints, std::size_t c) {
  constexpr double kConfident = 0.3;
  const bool detects =
      std::any_of(keypoints.detections.begin(), keypoints.detections.end(),
                  [&](const std::vector<Keypoints2d>& cameras) {
                    return cameras[c].rows() > 0 && cameras[c].col(2).maxCoeff() > kConfident;
                  });
  return keypoints.calibration_fits && detects &&
         std::none_of(
             keypoints.findings.begin(), keypoints.findings.end(), [&](const Finding& finding) {
               return finding.severity != Severity::Note && finding.place == dataset.cameras[c].id;
             });
}

/// The turn that a setting such as "--capture.turned cam3=90" asks for a camera; 0: none.
int degrees_in(const std::string& setting, const std::string& camera) {
  for (const std::string& part : split_text(setting.substr(setting.find(' ') + 1), ',')) {
    if (part.starts_with(camera + "=")) {
      return part == camera + "=90" ? 90 : part == camera + "=180" ? 180 : 270;
    }
  }
  return 0;
}

/// The turn of keypoints that findings advise for a camera, or for all; 0: none.
int advised_keypoint_turn(const std::vector<Finding>& findings, const std::string& camera) {
  for (const Finding& finding : findings) {
    for (const std::string& whose : {camera, std::string("all")}) {
      const std::string start = "--capture.keypoints " + whose + "=turned_";
      if (finding.code == "keypoints-turned" && finding.setting.starts_with(start)) {
        const std::string degrees = finding.setting.substr(start.size());
        return degrees == "90" ? 90 : degrees == "180" ? 180 : 270;
      }
    }
  }
  return 0;
}

/// Keypoints of images that were turned since the calibration are turned against it as well: where
/// sizes say so, the turn of the images alone is advised, and the way round that the keypoints
/// tell.
void explain_by_images(std::vector<Finding>& findings, const Dataset& dataset) {
  std::set<std::string> explained;
  for (Finding& finding : findings) {
    const Index c = camera_index(dataset, finding.place);
    if (finding.code != "image-turned" || finding.severity != Severity::Error || c < 0 ||
        dataset.frames[static_cast<std::size_t>(c)].turn % 4 != 0) {
      continue;
    }
    const int told = advised_keypoint_turn(findings, finding.place);
    if (told % 180 != 0 && finding.setting.empty()) {
      finding.setting = "--capture.turned " + finding.place + "=" + std::to_string(told);
      finding.advice = "say so, or write the images as they were calibrated";
    }
    if (told != 0 && told == degrees_in(finding.setting, finding.place)) {
      explained.insert(finding.place);
    }
  }
  std::erase_if(findings, [&](const Finding& finding) {
    const bool all = finding.setting.starts_with("--capture.keypoints all=");
    return finding.code == "keypoints-turned" &&
           (explained.contains(finding.place) ||
            (all && explained.size() == dataset.cameras.size()));
  });
}

/// An EXIF that says to turn images by half, of cameras that were calibrated upright: where images
/// as they are stored, or masks of them, show the person where the keypoints have it, it is the
/// EXIF that is wrong, of every such camera if of none it is right.
void settle_stale_exif(std::vector<Finding>& findings, FrameReader& reader,
                       const KeypointCheck& keypoints, const LabelCheck& labels) {
  const Dataset& dataset = reader.dataset();
  std::vector<std::pair<Finding*, int>> doubted;  // and which way up the images are stored
  bool some_upright = false;
  bool some_turned = false;
  for (Finding& finding : findings) {
    const Index found = camera_index(dataset, finding.place);
    if (finding.code != "image-turned" || found < 0) {
      continue;
    }
    const auto c = static_cast<std::size_t>(found);
    const CameraFrames& frames = dataset.frames[c];
    if (quarters_shown(frames.image_orientation) != 2 || frames.turn % 4 != 0 ||
        degrees_in(finding.setting, finding.place) != 180 || !is_proven(dataset, keypoints, c)) {
      continue;
    }
    const bool by_masks =
        !frames.masks.empty() && std::find(labels.sound_masks.begin(), labels.sound_masks.end(),
                                           finding.place) != labels.sound_masks.end();
    const int upright = by_masks ? 1 : upright_as_stored(reader, keypoints, c);
    some_upright = some_upright || upright > 0;
    some_turned = some_turned || upright < 0;
    doubted.emplace_back(&finding, upright);
  }
  for (const auto& [finding, upright] : doubted) {
    if (upright > 0 || (upright == 0 && some_upright && !some_turned)) {
      finding->severity = Severity::Warning;
      finding->code = "image-orientation";
      finding->what =
          "the EXIF of its images says to show them turned by 180 degrees, and they show the "
          "person "
          "upright as they are stored, where the keypoints have it: the EXIF is wrong";
      finding->advice = "say that they are not turned, or write them without it";
      finding->setting = "--capture.turned " + finding->place + "=0";
    }
  }
}

/// What keypoints say of turns of images. Those that fit a calibration of images that were turned
/// since are of the images as they were calibrated: with the images' turn theirs must be said.
/// Those that fit turned as it was set prove that turn. Of a turn that EXIF says, of a camera
/// that was calibrated as its images are stored, the keypoints are of the images as they are shown.
void settle_turns(std::vector<Finding>& findings, const Dataset& dataset,
                  const KeypointCheck& keypoints) {
  // Quarters by which EXIF brings a camera upright that was calibrated as its images are stored;
  // 0: none.
  const auto lies = [&](std::size_t c) {
    constexpr double kUp = 0.7;
    const int quarters = quarters_shown(dataset.frames[c].image_orientation);
    const bool upright =
        quarters > 0 &&
        -turned_camera(dataset.cameras[c], quarters).camera_from_world_rotation(1, 1) > kUp;
    return upright ? quarters : 0;
  };
  std::vector<int> lying;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    lying.push_back(lies(c));
  }
  const bool all_alike = !lying.empty() && lying.front() > 0 &&
                         std::equal(lying.begin() + 1, lying.end(), lying.begin());
  const auto turned_by = [](int quarters, const std::string& camera) {
    return "--capture.turned " + camera + "=" + std::to_string(90 * quarters);
  };
  // The cameras whose turn EXIF says, as a setting names them, and the quarters; "" where a finding
  // is of none.
  const auto told_by_exif = [&](const Finding& finding) -> std::pair<std::string, int> {
    if (finding.code != "camera-turned") {
      return {};
    }
    if (all_alike && finding.setting == turned_by(lying.front(), "all")) {
      return {"all", lying.front()};
    }
    const Index c = camera_index(dataset, finding.place);
    const int quarters = c < 0 ? 0 : lying[static_cast<std::size_t>(c)];
    return quarters > 0 && finding.setting == turned_by(quarters, finding.place)
               ? std::pair(finding.place, quarters)
               : std::pair<std::string, int>();
  };
  std::vector<Finding> settled;
  for (Finding& finding : findings) {
    if (const auto [cameras, quarters] = told_by_exif(finding); !cameras.empty()) {
      const std::string degrees = std::to_string(90 * quarters);
      finding.code = "keypoints-turned";
      finding.what = std::string(cameras == "all" ? "all" : "its") +
                     " keypoints are of the images as their EXIF says to show them, turned by " +
                     degrees + " degrees";
      finding.advice = "read them so";
      finding.setting = "--capture.keypoints " + cameras + "=turned_" + degrees;
    }
    const Index c = camera_index(dataset, finding.place);
    if (c < 0 || finding.code != "image-turned") {
      settled.push_back(std::move(finding));
      continue;
    }
    const CameraFrames& frames = dataset.frames[static_cast<std::size_t>(c)];
    const Camera& camera = dataset.cameras[static_cast<std::size_t>(c)];
    const bool proven = is_proven(dataset, keypoints, static_cast<std::size_t>(c));
    if (proven && frames.turn % 4 != 0 && finding.setting.empty()) {
      continue;
    }
    const std::string setting = finding.setting;
    settled.push_back(std::move(finding));
    if (proven && frames.turn % 4 == 0 && setting.starts_with("--capture.turned ")) {
      const int back = 360 - degrees_in(setting, camera.id);
      settled.push_back({Severity::Error, "keypoints-turned", camera.id,
                         "its keypoints fit the calibration as it is: they are of the images as "
                         "they were calibrated, which the files hold turned",
                         "say both turns: that of the images and that of the keypoints",
                         "--capture.keypoints " + camera.id + "=turned_" + std::to_string(back)});
    } else if (proven && frames.turn % 4 == 0 && settled.back().severity == Severity::Error) {
      settled.back().advice +=
          "; its keypoints fit the calibration as it is, so that theirs is to be said as well: "
          "--capture.keypoints " +
          camera.id + "=turned_270 beside 90, turned_90 beside 270";
    }
  }
  if (all_alike && lying.front() == 2) {
    // EXIF knows which way up they were: the rig is not upside down, its cameras are.
    std::erase_if(settled, [](const Finding& finding) { return finding.code == "stage-up"; });
  }
  findings = std::move(settled);
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
  explain_by_images(findings, dataset);
  settle_stale_exif(findings, reader, validation.keypoints, labels);
  settle_turns(findings, dataset, validation.keypoints);
  settle_convention(findings, reader, validation.keypoints);
  add(labels.findings);
  merge(findings);
  findings = join_alike(settle_advice(std::move(findings), dataset), dataset);
  std::stable_sort(findings.begin(), findings.end(), [](const Finding& a, const Finding& b) {
    return static_cast<int>(a.severity) > static_cast<int>(b.severity);
  });
  return validation;
}

}  // namespace atelier
