#include "core/io/cameras_file.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/limits.h"
#include "core/plain_name.h"
#include "core/printable.h"

namespace atelier {
namespace {

constexpr std::array kModels = {"none", "brown", "fisheye"};

void check_cameras(const std::vector<Camera>& cameras, const std::string& file) {
  if (cameras.empty()) {
    throw DataError(file, "cameras", "none", "at least one camera");
  }
  std::set<std::string> ids;
  for (const Camera& camera : cameras) {
    check_camera(camera, file);
    if (!is_plain_name(camera.id) || !ids.insert(camera.id).second) {
      throw DataError(file, "camera '" + camera.id + "'", "its id",
                      "letters, digits, '.', '_' and '-', each id once");
    }
  }
}

nlohmann::json rows_of(const Eigen::Matrix3d& matrix) {
  nlohmann::json rows = nlohmann::json::array();
  for (int i = 0; i < 3; ++i) {
    rows.push_back({matrix(i, 0), matrix(i, 1), matrix(i, 2)});
  }
  return rows;
}

template <std::size_t N>
std::array<double, N> exactly(const JsonPlace& place) {
  const std::vector<double> values = place.numbers();
  if (values.size() != N) {
    place.fail(counted(static_cast<std::int64_t>(values.size()), "number"), std::to_string(N));
  }
  std::array<double, N> result{};
  std::copy(values.begin(), values.end(), result.begin());
  return result;
}

Camera camera_of(const JsonPlace& place) {
  Camera camera;
  camera.id = place.at("id").text();
  camera.width = static_cast<int>(place.at("width").integer(1, Limits{}.camera_side));
  camera.height = static_cast<int>(place.at("height").integer(1, Limits{}.camera_side));
  camera.fx = place.at("fx").number();
  camera.fy = place.at("fy").number();
  camera.cx = place.at("cx").number();
  camera.cy = place.at("cy").number();
  const JsonPlace model = place.at("distortion_model");
  const auto found = std::find(kModels.begin(), kModels.end(), model.text());
  if (found == kModels.end()) {
    model.fail("'" + model.text() + "'", "none, brown or fisheye");
  }
  camera.distortion_model = static_cast<Distortion>(found - kModels.begin());
  camera.distortion = exactly<8>(place.at("distortion"));
  const JsonPlace pose = place.at("camera_from_world");
  const std::vector<JsonPlace> rows = pose.at("rotation").items();
  if (rows.size() != 3) {
    pose.fail(std::to_string(rows.size()) + " rows of rotation", "3");
  }
  for (int i = 0; i < 3; ++i) {
    const std::array<double, 3> row = exactly<3>(rows[static_cast<std::size_t>(i)]);
    camera.camera_from_world_rotation.row(i) << row[0], row[1], row[2];
  }
  const std::array<double, 3> t = exactly<3>(pose.at("translation"));
  camera.camera_from_world_translation = {t[0], t[1], t[2]};
  const std::array<double, 3> gain = exactly<3>(place.at("gain"));
  camera.gain = {gain[0], gain[1], gain[2]};
  return camera;
}

}  // namespace

std::string cameras_json(const std::vector<Camera>& cameras) {
  check_cameras(cameras, "");
  nlohmann::ordered_json root;
  root["schema"] = "atelier-cameras";
  root["version"] = 1;
  root["units"] = "m";
  root["up_axis"] = "y";
  root["pixel_origin"] = "corner";
  root["cameras"] = nlohmann::json::array();
  for (const Camera& camera : cameras) {
    nlohmann::ordered_json entry;
    entry["id"] = camera.id;
    entry["width"] = camera.width;
    entry["height"] = camera.height;
    entry["fx"] = camera.fx;
    entry["fy"] = camera.fy;
    entry["cx"] = camera.cx;
    entry["cy"] = camera.cy;
    entry["distortion_model"] = kModels[static_cast<std::size_t>(camera.distortion_model)];
    entry["distortion"] = camera.distortion;
    const Eigen::Vector3d& t = camera.camera_from_world_translation;
    entry["camera_from_world"]["rotation"] = rows_of(camera.camera_from_world_rotation);
    entry["camera_from_world"]["translation"] = {t.x(), t.y(), t.z()};
    entry["gain"] = {camera.gain.x(), camera.gain.y(), camera.gain.z()};
    root["cameras"].push_back(entry);
  }
  return root.dump(1) + "\n";
}

std::vector<Camera> parse_cameras_json(const std::string& text, const std::string& file,
                                       const Limits& limits) {
  const nlohmann::json parsed = parse_json(text, file, limits);
  const JsonPlace root(parsed, file);
  const auto must_be = [&](const char* key, const std::string& expected) {
    const JsonPlace place = root.at(key);
    if (place.text() != expected) {
      place.fail("'" + place.text() + "'", "'" + expected + "'");
    }
  };
  must_be("schema", "atelier-cameras");
  root.at("version").integer(1, 1);
  must_be("units", "m");
  must_be("up_axis", "y");
  must_be("pixel_origin", "corner");
  const std::vector<JsonPlace> items = root.at("cameras").items();
  if (static_cast<std::int64_t>(items.size()) > limits.cameras) {
    root.fail(std::to_string(items.size()) + " cameras",
              "at most " + std::to_string(limits.cameras));
  }
  std::vector<Camera> cameras;
  cameras.reserve(items.size());
  for (const JsonPlace& item : items) {
    cameras.push_back(camera_of(item));
  }
  check_cameras(cameras, file);
  return cameras;
}

std::vector<Camera> read_cameras(const std::filesystem::path& folder, const Limits& limits) {
  const std::filesystem::path path = folder / "cameras.json";
  return parse_cameras_json(read_file_text(path, limits.text_file_bytes), path.string(), limits);
}

}  // namespace atelier
