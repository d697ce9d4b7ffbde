#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/limits.h"

namespace atelier {

/// The text of cameras.json (docs/reference/formats.md), and back to the same bits. Throws
/// DataError for cameras that check_camera refuses, ids that are no plain names or are there twice,
/// no camera, and what the format does not know.
std::string cameras_json(const std::vector<Camera>& cameras);
std::vector<Camera> parse_cameras_json(const std::string& text, const std::string& file = "",
                                       const Limits& limits = {});

/// Reads `folder`/cameras.json.
std::vector<Camera> read_cameras(const std::filesystem::path& folder, const Limits& limits = {});

}  // namespace atelier
