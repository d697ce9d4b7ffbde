#pragma once

#include "appearance/transfer_terms.h"
#include "core/host_device.h"

namespace atelier {

/// A surface as loops and kernels see it when they put an image together.
struct PictureLayer {
  int first_face, end_face;  ///< among those of all surfaces
  const int* faces;          ///< [F,3] of its vertices
  const int* uv_faces;       ///< [F,3]
  const float* uvs;          ///< [T,2]
  const float* position;     ///< [V,3] metres
  const float* transfer;     ///< [V,2*9], the first of each side its ambient visibility
  const float* texture;      ///< [3,R,R]; null: `color` times the visibility of the side that shows
  int resolution;            ///< R
  float color[3];
};

/// How pixels are put together; as PaintOptions.
struct PictureStyle {
  int samples;
  bool alpha;
  float background[3];
  float eye[3];  ///< metres, where the camera stands
};

struct PictureColor {
  float channel[4];
};

ATELIER_HOST_DEVICE inline float clamped(float value, float low, float high) {
  return value < low ? low : (value > high ? high : value);
}

/// Bilinear, as texture_taps (appearance/texture_sampling.h).
ATELIER_HOST_DEVICE inline void add_texture_color(const PictureLayer& layer, float u, float v,
                                                  PictureColor& sum) {
  const int side = layer.resolution;
  const float last = static_cast<float>(side - 1);
  const float x = clamped(u * static_cast<float>(side) - 0.5f, 0.0f, last);
  const float y = clamped((1 - v) * static_cast<float>(side) - 0.5f, 0.0f, last);
  const int x0 = static_cast<int>(x) < side - 2 ? static_cast<int>(x) : side - 2;
  const int y0 = static_cast<int>(y) < side - 2 ? static_cast<int>(y) : side - 2;
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  for (int c = 0; c < 3; ++c) {
    const float* texel =
        layer.texture + (static_cast<long long>(c) * side + y0) * side + x0;  // of its plane
    const float upper = (1 - fx) * texel[0] + fx * texel[1];
    const float lower = (1 - fx) * texel[side] + fx * texel[side + 1];
    sum.channel[c] += clamped((1 - fy) * upper + fy * lower, 0.0f, 1.0f);
  }
}

/// Whether a triangle turns its inside to a place: as its corners go round clockwise from there.
ATELIER_HOST_DEVICE inline bool shows_inside(const float* a, const float* b, const float* c,
                                             const float* eye) {
  float along[3];
  float across[3];
  float to[3];
  for (int i = 0; i < 3; ++i) {
    along[i] = b[i] - a[i];
    across[i] = c[i] - a[i];
    to[i] = eye[i] - a[i];
  }
  float volume = 0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    volume += (along[j] * across[k] - along[k] * across[j]) * to[i];
  }
  return volume < 0;
}

/// Adds what one pixel of the raster shows of a surface.
ATELIER_HOST_DEVICE inline void add_layer_color(const PictureLayer& layer, int face,
                                                const float* barycentric, const float* eye,
                                                PictureColor& sum) {
  const int* corners = (layer.texture != nullptr ? layer.uv_faces : layer.faces) + 3 * face;
  sum.channel[3] += 1;
  if (layer.texture == nullptr) {
    // Cloth is lit on the side that is seen, and so is skin that a fit has turned inside out.
    const bool inside =
        shows_inside(layer.position + 3 * corners[0], layer.position + 3 * corners[1],
                     layer.position + 3 * corners[2], eye);
    const int side = inside ? kTransferTerms : 0;
    float open = 0;
    for (int k = 0; k < 3; ++k) {
      open += barycentric[k] * layer.transfer[2 * kTransferTerms * corners[k] + side];
    }
    for (int c = 0; c < 3; ++c) {
      sum.channel[c] += clamped(open * layer.color[c], 0.0f, 1.0f);
    }
    return;
  }
  float u = 0;
  float v = 0;
  for (int k = 0; k < 3; ++k) {
    u += barycentric[k] * layer.uvs[2 * corners[k]];
    v += barycentric[k] * layer.uvs[2 * corners[k] + 1];
  }
  add_texture_color(layer, clamped(u, 0.0f, 1.0f), clamped(v, 0.0f, 1.0f), sum);
}

/// The front-most surface in each pixel of a raster.
struct RasterView {
  const int* face;           ///< of all surfaces; -1: none
  const float* barycentric;  ///< three a pixel
  int width;
};

/// A pixel of the image: the mean of `samples` x `samples` of the raster; what nothing covers
/// shows the background.
ATELIER_HOST_DEVICE inline PictureColor picture_color(const PictureLayer* layers, int layer_count,
                                                      const RasterView& raster, int x, int y,
                                                      const PictureStyle& style) {
  PictureColor color = {{0, 0, 0, 0}};
  for (int i = 0; i < style.samples * style.samples; ++i) {
    const long long place =
        static_cast<long long>(y * style.samples + i / style.samples) * raster.width +
        x * style.samples + i % style.samples;
    for (int l = 0; l < layer_count; ++l) {
      const int face = raster.face[place];
      if (face >= layers[l].first_face && face < layers[l].end_face) {
        add_layer_color(layers[l], face - layers[l].first_face, raster.barycentric + 3 * place,
                        style.eye, color);
      }
    }
  }
  const float share = 1.0f / static_cast<float>(style.samples * style.samples);
  for (float& channel : color.channel) {
    channel *= share;
  }
  if (!style.alpha) {
    for (int c = 0; c < 3; ++c) {
      color.channel[c] += (1 - color.channel[3]) * style.background[c];
    }
    color.channel[3] = 1;
  }
  return color;
}

}  // namespace atelier
