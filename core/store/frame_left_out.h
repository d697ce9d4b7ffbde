#pragma once

namespace atelier {

/// Thrown out of the function that `StageRun::each_frame` is given: nothing can be made of its
/// frame, and the rest goes on. The frame is finished without files, which a later run, another
/// shard and `StageRun::frame_file` (a path where nothing lies) know; what the function has warned
/// of is kept. The stage has to say why with `warn`, and from which share of such frames on it
/// fails. Not for sequences with a header, whose readers expect every frame.
struct FrameLeftOut {};

}  // namespace atelier
