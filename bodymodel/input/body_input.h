#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/formats/makehuman_target.h"
#include "core/finding.h"

namespace atelier {

/// A requested body.
struct BodySource {
  std::string body;                 ///< default, female, male, or a file or folder
  std::vector<std::string> shape;   ///< name=value; of a generated body also files of measurements
  std::vector<std::string> target;  ///< of a MakeHuman body: file=weight
};

struct BodyInputOptions {
  MakeHumanMacros macros;
  std::string rig;      ///< of a MakeHuman body; "": the one beside it
  std::string weights;  ///< of a MakeHuman body; "": those beside it
  double metres_per_unit = 1;
  bool four_influences = false;  ///< at most four joints a vertex
};

/// A body and the shape it is asked for.
struct ShapedInput {
  BodyModel model;
  Eigen::VectorXd shape;
};

/// Takes what a reader found.
using TellFindings = std::function<void(const std::vector<Finding>& findings)>;

/// default, female or male, which are generated with the shape.
bool is_generated_body(const std::string& body);

/// A MakeHuman body: base.obj or its folder.
bool is_makehuman_body(const std::string& body);

/// Whether a file holds a motion alone: by its extension or, for npz and glTF, by what is in it.
/// False for names of generated bodies and folders. Throws DataError for a file that cannot be
/// opened.
bool holds_motion(const std::string& file);

/// Whether a file, or a name of a generated body, is a body without a motion.
bool holds_body(const std::string& file);

/// Reads or makes the body. Throws UsageError for shapes, targets and sliders that are not
/// possible.
/// @param tell  told what readers found, when they have
ShapedInput read_body_input(const BodySource& source, const BodyInputOptions& options,
                            const TellFindings& tell);

}  // namespace atelier
