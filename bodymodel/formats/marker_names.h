#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

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

/// The places of all the names of one subject, [M]. Where they are the joints of a skeleton, as a
/// motion written as markers has them, joints are joints: "Head" is not the top of the head, "foot"
/// the ball of the foot or the ankle as the others say (humanoid.h: Hips, LeftUpLeg; pelvis,
/// left_hip). Such are names that mean two whole legs and arms and a head, with collars or upper
/// legs, which no set of markers or keypoints has; a prefix that all share does not matter. Of the
/// default human's joints those that are carried stiffly have a place too: jaw, eyes, knuckles.
std::vector<std::optional<MarkerPlace>> marker_places(const std::vector<std::string>& names);

}  // namespace atelier
