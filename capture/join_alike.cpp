#include "capture/join_alike.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <string>
#include <string_view>

#include "core/split_text.h"

namespace atelier {
namespace {

/// Codes of findings that are alike although their numbers are not.
constexpr std::array<std::string_view, 6> kOfNumbers = {"camera-focal",  "camera-principal-point",
                                                        "camera-aspect", "camera-rotation",
                                                        "image-size",    "image-scale"};

/// The text with a camera's name, where it stands as a word, replaced.
std::string renamed(const std::string& text, const std::string& id, const std::string& to) {
  const auto is_part = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
  };
  std::string result;
  std::size_t at = 0;
  while (at < text.size()) {
    const bool begins = text.compare(at, id.size(), id) == 0 && (at == 0 || !is_part(text[at - 1]));
    const std::size_t end = at + id.size();
    if (begins && !id.empty() && (end >= text.size() || !is_part(text[end]))) {
      result += to;
      at = end;
    } else {
      result += text[at++];
    }
  }
  return result;
}

std::string without_numbers(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (std::isdigit(static_cast<unsigned char>(c)) == 0) {
      result += c;
    } else if (result.empty() || result.back() != '#') {
      result += '#';
    }
  }
  return result;
}

/// The camera that a finding is of: its place, or of masks what stands before its frame; "" of
/// none.
std::string camera_named_in(const Finding& finding, const Dataset& dataset) {
  if (camera_index(dataset, finding.place) >= 0) {
    return finding.place;
  }
  const std::size_t frame = finding.place.rfind(" frame ");
  const std::string camera = finding.place.substr(0, frame);
  return frame != std::string::npos && finding.code.starts_with("mask-") &&
                 camera_index(dataset, camera) >= 0
             ? camera
             : "";
}

/// Cameras that stages may open.
std::size_t open_cameras(const Dataset& dataset) {
  const std::vector<std::string>& held = dataset.info.held_out_cameras;
  return static_cast<std::size_t>(
      std::count_if(dataset.cameras.begin(), dataset.cameras.end(), [&](const Camera& camera) {
        return std::find(held.begin(), held.end(), camera.id) == held.end();
      }));
}

std::string key_of(const Finding& finding, const std::string& camera) {
  constexpr const char* kAny = "\x01";
  const bool of_numbers =
      std::find(kOfNumbers.begin(), kOfNumbers.end(), finding.code) != kOfNumbers.end();
  const std::string what = renamed(finding.what, camera, kAny);
  const std::string& setting = finding.setting;
  return std::string(severity_name(finding.severity)) + "\x02" + finding.code + "\x02" +
         (of_numbers ? without_numbers(what)
                     : what + "\x02" + renamed(finding.advice, camera, kAny)) +
         "\x02" + setting.substr(0, setting.find(' '));
}

/// "--capture.turned cam0=90" and so on as one; "" where there is none for all.
std::string joined_setting(const std::vector<const Finding*>& alike) {
  const std::string& first = alike.front()->setting;
  const std::size_t space = first.find(' ');
  if (space == std::string::npos || first.starts_with("--capture.leave-out ")) {
    return "";
  }
  std::map<std::string, std::string> values;  // by camera
  for (const Finding* finding : alike) {
    for (const std::string& part : split_text(finding->setting.substr(space + 1), ',')) {
      const std::size_t equals = part.find('=');
      if (equals == std::string::npos) {
        return first;  // of no camera
      }
      values[part.substr(0, equals)] = part.substr(equals + 1);
    }
  }
  const std::string& value = values.begin()->second;
  if (std::all_of(values.begin(), values.end(),
                  [&](const auto& one) { return one.second == value; })) {
    return first.substr(0, space) + " all=" + value;
  }
  std::string text;
  for (const auto& [camera, its] : values) {
    text += (text.empty() ? "" : ",") + camera + "=" + its;
  }
  return first.substr(0, space) + " " + text;
}

Finding joined_finding(const std::vector<const Finding*>& alike, const Dataset& dataset) {
  Finding all = *alike.front();
  const std::string first = camera_named_in(all, dataset);
  all.place = "all " + std::to_string(alike.size()) + " cameras" +
              (alike.size() < dataset.cameras.size() ? " that are not held out" : "");
  const bool same = std::all_of(alike.begin(), alike.end(), [&](const Finding* finding) {
    return renamed(finding->what, camera_named_in(*finding, dataset), first) == alike.front()->what;
  });
  all.what =
      same ? renamed(all.what, first, "all") : first + ": " + all.what + "; the others alike";
  all.advice = renamed(all.advice, first, "all");
  all.setting = joined_setting(alike);
  return all;
}

}  // namespace

std::vector<Finding> join_alike(const std::vector<Finding>& findings, const Dataset& dataset) {
  std::map<std::string, std::vector<const Finding*>> groups;
  for (const Finding& finding : findings) {
    if (const std::string camera = camera_named_in(finding, dataset); !camera.empty()) {
      groups[key_of(finding, camera)].push_back(&finding);
    }
  }
  const std::size_t open = open_cameras(dataset);
  std::vector<Finding> result;
  for (const Finding& finding : findings) {
    const std::string camera = camera_named_in(finding, dataset);
    const auto group = camera.empty() ? groups.end() : groups.find(key_of(finding, camera));
    const std::size_t size = group == groups.end() ? 0 : group->second.size();
    // Images and masks of those that are held out are not looked at.
    const bool masks = finding.code.starts_with("mask-");
    const bool all = size > 1 && (size == dataset.cameras.size() || (masks && size == open));
    if (!all) {
      result.push_back(finding);
    } else if (group->second.front() == &finding) {
      result.push_back(joined_finding(group->second, dataset));
    }
  }
  return result;
}

}  // namespace atelier
