#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/layouts/layout.h"

namespace atelier {

/// COLMAP (doc/format.rst): sparse/0/ (or sparse/, or the folder itself) with cameras, images and
/// points3D as .txt or .bin, `images/<name>`, `masks/<name>.png`. World: arbitrary unit and axes
/// (--metres-per-unit, --up); pixels as ours. Camera models SIMPLE_PINHOLE to FULL_OPENCV and the
/// two radial fisheyes; the others have no equal here and their cameras are refused.
std::string recognize_colmap_text(const std::filesystem::path& path);
std::string recognize_colmap_binary(const std::filesystem::path& path);
Dataset read_colmap_text(const std::filesystem::path& path, const DatasetOptions& options,
                         const Limits& limits);
Dataset read_colmap_binary(const std::filesystem::path& path, const DatasetOptions& options,
                           const Limits& limits);
std::vector<std::string> write_colmap_text(const LayoutSource& source,
                                           const std::filesystem::path& out);
std::vector<std::string> write_colmap_binary(const LayoutSource& source,
                                             const std::filesystem::path& out);

/// One line of images.txt: an image and where its camera stood.
struct ColmapImage {
  std::uint32_t id = 0;
  std::uint32_t camera_id = 0;
  std::string name;
  Eigen::Matrix3d camera_from_world_rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d camera_from_world_translation = Eigen::Vector3d::Zero();
};

/// Intrinsics by camera id; poses are those of the images. Every parser throws DataError, with line
/// or byte, for truncated files, ids given twice, models that are unknown or not read, numbers that
/// are not finite, quaternions of no length; counts are paid for by the bytes that remain.
std::map<std::uint32_t, Camera> parse_colmap_cameras_text(std::string_view text,
                                                          const std::string& file = "",
                                                          const Limits& limits = {});
std::map<std::uint32_t, Camera> parse_colmap_cameras_binary(std::span<const std::byte> bytes,
                                                            const std::string& file = "",
                                                            const Limits& limits = {});
std::vector<ColmapImage> parse_colmap_images_text(std::string_view text,
                                                  const std::string& file = "",
                                                  const Limits& limits = {});
std::vector<ColmapImage> parse_colmap_images_binary(std::span<const std::byte> bytes,
                                                    const std::string& file = "",
                                                    const Limits& limits = {});

}  // namespace atelier
