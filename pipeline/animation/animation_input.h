#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bodymodel/retarget/moving_body.h"
#include "core/store/stage.h"
#include "pipeline/avatar/avatar_result.h"
#include "pipeline/outfit/held_cloth.h"
#include "pipeline/outfit/worn_cloth.h"
#include "pipeline/pictures/animation_pictures.h"
#include "pipeline/sealing/consent_check.h"
#include "simulation/material/resolve_material.h"

namespace atelier {

struct AnimateOptions {
  std::string motion = "";       ///< file or procedural motion; "": the capture's own
  std::string sequence = "";     ///< of the capture, whose motion is its own; "": the first clothed
  double start = 0;              ///< s into the motion, 0 to 1e6
  double seconds = 0;            ///< of it; 0: to its end
  double fps = 0;                ///< of the result; 0: the capture's own, of other motions up to 30
  std::string body = "";         ///< another body: file, female or male; "": the person
  std::string garment = "auto";  ///< auto: as registered; else what `synthesize --garment` takes
  std::string holding = "";      ///< what holds it: "" as registered, none, or a file
  std::string cloth_sequence = "";                     ///< of another simulator, instead of ours
  Material material = fabrics_own_material("fitted");  ///< what is said of it, see resolve_material
  WornClothOptions cloth;
  double settle = 0.5;  ///< s that cloth hangs before the body begins to move, 0 to 60
  bool pictures = true;
  AnimationViewOptions view;
  bool mark = true;       ///< images and video say what they are
  std::string sign = "";  ///< file of the key that signs them; "": one that everybody can derive
  ConsentUse use;
};
OptionTable describe(AnimateOptions& options);

/// Everything that is to be animated, read and placed.
struct Animation {
  MovingBody body;
  WornCloth worn;                   ///< with `foreign`, its names, meshes and `first` alone
  std::optional<Sequence> foreign;  ///< cloth that another simulator moved
  std::vector<int> frame_ids;       ///< of the result
  double fps = 0;
  double step_seconds = 0;      ///< of a simulated frame
  int steps_before = 0;         ///< simulated frames before the first of the result
  int steps_per_frame = 1;      ///< from one to the next
  std::vector<Camera> cameras;  ///< of the capture
  /// Files of networks by what they draw, "body" and garments; none: everything has one colour.
  std::map<std::string, std::filesystem::path> networks;
  std::optional<BodyAvatar> avatar;   ///< how the body is seen; none: of another body, or not made
  std::function<Points(Index)> seen;  ///< by an avatar in each frame of the result
  std::vector<RingPlace> places;      ///< of what holds registered clothes, in the cloth of all
  /// Where the clothes are to be, where that is known: the capture's own motion on its own person.
  std::vector<RegisteredGarmentSequence> registered;
};

/// Refuses files and cameras that the options name and that are not there, as `read_animation` does
/// behind its inputs. Quick: what is there is not read. Throws DataError, UsageError for networks
/// of what none is learnt of.
void require_named(const AnimateOptions& options, const std::filesystem::path& capture);

/// Reads the motion that the options name, puts it on the wearer, if that is known, and takes the
/// part that is asked for: what a run would say of it. Nothing of the capture's own motion and of
/// procedural ones. Throws DataError as read_animation.
/// @param workspace  of the person; "": not known yet
std::vector<Finding> preview_animation(const AnimateOptions& options,
                                       const std::filesystem::path& workspace);

/// Reads the workspace and what the options name; says what it assumes. Throws DataError for
/// results or files that are missing or do not fit each other, with what would help.
Animation read_animation(StageRun& run);

/// Step whose end is the i-th frame of the result.
int step_of(const Animation& animation, Index frame);

/// Azimuth, as of a View, to which the person's hips face in the first frame; 0 where they lie.
double first_azimuth(const Animation& animation);

/// The body's surface after a step, [V,3] m.
Points body_after(const Animation& animation, int step);

}  // namespace atelier
