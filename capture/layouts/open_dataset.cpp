#include "capture/layouts/open_dataset.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <set>

#include "capture/camera_conventions.h"
#include "capture/frame_reader.h"
#include "capture/image_turns.h"
#include "capture/keypoint_schema.h"
#include "capture/label_taxonomy.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/layout_table.h"
#include "capture/layouts/video_clocks.h"
#include "capture/layouts/write_layout.h"
#include "capture/video_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/lower_extension.h"
#include "core/limits.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"
#include "core/split_text.h"
#include "core/store/consent_file.h"
#include "core/unknown_value.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

const std::vector<std::string> kUps = {"auto", "x", "y", "z", "-x", "-y", "-z"};

std::vector<std::string> auto_or(const std::vector<std::string>& names) {
  std::vector<std::string> choices = {"auto"};
  choices.insert(choices.end(), names.begin(), names.end());
  return choices;
}

/// The layout to read `path` by, and what told it.
struct Choice {
  const Layout* layout = nullptr;
  std::string evidence;
  std::vector<Finding> findings;
};

bool is_recognized(const fs::path& path, bool pictures_alone) {
  return std::any_of(all_layouts().begin(), all_layouts().end(), [&](const Layout& layout) {
    return (pictures_alone || std::string(layout.name) != "images") &&
           !layout.recognize(path).empty();
  });
}

/// A file of a kind of images that cameras and telephones write and that is not read; "": none
/// among the first of the folder.
std::string unread_image(const fs::path& folder) {
  static const std::set<std::string> kinds = {".heic", ".heif", ".hif", ".dng", ".cr2", ".cr3",
                                              ".nef",  ".arw",  ".raf", ".rw2", ".jxl", ".jp2",
                                              ".exr",  ".gif",  ".pgm", ".ppm", ".pnm"};
  constexpr int kLookedAt = 10'000;
  constexpr int kDeepest = 2;
  std::error_code error;
  auto walk = fs::recursive_directory_iterator(folder, error);
  for (int i = 0; !error && i < kLookedAt && walk != fs::recursive_directory_iterator();
       walk.increment(error), ++i) {
    if (walk.depth() >= kDeepest) {
      walk.disable_recursion_pending();
    }
    if (kinds.contains(lower_extension(walk->path()))) {
      return walk->path().string();
    }
  }
  return "";
}

Choice choose(const fs::path& path, const DatasetOptions& options) {
  Choice choice;
  if (options.layout != "auto") {
    choice.layout = &find_layout(options.layout);
    choice.evidence = "asked for by --layout";
    return choice;
  }
  for (const Layout& layout : all_layouts()) {
    // Images alone are what remains: every other layout has some as well.
    if (choice.layout != nullptr && std::string(layout.name) == "images") {
      break;
    }
    const std::string evidence = layout.recognize(path);
    if (evidence.empty()) {
      continue;
    }
    if (choice.layout == nullptr) {
      choice.layout = &layout;
      choice.evidence = evidence;
    } else {
      choice.findings.push_back(
          {Severity::Note, "layout-ambiguous", path.string(),
           "it could also be " + std::string(layout.name) + " (" + evidence + "); read as " +
               choice.layout->name + " (" + choice.evidence + ")",
           "if that is right, say so", "--capture.layout " + std::string(layout.name)});
    }
  }
  if (choice.layout == nullptr) {
    require_no_folder_above(path);
    if (const std::string image = unread_image(path); !image.empty()) {
      throw DataError(image, "", "an image of a kind that is not read",
                      "PNG, JPEG, TIFF, WebP, BMP or AVIF: heif-convert, dcraw or ImageMagick "
                      "write such");
    }
    std::string tried;
    for (const std::string& name : layout_names()) {
      tried += (tried.empty() ? "" : ", ") + name;
    }
    throw DataError(
        path.string(), "", "no layout that is known",
        "the files of one of: " + tried + "; --layout says which, docs/reference/formats.md what");
  }
  return choice;
}

void settle_world(Dataset& dataset, const DatasetOptions& options) {
  WorldConvention& world = dataset.world_convention;
  const std::string& root = dataset.root.string();
  if (options.metres_per_unit > 0) {
    world.metres_per_unit = options.metres_per_unit;
  } else if (!(world.metres_per_unit > 0)) {
    world.metres_per_unit = 1;
    if (dataset.calibrated) {
      dataset.findings.push_back({Severity::Warning, "unit-unknown", root,
                                  "the layout does not say the unit of its translations; metres "
                                  "are taken",
                                  "--capture.metres-per-unit says it: 1, 0.01, 0.001"});
    }
  }
  if (options.up != "auto") {
    world.up = options.up;
  } else if (world.up.empty()) {
    world.up = "y";
    world.up_guessed = true;
    if (dataset.calibrated) {
      dataset.findings.push_back({Severity::Note, "up-unknown", root,
                                  "the layout does not say which axis points up; y is taken",
                                  "--capture.up says it: y, z, -y"});
    }
  }
  for (Camera& camera : dataset.cameras) {
    camera = in_our_world(camera, world);
  }
}

/// Size of the images that the principal point belongs to, of a layout that does not say it: the
/// pictures' own, or 2, 4 or 8 times that, whichever has the principal point nearest to its middle.
int calibrated_scale(const Camera& camera, int width, int height) {
  int best = 1;
  double least = std::numeric_limits<double>::infinity();
  for (const int scale : {1, 2, 4, 8}) {
    const double off =
        std::abs(camera.cx / (scale * width) - 0.5) + std::abs(camera.cy / (scale * height) - 0.5);
    if (off < least) {
      least = off;
      best = scale;
    }
  }
  return best;
}

std::string size_text(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

/// Which way the images of a camera were turned since it was calibrated, by 1 or 3 quarters: as
/// their EXIF says, else so that up in the image is up; 0: nothing tells.
int quarters_told(const Camera& camera, const CameraFrames& frames) {
  const int shown = quarters_shown(frames.image_orientation);
  if (shown == 1 || shown == 3) {
    return 4 - shown;
  }
  constexpr double kUp = 0.7;  // a camera that is tilted by less than 45 degrees
  for (const int quarters : {1, 3}) {
    if (-turned_camera(camera, quarters).camera_from_world_rotation(1, 1) > kUp) {
      return quarters;
    }
  }
  return 0;
}

/// "--capture.turned" as it is set, with another turn of one camera; nothing: without it.
std::string turned_setting(const std::string& set, const std::string& camera,
                           std::optional<int> quarters) {
  std::string text;
  const auto add = [&](const std::string& part) { text += (text.empty() ? "" : ",") + part; };
  for (const std::string& part : split_text(set, ',')) {
    if (part.substr(0, part.find('=')) != camera) {
      add(part);
    }
  }
  if (quarters) {
    add(camera + "=" + std::to_string(90 * *quarters));
  }
  return text.empty() ? "" : "--capture.turned " + text;
}

/// Images whose sides are those of the calibration in each other's place, turned as it is set.
/// @param set  --capture.turned
Finding turned_finding(const Camera& camera, const CameraFrames& frames, const std::string& both,
                       const std::string& set) {
  if (frames.turn % 2 != 0) {  // as they are stored they fit
    const std::vector<std::string> parts = split_text(set, ',');
    const bool own = std::any_of(parts.begin(), parts.end(), [&](const std::string& part) {
      return part.starts_with(camera.id + "=");
    });
    const std::string rest = turned_setting(set, camera.id, std::nullopt);
    return {Severity::Error,
            "image-turned",
            camera.id,
            both + " where --capture.turned " + set + " turns them",
            !own ? "without it the sizes fit: name the cameras that are turned instead of all"
                 : "take " + camera.id + " from it: without that the sizes fit" +
                       (rest.empty() ? std::string() : ", as in " + rest),
            ""};
  }
  if (quarters_shown(frames.image_orientation) < 0) {
    return {Severity::Error,
            "image-turned",
            camera.id,
            both + ": their EXIF says to show them turned and mirrored (orientation " +
                std::to_string(frames.image_orientation) + ")",
            "write the images as they are shown: no turn alone makes them so",
            ""};
  }
  std::string why;
  if (quarters_shown(frames.image_orientation) % 2 != 0) {
    why = "their EXIF says to show them turned (orientation " +
          std::to_string(frames.image_orientation) + "), and the calibration is of images shown so";
  } else if (frames.view_rotation != 0) {
    why = "the recorder shows and exports them turned by " + std::to_string(frames.view_rotation) +
          " degrees (viewrotation)";
  } else {
    why = "they are turned by 90 degrees";
  }
  const int quarters = quarters_told(camera, frames);
  return {Severity::Error,
          "image-turned",
          camera.id,
          both + ": " + why,
          quarters > 0 ? "say so, or write the images as they were calibrated"
                       : "write the images as they were calibrated, or say which way they were "
                         "turned: " +
                             turned_setting(set, camera.id, 1) + " (clockwise) or " +
                             turned_setting(set, camera.id, 3),
          quarters > 0 ? turned_setting(set, camera.id, quarters) : ""};
}

/// The turn of a camera's images that its files tell, where it is not the one that is set and sizes
/// do not tell of it; "" where nothing is against that.
std::string against_turn(const Camera& camera, const CameraFrames& frames) {
  const int turn = frames.turn % 4;
  const int shown = quarters_shown(frames.image_orientation);
  const bool square = camera.width == camera.height;
  if (shown > 0) {
    const bool as_stored = shown % 2 != 0 && !square && turn % 2 == 0;  // the sizes say
    const int told = as_stored ? 0 : 4 - shown;
    if (turn != told) {
      return "their EXIF (orientation " + std::to_string(frames.image_orientation) +
             ") and size say " +
             (told == 0 ? "that they were not turned" : std::to_string(90 * told) + " degrees");
    }
    return "";
  }
  if (frames.view_rotation != 0 && (frames.view_rotation % 180 != 0) != (turn % 2 != 0)) {
    return "the recorder shows them turned by " + std::to_string(frames.view_rotation) +
           " degrees (viewrotation)";
  }
  return "";
}

/// What speaks against the turn that is set: EXIF, the recorder, or a view that stands on its head.
void doubt_turn(const Camera& camera, const CameraFrames& frames, const std::string& turned,
                std::vector<Finding>& findings) {
  const std::string set = "--capture.turned " + turned + " turns its images by " +
                          std::to_string(90 * (frames.turn % 4)) + " degrees";
  if (const std::string against = against_turn(camera, frames); !against.empty()) {
    findings.push_back({Severity::Error, "image-turned", camera.id, set + ", and " + against,
                        "take " + camera.id + " from it, or say what the files say", ""});
    return;
  }
  constexpr double kUp = 0.7;  // a camera that is tilted by less than 45 degrees
  const bool told = quarters_shown(frames.image_orientation) > 0;
  if (!told && turned_camera(camera, frames.turn).camera_from_world_rotation(1, 1) > kUp) {
    const int other = (frames.turn + 2) % 4;
    const std::string instead = turned_setting(turned, camera.id, other);
    findings.push_back({frames.view_rotation != 0 ? Severity::Error : Severity::Warning,
                        frames.view_rotation != 0 ? "image-turned" : "image-upside-down", camera.id,
                        set + ", by which up in the calibration is down in them",
                        "look at an image: unless the person stands on the head, " +
                            (other == 0 ? "take " + camera.id + " from it" : "say " + instead)});
  } else if (frames.view_rotation != 0 && frames.view_rotation / 90 != frames.turn % 4) {
    findings.push_back({Severity::Warning, "image-turned", camera.id,
                        set + ", the other way than the recorder shows them (viewrotation " +
                            std::to_string(frames.view_rotation) + ")",
                        "look at an image: if it lies on the wrong side, say " +
                            turned_setting(turned, camera.id, frames.view_rotation / 90)});
  }
}

/// Whether up in the camera's image is up, within 45 degrees of it.
bool is_upright(const Camera& camera) {
  constexpr double kUp = 0.7;
  return -camera.camera_from_world_rotation(1, 1) > kUp;
}

/// What EXIF says of images that have the calibration's size as they are stored.
/// @param up_said  the layout or a setting says which way is up
void note_orientation(const Camera& camera, const CameraFrames& frames, const std::string& turned,
                      bool up_said, std::vector<Finding>& findings) {
  const int shown = quarters_shown(frames.image_orientation);
  const std::string told =
      "the EXIF of its images says to show them " +
      (shown < 0 ? std::string("mirrored")
                 : "turned by " + std::to_string(90 * shown) + " degrees clockwise") +
      " (orientation " + std::to_string(frames.image_orientation) + ")";
  const bool sizes_say = shown % 2 != 0 && camera.width != camera.height;
  const std::string as_stored = turned_setting(turned, camera.id, 0);
  if (shown > 0 && !sizes_say && up_said && is_upright(camera)) {
    findings.push_back({Severity::Error, "image-turned", camera.id,
                        told + ", and up in its calibration is up in them then: it was calibrated "
                               "as they are shown",
                        "say so; if an image as it is stored shows the person upright, its EXIF is "
                        "wrong: " +
                            as_stored,
                        turned_setting(turned, camera.id, 4 - shown)});
    return;
  }
  findings.push_back({Severity::Warning, "image-orientation", camera.id,
                      told + "; they are read as they are stored",
                      (shown <= 0  ? "if they were calibrated as they are shown, write them so"
                       : sizes_say ? "their size says that they were calibrated so"
                                   : "if they were calibrated as they are shown, say " +
                                         turned_setting(turned, camera.id, 4 - shown)) +
                          "; to be told no more, " + as_stored});
}

/// What is said of turns where sizes do not tell.
void note_turns(const Camera& camera, const CameraFrames& frames, const std::string& turned,
                bool up_said, std::vector<Finding>& findings) {
  if (frames.turn % 4 != 0) {
    doubt_turn(camera, frames, turned, findings);
  }
  if (frames.turn_is_given || frames.turn % 4 != 0) {
    return;
  }
  // Sizes that fit as images are stored do not fit images turned by 90 degrees, unless square.
  const bool square = camera.width == camera.height;
  if (frames.view_rotation != 0) {
    findings.push_back(
        {frames.view_rotation == 180 ? Severity::Error : Severity::Warning, "image-turned",
         camera.id,
         "the recorder shows it turned by " + std::to_string(frames.view_rotation) +
             " degrees (viewrotation); its images have the calibration's size and are taken as "
             "not turned",
         "look at an image: if it is turned, " +
             (square || frames.view_rotation == 180
                  ? "say " + turned_setting(turned, camera.id, frames.view_rotation / 90)
                  : std::string("it was calibrated so as well")) +
             "; if it is right as it is, " + turned_setting(turned, camera.id, 0)});
  }
  if (frames.image_orientation != 1) {
    note_orientation(camera, frames, turned, up_said, findings);
  }
}

/// Whether a calibration that is of images as they are has their height for its width: the
/// principal point is in the middle of that size alone.
bool size_is_swapped(const Camera& camera, int width, int height) {
  const auto off_middle = [&](int w, int h) {
    return std::max(std::abs(camera.cx / w - 0.5), std::abs(camera.cy / h - 0.5));
  };
  constexpr double kNear = 0.1;
  constexpr double kMore = 0.05;
  const bool turned = static_cast<std::int64_t>(camera.width) * width ==
                      static_cast<std::int64_t>(camera.height) * height;
  const double off = off_middle(camera.height, camera.width);
  return turned && width != height && off < kNear &&
         off_middle(camera.width, camera.height) > off + kMore;
}

/// @param turned  --capture.turned
/// @param up_said  the layout or a setting says which way is up
void fit_to_pictures(Camera& camera, const CameraFrames& frames, const std::string& turned,
                     bool up_said, std::vector<Finding>& findings) {
  const bool lying = frames.turn % 2 != 0;
  const int width = lying ? frames.image_height : frames.image_width;
  const int height = lying ? frames.image_width : frames.image_height;
  if (width == 0) {
    if (camera.width == 0) {
      const auto largest = static_cast<double>(Limits{}.camera_side);
      camera.width = saturating_cast<int>(std::clamp(std::round(2 * camera.cx), 1.0, largest));
      camera.height = saturating_cast<int>(std::clamp(std::round(2 * camera.cy), 1.0, largest));
      findings.push_back({Severity::Warning, "image-size-unknown", camera.id,
                          "neither the calibration nor an image says the size; " +
                              size_text(camera.width, camera.height) +
                              " is twice the principal point",
                          "put the images beside the calibration"});
    }
    return;
  }
  const bool unsaid = camera.width == 0;
  if (unsaid) {
    const int scale = calibrated_scale(camera, width, height);
    camera.width = scale * width;
    camera.height = scale * height;
  }
  if (camera.width == width && camera.height == height) {
    note_turns(camera, frames, turned, up_said, findings);
    return;
  }
  if (size_is_swapped(camera, width, height)) {
    findings.push_back({Severity::Warning, "size-swapped", camera.id,
                        "its calibrated size, " + size_text(camera.width, camera.height) +
                            ", is height and width in each other's place: the images and the "
                            "principal point say " +
                            size_text(camera.height, camera.width) + ", which is taken",
                        "write the width first"});
    std::swap(camera.width, camera.height);
    if (camera.width == width && camera.height == height) {
      note_turns(camera, frames, turned, up_said, findings);
      return;
    }
  }
  const std::string both = "calibrated for " + size_text(camera.width, camera.height) +
                           ", images are " + size_text(width, height);
  const auto cross = [](int a, int b) { return static_cast<std::int64_t>(a) * b; };
  if (cross(camera.width, height) == cross(camera.height, width)) {
    camera = scaled_camera(camera, width, height);
    note_turns(camera, frames, turned, up_said, findings);
    findings.push_back({Severity::Note, "image-scale", camera.id,
                        both + ": intrinsics are scaled" +
                            (unsaid ? " (the principal point tells the calibrated size)" : ""),
                        "nothing, if the images were scaled"});
  } else if (cross(camera.width, width) == cross(camera.height, height)) {
    findings.push_back(turned_finding(camera, frames, both, turned));
  } else {
    const int off = std::max(std::abs(camera.width - width), std::abs(camera.height - height));
    findings.push_back({Severity::Warning, "image-size", camera.id,
                        both + ": no scale of each other; projections may be off by up to " +
                            std::to_string(off) + " px",
                        "find out whether the images were cropped or padded, and where, and move "
                        "the principal point accordingly"});
  }
}

/// Nearest rotation, for matrices that were written with few digits.
void settle_rotation(Camera& camera, std::vector<Finding>& findings) {
  constexpr double kExact = 1e-7;
  constexpr double kRounded = 1e-2;
  Eigen::Matrix3d& rotation = camera.camera_from_world_rotation;
  const double off = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (!(off > kExact) || !(off < kRounded) || !(rotation.determinant() > 0)) {
    return;  // good, or for check_camera to refuse
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  rotation = svd.matrixU() * svd.matrixV().transpose();
  constexpr double kNoted = 1e-5;
  findings.push_back(
      {off > kNoted ? Severity::Warning : Severity::Note, "camera-rotation", camera.id,
       "the rotation is off a rotation by " + short_number(off) + "; the nearest one is taken",
       "write calibrations with all digits"});
}

/// By the first image of each camera that can be read: one that is damaged says nothing of the
/// others, and is told of where it is decoded (check_frames).
void measure_pictures(Dataset& dataset, const Limits& limits) {
  FrameReader reader(dataset, limits);
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    CameraFrames& frames = dataset.frames[c];
    std::optional<DataError> first_error;
    DataLocation last;
    for (const auto& [frame, place] : frames.images) {
      if (first_error && place.file == last.file && place.member == last.member) {
        continue;  // another frame of a video that cannot be opened
      }
      last = place;
      try {
        const std::optional<ImageHeader> header = reader.image_header(static_cast<Index>(c), frame);
        frames.image_width = header->width;
        frames.image_height = header->height;
        frames.image_orientation = header->orientation;
        break;
      } catch (const DataError& error) {
        first_error = first_error ? first_error : error;
      }
    }
    if (first_error && frames.image_width == 0) {
      dataset.findings.push_back(
          {Severity::Error, "image-broken", dataset.cameras[c].id,
           std::string("none of its images can be read; the first: ") + first_error->what(),
           "replace the files"});
    }
  }
}

/// Symbolic links in a capture's folder.
struct Links {
  std::vector<fs::path> sound;
  std::vector<fs::path> broken;  ///< lead nowhere
};

Links links_in(const fs::path& folder) {
  Links links;
  std::error_code error;  // what cannot be listed is told of by whoever reads it
  auto walk = fs::recursive_directory_iterator(folder, error);
  for (; !error && walk != fs::recursive_directory_iterator(); walk.increment(error)) {
    if (walk->path().filename().string().starts_with(".")) {
      walk.disable_recursion_pending();
    } else if (walk->is_symlink(error)) {
      std::error_code unreachable;
      (fs::exists(walk->path(), unreachable) ? links.sound : links.broken).push_back(walk->path());
    }
  }
  return links;
}

/// Place and description of the first of some links.
std::pair<std::string, std::string> described(const std::vector<fs::path>& some) {
  std::error_code ignored;
  const fs::path& first = *std::min_element(some.begin(), some.end());
  const std::string more =
      some.size() > 1 ? " (the first of " + std::to_string(some.size()) + " links)" : "";
  return {first.string(), "a symbolic link to " + fs::read_symlink(first, ignored).string() + more};
}

/// A note of links that lead somewhere, an error of the others, which stages refuse
/// (core/store/input_digest.h).
void find_links(const fs::path& folder, std::vector<Finding>& findings) {
  const Links links = links_in(folder);
  if (!links.broken.empty()) {
    const auto [place, what] = described(links.broken);
    findings.push_back({Severity::Error, "symbolic-link", place, what + ", where nothing is",
                        "correct or remove the link"});
  }
  if (!links.sound.empty()) {
    const auto [place, what] = described(links.sound);
    findings.push_back({Severity::Note, "symbolic-link", place, what + ", which is followed",
                        "keep what it leads to as long as results are to be made again"});
  }
}

/// Images of no calibration that EXIF says to show otherwise than they are stored: what others
/// found in them may be of either.
void note_stored(Dataset& dataset) {
  for (std::size_t c = 0; !dataset.calibrated && c < dataset.cameras.size(); ++c) {
    const CameraFrames& frames = dataset.frames[c];
    if (frames.image_orientation == 1 || frames.turn_is_given || frames.reading.turn != 0) {
      continue;
    }
    const std::string& id = dataset.cameras[c].id;
    const int shown = quarters_shown(frames.image_orientation);
    const bool detected = !frames.keypoints.empty() && shown > 0;
    dataset.findings.push_back(
        {detected ? Severity::Warning : Severity::Note, "image-orientation", id,
         "the EXIF of its images (orientation " + std::to_string(frames.image_orientation) +
             ") says to show them turned or mirrored; they are read as they are stored" +
             (detected ? ", and nothing tells which of both its keypoints are of" : ""),
         detected ? "if they were detected as they are shown, --capture.keypoints " + id +
                        "=turned_" + std::to_string(90 * shown) +
                        "; if as they are stored, --capture.turned " + id + "=0"
                  : "a calibration by them is of the stored images"});
  }
}

/// Held-out cameras that there are not: those that were meant would be opened.
void find_unknown_held_out(Dataset& dataset) {
  std::string unknown;
  for (const std::string& id : dataset.info.held_out_cameras) {
    if (camera_index(dataset, id) < 0) {
      unknown += (unknown.empty() ? "" : ", ") + id;
    }
  }
  if (!unknown.empty()) {
    dataset.findings.push_back({Severity::Error, "held-out-unknown", dataset.root.string(),
                                "no camera is called as these that are held out: " + unknown,
                                "write held_out_cameras of capture.toml as the calibration does"});
  }
}

void settle_cameras(Dataset& dataset) {
  std::vector<Camera> cameras;
  std::vector<CameraFrames> frames;
  std::set<std::string> ids;
  const auto set = dataset.corrections.find("turned");
  const std::string turned = set == dataset.corrections.end() ? "" : set->second;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    Camera camera = dataset.cameras[c];
    if (!ids.insert(camera.id).second) {
      throw DataError(dataset.root.string(), "camera '" + camera.id + "'", "twice",
                      "each camera once");
    }
    if (dataset.calibrated) {
      try {
        if (camera.camera_from_world_rotation.isZero(0)) {
          dataset.findings.push_back(camera_left_out(camera.id, "it has no pose"));
          continue;
        }
        settle_rotation(camera, dataset.findings);
        fit_to_pictures(camera, dataset.frames[c], turned, !dataset.world_convention.up_guessed,
                        dataset.findings);
        camera = turned_camera(camera, dataset.frames[c].turn);
        check_camera(camera, dataset.root.string());
      } catch (const DataError& error) {
        dataset.findings.push_back({Severity::Error, "camera-left-out", camera.id,
                                    std::string(error.what()) + "; the camera is left out",
                                    "correct its calibration, or leave it out",
                                    "--capture.leave-out " + camera.id});
        continue;
      }
    } else {
      camera.width = dataset.frames[c].image_width;
      camera.height = dataset.frames[c].image_height;
    }
    cameras.push_back(camera);
    frames.push_back(std::move(dataset.frames[c]));
  }
  if (cameras.empty()) {
    std::string first;
    for (const Finding& finding : dataset.findings) {
      first = first.empty() && finding.code == "camera-left-out" ? finding.what : first;
    }
    throw DataError(dataset.root.string(), "cameras", first.empty() ? "none" : first,
                    "at least one camera");
  }
  dataset.cameras = std::move(cameras);
  dataset.frames = std::move(frames);
}

double video_fps(const Dataset& dataset, const Limits& limits) {
  for (const CameraFrames& frames : dataset.frames) {
    if (!frames.images.empty()) {
      const DataLocation place = frames.images.begin()->second;
      if (place.member.empty() && place.index >= 0) {
        return VideoFile(place.file, limits).fps();
      }
    }
  }
  return 0;
}

void settle_sequences(Dataset& dataset, const DatasetOptions& options, const Limits& limits) {
  std::vector<CaptureSequence>& sequences = dataset.info.sequences;
  if (sequences.empty()) {
    sequences.push_back({"capture", "clothed", 0, {}});
  }
  if (sequences.size() == 1 && sequences.front().frame_ids.empty()) {
    std::vector<int>& ids = sequences.front().frame_ids;
    const auto collect = [&](FrameLocations CameraFrames::*kind) {
      for (const CameraFrames& frames : dataset.frames) {
        add_frames(ids, (frames.*kind).frames());
      }
    };
    collect(&CameraFrames::images);
    if (ids.empty()) {
      collect(&CameraFrames::keypoints);
    }
  }
  for (CaptureSequence& sequence : sequences) {
    if (options.fps > 0) {
      sequence.fps = options.fps;
    } else if (!(sequence.fps > 0)) {
      sequence.fps = video_fps(dataset, limits);
      if (!(sequence.fps > 0) && !sequence.frame_ids.empty()) {
        constexpr double kUsualFps = 30;
        sequence.fps = kUsualFps;
        dataset.findings.push_back({Severity::Warning, "fps-unknown", dataset.root.string(),
                                    "nothing says the frame rate; 30 frames per second are taken",
                                    "--capture.fps says it"});
      }
    }
  }
  if (sequences.size() == 1 && sequences.front().frame_ids.empty()) {
    sequences.clear();
    dataset.findings.push_back(
        {Severity::Note, "no-frames", dataset.root.string(),
         "there is a calibration but no image and no detection",
         "put images where the layout has them (docs/reference/formats.md)"});
  }
}

/// Some people of every camera, and what was looked at.
struct SomePeople {
  std::vector<Keypoints2d> people;
  int files = 0;       ///< that could be read
  std::string damage;  ///< of the first that could not
};

SomePeople some_people(const Dataset& dataset, const Limits& limits) {
  FrameReader reader(dataset, limits);
  constexpr std::size_t kSamples = 12;  // of each camera
  SomePeople some;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const FrameLocations& places = dataset.frames[c].keypoints;
    const std::size_t step = std::max<std::size_t>(1, places.size() / kSamples);
    std::size_t i = 0;
    for (const auto& [frame, place] : places) {
      if (i++ % step != 0) {
        continue;
      }
      try {
        for (PersonKeypoints& person : reader.keypoints(static_cast<Index>(c), frame)) {
          some.people.push_back(std::move(person.points));
        }
        ++some.files;
      } catch (const DataError& error) {
        some.damage = some.damage.empty() ? error.what() : some.damage;
      }
    }
  }
  return some;
}

double mean_stretch(const std::string& schema, const std::vector<Keypoints2d>& people) {
  double sum = 0;
  int count = 0;
  for (const Keypoints2d& person : people) {
    const KeypointSchema& order = keypoint_schema(schema);
    if (person.rows() == static_cast<Index>(order.points.size())) {
      if (const std::optional<double> stretch = limb_stretch(order, person)) {
        sum += *stretch;
        ++count;
      }
    }
  }
  return count > 0 ? sum / count : 0;
}

/// Compares the order of keypoints that the layout claims with the detections.
void settle_keypoints(Dataset& dataset, const DatasetOptions& options, const Limits& limits) {
  std::string& schema = dataset.info.keypoint_schema;
  if (options.keypoint_schema != "auto") {
    schema = keypoint_schema(options.keypoint_schema).name;
    return;
  }
  const SomePeople looked = some_people(dataset, limits);
  const std::vector<Keypoints2d>& people = looked.people;
  if (people.empty()) {
    if (looked.files > 0 && looked.damage.empty()) {
      dataset.findings.push_back({Severity::Warning, "keypoints-none", dataset.root.string(),
                                  "no detection is in any of " + std::to_string(looked.files) +
                                      " files of keypoints that were looked at, of all cameras",
                                  "detect again: the detector found nobody"});
    } else if (!looked.damage.empty()) {
      dataset.findings.push_back({Severity::Error, "keypoints-damaged", dataset.root.string(),
                                  "no file of keypoints can be read; the first: " + looked.damage,
                                  "write them as OpenPose, MMPose or AlphaPose do"});
    }
    if (looked.files > 0 && schema.empty()) {
      schema = body_25_schema().name;  // of nobody any order is right
    }
    return;
  }
  const Index points = people.front().rows();
  const std::string guess = guess_keypoint_schema(points, people);
  const auto add = [&](Severity severity, const std::string& what, const std::string& advice,
                       const std::string& setting = "") {
    dataset.findings.push_back(
        {severity, "keypoint-schema", dataset.root.string(), what, advice, setting});
  };
  const std::string those = "detections of " + std::to_string(points) + " points";
  if (guess.empty()) {
    add(Severity::Error, those + ", which no known order has",
        "detect with BODY_25, COCO or HALPE models");
  } else if (schema.empty()) {
    add(Severity::Note,
        those + " are in the order " + guess +
            ", which joins limbs best of the orders of as many points",
        "--capture.keypoint-schema says it otherwise");
    schema = guess;
  } else if (static_cast<Index>(keypoint_schema(schema).points.size()) != points) {
    add(Severity::Warning,
        "the settings say " + schema + ", but there are " + those + "; " + guess +
            " is taken, which joins limbs best",
        "--capture.keypoint-schema says it otherwise");
    schema = guess;
  } else if (guess != schema) {
    // A claim counts more than a guess, unless limbs go across the body.
    constexpr double kAcross = 1.3;
    const double claimed = mean_stretch(schema, people);
    const double guessed = mean_stretch(guess, people);
    if (guessed > 0 && claimed > kAcross * guessed) {
      add(Severity::Warning,
          "the order " + schema + " joins limbs across the body (" +
              number_text(std::round(100 * claimed / guessed) / 100) + " times as long as " +
              guess + " does)",
          "if that is right, say so", "--capture.keypoint-schema " + guess);
    }
  }
}

}  // namespace

OptionTable describe(DatasetOptions& options) {
  OptionTable table;
  table
      .add("layout", options.layout, auto_or(layout_names()),
           "Layout of the capture; auto: recognised by its files")
      .add("metres_per_unit", options.metres_per_unit, 0, 1e6, "m",
           "Length of the calibration's unit; 0: as the layout has it")
      .add("up", options.up, kUps,
           "Axis of the calibration that points up; auto: as the layout has it")
      .add("fps", options.fps, 0, 10000, "1/s", "Frame rate; 0: as the files say")
      .add("keypoint_schema", options.keypoint_schema, auto_or(keypoint_schema_names()),
           "Order of the 2D keypoints; auto: recognised by their number and by how limbs join")
      .add("label_taxonomy", options.label_taxonomy, auto_or(label_taxonomy_names()),
           "Numbering of the classes of label images; auto: as the layout has it")
      .add("subject", options.subject, std::vector<std::string>{},
           "Name of the person, in layouts with several; auto: the first")
      .add("links", options.links, {"follow", "refuse"},
           "Treatment of symbolic links in the folder of the capture")
      .not_keyed()
      .add(describe(options.corrections));
  return table;
}

Dataset open_dataset(const fs::path& path, const DatasetOptions& options, const Limits& limits) {
  if (!fs::exists(path)) {
    throw DataError(path.string(), "", "nothing is there", "a folder of a capture");
  }
  require_finished(path);
  if (options.links == "refuse") {
    require_no_links(path);
  }
  const Choice choice = choose(path, options);
  Dataset dataset = choice.layout->read(path, options, limits);
  if (options.subject != "auto" && dataset.info.subject != options.subject) {
    throw UnknownValue(path.string(), "capture.subject", options.subject,
                       "auto: captures of layout " + std::string(choice.layout->name) +
                           " have no subjects to choose from");
  }
  if (dataset.root.empty()) {
    dataset.root = ".";  // a calibration file named without its folder
  }
  dataset.layout = choice.layout->name;
  dataset.evidence = choice.evidence;
  dataset.findings.insert(dataset.findings.begin(), choice.findings.begin(), choice.findings.end());
  ATELIER_CHECK(dataset.frames.size() == dataset.cameras.size(), "frames of other cameras");
  if (static_cast<std::int64_t>(dataset.cameras.size()) > limits.cameras) {
    throw DataError(dataset.root.string(), "cameras", std::to_string(dataset.cameras.size()),
                    "at most " + std::to_string(limits.cameras));
  }
  for (Camera& camera : dataset.cameras) {
    camera.id = plain_name(camera.id);
  }
  find_unknown_held_out(dataset);
  correct_cameras(dataset, options.corrections);
  settle_world(dataset, options);
  find_links(path, dataset.findings);
  measure_pictures(dataset, limits);
  settle_cameras(dataset);
  correct_frames(dataset, options.corrections);
  note_stored(dataset);
  settle_sequences(dataset, options, limits);
  const std::vector<Finding> clocks = compare_video_clocks(dataset, limits);
  dataset.findings.insert(dataset.findings.end(), clocks.begin(), clocks.end());
  settle_keypoints(dataset, options, limits);
  if (options.label_taxonomy != "auto") {
    dataset.info.label_taxonomy = label_taxonomy(options.label_taxonomy).name;
  }
  if (dataset.info.consent.empty()) {
    dataset.info.consent = read_consent(dataset.root);
  }
  if (!dataset.info.sequences.empty()) {
    CaptureInfo info = dataset.info;
    if (info.keypoint_schema.empty()) {
      info.keypoint_schema = "body_25";  // there are no detections that could tell
    }
    check_capture_info(info, dataset.root.string());
  }
  return dataset;
}

void require_finished(const fs::path& path) {
  std::error_code error;
  if (fs::exists(path / "synthesis.json", error) && !fs::exists(path / "capture.toml", error)) {
    throw DataError(path.string(), "", "a synthetic capture that was interrupted",
                    "a finished one: run the same synthesize command again");
  }
}

void require_no_links(const fs::path& path) {
  const Links links = links_in(path);
  if (!links.sound.empty() || !links.broken.empty()) {
    const auto [place, what] = described(links.sound.empty() ? links.broken : links.sound);
    throw DataError(place, "", what,
                    "the file itself, as --capture.links refuse asks; --capture.links follow reads "
                    "what links lead to");
  }
}

void check_capture_input(const fs::path& path, const OptionTable& options) {
  require_no_folder_above(path);
  const bool refused =
      std::any_of(options.fields.begin(), options.fields.end(), [](const OptionField& field) {
        return field.name == "capture.links" && option_text(field) == "refuse";
      });
  if (refused) {
    require_no_links(path);
  }
}

void require_no_folder_above(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error) || is_recognized(path, true)) {
    return;
  }
  for (const fs::path& entry : list_folder(path)) {
    if (!entry.filename().string().starts_with(".") && fs::is_directory(entry, error) &&
        is_recognized(entry, false)) {  // any folder may have one of images
      throw DataError(path.string(), "", "no capture, but a folder with one in it",
                      "the capture itself; did you mean " + entry.string() + "?");
    }
  }
}

}  // namespace atelier
