#include "capture/layouts/colmap.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <set>

#include "capture/camera_conventions.h"
#include "capture/layouts/camera_side.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/posed_images.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/text_scanner.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

/// Nothing is said of the world; ours is written as it is.
const WorldConvention kColmapWorld = {0, ""};
const WorldConvention kColmapWritten = {1, "y"};

/// COLMAP's camera models (src/colmap/sensor/models.h). `slots` says what each parameter is: f both
/// focal lengths, x and y one each, u and v the principal point, 0 to 7 a coefficient of ours, -
/// one that must be 0, since nothing of ours is its equal.
struct Model {
  int id;
  const char* name;
  const char* slots;  ///< nullptr: known, but nothing here is its equal
  Distortion distortion;
  int parameters;
};
constexpr std::array kColmapModels = {
    Model{0, "SIMPLE_PINHOLE", "fuv", Distortion::None, 3},
    Model{1, "PINHOLE", "xyuv", Distortion::None, 4},
    Model{2, "SIMPLE_RADIAL", "fuv0", Distortion::Brown, 4},
    Model{3, "RADIAL", "fuv01", Distortion::Brown, 5},
    Model{4, "OPENCV", "xyuv0123", Distortion::Brown, 8},
    Model{5, "OPENCV_FISHEYE", "xyuv0123", Distortion::Fisheye, 8},
    Model{6, "FULL_OPENCV", "xyuv01234567", Distortion::Brown, 12},
    Model{7, "FOV", nullptr, Distortion::None, 5},
    Model{8, "SIMPLE_RADIAL_FISHEYE", "fuv0", Distortion::Fisheye, 4},
    Model{9, "RADIAL_FISHEYE", "fuv01", Distortion::Fisheye, 5},
    Model{10, "THIN_PRISM_FISHEYE", "xyuv01--23--", Distortion::Fisheye, 12},
    Model{11, "RAD_TAN_THIN_PRISM_FISHEYE", "xyuv0123--------", Distortion::Fisheye, 16},
    Model{12, "SIMPLE_DIVISION", "fuv-", Distortion::None, 4},
    Model{13, "DIVISION", "xyuv-", Distortion::None, 5},
    Model{14, "SIMPLE_FISHEYE", "fuv", Distortion::Fisheye, 3},
    Model{15, "FISHEYE", "xyuv", Distortion::Fisheye, 4},
};

std::string read_models() {
  std::string names;
  for (const Model& model : kColmapModels) {
    if (model.slots != nullptr) {
      names += (names.empty() ? "" : ", ") + std::string(model.name);
    }
  }
  return names;
}

Camera camera_of_model(const Model& model, const std::vector<double>& values, std::int64_t width,
                       std::int64_t height, const auto& fail) {
  Camera camera;
  camera.width = static_cast<int>(width);
  camera.height = static_cast<int>(height);
  camera.distortion_model = model.distortion;
  for (std::size_t i = 0; i < values.size(); ++i) {
    switch (model.slots[i]) {
      case 'f':
        camera.fx = camera.fy = values[i];
        break;
      case 'x':
        camera.fx = values[i];
        break;
      case 'y':
        camera.fy = values[i];
        break;
      case 'u':
        camera.cx = values[i];
        break;
      case 'v':
        camera.cy = values[i];
        break;
      case '-':
        if (values[i] != 0) {
          fail(std::string(model.name) + " with " + number_text(values[i]) + " as parameter " +
                   std::to_string(i + 1),
               "0 there: no lens of OpenCV has its part");
        }
        break;
      default:
        camera.distortion[static_cast<std::size_t>(model.slots[i] - '0')] = values[i];
    }
  }
  return camera;
}

/// The smallest model that holds a camera, and its parameters.
std::pair<const Model*, std::vector<double>> model_of(const Camera& camera) {
  const auto& d = camera.distortion;
  const bool rational = d[4] != 0 || d[5] != 0 || d[6] != 0 || d[7] != 0;
  const int id = camera.distortion_model == Distortion::Fisheye ? 5
                 : camera.distortion_model == Distortion::None  ? 1
                 : rational                                     ? 6
                                                                : 4;
  const Model& model = kColmapModels[static_cast<std::size_t>(id)];
  std::vector<double> values = {camera.fx, camera.fy, camera.cx, camera.cy};
  values.insert(values.end(), d.begin(), d.begin() + (model.parameters - 4));
  return {&model, values};
}

ColmapImage image_of(std::uint32_t id, const std::array<double, 7>& pose, std::uint32_t camera_id,
                     std::string name, const auto& fail) {
  ColmapImage image;
  image.id = id;
  image.camera_id = camera_id;
  image.name = std::move(name);
  const Eigen::Quaterniond q(pose[0], pose[1], pose[2], pose[3]);
  constexpr double kShortest = 1e-6;
  constexpr double kFarthest = 1e12;
  if (!(q.norm() > kShortest) || !(q.norm() < kFarthest)) {
    fail("a quaternion of no length", "QW QX QY QZ of length 1");
  }
  image.camera_from_world_rotation = q.normalized().toRotationMatrix();
  image.camera_from_world_translation = {pose[4], pose[5], pose[6]};
  if (!image.camera_from_world_translation.allFinite()) {
    fail("a translation that is not finite", "numbers");
  }
  return image;
}

void check_size(std::int64_t width, std::int64_t height, const auto& fail) {
  if (!is_camera_side(static_cast<double>(width)) || !is_camera_side(static_cast<double>(height))) {
    fail("an image of " + std::to_string(width) + " x " + std::to_string(height),
         "pixels a side, " + camera_side_range());
  }
}

/// Folder of the model, "" if there is none.
fs::path model_folder(const fs::path& path, const char* file) {
  for (const fs::path& folder :
       {path / "sparse" / "0", path / "sparse", path, path / "colmap" / "sparse" / "0"}) {
    if (fs::exists(folder / file)) {
      return folder;
    }
  }
  return {};
}

Dataset dataset_of_model(const fs::path& path, const std::map<std::uint32_t, Camera>& cameras,
                         const std::vector<ColmapImage>& images, const std::string& file) {
  // The images lie beside sparse/, also if the folder of the model itself was named.
  fs::path root = path;
  for (const fs::path& folder : {path, path / "..", path / ".." / ".."}) {
    if (fs::is_directory(folder / "images")) {
      root = folder.lexically_normal();
      break;
    }
  }
  std::vector<PosedImage> posed;
  for (const ColmapImage& image : images) {
    const auto camera = cameras.find(image.camera_id);
    if (camera == cameras.end()) {
      throw DataError(file, "image " + std::to_string(image.id),
                      "camera " + std::to_string(image.camera_id), "a camera of the cameras file");
    }
    PosedImage entry;
    entry.name = image.name;
    entry.camera = camera->second;
    entry.camera.camera_from_world_rotation = image.camera_from_world_rotation;
    entry.camera.camera_from_world_translation = image.camera_from_world_translation;
    const std::string where = "image " + std::to_string(image.id);
    entry.image.file = path_under(root / "images", image.name, file, where);
    entry.mask.file = path_under(root / "masks", image.name + ".png", file, where);
    posed.push_back(std::move(entry));
  }
  std::size_t missing = 0;
  for (PosedImage& entry : posed) {
    if (!fs::exists(entry.mask.file)) {
      entry.mask = {};
    }
    missing += fs::exists(entry.image.file) ? 0 : 1;
  }
  Dataset dataset = dataset_of(posed, file);
  if (missing > 0) {
    dataset.findings.push_back({missing == posed.size() ? Severity::Warning : Severity::Error,
                                "images-missing", (root / "images").string(),
                                std::to_string(missing) + " of the " +
                                    std::to_string(posed.size()) + " images are not there",
                                "put them into images/ under the names of the images file"});
    for (CameraFrames& frames : dataset.frames) {
      const FrameLocations listed = std::exchange(frames.images, {});
      for (const auto& [frame, place] : listed) {
        if (fs::exists(place.file)) {
          frames.images.add(frame, place);
        }
      }
    }
  }
  dataset.root = root;
  dataset.world_convention = kColmapWorld;
  return dataset;
}

/// Cameras and images in COLMAP's terms, of both writers.
struct WrittenModel {
  std::vector<Camera> cameras;
  std::vector<ColmapImage> images;
  std::string held_out;  ///< names of images, a line each
};

WrittenModel write_pictures(const LayoutSource& source, const fs::path& out) {
  WrittenModel model;
  model.cameras = cameras_in(source, kColmapWritten);
  std::uint32_t id = 0;
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    const Camera& camera = model.cameras[c];
    const auto index = static_cast<Index>(c);
    const auto add = [&](const std::string& name) {
      model.images.push_back({++id, static_cast<std::uint32_t>(c + 1), name,
                              camera.camera_from_world_rotation,
                              camera.camera_from_world_translation});
    };
    bool any = false;
    for (const int frame : source.sequence.frame_ids) {
      const std::string stem = camera.id + "/" + frame_name(frame);
      const std::string extension = write_picture(source, index, frame, out / "images" / stem);
      if (!extension.empty()) {
        write_mask(source, index, frame, out / "masks" / (stem + extension + ".png"));
        add(stem + extension);
        model.held_out += is_held_out(source, index, frame) ? stem + extension + "\n" : "";
        any = true;
      }
    }
    if (!any) {
      add(camera.id + "/" + frame_name(0) + ".png");  // the pose has no other place
    }
  }
  return model;
}

/// The images that a training leaves closed, as 3D Gaussian splatting reads them beside the model.
void write_held_out(const WrittenModel& written, const fs::path& sparse) {
  if (!written.held_out.empty()) {
    write_file_atomically(sparse / "test.txt", written.held_out);
  }
}

std::vector<std::string> losses(const LayoutSource& source) {
  std::vector<std::string> lost = {
      "frame rate, keypoints and labels are left out (masks of the person are kept)"};
  for (const Camera& camera : source.cameras()) {
    if (camera.gain != Eigen::Vector3d::Ones()) {
      lost.emplace_back("gains of the cameras are left out");
      break;
    }
  }
  for (const Camera& camera : source.cameras()) {
    if (camera.distortion_model == Distortion::Fisheye &&
        camera.distortion == std::array<double, 8>{}) {
      lost.emplace_back(
          "COLMAP 3.8 copies images of an equidistant fisheye (all coefficients 0) instead of "
          "undistorting them: write 1e-6 for one where you need that");
      break;
    }
  }
  return lost;
}

/// Little-endian numbers behind each other.
class Bytes {
 public:
  template <class T>
  Bytes& add(T value) {
    static_assert(std::endian::native == std::endian::little);
    const auto raw = std::as_bytes(std::span(&value, 1));
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
    return *this;
  }
  Bytes& add(const std::string& text) {
    const auto raw = std::as_bytes(std::span(text.c_str(), text.size() + 1));
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
    return *this;
  }
  void write(const fs::path& path) const {
    AtomicFile file(path);
    file.write(bytes_);
    file.commit();
  }

 private:
  std::vector<std::byte> bytes_;
};

/// A word without the comma that some writers (kapture) put behind it; COLMAP reads both.
std::string_view next_column(TextScanner& scanner) {
  const std::string_view word = scanner.next_word();
  return word.ends_with(',') ? word.substr(0, word.size() - 1) : word;
}

double number_column(TextScanner& scanner, const char* what) {
  const std::string_view word = next_column(scanner);
  double value = 0;
  if (!parse_number(word, value)) {
    scanner.fail(no_number(word), std::string(what) + ", a finite number");
  }
  return value;
}

std::int64_t integer_column(TextScanner& scanner, const char* what) {
  const std::string_view word = next_column(scanner);
  std::int64_t value = 0;
  if (!parse_integer(word, value)) {
    scanner.fail(word.empty() ? "the line ends" : in_quotes(word),
                 std::string(what) + ", a whole number");
  }
  return value;
}

/// Calls `take` for each line that is not empty, with the number that it starts with: each once.
template <class Take>
void each_numbered(TextScanner& scanner, const char* what, const Limits& limits, const Take& take) {
  const auto fail = [&](const std::string& found, const std::string& expected) {
    scanner.fail(found, expected);
  };
  std::set<std::uint32_t> ids;
  while (scanner.next_line()) {
    const std::string_view first = next_column(scanner);
    if (first.empty()) {
      continue;
    }
    std::int64_t id = 0;
    if (!parse_integer(first, id) || id < 0 || id > UINT32_MAX) {
      fail(in_quotes(first), what);
    }
    if (!ids.insert(static_cast<std::uint32_t>(id)).second) {
      fail(std::string(what) + " " + std::to_string(id) + " a second time", "each once");
    }
    if (static_cast<std::int64_t>(ids.size()) > limits.frames) {
      fail("more than " + std::to_string(limits.frames) + " of them", "fewer");
    }
    take(static_cast<std::uint32_t>(id), fail);
  }
}

}  // namespace

std::string recognize_colmap_text(const fs::path& path) {
  const fs::path folder = model_folder(path, "images.txt");
  return !folder.empty() && fs::exists(folder / "cameras.txt") ? "cameras.txt and images.txt" : "";
}

std::string recognize_colmap_binary(const fs::path& path) {
  const fs::path folder = model_folder(path, "images.bin");
  return !folder.empty() && fs::exists(folder / "cameras.bin") ? "cameras.bin and images.bin" : "";
}

std::map<std::uint32_t, Camera> parse_colmap_cameras_text(std::string_view text,
                                                          const std::string& file,
                                                          const Limits& limits) {
  std::map<std::uint32_t, Camera> cameras;
  TextScanner scanner(text, file, limits.line_bytes);
  each_numbered(scanner, "CAMERA_ID", limits, [&](std::uint32_t id, const auto& fail) {
    const std::string name(next_column(scanner));
    const auto* model = std::find_if(kColmapModels.begin(), kColmapModels.end(),
                                     [&](const Model& known) { return known.name == name; });
    if (model == kColmapModels.end() || model->slots == nullptr) {
      fail("the camera model " + in_quotes(name), "one of " + read_models());
    }
    const std::int64_t width = integer_column(scanner, "WIDTH");
    const std::int64_t height = integer_column(scanner, "HEIGHT");
    check_size(width, height, fail);
    std::vector<double> values;
    values.reserve(static_cast<std::size_t>(model->parameters));
    for (int i = 0; i < model->parameters; ++i) {
      values.push_back(number_column(scanner, "a parameter"));
    }
    if (!scanner.next_word().empty()) {
      fail("more parameters", std::to_string(model->parameters) + " of " + name);
    }
    cameras.emplace(id, camera_of_model(*model, values, width, height, fail));
  });
  return cameras;
}

std::vector<ColmapImage> parse_colmap_images_text(std::string_view text, const std::string& file,
                                                  const Limits& limits) {
  std::vector<ColmapImage> images;
  // A line of points is as long as there are points.
  TextScanner scanner(text, file, limits.text_file_bytes);
  each_numbered(scanner, "IMAGE_ID", limits, [&](std::uint32_t id, const auto& fail) {
    std::array<double, 7> pose{};
    for (double& value : pose) {
      value = number_column(scanner, "QW QX QY QZ TX TY TZ");
    }
    const std::int64_t camera = integer_column(scanner, "CAMERA_ID");
    const std::string name(scanner.rest());
    if (camera < 0 || camera > UINT32_MAX || name.empty()) {
      fail("no camera or no name", "CAMERA_ID and NAME");
    }
    images.push_back(image_of(id, pose, static_cast<std::uint32_t>(camera), name, fail));
    scanner.next_line();  // its points, which may be none; some writers leave the last line out
  });
  return images;
}

std::map<std::uint32_t, Camera> parse_colmap_cameras_binary(std::span<const std::byte> bytes,
                                                            const std::string& file,
                                                            const Limits& limits) {
  ByteReader reader(bytes, file);
  const auto fail = [&](const std::string& found, const std::string& expected) {
    reader.fail(found, expected);
  };
  constexpr std::size_t kSmallest = 4 + 4 + 8 + 8 + 3 * 8;
  const std::size_t count =
      reader.paid(reader.little<std::uint64_t>("number of cameras"), kSmallest, "cameras");
  if (static_cast<std::int64_t>(count) > limits.frames) {
    fail(std::to_string(count) + " cameras", "at most " + std::to_string(limits.frames));
  }
  std::map<std::uint32_t, Camera> cameras;
  for (std::size_t i = 0; i < count; ++i) {
    const auto id = reader.little<std::uint32_t>("camera id");
    const auto number = reader.little<std::int32_t>("camera model");
    const auto* model = std::find_if(kColmapModels.begin(), kColmapModels.end(),
                                     [&](const Model& known) { return known.id == number; });
    if (model == kColmapModels.end() || model->slots == nullptr) {
      fail("the camera model " + std::to_string(number), "one of " + read_models());
    }
    const auto width = reader.little<std::uint64_t>("width");
    const auto height = reader.little<std::uint64_t>("height");
    constexpr std::uint64_t kHuge = 1'000'000;
    check_size(static_cast<std::int64_t>(std::min(width, kHuge)),
               static_cast<std::int64_t>(std::min(height, kHuge)), fail);
    std::vector<double> values;
    for (int p = 0; p < model->parameters; ++p) {
      values.push_back(reader.little<double>("a parameter"));
      if (!std::isfinite(values.back())) {
        fail("a parameter that is not finite", "a number");
      }
    }
    if (!cameras
             .emplace(id, camera_of_model(*model, values, static_cast<std::int64_t>(width),
                                          static_cast<std::int64_t>(height), fail))
             .second) {
      fail("camera " + std::to_string(id) + " a second time", "each once");
    }
  }
  if (reader.remaining() > 0) {
    fail(std::to_string(reader.remaining()) + " bytes behind the last camera", "the end");
  }
  return cameras;
}

std::vector<ColmapImage> parse_colmap_images_binary(std::span<const std::byte> bytes,
                                                    const std::string& file, const Limits& limits) {
  ByteReader reader(bytes, file);
  const auto fail = [&](const std::string& found, const std::string& expected) {
    reader.fail(found, expected);
  };
  constexpr std::size_t kSmallest = 4 + 7 * 8 + 4 + 1 + 8;
  const std::size_t count =
      reader.paid(reader.little<std::uint64_t>("number of images"), kSmallest, "images");
  if (static_cast<std::int64_t>(count) > limits.frames) {
    fail(std::to_string(count) + " images", "at most " + std::to_string(limits.frames));
  }
  std::vector<ColmapImage> images;
  std::set<std::uint32_t> ids;
  for (std::size_t i = 0; i < count; ++i) {
    const auto id = reader.little<std::uint32_t>("image id");
    std::array<double, 7> pose{};
    for (double& value : pose) {
      value = reader.little<double>("QW QX QY QZ TX TY TZ");
      if (!std::isfinite(value)) {
        fail("a pose that is not finite", "numbers");
      }
    }
    const auto camera = reader.little<std::uint32_t>("camera id");
    std::string name;
    constexpr std::size_t kLongest = 4096;
    for (;;) {
      const char c = reader.text(1, "name")[0];
      if (c == '\0') {
        break;
      }
      name += c;
      if (name.size() > kLongest) {
        fail("a name without an end", "a name of at most 4096 bytes and a zero");
      }
    }
    if (!ids.insert(id).second) {
      fail("image " + std::to_string(id) + " a second time", "each once");
    }
    images.push_back(image_of(id, pose, camera, name, fail));
    constexpr std::size_t kPoint = 8 + 8 + 8;
    const std::size_t points =
        reader.paid(reader.little<std::uint64_t>("number of points"), kPoint, "points");
    reader.skip(points * kPoint, "points");
  }
  if (reader.remaining() > 0) {
    fail(std::to_string(reader.remaining()) + " bytes behind the last image", "the end");
  }
  return images;
}

Dataset read_colmap_text(const fs::path& path, const DatasetOptions& /*options*/,
                         const Limits& limits) {
  const fs::path folder = model_folder(path, "images.txt");
  const fs::path cameras = folder / "cameras.txt";
  const fs::path images = folder / "images.txt";
  return dataset_of_model(path,
                          parse_colmap_cameras_text(read_file_text(cameras, limits.text_file_bytes),
                                                    cameras.string(), limits),
                          parse_colmap_images_text(read_file_text(images, limits.motion_file_bytes),
                                                   images.string(), limits),
                          images.string());
}

Dataset read_colmap_binary(const fs::path& path, const DatasetOptions& /*options*/,
                           const Limits& limits) {
  const fs::path folder = model_folder(path, "images.bin");
  const fs::path cameras = folder / "cameras.bin";
  const fs::path images = folder / "images.bin";
  return dataset_of_model(
      path,
      parse_colmap_cameras_binary(read_file_bytes(cameras, limits.text_file_bytes),
                                  cameras.string(), limits),
      parse_colmap_images_binary(read_file_bytes(images, limits.motion_file_bytes), images.string(),
                                 limits),
      images.string());
}

std::vector<std::string> write_colmap_text(const LayoutSource& source, const fs::path& out) {
  const WrittenModel written = write_pictures(source, out);
  std::string cameras =
      "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, "
      "PARAMS[]\n";
  for (std::size_t c = 0; c < written.cameras.size(); ++c) {
    const auto [model, values] = model_of(written.cameras[c]);
    cameras += std::to_string(c + 1) + " " + model->name + " " +
               std::to_string(written.cameras[c].width) + " " +
               std::to_string(written.cameras[c].height);
    for (const double value : values) {
      cameras += " " + number_text(value);
    }
    cameras += "\n";
  }
  std::string images =
      "# Image list with two lines of data per image:\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, "
      "CAMERA_ID, NAME\n#   POINTS2D[] as (X, Y, POINT3D_ID)\n";
  for (const ColmapImage& image : written.images) {
    Eigen::Quaterniond q(image.camera_from_world_rotation);
    q.normalize();
    const Eigen::Vector3d& t = image.camera_from_world_translation;
    images += std::to_string(image.id);
    for (const double value : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) {
      images += " " + number_text(value);
    }
    images += " " + std::to_string(image.camera_id) + " " + image.name + "\n\n";
  }
  const fs::path sparse = out / "sparse" / "0";
  make_private_directory(sparse);
  write_file_atomically(sparse / "points3D.txt", "# 3D point list: none\n");
  write_file_atomically(sparse / "cameras.txt", cameras);
  write_file_atomically(sparse / "images.txt", images);
  write_held_out(written, sparse);
  return losses(source);
}

std::vector<std::string> write_colmap_binary(const LayoutSource& source, const fs::path& out) {
  const WrittenModel written = write_pictures(source, out);
  Bytes cameras;
  cameras.add<std::uint64_t>(written.cameras.size());
  for (std::size_t c = 0; c < written.cameras.size(); ++c) {
    const auto [model, values] = model_of(written.cameras[c]);
    cameras.add(static_cast<std::uint32_t>(c + 1))
        .add(static_cast<std::int32_t>(model->id))
        .add(static_cast<std::uint64_t>(written.cameras[c].width))
        .add(static_cast<std::uint64_t>(written.cameras[c].height));
    for (const double value : values) {
      cameras.add(value);
    }
  }
  Bytes images;
  images.add<std::uint64_t>(written.images.size());
  for (const ColmapImage& image : written.images) {
    Eigen::Quaterniond q(image.camera_from_world_rotation);
    q.normalize();
    const Eigen::Vector3d& t = image.camera_from_world_translation;
    images.add(image.id);
    for (const double value : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) {
      images.add(value);
    }
    images.add(image.camera_id).add(image.name).add(std::uint64_t{0});
  }
  const fs::path sparse = out / "sparse" / "0";
  make_private_directory(sparse);
  Bytes().add(std::uint64_t{0}).write(sparse / "points3D.bin");
  cameras.write(sparse / "cameras.bin");
  images.write(sparse / "images.bin");
  write_held_out(written, sparse);
  return losses(source);
}

}  // namespace atelier
