#include "capture/settle_advice.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "capture/camera_conventions.h"
#include "capture/camera_readings.h"
#include "core/io/text_scanner.h"
#include "core/io/text_writer.h"
#include "core/split_text.h"

namespace atelier {
namespace {

/// "cam3" and "-4" of "cam3=-4".
struct Setting {
  std::string camera;
  std::string value;
  std::string text() const { return camera + "=" + value; }
};

std::vector<Setting> settings_in(std::string_view text) {
  std::vector<Setting> settings;
  for (const std::string& part : split_text(text, ',')) {
    const std::size_t equals = part.find('=');
    if (equals != std::string::npos) {
      settings.push_back({part.substr(0, equals), part.substr(equals + 1)});
    }
  }
  return settings;
}

/// A camera on which every reading shows.
Camera probe() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = 600;
  camera.fy = 610;
  camera.cx = 330;
  camera.cy = 250;
  camera.distortion_model = Distortion::Brown;
  camera.distortion = {0.1, 0.02, 0.003, 0.004, 0.05, 0, 0, 0};
  camera.camera_from_world_rotation = rotation_of_vector({0.3, -0.7, 0.5});
  camera.camera_from_world_translation = {0.4, -0.2, 3};
  return camera;
}

bool same_camera(const Camera& a, const Camera& b) {
  constexpr double kSame = 1e-9;
  double off = (a.camera_from_world_rotation - b.camera_from_world_rotation).norm() +
               (a.camera_from_world_translation - b.camera_from_world_translation).norm() +
               std::abs(a.fx - b.fx) + std::abs(a.fy - b.fy) + std::abs(a.cx - b.cx) +
               std::abs(a.cy - b.cy);
  for (std::size_t i = 0; i < a.distortion.size(); ++i) {
    off += std::abs(a.distortion[i] - b.distortion[i]);
  }
  return off < kSame;
}

/// The value that reads a camera as first `set`, then `advised` read it: "" if that is as it is in
/// the file; nothing if there is no such value.
std::optional<std::string> both_read(std::string_view option, const std::string& set,
                                     const std::string& advised) {
  const Camera raw = probe();
  const Camera meant = read_as(read_as(raw, option, set), option, advised);
  if (same_camera(raw, meant)) {
    return "";
  }
  for (const Reading& reading : all_readings()) {
    if (reading.option == option && same_camera(read_as(raw, option, reading.value), meant)) {
      return std::string(reading.value);
    }
  }
  return std::nullopt;
}

std::optional<std::string> both(std::string_view option, const std::string& set,
                                const std::string& advised) {
  double a = 0;
  double b = 0;
  const bool adds = option == "sync" || option == "pixel_shift";
  const bool scales = option == "baseline" || option == "intrinsics" || option == "keypoints";
  if ((adds || scales) && parse_number(set, a) && parse_number(advised, b)) {
    const double value = adds ? a + b : a * b;
    return value == (adds ? 0 : 1) ? "" : number_text(value);
  }
  constexpr std::string_view kTurned = "turned_";
  if (option == "keypoints" && set.starts_with(kTurned) && advised.starts_with(kTurned) &&
      parse_number(set.substr(kTurned.size()), a) &&
      parse_number(advised.substr(kTurned.size()), b)) {
    const double degrees = std::fmod(a + b, 360);
    return degrees == 0 ? "" : std::string(kTurned) + number_text(degrees);
  }
  if (option == "turned" && parse_number(set, a) && parse_number(advised, b)) {
    const double degrees = std::fmod(a + b, 360);
    return degrees == 0 ? "" : number_text(degrees);
  }
  if (option == "extrinsics" || option == "distortion" || option == "intrinsics") {
    return both_read(option, set, advised);
  }
  return set == advised ? std::optional<std::string>("") : std::nullopt;
}

std::string listed(const std::vector<Setting>& settings) {
  std::string text;
  for (const Setting& setting : settings) {
    text += (text.empty() ? "" : ",") + setting.text();
  }
  return text;
}

bool is_of_all(const std::vector<Setting>& settings) {
  return std::any_of(settings.begin(), settings.end(),
                     [](const Setting& setting) { return setting.camera == "all"; });
}

/// A setting of all cameras as one of each that has none of its own.
std::vector<Setting> of_each(const std::vector<Setting>& settings, const Dataset& dataset) {
  std::vector<Setting> each;
  for (const Setting& setting : settings) {
    if (setting.camera != "all") {
      each.push_back(setting);
    }
  }
  for (const Setting& setting : settings) {
    for (std::size_t c = 0; setting.camera == "all" && c < dataset.cameras.size(); ++c) {
      const std::string& id = dataset.cameras[c].id;
      if (std::none_of(each.begin(), each.end(),
                       [&](const Setting& one) { return one.camera == id; })) {
        each.push_back({id, setting.value});
      }
    }
  }
  return each;
}

void settle(Finding& finding, const std::string& option, const std::string& typed,
            const std::string& value, const std::string& set, const Dataset& dataset) {
  if (option == "leave_out") {
    finding.setting = typed + " " + set + "," + value;
    return;
  }
  std::vector<Setting> settings = settings_in(set);
  std::vector<Setting> all_advised = settings_in(value);
  if (is_of_all(settings) != is_of_all(all_advised)) {
    settings = of_each(settings, dataset);
    all_advised = of_each(all_advised, dataset);
  }
  for (const Setting& advised : all_advised) {
    const auto same = std::find_if(settings.begin(), settings.end(), [&](const Setting& setting) {
      return setting.camera == advised.camera;
    });
    if (same == settings.end()) {
      settings.push_back(advised);
      continue;
    }
    const std::string before = same->text();
    const std::optional<std::string> now = both(option, same->value, advised.value);
    if (!now) {
      finding.setting.clear();
      finding.advice = "take " + typed + " " + before + " away and validate again";
      return;
    }
    if (now->empty()) {
      finding.advice = "take " + typed + " " + before + " away: without it this fits";
      settings.erase(same);
    } else {
      same->value = *now;
    }
  }
  finding.setting = settings.empty() ? "" : typed + " " + listed(settings);
}

}  // namespace

std::vector<Finding> settle_advice(std::vector<Finding> findings, const Dataset& dataset) {
  constexpr std::string_view kPrefix = "--capture.";
  for (Finding& finding : findings) {
    const std::size_t space = finding.setting.find(' ');
    if (!finding.setting.starts_with(kPrefix) || space == std::string::npos) {
      continue;
    }
    const std::string typed = finding.setting.substr(0, space);
    const std::string value = finding.setting.substr(space + 1);
    std::string option = typed.substr(kPrefix.size());
    std::replace(option.begin(), option.end(), '-', '_');
    const auto set = dataset.corrections.find(option);
    const bool whole = finding.code == "image-turned";  // advises what the option is to be
    if (set != dataset.corrections.end() && !whole) {
      settle(finding, option, typed, value, set->second, dataset);
    }
  }
  return findings;
}

}  // namespace atelier
