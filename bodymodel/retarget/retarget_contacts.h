#pragma once

#include <array>
#include <vector>

#include "bodymodel/humanoid.h"
#include "bodymodel/motion_clip.h"
#include "bodymodel/retarget/retarget.h"

namespace atelier {

/// Which feet of the clip stand still on the ground, frame by frame: the toe (the ankle where there
/// is none) is slower than `contact_speed` and lower than `contact_height` above its lowest 5%.
/// Phases shorter than 0.1 s are none, gaps shorter than 0.07 s are closed.
std::vector<std::array<bool, 2>> foot_contacts(const MotionClip& clip, const Humanoid& person,
                                               const RetargetOptions& options);

/// The motion with its standing feet pinned: each phase has one place, the mean of where the toe
/// was; the leg bends to reach it and the foot keeps its orientation. Between phases the correction
/// fades over 0.2 s.
Motion with_pinned_feet(const Motion& motion, const Skeleton& skeleton, const Humanoid& person,
                        const std::vector<std::array<bool, 2>>& contacts);

/// Bends one leg so that its ankle comes to `ankle` (or as near as the leg reaches), keeping the
/// plane of the knee and the world orientation of the foot.
Pose with_ankle_at(const Pose& pose, const Skeleton& skeleton, const Leg& leg,
                   const Eigen::Vector3d& ankle);

}  // namespace atelier
