#include "capture/camera_readings.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "capture/image_turns.h"
#include "core/error.h"
#include "core/usage_error.h"

namespace atelier {
namespace {

constexpr std::array kReadings = {
    Reading{"extrinsics", "inverse", "extrinsic-inverted",
            "its extrinsic takes the camera to the world, not the world to the camera"},
    Reading{"extrinsics", "transposed", "extrinsic-transposed",
            "its rotation is stored by columns, or is that of the camera in the world"},
    Reading{"extrinsics", "position", "extrinsic-position",
            "its translation is the place of the camera"},
    Reading{"extrinsics", "opengl", "extrinsic-axes",
            "its camera axes are x right, y up, z back, as OpenGL and NeRF have them"},
    Reading{"extrinsics", "inverse_opengl", "extrinsic-inverted",
            "its extrinsic takes the camera to the world, with y up and z back"},
    Reading{"baseline", "0.001", "camera-unit", "its translation is in millimetres", true},
    Reading{"baseline", "0.01", "camera-unit", "its translation is in centimetres", true},
    Reading{"baseline", "1000", "camera-unit",
            "its translation is in metres, the others' in millimetres", true},
    Reading{"baseline", "100", "camera-unit",
            "its translation is in metres, the others' in centimetres", true},
    Reading{"intrinsics", "0.5", "intrinsics-scale",
            "its intrinsics are those of an image twice as large"},
    Reading{"intrinsics", "2", "intrinsics-scale",
            "its intrinsics are those of an image half as large"},
    Reading{"intrinsics", "0.25", "intrinsics-scale",
            "its intrinsics are those of an image four times as large"},
    Reading{"intrinsics", "4", "intrinsics-scale",
            "its intrinsics are those of an image a quarter as large"},
    Reading{"intrinsics", "swapped_centre", "principal-point-swapped",
            "x and y of its principal point are in each other's place"},
    Reading{"distortion", "k3_third", "distortion-order",
            "its distortion is k1 k2 k3 p1 p2, and was read as k1 k2 p1 p2 k3"},
    Reading{"distortion", "times_64", "distortion-scaled",
            "its distortion was divided by 64 (QTM's unit of pixels) and has no unit"},
    Reading{"distortion", "by_64", "distortion-scaled",
            "its distortion was multiplied by 64 (QTM's unit of pixels) and has no unit"},
    Reading{"distortion", "negated", "distortion-sign",
            "its distortion is that from bent to straight, with the other sign"},
    Reading{"distortion", "none", "distortion-none",
            "its images, or keypoints, are undistorted already"},
    Reading{"keypoints", "0.5", "keypoints-scaled",
            "its keypoints are those of an image twice as large"},
    Reading{"keypoints", "2", "keypoints-scaled",
            "its keypoints are those of an image half as large"},
    Reading{"keypoints", "0.25", "keypoints-scaled",
            "its keypoints are those of an image four times as large"},
    Reading{"keypoints", "4", "keypoints-scaled",
            "its keypoints are those of an image a quarter as large"},
    Reading{"keypoints", "shares", "keypoints-scaled",
            "its keypoints are shares of the image's width and height"},
    Reading{"keypoints", "mirrored", "keypoints-mirrored", "its keypoints are of mirrored images"},
    Reading{"keypoints", "upside_down", "keypoints-upside-down",
            "its keypoints count rows from below"},
    Reading{"keypoints", "swapped_sides", "keypoint-sides",
            "left and right of its keypoints are in each other's place"},
};

constexpr std::array kTurnedKeypoints = {
    Reading{"keypoints", "turned_180", "keypoints-turned",
            "its keypoints are of the images turned by 180 degrees"},
    Reading{"keypoints", "turned_90", "keypoints-turned",
            "its keypoints are of the images turned by 90 degrees clockwise"},
    Reading{"keypoints", "turned_270", "keypoints-turned",
            "its keypoints are of the images turned by 270 degrees clockwise"},
};

/// Quarters of "turned_90"; 0 of another value.
int quarters_in(std::string_view value) {
  return value == "turned_90" ? 1 : value == "turned_180" ? 2 : value == "turned_270" ? 3 : 0;
}

[[noreturn]] void refuse_reading(std::string_view option, std::string_view value,
                                 const std::string& expected) {
  refuse_correction(option, "'" + std::string(value.substr(0, 60)) + "'", expected);
}

double number_of(std::string_view option, std::string_view text, const std::string& expected) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    refuse_reading(option, text, expected);
  }
  return value;
}

double factor_of(std::string_view option, std::string_view text, const std::string& expected) {
  constexpr double kMost = 1e6;
  const std::string range = expected + ", above 0.000001 and below 1000000, such as 0.5";
  const double value = number_of(option, text, range);
  if (!(value > 1 / kMost) || !(value < kMost)) {
    refuse_reading(option, text, range);
  }
  return value;
}

void read_extrinsics_as(Camera& camera, std::string_view value) {
  Eigen::Matrix3d& rotation = camera.camera_from_world_rotation;
  Eigen::Vector3d& translation = camera.camera_from_world_translation;
  const bool opengl = value == "opengl" || value == "inverse_opengl";
  if (value == "inverse" || value == "inverse_opengl") {
    translation = (-rotation.transpose() * translation).eval();
    rotation.transposeInPlace();
    if (opengl) {
      // The camera's own axes are on the other side of an inverse; it is read from what was
      // inverted, so that they are turned last.
      rotation.bottomRows<2>() *= -1;
      translation.tail<2>() *= -1;
    }
  } else if (value == "transposed") {
    rotation.transposeInPlace();
  } else if (value == "position") {
    translation = (-rotation * translation).eval();
  } else if (opengl) {
    rotation.bottomRows<2>() *= -1;
    translation.tail<2>() *= -1;
  } else {
    refuse_reading("extrinsics", value, "inverse, transposed, position, opengl or inverse_opengl");
  }
}

void read_distortion_as(Camera& camera, std::string_view value) {
  auto& d = camera.distortion;
  constexpr double kQtm = 64;
  if (value == "none") {
    d = {};
    camera.distortion_model = Distortion::None;
  } else if (value == "k3_third") {
    if (camera.distortion_model == Distortion::Brown) {
      d = {d[0], d[1], d[3], d[4], d[2], d[5], d[6], d[7]};
    }
  } else if (value == "times_64" || value == "by_64" || value == "negated") {
    for (double& coefficient : d) {
      coefficient *= value == "negated" ? -1 : value == "by_64" ? 1 / kQtm : kQtm;
    }
  } else {
    refuse_reading("distortion", value, "none, k3_third, times_64, by_64 or negated");
  }
}

}  // namespace

void refuse_correction(std::string_view option, const std::string& found,
                       const std::string& expected) {
  throw UsageError("capture." + std::string(option) + " cannot be " + found + ": it takes " +
                   expected);
}

std::span<const Reading> all_readings() {
  return kReadings;
}

std::span<const Reading> turned_keypoint_readings() {
  return kTurnedKeypoints;
}

Camera read_as(Camera camera, std::string_view option, std::string_view value) {
  if (option == "extrinsics") {
    read_extrinsics_as(camera, value);
  } else if (option == "distortion") {
    read_distortion_as(camera, value);
  } else if (option == "intrinsics" && value == "swapped_centre") {
    std::swap(camera.cx, camera.cy);
  } else if (option == "intrinsics") {
    const double factor = factor_of(option, value, "swapped_centre or a factor");
    for (double* number : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) {
      *number *= factor;
    }
  } else if (option == "baseline") {
    camera.camera_from_world_translation *= factor_of(option, value, "a factor on translations");
  } else if (option == "pixel_shift") {
    const double shift = number_of(option, value, "pixels");
    camera.cx += shift;
    camera.cy += shift;
  } else {
    ATELIER_CHECK(false, "no reading of cameras is called '" + std::string(option) + "'");
  }
  return camera;
}

KeypointReading keypoint_reading(std::string_view value, int width, int height) {
  KeypointReading reading;
  if (value == "shares") {
    reading.scale_x = width;
    reading.scale_y = height;
  } else if (value == "mirrored") {
    reading.mirrored = true;
  } else if (value == "upside_down") {
    reading.upside_down = true;
  } else if (value == "swapped_sides") {
    reading.swapped_sides = true;
  } else if (value == "percent") {
    reading.confidence = 0.01;
  } else if (quarters_in(value) != 0) {
    reading.turn = quarters_in(value);
  } else {
    reading.scale_x = reading.scale_y =
        factor_of("keypoints", value,
                  "shares, mirrored, upside_down, swapped_sides, turned_90, turned_180, "
                  "turned_270, percent or a factor");
  }
  return reading;
}

Keypoints2d read_as(Keypoints2d points, const KeypointReading& reading,
                    const KeypointSchema& schema, int width, int height) {
  for (Index k = 0; k < points.rows(); ++k) {
    if (points.row(k).isZero(0)) {
      continue;
    }
    points(k, 0) *= reading.scale_x;
    points(k, 1) *= reading.scale_y;
    points.row(k).head<2>() =
        turned_back(points.row(k).head<2>().transpose(), reading.turn, width, height).transpose();
    points(k, 0) = reading.mirrored ? width - points(k, 0) : points(k, 0);
    points(k, 1) = reading.upside_down ? height - points(k, 1) : points(k, 1);
    points(k, 2) *= reading.confidence;
  }
  // A mirrored person's left is its right as well.
  if (reading.swapped_sides != reading.mirrored &&
      points.rows() == static_cast<Index>(schema.mirror.size())) {
    const Keypoints2d as_read = points;
    for (Index k = 0; k < points.rows(); ++k) {
      points.row(k) = as_read.row(schema.mirror[static_cast<std::size_t>(k)]);
    }
  }
  return points;
}

}  // namespace atelier
