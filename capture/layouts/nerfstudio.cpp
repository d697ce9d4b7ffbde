#include "capture/layouts/nerfstudio.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "capture/camera_conventions.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/json_numbers.h"
#include "capture/layouts/posed_images.h"
#include "capture/radial_fit.h"
#include "capture/sentence.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/io/json.h"
#include "core/printable.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

const WorldConvention kNerfstudioWorld = {0, "z"};
const WorldConvention kNerfstudioWritten = {1, "z"};

/// From their camera (x right, y up, z back) to ours and back.
const Eigen::DiagonalMatrix<double, 3> kAxes(1, -1, -1);

fs::path transforms_file(const fs::path& path) {
  if (fs::is_regular_file(path)) {
    return path.filename().string().starts_with("transforms") && path.extension() == ".json"
               ? path
               : fs::path();
  }
  for (const char* name : {"transforms.json", "transforms_train.json"}) {
    if (fs::is_regular_file(path / name)) {
      return path / name;
    }
  }
  return {};
}

/// A camera whose focal length is in widths, for images of a size.
Camera with_size(Camera camera, int width, int height) {
  camera.width = width;
  camera.height = height;
  camera.fx *= width;
  camera.fy *= width;
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  return camera;
}

/// A field of the frame, or else of the whole file.
std::optional<JsonPlace> find(const JsonPlace& frame, const JsonPlace& root,
                              const std::string& key) {
  const std::optional<JsonPlace> own = frame.find(key);
  return own ? own : root.find(key);
}

/// px, across ('x') or down ('y'), as instant-ngp reads it: x_fov in degrees, else fl_x, else
/// camera_angle_x in radians; 0 where none of them is there.
/// @param size  px of the image in that direction
double focal_length(const JsonPlace& frame, const JsonPlace& root, char axis, double size) {
  const auto of_angle = [&](const JsonPlace& place, double radians, const char* expected) {
    constexpr double kRight = 1.5707963267948966;
    if (!(radians > 0 && radians < 2 * kRight)) {
      place.fail("an angle of no camera", expected);
    }
    return 0.5 * size / std::tan(0.5 * radians);
  };
  if (const auto degrees = find(frame, root, std::string(1, axis) + "_fov")) {
    constexpr double kDegree = 3.14159265358979323846 / 180;
    return of_angle(*degrees, degrees->number() * kDegree, "degrees, below 180");
  }
  const auto focal = find(frame, root, std::string("fl_") + axis);
  if (focal && focal->number() < 0) {
    focal->fail("a negative focal length", "one above 0");
  }
  if (focal && focal->number() != 0) {
    return focal->number();
  }
  if (const auto angle = find(frame, root, std::string("camera_angle_") + axis)) {
    return of_angle(*angle, angle->number(), "radians, below pi");
  }
  return 0;
}

Camera intrinsics_of(const JsonPlace& frame, const JsonPlace& root) {
  Camera camera;
  const auto number = [&](const std::string& key, double fallback) {
    const std::optional<JsonPlace> place = find(frame, root, key);
    return place ? place->number() : fallback;
  };
  if (const std::optional<JsonPlace> width = find(frame, root, "w")) {
    camera.width = pixels_of(*width);
    const std::optional<JsonPlace> height = find(frame, root, "h");
    if (!height) {
      frame.fail("w without h", "both");
    }
    camera.height = pixels_of(*height);
  }
  // Where the size is not said, all is in widths until an image tells it.
  const double x_focal = focal_length(frame, root, 'x', camera.width > 0 ? camera.width : 1);
  const bool tall = camera.height > 0 || find(frame, root, "fl_y");
  const double y_focal = tall ? focal_length(frame, root, 'y', camera.height) : 0;
  camera.fx = x_focal > 0 ? x_focal : y_focal;
  camera.fy = y_focal > 0 ? y_focal : x_focal;
  camera.cx = number("cx", 0.5 * camera.width);
  camera.cy = number("cy", 0.5 * camera.height);
  if (camera.width == 0 && find(frame, root, "fl_x") && !find(frame, root, "cx")) {
    frame.fail("neither w nor cx", "the size, or the principal point");
  }
  if (!(camera.fx > 0) || !(camera.fy > 0)) {
    frame.fail("no focal length", "fl_x (and fl_y), camera_angle_x or x_fov");
  }
  return camera;
}

/// The pose of a frame; of instant-ngp's frames of a rolling shutter the one that does not change.
std::optional<JsonPlace> pose_of(const JsonPlace& frame) {
  const std::optional<JsonPlace> begin = frame.find("transform_matrix_start");
  const std::optional<JsonPlace> end = frame.find("transform_matrix_end");
  if (begin && end && !is_unsaid(*begin) && !is_unsaid(*end) &&
      matrix4_of(*begin) != matrix4_of(*end)) {
    end->fail("a camera that moves while it takes an image (rolling shutter)",
              "one pose, as of a global shutter");
  }
  return begin ? begin : frame.find("transform_matrix");
}

/// Cameras and frames all of whose images are held out.
void take_held_out(Dataset& dataset, const std::set<fs::path>& held) {
  const auto is_held = [&](const DataLocation& place) { return held.contains(place.file); };
  const std::size_t all = held.size();
  std::size_t told = 0;
  std::map<int, std::pair<int, int>> frames;  // held, all of other cameras
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const auto& images = dataset.frames[c].images;
    const auto count = std::count_if(images.begin(), images.end(),
                                     [&](const auto& one) { return is_held(one.second); });
    if (count > 0 && count == std::ssize(images)) {
      dataset.info.held_out_cameras.push_back(dataset.cameras[c].id);
      told += images.size();
      continue;
    }
    for (const auto& [frame, place] : images) {
      frames[frame].first += is_held(place) ? 1 : 0;
      ++frames[frame].second;
    }
  }
  for (const auto& [frame, counts] : frames) {
    if (counts.first > 0 && counts.first == counts.second) {
      dataset.info.held_out_frames.push_back(frame);
      told += static_cast<std::size_t>(counts.first);
    }
  }
  if (told < all) {
    dataset.findings.push_back({Severity::Warning, "held-out-single", "transforms.json",
                                std::to_string(all - told) +
                                    " images of test_filenames or val_filenames are neither all of "
                                    "a camera nor all of a frame",
                                "stages open them: cameras and frames can be held out"});
  }
}

/// Adds the lens of a frame, in nerfstudio's words or in those of instant-ngp. nerfstudio's k4 is
/// the fourth coefficient of the radial polynomial, 1 + r2 (k1 + r2 (k2 + r2 (k3 + r2 k4)))
/// (nerfstudio/cameras/camera_utils.py), which no lens of ours has: a rational one stands for it.
/// @return  largest error of that, px of the calibrated image (in widths where its size is not
/// said)
double add_lens(Camera& camera, const JsonPlace& frame, const JsonPlace& root) {
  // All coefficients as one list, which nerfstudio takes before any of their names.
  constexpr std::array kListed = {"k1", "k2", "k3", "k4", "p1", "p2"};
  std::vector<double> listed;
  if (const auto list = find(frame, root, "distortion_params")) {
    listed = list->numbers();
    if (listed.size() != kListed.size()) {
      list->fail(counted(std::ssize(listed), "number"), "k1, k2, k3, k4, p1 and p2");
    }
  }
  const auto number = [&](const std::string& key) {
    const auto* const at = std::find(kListed.begin(), kListed.end(), key);
    if (!listed.empty() && at != kListed.end()) {
      return listed[static_cast<std::size_t>(at - kListed.begin())];
    }
    const std::optional<JsonPlace> place = find(frame, root, key);
    return place ? place->number() : 0.0;
  };
  const std::optional<JsonPlace> model = find(frame, root, "camera_model");
  const std::string name = model ? model->text() : "OPENCV";
  // nerfstudio reads the coefficients that there are, whatever a perspective camera is called.
  constexpr std::array kPerspective = {"OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "RADIAL",
                                       "SIMPLE_RADIAL"};
  const std::optional<JsonPlace> flag = find(frame, root, "is_fisheye");
  const bool fisheye = name == "OPENCV_FISHEYE" || (flag && flag->boolean());
  if (!fisheye && std::find(kPerspective.begin(), kPerspective.end(), name) == kPerspective.end()) {
    model->fail("'" + name.substr(0, 40) + "'",
                "OPENCV, OPENCV_FISHEYE, RADIAL, SIMPLE_RADIAL, PINHOLE or SIMPLE_PINHOLE");
  }
  if (const auto ftheta = find(frame, root, "ftheta_p0")) {
    ftheta->fail("an f-theta lens", "a perspective one, or an equidistant fisheye (is_fisheye)");
  }
  for (const char* other : {"latlong", "equirectangular"}) {
    if (const auto place = find(frame, root, other)) {
      place->fail("a panorama", "a perspective image, or an equidistant fisheye (is_fisheye)");
    }
  }
  for (const char* unread : {"k5", "k6", "s1", "s2", "s3", "s4", "b1", "b2"}) {
    if (number(unread) != 0) {
      find(frame, root, unread)
          ->fail("a coefficient that no program reads here", "k1, k2, k3, k4, p1 and p2 alone");
    }
  }
  const std::array<double, 4> radial = {number("k1"), number("k2"), number("k3"), number("k4")};
  auto& d = camera.distortion;
  if (fisheye) {
    camera.distortion_model = Distortion::Fisheye;
    std::copy(radial.begin(), radial.end(), d.begin());
    return 0;
  }
  d = {radial[0], radial[1], number("p1"), number("p2"), radial[2]};
  if (radial[3] != 0 || std::any_of(d.begin(), d.end(), [](double k) { return k != 0; })) {
    camera.distortion_model = Distortion::Brown;
  }
  if (radial[3] == 0) {
    return 0;
  }
  const RadialFit fit = rational_of_polynomial(radial, corner_reach(camera));
  const std::vector<double>& k = fit.coefficients;
  d = {k[0], k[1], d[2], d[3], k[2], k[3], k[4], k[5]};
  const double error = fit.error * std::max(camera.fx, camera.fy);
  constexpr double kMost = 0.1;
  if (!(error < kMost * std::max(1, camera.width / 1000))) {
    find(frame, root, listed.empty() ? "k4" : "distortion_params")
        ->fail("a polynomial of four coefficients that no rational lens is near to",
               "a lens, not folding back inside the image");
  }
  return error;
}

}  // namespace

std::string recognize_nerfstudio(const fs::path& path) {
  const fs::path file = transforms_file(path);
  return file.empty() ? "" : file.filename().string();
}

std::vector<NerfFrame> parse_transforms(std::string_view text, const std::string& file,
                                        const Limits& limits) {
  const nlohmann::json parsed = parse_python_json(text, file, limits);
  const JsonPlace root(parsed, file);
  const std::vector<JsonPlace> items = root.at("frames").items();
  if (static_cast<std::int64_t>(items.size()) > limits.frames) {
    root.fail(std::to_string(items.size()) + " frames", "at most " + std::to_string(limits.frames));
  }
  std::vector<NerfFrame> frames;
  std::size_t masks = 0;
  for (const JsonPlace& item : items) {
    NerfFrame frame;
    frame.file_path = item.at("file_path").text();
    frame.mask_path = item.text_or("mask_path", "");
    masks += frame.mask_path.empty() ? 0 : 1;
    frame.camera = intrinsics_of(item, root);
    frame.lens_error = add_lens(frame.camera, item, root);
    const std::optional<JsonPlace> place = pose_of(item);
    if (!place || is_unsaid(*place)) {
      frame.camera.camera_from_world_rotation.setZero();  // left out by open_dataset
      frames.push_back(std::move(frame));
      continue;
    }
    const Eigen::Matrix4d world_from_camera = matrix4_of(*place);
    if (world_from_camera.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
      place->fail("a last row that is not 0 0 0 1",
                  "world from camera (a transposed matrix has its translation there)");
    }
    const Eigen::Matrix3d rotation = world_from_camera.topLeftCorner<3, 3>();
    frame.camera.camera_from_world_rotation = kAxes * rotation.transpose();
    frame.camera.camera_from_world_translation =
        -(frame.camera.camera_from_world_rotation * world_from_camera.topRightCorner<3, 1>());
    check_numbers(frame.camera, file);
    frames.push_back(std::move(frame));
  }
  if (frames.empty()) {
    root.fail("no frames", "at least one");
  }
  const auto named = [&](const char* list) {
    std::set<std::string> names;
    if (const std::optional<JsonPlace> place = root.find(list)) {
      for (const JsonPlace& name : place->items()) {
        names.insert(name.text());
      }
    }
    return names;
  };
  const std::set<std::string> train = named("train_filenames");
  std::set<std::string> held = named("test_filenames");
  held.merge(named("val_filenames"));
  for (NerfFrame& frame : frames) {
    frame.held_out = held.contains(frame.file_path) && !train.contains(frame.file_path);
  }
  if (masks != 0 && masks != frames.size()) {
    root.fail(
        "masks of " + std::to_string(masks) + " of " + std::to_string(frames.size()) + " frames",
        "mask_path for all or for none");
  }
  return frames;
}

Dataset read_nerfstudio(const fs::path& path, const DatasetOptions& /*options*/,
                        const Limits& limits) {
  const fs::path file = transforms_file(path);
  if (file.empty()) {
    throw DataError(path.string(), "", "no transforms.json", "the file of poses");
  }
  const fs::path root = file.parent_path().empty() ? fs::path(".") : file.parent_path();
  std::vector<PosedImage> posed;
  std::set<fs::path> held;
  ImageHeader first;  // NeRF's images all have one size
  double lens_error = 0;
  for (NerfFrame& frame :
       parse_transforms(read_file_text(file, limits.text_file_bytes), file.string(), limits)) {
    PosedImage entry;
    lens_error = std::max(lens_error, frame.lens_error);
    if (frame.file_path.starts_with("./")) {
      frame.file_path.erase(0, 2);
    }
    entry.name = frame.file_path;
    entry.camera = frame.camera;
    fs::path image = path_under(root, frame.file_path, file.string(), "file_path");
    if (!fs::exists(image) && image.extension().empty()) {
      image += ".png";  // NeRF's own files leave it out
    }
    entry.image.file = image;
    if (entry.camera.width == 0 && entry.camera.cx == 0) {
      first = first.width > 0 ? first : read_image_header(image, limits);
      entry.camera = with_size(entry.camera, first.width, first.height);
      lens_error = std::max(lens_error, frame.lens_error * first.width);
    }
    if (!frame.mask_path.empty()) {
      if (frame.mask_path.starts_with("./")) {
        frame.mask_path.erase(0, 2);
      }
      entry.mask.file = path_under(root, frame.mask_path, file.string(), "mask_path");
    }
    if (frame.held_out) {
      held.insert(entry.image.file);
    }
    posed.push_back(std::move(entry));
  }
  Dataset dataset = dataset_of(posed, file.string());
  dataset.root = root;
  dataset.world_convention = kNerfstudioWorld;
  take_held_out(dataset, held);
  if (lens_error > 0) {
    dataset.findings.push_back(
        {Severity::Note, "lens-refitted", file.string(),
         sentence("k4 of its radial polynomial is no coefficient of OpenCV's lens; a rational one "
                  "stands for it, off by at most %.2g px",
                  lens_error),
         "nothing"});
  }
  return dataset;
}

std::vector<std::string> write_nerfstudio(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost = {
      "keypoints and labels are left out (masks of the person are kept)"};
  nlohmann::ordered_json root;
  root["frames"] = nlohmann::ordered_json::array();
  nlohmann::ordered_json splits;
  bool any_held_out = false;
  const std::vector<Camera> cameras = cameras_in(source, kNerfstudioWritten);
  // nerfstudio takes the lens from the top of the file alone, and otherwise perspective for all.
  const auto is_fisheye = [](const Camera& camera) {
    return camera.distortion_model == Distortion::Fisheye;
  };
  const auto fisheyes = std::count_if(cameras.begin(), cameras.end(), is_fisheye);
  root["camera_model"] = fisheyes > 0 ? "OPENCV_FISHEYE" : "OPENCV";
  if (fisheyes > 0 && fisheyes < std::ssize(cameras)) {
    lost.emplace_back(
        "nerfstudio reads one lens for all cameras of a file, and takes the perspective ones for "
        "fisheyes: write cameras of one kind alone (--capture.leave-out)");
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& camera = cameras[c];
    Eigen::Matrix4d world_from_camera = Eigen::Matrix4d::Identity();
    world_from_camera.topLeftCorner<3, 3>() = camera.camera_from_world_rotation.transpose() * kAxes;
    world_from_camera.topRightCorner<3, 1>() = camera_center(camera);
    if (camera.gain != Eigen::Vector3d::Ones()) {
      lost.emplace_back("gains of the cameras are left out");
    }
    std::vector<int> frames = source.sequence.frame_ids;
    if (frames.empty()) {
      frames = {0};  // the pose has no other place
    }
    std::size_t number = 0;
    for (const int frame : frames) {
      const auto index = static_cast<Index>(c);
      const std::string stem = camera.id + "_" + frame_name(frame);
      const std::string extension = write_picture(source, index, frame, out / "images" / stem);
      if (extension.empty() && !source.sequence.frame_ids.empty()) {
        continue;
      }
      nlohmann::ordered_json entry;
      entry["file_path"] = "images/" + stem + (extension.empty() ? ".png" : extension);
      if (write_mask(source, index, frame, out / "masks" / (stem + ".png"))) {
        entry["mask_path"] = "masks/" + stem + ".png";
      }
      const auto& d = camera.distortion;
      const bool fisheye = camera.distortion_model == Distortion::Fisheye;
      entry["camera_model"] = fisheye ? "OPENCV_FISHEYE" : "OPENCV";
      entry["w"] = camera.width;
      entry["h"] = camera.height;
      entry["fl_x"] = camera.fx;
      entry["fl_y"] = camera.fy;
      entry["cx"] = camera.cx;
      entry["cy"] = camera.cy;
      if (fisheye) {
        for (std::size_t i = 0; i < 4; ++i) {
          entry["k" + std::to_string(i + 1)] = d[i];
        }
      } else if (camera.distortion_model == Distortion::Brown) {
        entry["p1"] = d[2];
        entry["p2"] = d[3];
        const std::vector<double> radial = polynomial_radial(camera, 4, lost);
        for (std::size_t i = 0; i < radial.size(); ++i) {
          entry["k" + std::to_string(i + 1)] = radial[i];
        }
      }
      entry["transform_matrix"] = rows_json(world_from_camera);
      if (source.sequence.fps > 0) {
        entry["time"] = static_cast<double>(number++) / source.sequence.fps;
      }
      root["frames"].push_back(entry);
      const bool held_out = is_held_out(source, index, frame);
      any_held_out = any_held_out || held_out;
      splits[held_out ? "test_filenames" : "train_filenames"].push_back(entry["file_path"]);
    }
  }
  if (any_held_out) {  // what is judged during a training is held out as well
    splits["val_filenames"] = splits["test_filenames"];
    root.update(splits);
  }
  write_file_atomically(out / "transforms.json", root.dump(1) + "\n");
  return lost;
}

}  // namespace atelier
