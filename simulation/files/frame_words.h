#pragma once

#include <filesystem>
#include <string>

#include "core/garment.h"
#include "core/types.h"
#include "simulation/cloth/cloth.h"
#include "simulation/cloth/frame_report.h"

namespace atelier {

/// A frame's report as one line of JSON; what was not counted is null.
std::string frame_json(const FrameReport& r);

/// The same as a line for people. Vertices counted within the contact reach ("inside") are told
/// again however deep they are in the frames that count them.
std::string frame_line(const FrameReport& r, bool with_body);

/// A garment's size, its material and what of it is in use, as one line of JSON.
/// @param name  of the garment, where there are several; "" otherwise
std::string garment_json(const std::string& name, const Garment& garment,
                         const ClothOptions& options);

/// The same as two lines for people.
std::string garment_words(const std::string& name, const Garment& garment,
                          const ClothOptions& options);

/// How a simulation was stopped, and where its frames are.
std::string stopped_words(Index done, Index count, const std::filesystem::path& out);

/// Where the frames before a failure are; follows the words of the failure.
std::string kept_words(Index done, const std::filesystem::path& place);

}  // namespace atelier
