#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "appearance/body_pose.h"
#include "appearance/occlusion.h"
#include "appearance/surface_frame.h"
#include "appearance/texture_sampling.h"
#include "core/archive.h"

namespace atelier {

/// One camera's pixels of the surface in one frame.
struct AppearanceView {
  int camera_idx = 0;
  int frame_idx = 0;
  std::vector<int> pixel;            ///< [P] y * width + x
  std::vector<float> u, v;           ///< [P] in [0,1], v up
  std::vector<std::uint8_t> colors;  ///< [3P] sRGB as the image holds them; empty: to be predicted
};

/// What a body's network learns beside its texture: how the surface of each frame differs from the
/// mean one.
struct BodyShapes {
  BodyParts parts;
  std::vector<FloatRows> offset;         ///< [F] of [V,3] m, off the mean surface, in its own axes
  std::vector<Eigen::VectorXf> support;  ///< [F] of [V] in [0,1], how much is known of each
};

/// All that a network learns from, or is asked for: one surface, its frames, its views. Prepared
/// once from capture, bodies and garment, so that a machine that trains needs none of them; of any
/// resolution, since nothing here is per texel.
struct AppearanceData {
  std::string name;                     ///< of the garment
  Triangles faces;                      ///< [F,3] of its vertices
  Points2 uvs;                          ///< [T,2] an atlas in [0,1] without overlaps
  Triangles uv_faces;                   ///< [F,3] into uvs
  std::vector<std::string> camera_ids;  ///< [C]
  Points centers;                       ///< [C,3] metres, where each stands
  std::vector<int> widths;              ///< [C] pixels, of its images
  std::vector<int> heights;             ///< [C]
  std::vector<SurfaceFrame> frames;
  std::optional<OcclusionOptions> occlusion;  ///< with which their light transfer was measured;
                                              ///< nothing: of an older program
  std::vector<AppearanceView> views;
  std::optional<BodyShapes> body;  ///< of a body that is conditioned on its pose
};

/// A view's pixels in linear light.
TexturePixels texture_pixels(const AppearanceView& view);

/// Archive of schema "atelier.appearance_data", version 2 (docs/reference/formats.md), and back:
/// texture coordinates of pixels to 1/65535, normals and tangents recomputed. Reading throws
/// DataError for arrays that are missing, of another shape, not finite or out of range, and for
/// version 1, which knew the ambient visibility alone.
Archive archive_of(const AppearanceData& data);
AppearanceData appearance_data_of(const Archive& archive, const std::string& file = "");
AppearanceData read_appearance_data(const std::filesystem::path& path, const Limits& limits = {});

/// Throws DataError unless every array agrees with the others.
void check_appearance_data(const AppearanceData& data, const std::string& file = "");

}  // namespace atelier
