#pragma once

#include <cstdint>
#include <cstring>

#include "core/vec.h"

namespace atelier {

/// The arithmetic of the rasteriser, the same bits on both devices: coverage in whole numbers,
/// depth and barycentrics in operations that are rounded one by one.

#ifdef __CUDA_ARCH__
ATELIER_HOST_DEVICE inline double rounded_product(double a, double b) {
  return __dmul_rn(a, b);
}
ATELIER_HOST_DEVICE inline double rounded_sum(double a, double b) {
  return __dadd_rn(a, b);
}
#else
// The compiler is told not to fuse in files that use these (-ffp-contract=off).
ATELIER_HOST_DEVICE inline double rounded_product(double a, double b) {
  return a * b;
}
ATELIER_HOST_DEVICE inline double rounded_sum(double a, double b) {
  return a + b;
}
#endif

/// A vertex as the raster sees it: z metres in front of the camera; x / z and y / z are its pixel.
/// A z of NaN: it cannot be projected, and no face with it is drawn.
using ScreenVertex = Vec3d;

/// Fixed-point pixels: 4096 steps a pixel.
inline constexpr int kSubpixels = 4096;
/// Faces are clipped to this many pixels on each side of the origin, so that edge functions fit 64
/// bits: 2^17 pixels * 2^12 steps, differences below 2^30, products below 2^60.
inline constexpr double kGuardBand = 131'072;
/// Largest image side.
inline constexpr int kLargestRasterSide = 32'768;

/// A triangle in fixed point, turned so that its area is positive.
struct ScreenTriangle {
  std::int32_t x[3], y[3];
  int face;
};

/// A face after clipping: at most eight corners, a fan of at most six triangles.
struct ScreenPolygon {
  Vec3d corner[8];
  int count;
};

/// Pixels [x0, x1) x [y0, y1).
struct PixelBox {
  int x0, y0, x1, y1;
};

/// Signed distance of a vertex from one of five planes, positive inside: near, left, right, top,
/// bottom.
ATELIER_HOST_DEVICE inline double plane_distance(Vec3d v, int plane, double near) {
  switch (plane) {
    case 0:
      return v.z - near;
    case 1:
      return rounded_sum(v.x, rounded_product(kGuardBand, v.z));
    case 2:
      return rounded_sum(-v.x, rounded_product(kGuardBand, v.z));
    case 3:
      return rounded_sum(v.y, rounded_product(kGuardBand, v.z));
    default:
      return rounded_sum(-v.y, rounded_product(kGuardBand, v.z));
  }
}

/// Where an edge crosses a plane. Always computed from the inner end to the outer, so that both
/// faces at the edge get the same point.
ATELIER_HOST_DEVICE inline Vec3d crossing(Vec3d inner, double d_inner, Vec3d outer,
                                          double d_outer) {
  const double t = d_inner / (d_inner - d_outer);
  return {rounded_sum(inner.x, rounded_product(t, outer.x - inner.x)),
          rounded_sum(inner.y, rounded_product(t, outer.y - inner.y)),
          rounded_sum(inner.z, rounded_product(t, outer.z - inner.z))};
}

/// Whether no coordinate is infinite or NaN, whose differences from themselves are NaN.
ATELIER_HOST_DEVICE inline bool is_finite(Vec3d v) {
  return v.x - v.x == 0 && v.y - v.y == 0 && v.z - v.z == 0;
}

/// The part of a face in front of the near plane and inside the guard band (Sutherland and Hodgman,
/// "Reentrant polygon clipping", CACM 1974). No corners: none of it.
ATELIER_HOST_DEVICE inline ScreenPolygon clipped(Vec3d a, Vec3d b, Vec3d c, double near) {
  ScreenPolygon polygon;
  polygon.corner[0] = a;
  polygon.corner[1] = b;
  polygon.corner[2] = c;
  polygon.count = is_finite(a) && is_finite(b) && is_finite(c) ? 3 : 0;
  for (int plane = 0; plane < 5 && polygon.count > 0; ++plane) {
    bool all_inside = true;
    for (int i = 0; i < polygon.count; ++i) {
      all_inside = all_inside && plane_distance(polygon.corner[i], plane, near) >= 0;
    }
    if (all_inside) {
      continue;
    }
    ScreenPolygon kept;
    kept.count = 0;
    for (int i = 0; i < polygon.count; ++i) {
      const Vec3d from = polygon.corner[i];
      const Vec3d to = polygon.corner[(i + 1) % polygon.count];
      const double d_from = plane_distance(from, plane, near);
      const double d_to = plane_distance(to, plane, near);
      if (d_from >= 0) {
        kept.corner[kept.count++] = from;
        if (d_to < 0 && kept.count < 8) {
          kept.corner[kept.count++] = crossing(from, d_from, to, d_to);
        }
      } else if (d_to >= 0) {
        kept.corner[kept.count++] = crossing(to, d_to, from, d_from);
      }
      if (kept.count == 8) {
        break;  // only where rounding bends the polygon; a convex one has at most eight
      }
    }
    polygon = kept;
  }
  return polygon;
}

/// Fixed-point pixel coordinate; ties to even. Of corners that `clipped` kept: inside the guard
/// band, whose fixed-point coordinates fit.
ATELIER_HOST_DEVICE inline std::int32_t fixed_point(double numerator, double z) {
  return static_cast<std::int32_t>(std::rint(numerator / z * kSubpixels));
}

/// Twice the signed area of abc: positive if it turns clockwise as seen (y runs down).
ATELIER_HOST_DEVICE inline std::int64_t edge_function(std::int32_t ax, std::int32_t ay,
                                                      std::int32_t bx, std::int32_t by,
                                                      std::int32_t cx, std::int32_t cy) {
  return (static_cast<std::int64_t>(bx) - ax) * (static_cast<std::int64_t>(cy) - ay) -
         (static_cast<std::int64_t>(by) - ay) * (static_cast<std::int64_t>(cx) - ax);
}

/// Triangle k of a polygon's fan. False: it has no area, or it is seen from behind and `cull_back`.
ATELIER_HOST_DEVICE inline bool fan_triangle(const ScreenPolygon& polygon, int k, int face,
                                             bool cull_back, ScreenTriangle& triangle) {
  const int corners[3] = {0, k + 1, k + 2};
  for (int i = 0; i < 3; ++i) {
    const Vec3d v = polygon.corner[corners[i]];
    triangle.x[i] = fixed_point(v.x, v.z);
    triangle.y[i] = fixed_point(v.y, v.z);
  }
  triangle.face = face;
  const std::int64_t area = edge_function(triangle.x[0], triangle.y[0], triangle.x[1],
                                          triangle.y[1], triangle.x[2], triangle.y[2]);
  if (area == 0 || (area > 0 && cull_back)) {
    return false;  // counter-clockwise from outside is a negative area where y runs down
  }
  if (area < 0) {
    const std::int32_t x = triangle.x[1];
    const std::int32_t y = triangle.y[1];
    triangle.x[1] = triangle.x[2];
    triangle.y[1] = triangle.y[2];
    triangle.x[2] = x;
    triangle.y[2] = y;
  }
  return true;
}

/// First pixel whose centre is at or right of (below) a fixed-point coordinate.
ATELIER_HOST_DEVICE inline int first_pixel(std::int32_t fixed) {
  const std::int32_t shifted = fixed + kSubpixels / 2 - 1;  // ceil(fixed - half)
  return shifted >> 12;                                     // floor, also of negative numbers
}

/// Pixels whose centres may be covered, cut to the image.
ATELIER_HOST_DEVICE inline PixelBox pixel_box(const ScreenTriangle& t, int width, int height) {
  std::int32_t low_x = t.x[0], high_x = t.x[0], low_y = t.y[0], high_y = t.y[0];
  for (int i = 1; i < 3; ++i) {
    low_x = t.x[i] < low_x ? t.x[i] : low_x;
    high_x = t.x[i] > high_x ? t.x[i] : high_x;
    low_y = t.y[i] < low_y ? t.y[i] : low_y;
    high_y = t.y[i] > high_y ? t.y[i] : high_y;
  }
  const auto cut = [](int value, int end) { return value < 0 ? 0 : (value > end ? end : value); };
  return {cut(first_pixel(low_x), width), cut(first_pixel(low_y), height),
          cut(first_pixel(high_x) + 1, width), cut(first_pixel(high_y) + 1, height)};
}

/// The three edge functions at a pixel's centre and how they grow to the right and down. Where all
/// are 0 or more the pixel is covered: those on a bottom or right edge are lowered by one, so that
/// a centre on an edge belongs to one of the two faces there (top-left rule).
struct EdgeFunctions {
  std::int64_t value[3], step_x[3], step_y[3];

  ATELIER_HOST_DEVICE bool covered() const { return (value[0] | value[1] | value[2]) >= 0; }
  ATELIER_HOST_DEVICE void move(std::int64_t x, std::int64_t y) {
    for (int i = 0; i < 3; ++i) {
      value[i] += x * step_x[i] + y * step_y[i];
    }
  }
};

ATELIER_HOST_DEVICE inline EdgeFunctions edge_functions_at(const ScreenTriangle& t, int x, int y) {
  EdgeFunctions edges;
  const std::int32_t px = x * kSubpixels + kSubpixels / 2;
  const std::int32_t py = y * kSubpixels + kSubpixels / 2;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const std::int64_t dx = static_cast<std::int64_t>(t.x[j]) - t.x[i];
    const std::int64_t dy = static_cast<std::int64_t>(t.y[j]) - t.y[i];
    const bool top_left = dy < 0 || (dy == 0 && dx > 0);
    edges.value[i] = edge_function(t.x[i], t.y[i], t.x[j], t.y[j], px, py) - (top_left ? 0 : 1);
    edges.step_x[i] = -dy * kSubpixels;
    edges.step_y[i] = dx * kSubpixels;
  }
  return edges;
}

/// A pixel's sample of a face.
struct PixelSample {
  double barycentric[3];  ///< perspective-correct, of the face's corners; sums to 1
  double depth;           ///< metres along the camera's axis
};

/// The face's plane under a pixel's centre, in homogeneous coordinates (Olano and Greer,
/// "Triangle scan conversion using 2D homogeneous coordinates", HWWS 1997), so that clipped faces
/// need no clipped attributes. A centre that lies outside by the rounding to fixed point is moved
/// onto the face.
ATELIER_HOST_DEVICE inline PixelSample sample_face(Vec3d a, Vec3d b, Vec3d c, int x, int y) {
  const double px = x + 0.5;
  const double py = y + 0.5;
  const Vec3d corners[3] = {a, b, c};
  double ex[3], ey[3];
  for (int i = 0; i < 3; ++i) {
    ex[i] = rounded_sum(corners[i].x, -rounded_product(px, corners[i].z));
    ey[i] = rounded_sum(corners[i].y, -rounded_product(py, corners[i].z));
  }
  double weight[3];
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    weight[i] = rounded_sum(rounded_product(ex[j], ey[k]), -rounded_product(ey[j], ex[k]));
  }
  double sum = rounded_sum(rounded_sum(weight[0], weight[1]), weight[2]);
  const double sign = sum < 0 ? -1 : 1;
  sum = 0;
  for (int i = 0; i < 3; ++i) {
    weight[i] = weight[i] * sign > 0 ? weight[i] * sign : 0;
    sum = rounded_sum(sum, weight[i]);
  }
  PixelSample sample;
  sample.depth = 0;
  for (int i = 0; i < 3; ++i) {
    sample.barycentric[i] = sum > 0 ? weight[i] / sum : 1.0 / 3;
    sample.depth = rounded_sum(sample.depth, rounded_product(sample.barycentric[i], corners[i].z));
  }
  return sample;
}

/// No face.
inline constexpr std::uint64_t kEmptyPixel = ~std::uint64_t{0};

/// Orders what a pixel may see: by depth, rounded to float, then by face. Bits of positive floats
/// grow with their values.
ATELIER_HOST_DEVICE inline std::uint64_t pixel_key(double depth, int face) {
  const float rounded = depth > 0 ? static_cast<float>(depth) : 0.0f;
  std::uint32_t bits = 0;
  memcpy(&bits, &rounded, sizeof bits);
  return (static_cast<std::uint64_t>(bits) << 32) | static_cast<std::uint32_t>(face);
}

ATELIER_HOST_DEVICE inline int face_of(std::uint64_t key) {
  return key == kEmptyPixel ? -1 : static_cast<int>(key & 0xffffffffu);
}

}  // namespace atelier
