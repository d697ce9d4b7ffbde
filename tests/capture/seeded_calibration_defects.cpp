#include <Eigen/Geometry>

#include "capture/camera_readings.h"
#include "tests/capture/seeded_defects.h"

namespace atelier::fixtures {
namespace {

Camera& camera(Spoiled& spoiled, std::size_t c) {
  return spoiled.capture.cameras[c];
}

void invert(Camera& camera) {
  camera = read_as(camera, "extrinsics", "inverse");
}

void transpose(Camera& camera) {
  camera.camera_from_world_rotation.transposeInPlace();
}

void place_for_translation(Camera& camera) {
  camera.camera_from_world_translation = camera_center(camera);
}

void y_up_z_back(Camera& camera) {
  camera = read_as(camera, "extrinsics", "opengl");
}

void k3_before_tangential(Camera& camera) {
  auto& d = camera.distortion;
  d = {d[0], d[1], d[4], d[2], d[3]};
}

template <void (*change)(Camera&)>
void of_all(Spoiled& spoiled) {
  for (Camera& one : spoiled.capture.cameras) {
    change(one);
  }
}

template <int idx, void (*change)(Camera&)>
void of_one(Spoiled& spoiled) {
  change(camera(spoiled, idx));
}

void scale_translation(Camera& camera, double factor) {
  camera.camera_from_world_translation *= factor;
}

void scale_intrinsics(Camera& camera, double factor) {
  for (double* number : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) {
    *number *= factor;
  }
}

void scale_distortion(Camera& camera, double factor) {
  for (double& number : camera.distortion) {
    number *= factor;
  }
}

void turn(Camera& camera, double angle) {
  const Eigen::Vector3d centre = camera_center(camera);
  camera.camera_from_world_rotation =
      Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()) * camera.camera_from_world_rotation;
  camera.camera_from_world_translation = -camera.camera_from_world_rotation * centre;
}

}  // namespace

std::vector<SeededDefect> calibration_defects() {
  return {
      {"one extrinsic inverted (camera to world)", "extrinsic-inverted", "cam3",
       "--capture.extrinsics cam3=inverse", 0, of_one<3, invert>},
      {"every extrinsic inverted", "extrinsic-inverted", "", "--capture.extrinsics all=inverse", 2,
       of_all<invert>},
      {"every extrinsic inverted, small images", "extrinsic-inverted", "",
       "--capture.extrinsics all=inverse", 0, of_all<invert>},
      {"one rotation transposed", "extrinsic-transposed", "cam5",
       "--capture.extrinsics cam5=transposed", 2, of_one<5, transpose>},
      {"every rotation transposed", "extrinsic-transposed", "",
       "--capture.extrinsics all=transposed", 2, of_all<transpose>},
      {"a camera's position in place of its translation", "extrinsic-position", "cam1",
       "--capture.extrinsics cam1=position", 1, of_one<1, place_for_translation>},
      {"every position in place of a translation", "extrinsic-position", "",
       "--capture.extrinsics all=position", 2, of_all<place_for_translation>},
      {"one camera with y up and z back", "extrinsic-axes", "cam6",
       "--capture.extrinsics cam6=opengl", 2, of_one<6, y_up_z_back>},
      {"every camera with y up and z back", "extrinsic-axes", "", "--capture.extrinsics all=opengl",
       2, of_all<y_up_z_back>},
      {"calibration in millimetres", "person-size", "", "--capture.metres-per-unit 0.001", 2,
       [](Spoiled& s) {
         for (Camera& one : s.capture.cameras) {
           scale_translation(one, 1000);
         }
       }},
      {"calibration in centimetres", "person-size", "", "--capture.metres-per-unit 0.01", 1,
       [](Spoiled& s) {
         for (Camera& one : s.capture.cameras) {
           scale_translation(one, 100);
         }
       }},
      {"calibration in millimetres, by where cameras look", "stage-size", "",
       "--capture.metres-per-unit 0.001", 0,
       [](Spoiled& s) {
         for (Camera& one : s.capture.cameras) {
           scale_translation(one, 1000);
         }
         s.capture.keypoints.clear();
       }},
      {"one camera in millimetres", "camera-unit", "cam2", "--capture.baseline cam2=0.001", 2,
       [](Spoiled& s) { scale_translation(camera(s, 2), 1000); }},
      {"one camera in centimetres", "camera-unit", "cam4", "--capture.baseline cam4=0.01", 0,
       [](Spoiled& s) { scale_translation(camera(s, 4), 100); }},
      {"axes swapped: z is up", "stage-up", "", "--capture.up z", 2,
       [](Spoiled& s) {
         Eigen::Matrix3d swapped;
         swapped << 1, 0, 0, 0, 0, 1, 0, -1, 0;
         for (Camera& one : s.capture.cameras) {
           one.camera_from_world_rotation *= swapped;
         }
       }},
      {"axes swapped: y is down", "stage-up", "", "--capture.up -y", 1,
       [](Spoiled& s) {
         Eigen::Matrix3d swapped;
         swapped << 1, 0, 0, 0, -1, 0, 0, 0, -1;
         for (Camera& one : s.capture.cameras) {
           one.camera_from_world_rotation *= swapped;
         }
       }},
      {"half a pixel between calibration and detections", "half-pixel", "",
       "--capture.pixel-shift all=0.5", 2,
       [](Spoiled& s) {
         for (Camera& one : s.capture.cameras) {
           one.cx -= 0.5;
           one.cy -= 0.5;
         }
       }},
      {"half a pixel, the other way", "half-pixel", "", "--capture.pixel-shift all=-0.5", 2,
       [](Spoiled& s) {
         for (Camera& one : s.capture.cameras) {
           one.cx += 0.5;
           one.cy += 0.5;
         }
       }},
      {"distortion of every camera in the order k1 k2 k3 p1 p2", "distortion-order", "",
       "--capture.distortion all=k3_third", 2, of_all<k3_before_tangential>},
      {"distortion of one camera in the order k1 k2 k3 p1 p2", "distortion-order", "cam4",
       "--capture.distortion cam4=k3_third", 2, of_one<4, k3_before_tangential>},
      {"distortion of every camera divided by 64", "distortion-scaled", "",
       "--capture.distortion all=times_64", 2,
       [](Spoiled& s) {
         for (Camera& one : s.capture.cameras) {
           scale_distortion(one, 1.0 / 64);
         }
       }},
      {"distortion of every camera multiplied by 64", "distortion-scaled", "",
       "--capture.distortion all=by_64", 1,
       [](Spoiled& s) {
         for (Camera& one : s.capture.cameras) {
           scale_distortion(one, 64);
         }
       }},
      {"distortion of every camera with the other sign", "distortion-sign", "",
       "--capture.distortion all=negated", 2,
       [](Spoiled& s) {
         for (Camera& one : s.capture.cameras) {
           scale_distortion(one, -1);
         }
       }},
      {"distortion that folds over", "camera-distortion", "cam0", "", 1,
       [](Spoiled& s) { camera(s, 0).distortion = {-3}; }},
      {"two cameras' names exchanged", "camera-mislabelled", "cam2",
       "--capture.calibration-of cam2=cam5,cam5=cam2", 2,
       [](Spoiled& s) { std::swap(s.capture.keypoints[2], s.capture.keypoints[5]); }},
      {"three cameras' names exchanged in a ring", "camera-mislabelled", "cam1",
       "--capture.calibration-of cam1=cam4,cam4=cam6,cam6=cam1", 0,
       [](Spoiled& s) {
         const auto first = s.capture.keypoints[1];
         s.capture.keypoints[1] = s.capture.keypoints[4];
         s.capture.keypoints[4] = s.capture.keypoints[6];
         s.capture.keypoints[6] = first;
       }},
      {"a camera that was pushed after calibration", "camera-off", "cam7",
       "--capture.leave-out cam7", 2, [](Spoiled& s) { turn(camera(s, 7), 0.03); }},
      {"a camera that was pushed, small images", "camera-off", "cam4", "--capture.leave-out cam4",
       1, [](Spoiled& s) { turn(camera(s, 4), 0.04); }},
      {"a camera that was pushed half way through", "camera-moved", "cam3",
       "--capture.leave-out cam3", 2,
       [](Spoiled& s) {
         Camera pushed = camera(s, 3);
         turn(pushed, 0.05);
         const auto after = seeded_detections(s.rig, pushed, 3);
         std::copy(after.begin() + 12, after.end(), s.capture.keypoints[3].begin() + 12);
       }},
      {"intrinsics of one camera for images twice as large", "intrinsics-scale", "cam2",
       "--capture.intrinsics cam2=0.5", 2, [](Spoiled& s) { scale_intrinsics(camera(s, 2), 2); }},
      {"intrinsics of every camera for images twice as large", "intrinsics-scale", "",
       "--capture.intrinsics all=0.5", 2,
       [](Spoiled& s) {
         for (Camera& one : s.capture.cameras) {
           scale_intrinsics(one, 2);
         }
       }},
      {"x and y of a principal point exchanged", "principal-point-swapped", "cam1",
       "--capture.intrinsics cam1=swapped_centre", 2,
       [](Spoiled& s) { std::swap(camera(s, 1).cx, camera(s, 1).cy); }},
      {"x and y of every principal point exchanged", "principal-point-swapped", "",
       "--capture.intrinsics all=swapped_centre", 2,
       [](Spoiled& s) {
         for (Camera& one : s.capture.cameras) {
           std::swap(one.cx, one.cy);
         }
       }},
      {"a principal point at the rim", "camera-principal-point", "cam4", "", 0,
       [](Spoiled& s) {
         camera(s, 4).cx = 4;
         s.capture.keypoints.clear();
       }},
      {"a focal length that no lens has", "camera-focal", "cam1", "", 0,
       [](Spoiled& s) {
         camera(s, 1).fx = camera(s, 1).fy = 1.5;
         s.capture.keypoints.clear();
       }},
      {"fx and fy far apart", "camera-aspect", "cam6", "", 2,
       [](Spoiled& s) { camera(s, 6).fx *= 1.5; }},
      {"one camera's extrinsic copied to another", "camera-twins", "cam5", "", 1,
       [](Spoiled& s) {
         camera(s, 5).camera_from_world_rotation = camera(s, 2).camera_from_world_rotation;
         camera(s, 5).camera_from_world_translation = camera(s, 2).camera_from_world_translation;
       }},
      {"a calibration for images of other proportions", "image-size", "cam3", "", 0,
       [](Spoiled& s) { camera(s, 3).width += 8; }},
      {"images a quarter of the calibrated size", "image-scale", "cam1", "", 1,
       [](Spoiled& s) {
         Camera& one = camera(s, 1);
         scale_intrinsics(one, 4);
         one.width *= 4;
         one.height *= 4;
         s.capture.keypoints[1].clear();
       }},
  };
}

}  // namespace atelier::fixtures
