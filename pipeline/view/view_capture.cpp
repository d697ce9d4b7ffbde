#include "pipeline/view/view_capture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "capture/check_frames.h"
#include "capture/check_keypoints.h"
#include "capture/frame_reader.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints3d_file.h"
#include "capture/skeleton_lines.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/limits.h"
#include "core/median.h"
#include "core/printable.h"
#include "core/render/contact_sheet.h"
#include "pipeline/pictures/report_page.h"
#include "pipeline/view/view_data.h"

namespace atelier {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kThumbWidth = 192;  // px, of the image in a camera's frustum

/// "" for a format that browsers do not show.
std::string_view browser_type(ImageFormat format) {
  switch (format) {
    case ImageFormat::Png:
      return "image/png";
    case ImageFormat::Jpeg:
      return "image/jpeg";
    case ImageFormat::WebP:
      return "image/webp";
    case ImageFormat::Tiff:
    case ImageFormat::Bmp:
    case ImageFormat::Avif:
      break;
  }
  return "";
}

/// One reader for all files of a capture; it is for one thread at a time.
struct CaptureSource {
  explicit CaptureSource(Dataset dataset) : reader(std::move(dataset)) {}
  std::mutex mutex;
  FrameReader reader;
  Index last_camera = -1;  ///< of `last`
  int last_frame = -1;
  std::optional<Image> last;

  /// The image, which the next call may ask for again: a video goes back to its beginning for that.
  const std::optional<Image>& image(Index camera, int frame_id) {
    if (camera != last_camera || frame_id != last_frame) {
      last = reader.image(camera, frame_id);
      last_camera = camera;
      last_frame = frame_id;
    }
    return last;
  }

  /// The type of an image's own bytes, "" where a browser does not show them as they are: a frame
  /// of a video, another format, an image that is wider.
  std::string_view browser_type_of(Index camera, int frame_id, int width) {
    const auto place =
        reader.dataset().frames[static_cast<std::size_t>(camera)].images.find(frame_id);
    if (!place || place->index >= 0) {
      return "";
    }
    const std::optional<ImageHeader> header = reader.image_header(camera, frame_id);
    // A browser would turn what EXIF says to turn; everything else is of the stored pixels.
    return header && header->width <= width && header->bit_depth == 8 && header->orientation == 1
               ? browser_type(header->format)
               : "";
  }
};

std::string address(std::string_view type, std::span<const std::byte> bytes) {
  return "data:" + std::string(type) + ";base64," + base64_text(bytes);
}

std::string address(std::string_view type, const std::string& bytes) {
  return address(type, std::as_bytes(std::span(bytes)));
}

/// An image no wider than `width`, as JPEG.
std::string reduced(const Image& image, int width) {
  const int height = std::max(1, image.height * width / std::max(image.width, 1));
  return address("image/jpeg",
                 image_bytes(image.width > width ? resized(image, width, height) : image,
                             ImageFormat::Jpeg, {.quality = 88}));
}

/// Numbers of pixels as a grey PNG no wider than `width`, each that of the nearest pixel.
std::string reduced(const ByteImage& numbers, int width) {
  if (numbers.width <= width) {
    return address("image/png", image_bytes(numbers, ImageFormat::Png));
  }
  ByteImage small(width, std::max(1, numbers.height * width / numbers.width), 1);
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      small.at(x, y) = numbers.at(x * numbers.width / width, y * numbers.height / small.height);
    }
  }
  return address("image/png", image_bytes(small, ImageFormat::Png));
}

/// Adds what is wrong with a part of a frame to the header.
void tell_problem(ViewData& data, const std::function<void()>& fill) {
  if (const auto problem = problem_of(fill)) {
    data.header["problems"].push_back(*problem);
  }
}

std::string frame_file(const std::string& key, CaptureSource& source, Index camera, int frame_id,
                       int width) {
  const std::lock_guard lock(source.mutex);
  FrameReader& reader = source.reader;
  ViewData data;
  tell_problem(data, [&] {
    const std::string_view type = source.browser_type_of(camera, frame_id, width);
    const std::optional<EncodedImage> encoded =
        type.empty() ? std::nullopt : reader.encoded_image(camera, frame_id);
    const std::optional<Image>& image = source.image(camera, frame_id);  // refuses a torn one
    if (encoded) {
      data.header["image"] = address(type, std::span(encoded->bytes));
    } else if (image) {
      data.header["image"] = reduced(*image, width);
    }
  });
  tell_problem(data, [&] {
    if (const std::optional<ByteImage> labels = reader.labels(camera, frame_id)) {
      data.header["labels"] = reduced(*labels, width);
    }
  });
  tell_problem(data, [&] {
    if (const std::optional<ByteImage> mask = reader.mask(camera, frame_id)) {
      data.header["mask"] = reduced(*mask, width);
    }
  });
  tell_problem(data, [&] {
    Json people = Json::array();
    for (const PersonKeypoints& person : reader.keypoints(camera, frame_id)) {
      Json points = Json::array();
      for (Index k = 0; k < person.points.rows(); ++k) {
        points.push_back({person.points(k, 0), person.points(k, 1), person.points(k, 2)});
      }
      people.push_back(std::move(points));
    }
    if (!people.empty()) {
      data.header["keypoints"] = std::move(people);
    }
  });
  return data.script(key);
}

std::string thumb_file(const std::string& key, CaptureSource& source, Index camera, int frame_id) {
  const std::lock_guard lock(source.mutex);
  ViewData data;
  tell_problem(data, [&] {
    if (const std::optional<Image>& image = source.image(camera, frame_id)) {
      data.header["image"] = reduced(*image, kThumbWidth);
    }
  });
  return data.script(key);
}

/// Keypoints of one person in space: metres, confidence, standard deviation in metres.
struct FramePoints {
  int frame_id = 0;
  std::vector<Eigen::Matrix<double, 5, 1>> points;
};

double confidence_of(const Keypoints2d& points) {
  return points.rows() == 0 ? 0 : points.col(2).sum();
}

/// Median distance, px, of the points that a camera detected to where those in space are in its
/// image; none of fewer than four points.
std::optional<double> residual_of(const Camera& camera, const FramePoints& frame,
                                  const Keypoints2d& detected) {
  constexpr double kSure = 0.3;
  constexpr std::size_t kFewest = 4;
  std::vector<double> distances;
  for (Index k = 0; k < std::min<Index>(detected.rows(), static_cast<Index>(frame.points.size()));
       ++k) {
    const auto& point = frame.points[static_cast<std::size_t>(k)];
    if (detected(k, 2) < kSure || point[3] <= 0) {
      continue;
    }
    if (const auto pixel = project(camera, point.head<3>())) {
      distances.push_back((*pixel - detected.row(k).head<2>().transpose()).norm());
    }
  }
  if (distances.size() < kFewest) {
    return std::nullopt;
  }
  return median(distances);
}

std::vector<FramePoints> read_points(const std::filesystem::path& folder,
                                     const std::vector<int>& frame_ids) {
  std::vector<FramePoints> frames;
  for (const int id : frame_ids) {
    char name[32];
    std::snprintf(name, sizeof name, "%06d.json", id);
    if (!std::filesystem::exists(folder / name)) {
      continue;
    }
    const std::string text = read_file_text(folder / name, Limits{}.text_file_bytes);
    const std::string file = (folder / name).string();
    const std::vector<PersonPoints> people = parse_keypoints3d(text, file);
    const std::map<int, std::vector<double>> deviations = parse_keypoint_deviations(text, file);
    if (people.empty()) {
      continue;
    }
    FramePoints frame{id, {}};
    const auto own = deviations.find(people.front().id);
    for (Index k = 0; k < people.front().points.rows(); ++k) {
      Eigen::Matrix<double, 5, 1> point = Eigen::Matrix<double, 5, 1>::Zero();
      point.head<4>() = people.front().points.row(k).transpose();
      point[4] = own == deviations.end() ? 0 : own->second[static_cast<std::size_t>(k)];
      frame.points.push_back(point);
    }
    frames.push_back(std::move(frame));
  }
  return frames;
}

std::vector<FramePoints> triangulated_points(FrameReader& reader, ViewData& data) {
  const KeypointCheck check = check_keypoints(reader);
  const std::array roots = {reader.dataset().root.string()};
  for (const Finding& finding : check.findings) {
    data.header["findings"].push_back(
        {{"severity", severity_name(finding.severity)},
         {"text", printable(without_folders(to_string(finding), roots))},
         {"place", printable(without_folders(finding.place, roots))}});
  }
  std::vector<FramePoints> frames;
  for (std::size_t f = 0; f < check.found.frames.size(); ++f) {
    FramePoints frame{check.frame_ids[f], {}};
    for (const SpacePoint& one : check.found.frames[f].points) {
      Eigen::Matrix<double, 5, 1> point;
      point << one.place, one.confidence, std::sqrt(one.covariance.trace() / 3);
      frame.points.push_back(point);
    }
    frames.push_back(std::move(frame));
  }
  return frames;
}

/// Keypoints in space, and how far from them each camera's detections are.
std::string agreement_file(const std::string& key, const CaptureSource& source,
                           const std::filesystem::path& keypoints3d,
                           const std::vector<int>& frame_ids) {
  FrameReader reader(source.reader.dataset());  // its own: this takes its time
  const Dataset& dataset = reader.dataset();
  ViewData data;
  tell_problem(data, [&] {
    const std::vector<FramePoints> frames = keypoints3d.empty()
                                                ? triangulated_points(reader, data)
                                                : read_points(keypoints3d, frame_ids);
    Json json = Json::array();
    std::vector<std::vector<double>> all(dataset.cameras.size());
    for (const FramePoints& frame : frames) {
      Json points = Json::array();
      for (const auto& point : frame.points) {
        points.push_back({point[0], point[1], point[2], point[3], point[4]});
      }
      Json residuals = Json::array();
      for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
        Keypoints2d best;
        for (const PersonKeypoints& person :
             reader.keypoints(static_cast<Index>(c), frame.frame_id)) {
          if (confidence_of(person.points) > confidence_of(best)) {
            best = person.points;
          }
        }
        const std::optional<double> residual = residual_of(dataset.cameras[c], frame, best);
        residuals.push_back(residual ? Json(*residual) : Json(nullptr));
        if (residual) {
          all[c].push_back(*residual);
        }
      }
      json.push_back(
          {{"frame", frame.frame_id}, {"points", std::move(points)}, {"residuals", residuals}});
    }
    data.header["frames"] = std::move(json);
    data.header["cameras"] = Json::array();
    for (std::vector<double>& residuals : all) {
      data.header["cameras"].push_back(residuals.empty() ? Json(nullptr) : Json(median(residuals)));
    }
    const std::vector<std::string>& names = keypoint_schema_names();
    if (std::find(names.begin(), names.end(), dataset.info.keypoint_schema) != names.end()) {
      data.header["limbs"] =
          skeleton_lines(keypoint_schema(dataset.info.keypoint_schema), SkeletonDetail::Full);
    }
  });
  return data.script(key);
}

Json json_of(const Camera& camera) {
  Json rotation = Json::array();
  for (Index i = 0; i < 9; ++i) {
    rotation.push_back(camera.camera_from_world_rotation(i / 3, i % 3));
  }
  const Eigen::Vector3d& t = camera.camera_from_world_translation;
  constexpr std::array kModels = {"none", "brown", "fisheye"};
  return {{"id", camera.id},
          {"width", camera.width},
          {"height", camera.height},
          {"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy},
          {"model", kModels[static_cast<std::size_t>(camera.distortion_model)]},
          {"distortion", camera.distortion},
          {"rotation", std::move(rotation)},
          {"translation", {t.x(), t.y(), t.z()}}};
}

}  // namespace

Json put_capture(ViewPage& page, Dataset dataset, std::filesystem::path keypoints3d,
                 const std::vector<int>& frame_ids, const std::string& folder,
                 const ViewPageOptions& options) {
  const std::vector<std::string> held = dataset.info.held_out_cameras;
  const auto source =
      std::make_shared<CaptureSource>(without_held_out_pictures(std::move(dataset)));
  const Dataset& content = source->reader.dataset();
  Json json{{"data", folder},
            {"held_out_frames", content.info.held_out_frames},
            {"cameras", Json::array()}};
  const auto put = [&](const std::string& name,
                       std::function<std::string(const std::string&)> make) {
    put_data(page, folder + "/" + name, std::move(make));
  };
  for (std::size_t c = 0; c < content.cameras.size(); ++c) {
    const auto camera = static_cast<Index>(c);
    Json one = json_of(content.cameras[c]);
    one["held_out"] = std::find(held.begin(), held.end(), content.cameras[c].id) != held.end();
    one["frames"] = Json::array();
    for (const int id : frame_ids) {
      if (!content.frames[c].images.contains(id) && !content.frames[c].keypoints.contains(id)) {
        continue;
      }
      one["frames"].push_back(id);
      const std::string name = std::to_string(c) + "/" + std::to_string(id);
      put(name, [source, camera, id, width = options.image_width](const std::string& key) {
        return frame_file(key, *source, camera, id, width);
      });
      put(name + "_small", [source, camera, id](const std::string& key) {
        return thumb_file(key, *source, camera, id);
      });
    }
    json["cameras"].push_back(std::move(one));
  }
  const bool detected =
      std::any_of(content.frames.begin(), content.frames.end(),
                  [](const CameraFrames& frames) { return !frames.keypoints.empty(); });
  if (content.calibrated && detected) {
    json["agreement"] = true;
    put("agreement",
        [source, keypoints3d = std::move(keypoints3d), frame_ids](const std::string& key) {
          return agreement_file(key, *source, keypoints3d, frame_ids);
        });
  }
  return json;
}

std::string image_address(const std::filesystem::path& file) {
  const std::vector<std::byte> bytes = read_file_bytes(file, Limits{}.image_file_bytes);
  const ImageHeader header = read_image_header(bytes, file.string());
  const std::string_view type = browser_type(header.format);
  return type.empty() ? address("image/png", image_bytes(read_byte_image(bytes, file.string()),
                                                         ImageFormat::Png))
                      : address(type, std::span(bytes));
}

}  // namespace atelier
