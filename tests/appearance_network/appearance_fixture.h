#pragma once

#include <cmath>

#include "appearance/appearance_data.h"
#include "appearance/appearance_model.h"
#include "core/normals.h"
#include "tests/support/shapes.h"

namespace atelier::testing {

/// A small garment that brightens where its normal is up, with a highlight towards the camera:
/// three frames of a waving sheet, two cameras of different gain, every texel seen in every
/// picture.
inline AppearanceData small_data(int resolution = 16) {
  AppearanceData data;
  data.name = "sheet";
  Mesh mesh = grid(6, 6);
  data.faces = data.uv_faces = mesh.faces;
  data.uvs.resize(mesh.vertices.rows(), 2);
  data.uvs.col(0) = 0.05 + 0.9 * mesh.vertices.col(0).array();
  data.uvs.col(1) = 0.95 - 0.9 * mesh.vertices.col(2).array();
  data.resolution = resolution;
  data.shadow_resolution = shadow_resolution_of(resolution);
  data.camera_ids = {"a", "b"};
  data.centers.resize(2, 3);
  data.centers << 0.5, 3, -1, 2.5, 2, 2;
  data.widths = data.heights = {64, 64};
  const TexelMap texels = texture_texels(data);
  const TexelMap shadow = shadow_texels(data);
  for (int f = 0; f < 3; ++f) {
    Points vertices = mesh.vertices;
    for (Index v = 0; v < vertices.rows(); ++v) {
      vertices(v, 1) = 0.15 * std::sin(6 * vertices(v, 0) + f) * std::cos(4 * vertices(v, 2));
    }
    FrameMaps frame;
    frame.frame_id = f;
    frame.geometry = geometry_maps(vertices, data.faces, data.uvs, data.uv_faces, texels);
    const GeometryMaps low = geometry_maps(vertices, data.faces, data.uvs, data.uv_faces, shadow);
    frame.visibility = low.normal.col(1).array().square().matrix();
    data.frames.push_back(std::move(frame));
  }
  for (int f = 0; f < 3; ++f) {
    for (int c = 0; c < 2; ++c) {
      AppearanceView view;
      view.camera_idx = c;
      view.frame_idx = f;
      const GeometryMaps& maps = data.frames[static_cast<std::size_t>(f)].geometry;
      const auto towards = view_directions(maps, data.centers.row(c));
      for (std::size_t i = 0; i < texels.covered.size(); ++i) {
        const int texel = texels.covered[i];
        view.pixel.push_back(texel % 4096);
        view.u.push_back((texel % resolution + 0.5F) / resolution);
        view.v.push_back(1 - (texel / resolution + 0.5F) / resolution);
        const auto row = static_cast<Index>(i);
        const float shade = 0.3F + 0.6F * maps.normal(row, 0) + 0.2F * towards(row, 2);
        for (int k = 0; k < 3; ++k) {
          const float print = 0.6F + 0.2F * std::sin(0.7F * static_cast<float>(texel + k));
          const float value = 255 * std::clamp(shade * print + 0.2F, 0.05F, 0.95F);
          view.colors.push_back(static_cast<std::uint8_t>(value * (c == 0 ? 1.0F : 0.95F)));
        }
      }
      data.views.push_back(std::move(view));
    }
  }
  return data;
}

}  // namespace atelier::testing
