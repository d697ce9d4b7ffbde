#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

namespace atelier {

/// Where on a person a marker is, by its name.
struct MarkerPlace {
  std::string joint;       ///< joint of the default human that carries it: "left_knee"
  Eigen::Vector3d offset;  ///< from the joint in its rest frame (A-pose), in thousandths of stature
  bool centre = false;     ///< stands for a joint centre, so that bone lengths follow from it;
                           ///< otherwise it sits on the skin near this place
};

/// The place that a name of the common marker sets means: joint-centre files and keypoints
/// (Pose2Sim, OpenPose, HALPE, COCO: "RHip", "left_knee", "MidHip", "LBigToe"), Vicon's Plug-in
/// Gait ("LASI", "RKNE", "C7") and its medial markers, OpenSim's gait2392 and Rajagopal sets
/// ("R.Knee.Lat", "V.Sacral", "RLFC", "LHJC"), CMU's ("LFWT", "RSHN"), Qualisys' ("L_IAS", "R_FLE",
/// "CV7") and Theia3D's segments ("l_thigh_4X4"). Case, separators and a
/// subject before a colon do not matter; sides are l, r, left, right before or behind. Places on
/// the skin are our choice, read off the default human; a fit refines them. Nothing for any other
/// name. O(log names).
std::optional<MarkerPlace> marker_place(const std::string& name);

}  // namespace atelier
