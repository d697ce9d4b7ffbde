#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "registration/tracking/followed_frame.h"

namespace atelier {

/// Cloth between a frame and the next one to be registered: the input of a physical prediction.
/// Refers to what others own.
struct ClothStep {
  Index from = 0, to = 0;             ///< rows of the two frames
  const Points& vertices;             ///< [V,3] m, registered, in the first frame
  const Points& before;               ///< [V,3] m, one frame before it; no rows: unknown
  const Eigen::VectorXd& confidence;  ///< [V] in [0,1], reliability of `vertices` and `before`
  const Points& predicted;            ///< [V,3] m, body-driven prediction for the second frame
};

struct RegisterSequenceOptions {
  RegisterOptions fit;
  PredictOptions predict;
  bool recent_texture = true;  ///< compare images with those of the frame before, too
  int window = 48;  ///< frames that are registered one from the other; each window by itself
};
OptionTable describe(RegisterSequenceOptions& options);

/// Where a sequence's frames come from. Rows are dense positions, 0 to rows - 1.
struct RegistrationSource {
  Index rows = 0;
  Index template_row = 0;                 ///< whose pose the template has
  std::vector<Index> starts;              ///< increasing rows at which takes begin, or empty
  Triangles body_faces;                   ///< [.,3]
  std::function<Points(Index row)> body;  ///< [B,3] m, of one topology
  std::function<RegistrationFrame(Index row)> load;  ///< all of a frame
  /// Physical prediction of cloth that hangs free, [V,3] m, in place of ClothStep::predicted; no
  /// rows where there is none. Empty: the body-driven prediction alone. Used on several threads.
  std::function<Points(const ClothStep& step)> simulate;
  FrameKeeping keeping;
  std::function<void()> before_frame;  ///< before each is followed, and while one is waited for;
                                       ///< may throw, which stops; or empty
};

/// A garment registered to frame after frame. Takes are cut into windows of equal length; in each,
/// the frame nearest to the template's (its anchor) starts from the template as it rides on the
/// body, and every other from its neighbour, outwards, in two chains. So a window needs no other,
/// and any machine finds the same frames. Each is kept as soon as it is followed, so that a stop
/// costs one frame a thread. The texture is taken from the template's frame; what that does not
/// show, from the first frames of the chain that do. Safe on several threads, and beside other
/// processes with the same keeping: whoever waits for a frame that another one is at follows one of
/// another chain meanwhile.
///
/// Images are compared with the texture and, unless that matched the frame before by 0.65 on
/// average, with that frame where it matches clearly better (photometric_term): cloth without a
/// print shows little but its shading, which changes with its folds.
class RegisteredSequence {
 public:
  /// Throws DataError as registration_model does, LogicError where the source contradicts itself.
  RegisteredSequence(const Garment& garment, RegistrationSource source,
                     const RegisterSequenceOptions& options = {}, const std::string& file = "");
  ~RegisteredSequence();

  /// One frame; those of its chain before it are registered first.
  const RegisteredGarment& at(Index row);

  /// A frame registered again from another's result, [V,3] m, or straight from the template: what
  /// comes out differently is drift.
  RegisteredGarment again(Index row, Index from, const Points& result) const;
  RegisteredGarment from_template(Index row) const;

  const RegistrationModel& model() const;

  /// The frame at which the window of a row begins: every chain leads from there.
  Index anchor(Index row) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The row in whose pose the template is: where its attachments put it nearest to its own vertices.
/// -1 for a garment without attachments. Throws DataError (with `file`) where one names a triangle
/// that the body does not have.
Index template_row_of(const Garment& garment, const RegistrationSource& source,
                      const std::string& file = "");

}  // namespace atelier
