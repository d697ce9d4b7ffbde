#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/archive.h"
#include "registration/tracking/register_garment.h"

namespace atelier {

/// The part of a garment's texture that one frame was the first to show.
struct TextureGain {
  int levels = 0;             ///< sizes of the texture
  int channels = 3;           ///< 1 or 3
  std::vector<int> samples;   ///< [N] increasing
  std::vector<float> values;  ///< [N, levels, channels]
};

/// The part that is known in `after` and not in `before`, from which add_texture made it.
TextureGain texture_gain(const GarmentTexture& before, const GarmentTexture& after);

/// The same texture again. Throws DataError for a gain of other sizes or channels than what is
/// known. @param samples  of the whole garment
void add_gain(GarmentTexture& texture, const TextureGain& gain, std::size_t samples);

/// A frame of a window as registration leaves it: with those of all frames from the window's anchor
/// up to this one, the next can be registered, to the same bits as if nothing had come between.
struct FollowedFrame {
  RegisteredGarment garment;
  Points drift;      ///< [V,3] m, its motion against the body that it rides on; no rows: unknown
  TextureGain gain;  ///< what its images were the first to show
};

/// A followed frame as an archive of schema "atelier.followed_frame", version 1, and back.
/// @param made_of  names all that it depends on: another one's frame is not taken
/// @throws DataError unless the frame is whole and finite, of that name, and of a garment of so
///         many vertices and samples
Archive archive_of(const FollowedFrame& frame, const std::string& made_of);
FollowedFrame followed_frame_of(const Archive& archive, const std::string& made_of, Index vertices,
                                Index samples, const std::string& file = "");
inline constexpr const char* kFollowedFrameSchema = "atelier.followed_frame";

/// Where followed frames are kept beyond the run, so that one that goes on need not follow them
/// again, nor one beside it. Rows are the sequence's. As it is: nowhere. Used on several threads.
struct FrameKeeping {
  /// Nothing where it is not there, or no good.
  std::function<std::optional<FollowedFrame>(Index row, const RegistrationModel& model)> read;
  std::function<void(Index row, const FollowedFrame& frame)> write;
  /// The lock of a frame while it is registered; null: another process has it.
  std::function<std::shared_ptr<void>(Index row)> reserve;
};

}  // namespace atelier
