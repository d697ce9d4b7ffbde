#pragma once

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "bodymodel/formats/marker_names.h"
#include "bodymodel/formats/marker_pose.h"
#include "bodymodel/formats/motion_trc.h"
#include "bodymodel/human/human_anatomy.h"
#include "bodymodel/human/human_rig.h"
#include "core/random.h"

namespace atelier::fixtures {

inline std::vector<std::string> joint_centre_names() {
  return {"RHip",  "RKnee",     "RAnkle",  "RBigToe",   "RSmallToe", "RHeel",  "LHip",
          "LKnee", "LAnkle",    "LBigToe", "LSmallToe", "LHeel",     "Neck",   "Head",
          "Nose",  "RShoulder", "RElbow",  "RWrist",    "LShoulder", "LElbow", "LWrist"};
}

inline std::vector<std::string> plug_in_gait_names() {
  return {"LFHD", "RFHD", "LBHD", "RBHD", "C7",   "T10",  "CLAV", "STRN", "RBAK", "LSHO",
          "LUPA", "LELB", "LFRM", "LWRA", "LWRB", "LFIN", "RSHO", "RUPA", "RELB", "RFRM",
          "RWRA", "RWRB", "RFIN", "LASI", "RASI", "LPSI", "RPSI", "LTHI", "LKNE", "LTIB",
          "LANK", "LHEE", "LTOE", "RTHI", "RKNE", "RTIB", "RANK", "RHEE", "RTOE"};
}

inline std::vector<std::string> opensim_names() {
  std::vector<std::string> names = {"Sternum", "Top.Head", "V.Sacral"};
  for (const char* side : {"R.", "L."}) {
    for (const char* name :
         {"Acromium",    "ASIS",        "Bicep",       "Elbow.Lat",  "Elbow.Med", "Wrist.Med",
          "Wrist.Lat",   "Thigh.Upper", "Thigh.Front", "Thigh.Rear", "Knee.Lat",  "Knee.Med",
          "Shank.Upper", "Shank.Front", "Shank.Rear",  "Ankle.Lat",  "Ankle.Med", "Heel",
          "Midfoot.Sup", "Midfoot.Lat", "Toe.Lat",     "Toe.Med",    "Toe.Tip"}) {
      names.push_back(std::string(side) + name);
    }
  }
  return names;
}

/// A known motion of a person who is not the fit's nominal one, and markers on it.
struct MarkedPerson {
  Skeleton skeleton;
  std::vector<Pose> poses;
  MarkerClip clip;
};

/// Walks in a circle while swinging and bending everything. Bones differ from the nominal person's
/// by up to 10%; skin markers are `astray` metres off their named places and shake by `noise`.
inline MarkedPerson marked_person(const std::vector<std::string>& names, double astray = 0,
                                  double noise = 0, int frames = 30) {
  Random random{11, 3};
  HumanBuild build;
  build.male = 1;
  build.leg = 1.06;
  build.arm = 0.93;
  build.shoulder = 1.08;
  MarkedPerson person;
  person.skeleton = human_skeleton(human_anatomy(build));
  RidingMarkers markers;
  markers.offsets.resize(static_cast<Index>(names.size()), 3);
  const double k = build.stature / 1000;
  for (std::size_t m = 0; m < names.size(); ++m) {
    const MarkerPlace place = marker_place(names[m]).value();
    markers.joints.push_back(find_joint(person.skeleton, place.joint));
    const Eigen::Vector3d off(normal(random), normal(random), normal(random));
    markers.offsets.row(static_cast<Index>(m)) =
        (k * place.offset + (place.centre ? 0 : astray) * off / std::sqrt(3.0)).transpose();
  }
  person.clip.name = "person.trc";
  person.clip.markers = names;
  person.clip.fps = 60;
  const auto turn = [&](Pose& pose, const char* joint, double x, double y, double z) {
    pose.rotations.row(find_joint(person.skeleton, joint)) << x, y, z;
  };
  for (int i = 0; i < frames; ++i) {
    const double t = 2 * M_PI * i / frames;
    const double s = std::sin(3 * t);
    Pose pose = rest_pose(person.skeleton);
    turn(pose, "pelvis", 0.1 * s, t, 0.05 * std::cos(t));
    pose.root_translation << std::sin(t), 0.02 * s, std::cos(t);
    turn(pose, "spine1", 0.1 * s, 0.05, 0.08 * s);
    turn(pose, "spine2", 0.1 * s, 0.05, 0.08 * s);
    turn(pose, "spine3", 0.1 * s, 0.05, 0.08 * s);
    turn(pose, "head", 0.2 * s, 0.3 * std::sin(t), 0);
    turn(pose, "left_hip", -0.3 - 0.5 * s, 0.1, 0.1);
    turn(pose, "right_hip", -0.3 + 0.5 * s, -0.1, -0.1);
    turn(pose, "left_knee", 0.6 + 0.5 * s, 0, 0);
    turn(pose, "right_knee", 0.6 - 0.5 * s, 0, 0);
    turn(pose, "left_ankle", 0.2 * s, 0, 0);
    turn(pose, "right_ankle", -0.2 * s, 0, 0);
    turn(pose, "left_shoulder", 0.2, -0.4 + 0.5 * s, -0.2 + 0.4 * std::sin(t));
    turn(pose, "right_shoulder", 0.2, 0.4 + 0.5 * s, 0.2 + 0.4 * std::sin(t));
    turn(pose, "left_elbow", -0.4 + 0.2 * s, -0.7 + 0.3 * s, 0);
    turn(pose, "right_elbow", -0.4 + 0.2 * s, 0.7 - 0.3 * s, 0);
    Points at = marker_positions(markers, forward_kinematics(person.skeleton, pose));
    for (Index j = 0; j < at.size(); ++j) {
      at.data()[j] += noise * normal(random);
    }
    person.poses.push_back(pose);
    person.clip.frame_ids.push_back(i + 1);
    person.clip.positions.push_back(at);
    person.clip.seen.emplace_back(names.size(), true);
  }
  return person;
}

/// The clip as a TRC file.
inline std::string trc_text(const MarkerClip& clip, const char* unit = "m",
                            double units_a_metre = 1) {
  std::string text =
      "PathFileType\t4\t(X/Y/Z)\tperson.trc\nDataRate\tCameraRate\tNumFrames\t"
      "NumMarkers\tUnits\n";
  char cell[64];
  std::snprintf(cell, sizeof cell, "%g\t%g\t%zu\t%zu\t%s\n", clip.fps, clip.fps,
                clip.positions.size(), clip.markers.size(), unit);
  text += cell;
  text += "Frame#\tTime";
  for (const std::string& name : clip.markers) {
    text += "\t" + name + "\t\t";
  }
  text += "\n\t";
  for (std::size_t m = 1; m <= clip.markers.size(); ++m) {
    const std::string number = std::to_string(m);
    text += "\tX" + number + "\tY" + number + "\tZ" + number;
  }
  text += "\n";
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    std::snprintf(cell, sizeof cell, "%d\t%g", clip.frame_ids[f],
                  static_cast<double>(f) / clip.fps);
    text += cell;
    for (Index i = 0; i < clip.positions[f].size(); ++i) {
      std::snprintf(cell, sizeof cell, "\t%.6f", units_a_metre * clip.positions[f].data()[i]);
      text += cell;
    }
    text += "\n";
  }
  return text;
}

}  // namespace atelier::fixtures
