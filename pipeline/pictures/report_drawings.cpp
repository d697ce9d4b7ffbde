#include "pipeline/pictures/report_drawings.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "capture/capture_info.h"
#include "capture/frame_reader.h"
#include "capture/layouts/open_dataset.h"
#include "core/io/image_file.h"
#include "core/io/json.h"
#include "core/render/contact_sheet.h"
#include "core/store/result.h"
#include "pipeline/pictures/report_page.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

Image scaled(const Image& image) {
  const int width = std::max(1, image.width * kReportHeight / std::max(1, image.height));
  return resized(image, width, kReportHeight);
}

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

}  // namespace

std::string figure_html(const Image& image, const std::string& caption) {
  const std::string jpeg = image_bytes(image, ImageFormat::Jpeg, {.quality = 88});
  return "<figure><img alt=\"" + html_text(caption) + "\" src=\"data:image/jpeg;base64," +
         base64_text(std::as_bytes(std::span(jpeg))) + "\"><figcaption>" + html_text(caption) +
         "</figcaption></figure>\n";
}

Image seen_in_report(const std::vector<RenderMesh>& meshes, const View& view, int width) {
  PictureOptions options;
  options.width = width;
  options.height = kReportHeight;
  options.samples = 6;
  return picture_of(meshes, view, options);
}

Image coloured(Image image) {
  if (image.channels == 1) {
    Image colour(image.width, image.height, 3);
    for (std::size_t i = 0; i < colour.data.size(); ++i) {
      colour.data[i] = image.data[i / 3];
    }
    return colour;
  }
  return image;
}

fs::path result_folder_of(const StageStatus& status, const ReportPlaces& places) {
  return results_of_stage(places.workspace, status.stage) / folder_name(status.manifest->key);
}

const StageStatus* sound_maker(const ReportPlaces& places, std::string_view kind) {
  const auto found =
      std::find_if(places.stages.begin(), places.stages.end(), [&](const StageStatus& status) {
        const auto& outputs = status.row->outputs;
        return std::find(outputs.begin(), outputs.end(), kind) != outputs.end();
      });
  return found != places.stages.end() && found->manifest &&
                 found->state != StageStatus::State::Damaged
             ? &*found
             : nullptr;
}

fs::path maker_folder(const ReportPlaces& places, std::string_view kind) {
  const StageStatus* status = sound_maker(places, kind);
  return status == nullptr ? places.workspace / "none" : result_folder_of(*status, places);
}

Dataset dataset_of(const StageStatus& status) {
  DatasetOptions options;
  OptionTable table = describe(options);
  constexpr std::string_view kSection = "capture.";
  for (const ManifestOption& option : status.manifest->options) {
    if (option.name.starts_with(kSection)) {
      const nlohmann::json value = parse_json(option.json, "manifest.json");
      set_option(table, option.name.substr(kSection.size()),
                 value.is_string() ? value.get<std::string>() : option.json);
    }
  }
  return open_dataset(status.manifest->inputs.front().path, options);
}

std::optional<Dataset> scanned_dataset(const ReportPlaces& places) {
  const StageStatus* status = sound_maker(places, "scans");
  return status == nullptr ? std::nullopt : std::optional(dataset_of(*status));
}

std::optional<ReportedTrack> reported_track(const ReportPlaces& places, const Dataset& dataset) {
  const fs::path result = maker_folder(places, "tracked");
  fs::path file;
  for (const CaptureSequence& sequence : dataset.info.sequences) {
    const fs::path one = result / "tracked" / (sequence.name + ".h5");
    if (fs::exists(one) && (file.empty() || sequence.kind == "clothed")) {
      file = one;
    }
  }
  if (file.empty()) {
    return std::nullopt;
  }
  ReportedTrack tracked{read_tracked_motion(file), {}};
  const int left = find_joint(tracked.motion.skeleton, "left_hip");
  const int right = find_joint(tracked.motion.skeleton, "right_hip");
  const std::vector<std::string>& held = dataset.info.held_out_cameras;
  std::vector<std::pair<double, Index>> facing_away;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const Camera& camera = dataset.cameras[c];
    if (std::find(held.begin(), held.end(), camera.id) != held.end() ||
        dataset.frames[c].images.empty()) {
      continue;
    }
    double facing = 0;  // the left hip on the right of the image: the person looks here
    if (left >= 0 && right >= 0 && !tracked.motion.joints.empty()) {
      const Points& joints = tracked.motion.joints.front();
      const auto a = project(camera, joints.row(left).transpose());
      const auto b = project(camera, joints.row(right).transpose());
      facing = a && b ? (a->x() - b->x()) / camera.width : -1e6;
    }
    facing_away.emplace_back(-facing, static_cast<Index>(c));
  }
  std::sort(facing_away.begin(), facing_away.end());
  for (const auto& [away, camera] : facing_away) {
    tracked.cameras.push_back(camera);
  }
  return tracked;
}

Eigen::Vector3d tracked_facing(const std::optional<ReportedTrack>& tracked, int frame_id) {
  if (!tracked) {
    return Eigen::Vector3d::Zero();
  }
  const TrackedMotion& motion = tracked->motion;
  const std::vector<int>& ids = motion.motion.frame_ids;
  const auto at = std::find(ids.begin(), ids.end(), frame_id);
  const int left = find_joint(motion.skeleton, "left_hip");
  const int right = find_joint(motion.skeleton, "right_hip");
  if (at == ids.end() || left < 0 || right < 0) {
    return Eigen::Vector3d::Zero();
  }
  constexpr double kLies = 0.2;  // of the hips' distance that goes along the ground
  const Points& joints = motion.joints[static_cast<std::size_t>(at - ids.begin())];
  const Eigen::Vector3d across = (joints.row(left) - joints.row(right)).transpose();
  const Eigen::Vector3d facing = across.cross(Eigen::Vector3d::UnitY());
  return facing.norm() > kLies * across.norm() ? facing : Eigen::Vector3d::Zero().eval();
}

std::string front_pictures(const ReportPlaces& places, const std::string& what,
                           const DrawOver& draw) {
  std::optional<Dataset> dataset = scanned_dataset(places);
  const std::optional<ReportedTrack> tracked =
      dataset ? reported_track(places, *dataset) : std::nullopt;
  if (!tracked) {
    return "";
  }
  const std::vector<Camera> cameras = dataset->cameras;
  FrameReader reader(std::move(*dataset));
  std::string other_size;
  for (const Index c : tracked->cameras) {
    const Camera& camera = cameras[static_cast<std::size_t>(c)];
    bool agree = true;
    std::vector<CaptionedImage> cells;
    for (const int id : spread(tracked->motion.motion.frame_ids, kReportPictures)) {
      const auto image = reader.image(c, id);
      if (!image) {
        continue;
      }
      agree = image->width == camera.width && image->height == camera.height;
      if (!agree) {
        other_size += (other_size.empty() ? "" : "; ") + camera.id + ": " +
                      size_text(image->width, image->height) + " pixels, calibrated for " +
                      size_text(camera.width, camera.height);
        break;
      }
      if (const auto drawn = draw(camera, tracked->motion, id, coloured(*image))) {
        cells.push_back({scaled(*drawn), "frame " + std::to_string(id)});
      }
    }
    if (agree && !cells.empty()) {
      return figure_html(contact_sheet(cells, {.columns = static_cast<int>(kReportPictures)}),
                         what + " over the images of camera " + camera.id);
    }
  }
  return other_size.empty() ? ""
                            : "<p class=\"warning\">" + what +
                                  " over images is left out: no camera's are as large as its "
                                  "calibration says (" +
                                  html_text(other_size) + ")</p>\n";
}

}  // namespace atelier
