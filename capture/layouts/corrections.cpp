#include "capture/layouts/corrections.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <set>
#include <string_view>
#include <vector>

#include "capture/camera_readings.h"
#include "core/error.h"
#include "core/usage_error.h"

namespace atelier {
namespace {

constexpr std::string_view kAllCameras = "all";

/// "cam3=-4" of an option, as it is written.
struct Written {
  std::string_view camera;
  std::string value;
};

/// The same with the cameras that it names.
struct Entry {
  std::vector<std::size_t> cameras;
  std::string value;
};

[[noreturn]] void refuse(std::string_view option, const std::string& found,
                         const std::string& expected) {
  refuse_correction(option, found, expected);
}

std::string value_shown(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  return "'" + std::string(text.substr(0, kLongest)) + "'";
}

/// "cam1, cam2, cam3"; of many the first.
std::string known_cameras(const Dataset& dataset) {
  constexpr std::size_t kMost = 30;
  std::string known;
  for (std::size_t c = 0; c < std::min(kMost, dataset.cameras.size()); ++c) {
    known += (known.empty() ? "" : ", ") + dataset.cameras[c].id;
  }
  return known + (dataset.cameras.size() > kMost ? ", ..." : "");
}

std::vector<std::size_t> cameras_named(const Dataset& dataset, const char* option,
                                       std::string_view name) {
  std::vector<std::size_t> found;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    if (name == kAllCameras || dataset.cameras[c].id == name) {
      found.push_back(c);
    }
  }
  if (found.empty()) {
    refuse(option, value_shown(name), "'all', or one of " + known_cameras(dataset));
  }
  return found;
}

/// The same for options that take no 'all'.
std::size_t camera_named(const Dataset& dataset, const char* option, std::string_view name,
                         const char* expected) {
  const Index found = camera_index(dataset, std::string(name));
  if (found < 0) {
    refuse(option, value_shown(name), expected + known_cameras(dataset));
  }
  return static_cast<std::size_t>(found);
}

std::vector<std::string_view> parts_of(std::string_view text) {
  std::vector<std::string_view> parts;
  while (!text.empty()) {
    const std::size_t comma = text.find(',');
    parts.push_back(text.substr(0, comma));
    text.remove_prefix(comma == std::string_view::npos ? text.size() : comma + 1);
  }
  return parts;
}

/// The cameras of "leave_out".
std::vector<std::string_view> cameras_in_list(std::string_view text) {
  constexpr std::string_view kOption = "leave_out";
  const std::vector<std::string_view> names = parts_of(text);
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (name->empty()) {
      refuse(kOption, value_shown(text), "CAMERA,CAMERA");
    }
    if (std::find(names.begin(), name, *name) != name) {
      refuse(kOption, value_shown(text),
             "each camera once, and " + value_shown(*name) + " is twice");
    }
  }
  return names;
}

std::vector<Written> written_in(std::string_view option, std::string_view text) {
  std::vector<Written> entries;
  for (const std::string_view part : parts_of(text)) {
    const std::size_t equals = part.find('=');
    if (equals == std::string_view::npos || equals == 0 || equals + 1 == part.size()) {
      refuse(option, value_shown(part), "CAMERA=VALUE,CAMERA=VALUE");
    }
    const std::string_view camera = part.substr(0, equals);
    if (std::any_of(entries.begin(), entries.end(),
                    [&](const Written& before) { return before.camera == camera; })) {
      refuse(option, value_shown(text),
             "each camera once, and " + value_shown(camera) + " is twice");
    }
    entries.push_back({camera, std::string(part.substr(equals + 1))});
  }
  return entries;
}

/// "all" is every camera that has no entry of its own.
std::vector<Entry> entries_of(const Dataset& dataset, const char* option, const std::string& text) {
  const std::vector<Written> all = written_in(option, text);
  std::vector<Entry> entries;
  for (const Written& written : all) {
    std::vector<std::size_t> cameras = cameras_named(dataset, option, written.camera);
    if (written.camera == kAllCameras) {
      std::erase_if(cameras, [&](std::size_t camera) {
        return std::any_of(all.begin(), all.end(), [&](const Written& other) {
          return other.camera == dataset.cameras[camera].id;
        });
      });
    }
    entries.push_back({std::move(cameras), written.value});
  }
  return entries;
}

int whole_number(const char* option, const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  constexpr int kMost = 1'000'000;
  if (error != std::errc() || end != text.data() + text.size() || value < -kMost || value > kMost) {
    refuse(option, value_shown(text), "a number of frames");
  }
  return value;
}

/// Quarter turns, clockwise.
int quarters_of(const std::string& text) {
  constexpr int kQuarter = 90;
  if (text != "0" && text != "90" && text != "180" && text != "270") {
    refuse("turned", value_shown(text), "0, 90, 180 or 270 degrees, clockwise");
  }
  return whole_number("turned", text) / kQuarter;
}

void require_inverted(const std::string& value) {
  if (value != "inverted") {
    refuse("masks", value_shown(value), "inverted");
  }
}

/// Refuses a value that no capture has.
void require_value(std::string_view option, const Written& entry) {
  if (option == "sync") {
    whole_number("sync", entry.value);
  } else if (option == "masks") {
    require_inverted(entry.value);
  } else if (option == "turned") {
    quarters_of(entry.value);
  } else if (option == "keypoints") {
    keypoint_reading(entry.value, 1, 1);
  } else if (option != "calibration_of") {
    read_as(Camera{}, option, entry.value);
  } else if (entry.camera == kAllCameras || entry.value == kAllCameras) {
    refuse(option, "'all'", "one camera on each side");
  }
}

/// Cameras are shifted against each other: a number that is all cameras' shifts nothing.
[[noreturn]] void refuse_common_shift(const std::string& text) {
  refuse("sync", value_shown(text),
         "shifts of some cameras against the others, as in cam3=-4; all alike change nothing");
}

/// The same frames under other numbers; those that become negative are left out, and so are those
/// that no sequence has, where sequences are said.
void renumber(FrameLocations& places, int by, const std::vector<int>& wanted) {
  places = places.shifted(by);
  if (!wanted.empty()) {
    places = places.only(wanted);
  }
}

void leave_out(Dataset& dataset, const std::string& names) {
  std::set<std::size_t> gone;
  for (const std::string_view name : cameras_in_list(names)) {
    if (std::erase_if(dataset.findings, [&](const Finding& finding) {
          return finding.code == "camera-left-out" && finding.place == name;
        }) > 0) {
      continue;  // its calibration left it out already
    }
    gone.insert(camera_named(dataset, "leave_out", name, "some, but not all, of "));
  }
  if (gone.size() == dataset.cameras.size() && !gone.empty()) {
    refuse("leave_out", value_shown(names), "some, but not all, of " + known_cameras(dataset));
  }
  for (auto camera = gone.rbegin(); camera != gone.rend(); ++camera) {
    dataset.cameras.erase(dataset.cameras.begin() + static_cast<std::ptrdiff_t>(*camera));
    dataset.frames.erase(dataset.frames.begin() + static_cast<std::ptrdiff_t>(*camera));
  }
}

void exchange_calibrations(Dataset& dataset, const std::string& text) {
  const std::vector<Camera> as_read = dataset.cameras;
  constexpr const char* kOption = "calibration_of";
  for (const Written& written : written_in(kOption, text)) {
    const std::size_t source = camera_named(dataset, kOption, written.value, "one of ");
    Camera& camera = dataset.cameras[camera_named(dataset, kOption, written.camera, "one of ")];
    const std::string id = camera.id;
    camera = as_read[source];
    camera.id = id;
  }
}

}  // namespace

OptionTable describe(CorrectionOptions& options) {
  OptionTable table;
  const std::vector<std::string> anything;
  table.add("leave_out", options.leave_out, anything, "Cameras that are left out: cam3,cam5")
      .add("sync", options.sync, anything,
           "Frames by which a camera's frame numbers are shifted: cam3=-4,cam5=2")
      .add("calibration_of", options.calibration_of, anything,
           "Camera whose calibration another one takes: cam3=cam5,cam5=cam3")
      .add("extrinsics", options.extrinsics, anything,
           "Convention of the extrinsics: inverse, transposed, position, opengl or inverse_opengl, "
           "as in cam3=inverse or all=transposed")
      .add("baseline", options.baseline, anything, "Factor on translations: cam3=0.001")
      .add("intrinsics", options.intrinsics, anything,
           "Factor on focal lengths and principal point, or swapped_centre: all=0.5")
      .add("distortion", options.distortion, anything,
           "Convention of the distortion: k3_third, times_64, by_64, negated or none, as in "
           "all=k3_third")
      .add("pixel_shift", options.pixel_shift, anything,
           "Shift of the principal point in pixels: all=0.5")
      .add("turned", options.turned, anything,
           "Clockwise turn of a camera's images since they were calibrated, in degrees; 0: none, "
           "whatever EXIF or the recorder says: cam3=90")
      .add("keypoints", options.keypoints, anything,
           "Convention of the 2D keypoints: mirrored, upside_down, swapped_sides, shares, percent, "
           "turned_90, turned_180 or turned_270 (of images turned clockwise, as by EXIF), or a "
           "factor on pixels, as in cam3=mirrored")
      .add("masks", options.masks, anything, "Convention of the masks: all=inverted");
  return table;
}

CorrectionOptions corrections_of(const std::map<std::string, std::string>& texts) {
  CorrectionOptions options;
  OptionTable table = describe(options);
  for (const auto& [option, text] : texts) {
    const std::string problem = set_option(table, option, text);
    ATELIER_CHECK(problem.empty(), problem);
  }
  return options;
}

std::string correction_problem(std::string_view option, const std::string& text) {
  constexpr std::array kOptions = {
      std::string_view("sync"),       std::string_view("calibration_of"),
      std::string_view("extrinsics"), std::string_view("baseline"),
      std::string_view("intrinsics"), std::string_view("distortion"),
      std::string_view("keypoints"),  std::string_view("pixel_shift"),
      std::string_view("masks"),      std::string_view("turned"),
  };
  try {
    if (option == "leave_out") {
      cameras_in_list(text);
    } else if (std::find(kOptions.begin(), kOptions.end(), option) != kOptions.end()) {
      const std::vector<Written> entries = written_in(option, text);
      for (const Written& entry : entries) {
        require_value(option, entry);
      }
      if (option == "sync" && entries.size() == 1 && entries.front().camera == kAllCameras &&
          whole_number("sync", entries.front().value) != 0) {
        refuse_common_shift(text);
      }
    }
  } catch (const UsageError& error) {
    const std::string_view words = error.what();
    return std::string(words.substr(words.find("cannot be ")));
  }
  return "";
}

void correct_cameras(Dataset& dataset, const CorrectionOptions& options) {
  exchange_calibrations(dataset, options.calibration_of);  // also that of one that is left out
  leave_out(dataset, options.leave_out);
  const std::pair<const char*, const std::string*> readings[] = {
      {"extrinsics", &options.extrinsics},   {"baseline", &options.baseline},
      {"intrinsics", &options.intrinsics},   {"distortion", &options.distortion},
      {"pixel_shift", &options.pixel_shift},
  };
  for (const auto& [option, text] : readings) {
    for (const Entry& entry : entries_of(dataset, option, *text)) {
      for (const std::size_t camera : entry.cameras) {
        dataset.cameras[camera] = read_as(dataset.cameras[camera], option, entry.value);
      }
    }
  }
  for (const Entry& entry : entries_of(dataset, "turned", options.turned)) {
    for (const std::size_t camera : entry.cameras) {
      dataset.frames[camera].turn += quarters_of(entry.value);
      dataset.frames[camera].turn_is_given = true;
    }
  }
  for (const auto& [option, text] : {std::pair("leave_out", &options.leave_out),
                                     {"sync", &options.sync},
                                     {"calibration_of", &options.calibration_of},
                                     {"extrinsics", &options.extrinsics},
                                     {"baseline", &options.baseline},
                                     {"intrinsics", &options.intrinsics},
                                     {"distortion", &options.distortion},
                                     {"pixel_shift", &options.pixel_shift},
                                     {"turned", &options.turned},
                                     {"keypoints", &options.keypoints},
                                     {"masks", &options.masks}}) {
    if (!text->empty()) {
      dataset.corrections[option] = *text;
    }
  }
}

void correct_frames(Dataset& dataset, const CorrectionOptions& options) {
  const std::vector<int> wanted = frame_ids(dataset);
  std::vector<int> shifts(dataset.frames.size(), 0);
  for (const Entry& entry : entries_of(dataset, "sync", options.sync)) {
    for (const std::size_t camera : entry.cameras) {
      shifts[camera] = whole_number("sync", entry.value);
    }
  }
  if (!shifts.empty() && shifts.front() != 0 &&
      std::count(shifts.begin(), shifts.end(), shifts.front()) == std::ssize(shifts)) {
    refuse_common_shift(options.sync);
  }
  for (std::size_t c = 0; c < shifts.size(); ++c) {
    CameraFrames& frames = dataset.frames[c];
    for (auto* places : {&frames.images, &frames.masks, &frames.labels, &frames.keypoints}) {
      if (shifts[c] != 0) {
        renumber(*places, shifts[c], wanted);
      }
    }
  }
  for (const Entry& entry : entries_of(dataset, "masks", options.masks)) {
    require_inverted(entry.value);
    for (const std::size_t camera : entry.cameras) {
      dataset.frames[camera].inverted_masks = !dataset.frames[camera].inverted_masks;
    }
  }
  for (const Entry& entry : entries_of(dataset, "keypoints", options.keypoints)) {
    for (const std::size_t c : entry.cameras) {
      const Camera& camera = dataset.cameras[c];
      const KeypointReading more = keypoint_reading(entry.value, camera.width, camera.height);
      KeypointReading& reading = dataset.frames[c].reading;
      reading.scale_x *= more.scale_x;
      reading.scale_y *= more.scale_y;
      reading.confidence *= more.confidence;
      reading.mirrored = reading.mirrored || more.mirrored;
      reading.upside_down = reading.upside_down || more.upside_down;
      reading.swapped_sides = reading.swapped_sides || more.swapped_sides;
      reading.turn = (reading.turn + more.turn) % 4;
    }
  }
}

}  // namespace atelier
