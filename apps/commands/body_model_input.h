#pragma once

#include <string>
#include <vector>

#include "bodymodel/formats/body_file.h"
#include "bodymodel/formats/makehuman_target.h"
#include "bodymodel/formats/marker_fit.h"
#include "bodymodel/motion_clip.h"
#include "bodymodel/retarget/retarget.h"
#include "core/options.h"
#include "core/render/studio.h"

namespace atelier {

/// Text arguments of `atelier body-model`.
struct BodyArguments {
  std::string action;
  std::string body;  ///< of convert: a motion too
  std::string motion;
  std::string out;
  std::string as;                   ///< convert: "body", "motion" or "": what the file holds
  std::vector<std::string> shape;   ///< name=value
  std::vector<std::string> target;  ///< of a MakeHuman body: file=weight
  bool json = false;
};

struct BodyOptions {
  MakeHumanMacros macros;
  std::string rig;      ///< of a MakeHuman body; "": the one beside it
  std::string weights;  ///< of a MakeHuman body; "": those beside it
  std::string asf;      ///< skeleton of an .amc; "": the .asf beside it
  double metres_per_unit = 1;
  MotionOptions motion;
  MarkerFitOptions markers;
  RetargetOptions retarget;
  bool four_influences = false;
  int pictures = 12;
  PictureOptions picture{.width = 360, .height = 540, .samples = 8, .framing = {}};
};
OptionTable describe(BodyOptions& options);

/// A body and the shape it is asked for.
struct ShapedInput {
  BodyModel model;
  Eigen::VectorXd shape;
};

/// default, female or male, which are generated with --shape.
bool is_generated(const BodyArguments& arguments);

/// A MakeHuman body: base.obj or its folder.
bool is_makehuman(const BodyArguments& arguments);

/// Whether a file holds a motion alone: by its extension or, for npz and glTF, by what is in it.
/// False for names of generated bodies and folders. Throws DataError for a file that cannot be
/// opened.
bool holds_motion(const std::string& file);

/// Whether a file, or a name of a generated body, is a body without a motion.
bool holds_body(const std::string& file);

/// Reads or makes the body; what its reader found goes to standard error. Throws UsageError for
/// shapes, targets and sliders that are not possible.
ShapedInput read_body_input(const BodyArguments& arguments, const BodyOptions& options);

/// Every finding as a line on standard error.
void print(const std::vector<Finding>& findings);

}  // namespace atelier
