#pragma once

#include <string>
#include <vector>

#include "core/finding.h"
#include "core/options.h"
#include "core/pose.h"
#include "core/skeleton.h"

namespace atelier {

/// Where a chain of joints ends: a fingertip, the top of the head.
struct EndSite {
  int joint = 0;                                     ///< of the skeleton
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< metres, in the joint's rest frame
};

/// A recorded motion and the skeleton it moves, in metres, Y up. Motion readers return this.
struct MotionClip {
  std::string name;
  Skeleton skeleton;
  std::vector<EndSite> end_sites;
  Motion motion;
  std::vector<Finding> findings;  ///< guesses and repairs of the reader
};

/// Information that motion files may lack. Every reader takes it; 0 means: guess, and say so.
struct MotionOptions {
  double metres_per_unit = 0;  ///< 0: guess_metres_per_unit; set it for children and animals
  char up = 0;                 ///< 'y' or 'z'; 0: guess_up_axis
  double fps = 0;              ///< frames per second; 0: what the file says
  std::string animation = {};  ///< of a file of several (glTF, FBX): name, or number from 1; "":
                               ///< the first that moves a joint
  std::string skin = {};       ///< of a file of several people (glTF, FBX): name of a skin, or
                               ///< number from 1; "": the first that the animation moves
  double path_scale = 1;       ///< factor of the person's path through the world, where the file
                               ///< has it in another unit than bones, [1e-4, 1e4]
};

OptionTable describe(MotionOptions& options);

/// Throws DataError unless the skeleton is valid, every pose has its joints, numbers are finite,
/// the frame rate is positive and frame ids increase.
void check_motion_clip(const MotionClip& clip, const std::string& file = "");

/// Throws DataError for what is beyond any stage: a root farther than 1 km from the origin, a bone
/// longer than that. What moves is simulated where it stands, in steps that its speed asks for.
void check_on_stage(const MotionClip& clip, const std::string& file = "");

/// Extent of the rest pose along x, y and z, with end sites; the skeleton's own unit.
Eigen::Vector3d rest_extent(const MotionClip& clip);

/// The up axis, 'y' or 'z': where the head is above the hips, in the rest pose if legs and trunk
/// point opposite ways there, else on average over the frames; without a person in the skeleton,
/// the axis along which the rest pose is longer.
char guess_up_axis(const MotionClip& clip);

/// Metres per unit that make the legs (thigh and shin; without a person, the rest pose along `up`)
/// nearest to an adult's: one of metre, decimetre, the CMU/cgspeed unit (0.45 units an inch), inch,
/// centimetre, millimetre; where none comes within 30%, whatever makes them an adult's. 1 for a
/// skeleton without extent.
double guess_metres_per_unit(const MotionClip& clip, char up);

/// Turns a clip that is in a file's own unit and axes into metres and Y up, as `options` say or by
/// the guesses above; a guess other than metres or Y leaves a Note ("motion-unit", "motion-up").
/// Throws DataError where the guess is no length of a unit: below a micrometre, above a kilometre.
MotionClip in_metres_y_up(MotionClip clip, const MotionOptions& options = {});

/// A rate as people state it: 1 / 0.0083333 is 120; rates within 0.1% of a whole number become it.
double frame_rate(double seconds_per_frame);

}  // namespace atelier
