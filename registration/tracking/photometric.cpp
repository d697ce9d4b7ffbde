#include "registration/tracking/photometric.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
using Jacobian = Eigen::Matrix<double, 2, 3>;

constexpr int kMaxChannels = 3;
constexpr double kMinCosine = 0.25;  // flatter views see too little
constexpr double kSaturated =
    0.5;  // standard deviations of a patch: the scale of Geman and McClure
constexpr float kInside = 0.2F;

/// Half the size, rounded down: every pixel the mean of its four, after a mild blur of neighbours.
Image half_size(const Image& image) {
  const int width = std::max(1, image.width / 2);
  const int height = std::max(1, image.height / 2);
  Image half(width, height, image.channels);
  parallel_for(height, 16, [&](Index begin, Index end) {
    for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < image.channels; ++c) {
          constexpr std::array<float, 4> kWeights = {0.125F, 0.375F, 0.375F, 0.125F};
          float sum = 0;
          for (int j = 0; j < 4; ++j) {
            const int row = std::clamp(2 * y - 1 + j, 0, image.height - 1);
            for (int i = 0; i < 4; ++i) {
              const int column = std::clamp(2 * x - 1 + i, 0, image.width - 1);
              sum += kWeights[static_cast<std::size_t>(i)] * kWeights[static_cast<std::size_t>(j)] *
                     image.at(column, row, c);
            }
          }
          half.at(x, y, c) = sum;
        }
      }
    }
  });
  return half;
}

/// Sums of each row's values within `radius` of a pixel, turned: rows of the result are columns.
Image turned_sums(const Image& image, int radius) {
  Image sums(image.height, image.width, image.channels);
  parallel_for(image.height, 16, [&](Index begin, Index end) {
    for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int c = 0; c < image.channels; ++c) {
        double sum = 0;
        for (int x = -radius; x < image.width; ++x) {
          sum += x + radius < image.width ? image.at(x + radius, y, c) : 0;
          sum -= x - radius - 1 >= 0 ? image.at(x - radius - 1, y, c) : 0;
          if (x >= 0) {
            sums.at(y, x, c) = static_cast<float>(sum);
          }
        }
      }
    }
  });
  return sums;
}

/// Each pixel less the weighted mean around it; 0 where nothing around has a weight. Two passes of
/// a box make a tent. Only the part of the image that weights reach is gone through.
Image without_mean(const Image& image, const Image& weights, int radius) {
  int left = image.width, right = 0, top = image.height, bottom = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (weights.at(x, y) > 0) {
        left = std::min(left, std::max(x - 2 * radius, 0));
        right = std::max(right, std::min(x + 2 * radius + 1, image.width));
        top = std::min(top, std::max(y - 2 * radius, 0));
        bottom = std::max(bottom, std::min(y + 2 * radius + 1, image.height));
      }
    }
  }
  Image detail(image.width, image.height, image.channels);
  if (left >= right) {
    return detail;
  }
  Image sums(right - left, bottom - top, image.channels + 1);
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) {
      const float weight = weights.at(x, y);
      for (int c = 0; c < image.channels; ++c) {
        sums.at(x - left, y - top, c) = weight * image.at(x, y, c);
      }
      sums.at(x - left, y - top, image.channels) = weight;
    }
  }
  for (int pass = 0; pass < 2; ++pass) {
    sums = turned_sums(turned_sums(sums, radius), radius);
  }
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) {
      const float weight = sums.at(x - left, y - top, image.channels);
      for (int c = 0; c < image.channels; ++c) {
        detail.at(x, y, c) =
            weight > 1 ? image.at(x, y, c) - sums.at(x - left, y - top, c) / weight : 0;
      }
    }
  }
  return detail;
}

/// A picture's value at a point, and how it grows; pixel centres are at halves.
struct Sampled {
  std::array<float, kMaxChannels> value{}, dx{}, dy{};
};

/// False: too near to the picture's edge.
bool value_at(const Image& image, double px, double py, std::array<float, kMaxChannels>& value) {
  const double u = px - 0.5;
  const double v = py - 0.5;
  if (!(u >= 0 && v >= 0 && u < image.width - 1 && v < image.height - 1)) {
    return false;
  }
  const int x = saturating_cast<int>(u);
  const int y = saturating_cast<int>(v);
  const auto s = static_cast<float>(u - x);
  const auto t = static_cast<float>(v - y);
  const int channels = image.channels;
  const float* a = &image.data[(static_cast<std::size_t>(y) * image.width + x) * channels];
  const float* b = a + static_cast<std::size_t>(image.width) * channels;
  for (int c = 0; c < channels; ++c) {
    const float top = a[c] + s * (a[c + channels] - a[c]);
    const float low = b[c] + s * (b[c + channels] - b[c]);
    value[static_cast<std::size_t>(c)] = top + t * (low - top);
  }
  return true;
}

bool sample_at(const Image& image, double px, double py, Sampled& sampled) {
  std::array<float, kMaxChannels> left{}, right{}, up{}, down{};
  if (!value_at(image, px - 0.5, py, left) || !value_at(image, px + 0.5, py, right) ||
      !value_at(image, px, py - 0.5, up) || !value_at(image, px, py + 0.5, down)) {
    return false;
  }
  for (std::size_t c = 0; c < kMaxChannels; ++c) {
    sampled.dx[c] = right[c] - left[c];
    sampled.dy[c] = down[c] - up[c];
  }
  return value_at(image, px, py, sampled.value);
}

/// A view of a face: its corners' pixels at full size, and the angle at which it is seen.
struct FaceView {
  std::array<Vector2, 3> corners;
  double cosine = 0;  ///< 0: not seen
};

/// Pixels of all vertices that a view sees.
std::vector<Vector2> vertex_pixels(const Points& x, const Camera& camera,
                                   const std::vector<float>& seen) {
  std::vector<Vector2> pixels(static_cast<std::size_t>(x.rows()), Vector2::Zero());
  parallel_for(x.rows(), 256, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) {
      if (seen[static_cast<std::size_t>(v)] > 0) {
        pixels[static_cast<std::size_t>(v)] =
            project(camera, x.row(v).transpose()).value_or(Vector2(-1e6, -1e6));
      }
    }
  });
  return pixels;
}

FaceView face_view(const Triangles& faces, Index face, const std::vector<Vector2>& pixels,
                   const std::vector<float>& seen) {
  FaceView view;
  double cosine = 1;
  for (int k = 0; k < 3; ++k) {
    const auto v = static_cast<std::size_t>(faces(face, k));
    cosine = std::min(cosine, static_cast<double>(seen[v]));
    view.corners[static_cast<std::size_t>(k)] = pixels[v];
  }
  view.cosine = cosine;
  return view;
}

Vector2 pixel_of(const FaceView& view, const Eigen::Vector3f& barycentric) {
  return barycentric[0] * view.corners[0] + barycentric[1] * view.corners[1] +
         barycentric[2] * view.corners[2];
}

/// Sums over a patch, of the image I and the texture R.
struct PatchSums {
  double count = 0;
  std::array<double, kMaxChannels> I{}, R{};
  double II = 0, RR = 0, IR = 0;

  PatchSums& operator+=(const PatchSums& other) {
    count += other.count;
    for (std::size_t c = 0; c < kMaxChannels; ++c) {
      I[c] += other.I[c];
      R[c] += other.R[c];
    }
    II += other.II;
    RR += other.RR;
    IR += other.IR;
    return *this;
  }
};

/// Means, deviations and correlation of a patch.
struct PatchMoments {
  std::array<double, kMaxChannels> mean_I{}, mean_R{};
  double deviation_I = 1, deviation_R = 1;
  double correlation = -1;
};

PatchMoments moments_of(const PatchSums& sums, int channels, double noise) {
  PatchMoments moments;
  if (!(sums.count > 0)) {
    return moments;
  }
  double var_I = sums.II / sums.count;
  double var_R = sums.RR / sums.count;
  double cov = sums.IR / sums.count;
  for (std::size_t c = 0; c < static_cast<std::size_t>(channels); ++c) {
    moments.mean_I[c] = sums.I[c] / sums.count;
    moments.mean_R[c] = sums.R[c] / sums.count;
    var_I -= moments.mean_I[c] * moments.mean_I[c];
    var_R -= moments.mean_R[c] * moments.mean_R[c];
    cov -= moments.mean_I[c] * moments.mean_R[c];
  }
  const double floor = channels * noise * noise;
  moments.deviation_I = std::sqrt(std::max(var_I, 0.0) + floor);
  moments.deviation_R = std::sqrt(std::max(var_R, 0.0) + floor);
  // Where there is contrast, noise lowers the correlation by itself.
  const double least = 0.1 * floor;
  moments.correlation =
      cov / std::sqrt((std::max(var_I, 0.0) + least) * (std::max(var_R, 0.0) + least));
  return moments;
}

}  // namespace

ViewPyramid view_pyramid(const PhotoView& view, int levels) {
  ATELIER_CHECK(view.image.width == view.camera.width && view.image.height == view.camera.height,
                "an image of another size than its camera's");
  ATELIER_CHECK(view.mask.data.empty() ||
                    (view.mask.width == view.image.width && view.mask.height == view.image.height),
                "a mask of another size than its image");
  ATELIER_CHECK(view.image.channels == 1 || view.image.channels == 3, "one or three channels");
  ViewPyramid pyramid;
  pyramid.camera = view.camera;
  pyramid.mask = view.mask;
  Image full = view.image;
  for (float& value : full.data) {
    value = std::sqrt(std::max(value, 0.0F));
  }
  pyramid.levels.push_back(std::move(full));
  for (int level = 1; level < levels; ++level) {
    pyramid.levels.push_back(half_size(pyramid.levels.back()));
  }
  return pyramid;
}

ViewPyramid detail_view(const ViewPyramid& view, int radius) {
  ATELIER_CHECK(radius > 0, "detail is finer than some pixels");
  ViewPyramid detail{view.camera, {}, view.mask};
  Image weights(view.camera.width, view.camera.height, 1);
  for (std::size_t i = 0; i < weights.data.size(); ++i) {
    weights.data[i] = view.mask.data.empty() || view.mask.data[i] != 0 ? 1.0F : 0.0F;
  }
  for (const Image& level : view.levels) {
    if (!detail.levels.empty()) {
      weights = half_size(weights);
    }
    detail.levels.push_back(without_mean(level, weights, radius));
  }
  return detail;
}

ClothSamples cloth_samples(const Points& vertices, const Triangles& faces, double spacing) {
  ATELIER_CHECK(spacing > 0, "samples need a spacing above 0");
  const Eigen::VectorXd areas = face_areas(vertices, faces);
  ClothSamples samples;
  samples.offsets.push_back(0);
  for (Index f = 0; f < faces.rows(); ++f) {
    // n^2 alike triangles, a sample in the middle of each.
    const int n =
        std::clamp(saturating_cast<int>(std::round(std::sqrt(areas[f]) / spacing)), 1, 32);
    const auto area = static_cast<float>(areas[f] / (n * n));
    const auto add = [&](double a, double b) {
      samples.barycentric.emplace_back(static_cast<float>(1 - (a + b) / n),
                                       static_cast<float>(a / n), static_cast<float>(b / n));
      samples.areas.push_back(area);
    };
    for (int i = 0; i < n; ++i) {
      for (int j = 0; i + j < n; ++j) {
        add(i + 1.0 / 3, j + 1.0 / 3);
        if (i + j + 1 < n) {
          add(i + 2.0 / 3, j + 2.0 / 3);
        }
      }
    }
    samples.offsets.push_back(static_cast<int>(samples.areas.size()));
  }
  return samples;
}

std::vector<std::vector<float>> vertex_views(const Points& x, const Triangles& faces,
                                             const std::vector<ViewPyramid>& views,
                                             const std::vector<const TriangleTree*>& occluders) {
  constexpr double kLift = 0.004;  // m above the surface, where rays begin
  constexpr int kToMask = 2;       // px to the mask's edge
  const Points normals = vertex_normals(x, faces);
  std::vector<std::vector<float>> seen(views.size());
  for (std::size_t c = 0; c < views.size(); ++c) {
    const ViewPyramid& view = views[c];
    const Vector3 centre = camera_center(view.camera);
    std::vector<float>& of_view = seen[c];
    of_view.assign(static_cast<std::size_t>(x.rows()), 0);
    parallel_for(x.rows(), 128, [&](Index begin, Index end) {
      for (Index v = begin; v < end; ++v) {
        const Vector3 here = x.row(v).transpose();
        const Vector3 normal = normals.row(v).transpose();
        const Vector3 to = centre - here;
        const double cosine = to.dot(normal) / to.norm();
        if (!(cosine > kMinCosine)) {
          continue;
        }
        const auto pixel = project(view.camera, here);
        if (!pixel || !(pixel->x() >= kToMask && pixel->y() >= kToMask &&
                        pixel->x() < view.camera.width - kToMask &&
                        pixel->y() < view.camera.height - kToMask)) {
          continue;
        }
        bool inside = true;
        if (!view.mask.data.empty()) {
          const int px = static_cast<int>(pixel->x());
          const int py = static_cast<int>(pixel->y());
          for (const auto& [i, j] : std::array<std::array<int, 2>, 4>{
                   {{-kToMask, 0}, {kToMask, 0}, {0, -kToMask}, {0, kToMask}}}) {
            inside = inside && view.mask.at(std::clamp(px + i, 0, view.mask.width - 1),
                                            std::clamp(py + j, 0, view.mask.height - 1)) != 0;
          }
        }
        const Ray ray{here + kLift * normal, to, 0, 1};
        for (const TriangleTree* tree : occluders) {
          inside = inside && (tree->nodes.empty() || !any_hit(*tree, ray));
        }
        if (inside) {
          of_view[static_cast<std::size_t>(v)] = static_cast<float>(cosine);
        }
      }
    });
  }
  return seen;
}

void add_texture(GarmentTexture& texture, const ClothSamples& samples, const ViewedCloth& cloth,
                 int sizes) {
  const Triangles& faces = cloth.topology.faces;
  const std::vector<ViewPyramid>& views = cloth.views;
  const std::vector<std::vector<float>>& seen = cloth.seen;
  if (views.empty()) {
    return;
  }
  const std::size_t count = samples.areas.size();
  const std::size_t all = views.front().levels.size();
  const std::size_t levels = sizes > 0 ? std::min(all, static_cast<std::size_t>(sizes)) : all;
  if (texture.levels.empty()) {
    texture.channels = views.front().levels.front().channels;
    texture.levels.assign(levels,
                          std::vector<float>(count * static_cast<std::size_t>(texture.channels)));
    texture.known.assign(count, 0);
  }
  std::vector<std::vector<Vector2>> pixels(views.size());
  for (std::size_t c = 0; c < views.size(); ++c) {
    pixels[c] = vertex_pixels(cloth.x, views[c].camera, seen[c]);
  }
  const auto channels = static_cast<std::size_t>(texture.channels);
  parallel_for(faces.rows(), 64, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f) {
      // Views that look at it almost as straight as the best one does.
      double best = 0;
      for (std::size_t c = 0; c < views.size(); ++c) {
        best = std::max(best, face_view(faces, f, pixels[c], seen[c]).cosine);
      }
      if (!(best > kMinCosine)) {
        continue;
      }
      for (int s = samples.offsets[static_cast<std::size_t>(f)];
           s < samples.offsets[static_cast<std::size_t>(f) + 1]; ++s) {
        const auto at = static_cast<std::size_t>(s);
        if (texture.known[at] != 0) {
          continue;
        }
        double total = 0;
        std::vector<std::array<double, kMaxChannels>> sums(levels);
        for (std::size_t c = 0; c < views.size(); ++c) {
          const FaceView view = face_view(faces, f, pixels[c], seen[c]);
          if (!(view.cosine > 0.7 * best)) {
            continue;
          }
          const Vector2 pixel = pixel_of(view, samples.barycentric[at]);
          std::vector<std::array<float, kMaxChannels>> values(levels);
          bool inside = true;
          for (std::size_t level = 0; level < levels; ++level) {
            const double scale = std::ldexp(1.0, -static_cast<int>(level));
            inside = inside && value_at(views[c].levels[level], scale * pixel.x(),
                                        scale * pixel.y(), values[level]);
          }
          if (!inside) {
            continue;
          }
          const double weight = view.cosine * view.cosine;
          total += weight;
          for (std::size_t level = 0; level < levels; ++level) {
            for (std::size_t k = 0; k < channels; ++k) {
              sums[level][k] += weight * values[level][k];
            }
          }
        }
        if (!(total > 0)) {
          continue;
        }
        texture.known[at] = 1;
        for (std::size_t level = 0; level < levels; ++level) {
          for (std::size_t k = 0; k < channels; ++k) {
            texture.levels[level][at * channels + k] = static_cast<float>(sums[level][k] / total);
          }
        }
      }
    }
  });
}

namespace {

/// All that both passes over the faces need, at one size of the pictures.
struct Alignment {
  const ViewedCloth& cloth;
  const ClothSamples& samples;
  std::vector<const GarmentTexture*> textures;  ///< what images are compared with
  std::vector<std::vector<Vector2>> pixels;
  int level;
  double scale;
  double noise;

  const Triangles& faces() const { return cloth.topology.faces; }
  const Image& image(std::size_t c) const {
    return cloth.views[c].levels[static_cast<std::size_t>(level)];
  }
  const std::vector<float>& values(const GarmentTexture& texture) const {
    return texture.levels[static_cast<std::size_t>(level)];
  }
  FaceView view_of(Index face, std::size_t c) const {
    return face_view(faces(), face, pixels[c], cloth.seen[c]);
  }

  /// A face's sums in a view, beside each texture.
  void set_sums(Index face, std::size_t c, std::span<PatchSums> sums) const {
    const FaceView view = view_of(face, c);
    if (!(view.cosine > kInside)) {
      return;
    }
    for (int s = samples.offsets[static_cast<std::size_t>(face)];
         s < samples.offsets[static_cast<std::size_t>(face) + 1]; ++s) {
      const auto at = static_cast<std::size_t>(s);
      const Vector2 pixel = scale * pixel_of(view, samples.barycentric[at]);
      const bool known = std::ranges::any_of(
          textures, [&](const GarmentTexture* texture) { return texture->known[at] != 0; });
      std::array<float, kMaxChannels> value{};
      if (!known || !value_at(image(c), pixel.x(), pixel.y(), value)) {
        continue;
      }
      for (std::size_t t = 0; t < textures.size(); ++t) {
        if (textures[t]->known[at] != 0) {
          add_sample(*textures[t], at, value, sums[t]);
        }
      }
    }
  }

 private:
  void add_sample(const GarmentTexture& texture, std::size_t at,
                  const std::array<float, kMaxChannels>& value, PatchSums& sums) const {
    const auto channels = static_cast<std::size_t>(texture.channels);
    const float* reference = &values(texture)[at * channels];
    const double weight = samples.areas[at];
    sums.count += weight;
    for (std::size_t k = 0; k < channels; ++k) {
      const double I = value[k];
      const double R = reference[k];
      sums.I[k] += weight * I;
      sums.R[k] += weight * R;
      sums.II += weight * I * I;
      sums.RR += weight * R * R;
      sums.IR += weight * I * R;
    }
  }
};

/// Of the textures that have something.
Alignment alignment_of(const ViewedCloth& cloth, const ClothSamples& samples,
                       const std::vector<const GarmentTexture*>& textures, int level,
                       const PhotometricOptions& options) {
  constexpr double kMinNoise = 0.002;  // what averaging does not take away
  const double noise = std::max(std::ldexp(options.noise, -level), kMinNoise);
  Alignment align{cloth, samples, {}, {}, level, std::ldexp(1.0, -level), noise};
  for (const GarmentTexture* texture : textures) {
    if (!texture->levels.empty()) {
      ATELIER_CHECK(level >= 0 && level < static_cast<int>(texture->levels.size()), "no such size");
      align.textures.push_back(texture);
    }
  }
  for (std::size_t c = 0; c < cloth.views.size() && !align.textures.empty(); ++c) {
    align.pixels.push_back(vertex_pixels(cloth.x, cloth.views[c].camera, cloth.seen[c]));
  }
  return align;
}

/// Of every texture and view: sums of the patch around each vertex.
using Patches = std::vector<std::vector<std::vector<PatchSums>>>;

Patches patches_of(const Alignment& align) {
  const Index face_count = align.faces().rows();
  const Index vertex_count = align.cloth.x.rows();
  const std::size_t textures = align.textures.size();
  const Adjacency around = vertex_faces(align.cloth.topology);
  Patches patches(textures, std::vector<std::vector<PatchSums>>(align.cloth.views.size()));
  for (std::size_t c = 0; c < align.cloth.views.size(); ++c) {
    std::vector<PatchSums> of_face(static_cast<std::size_t>(face_count) * textures);
    parallel_for(face_count, 128, [&](Index begin, Index end) {
      for (Index f = begin; f < end; ++f) {
        align.set_sums(
            f, c, std::span(of_face).subspan(static_cast<std::size_t>(f) * textures, textures));
      }
    });
    for (std::size_t t = 0; t < textures; ++t) {
      patches[t][c].resize(static_cast<std::size_t>(vertex_count));
    }
    parallel_for(vertex_count, 256, [&](Index begin, Index end) {
      for (Index v = begin; v < end; ++v) {
        for (const int f : around[v]) {
          for (std::size_t t = 0; t < textures; ++t) {
            patches[t][c][static_cast<std::size_t>(v)] +=
                of_face[static_cast<std::size_t>(f) * textures + t];
          }
        }
      }
    });
  }
  return patches;
}

/// How much better a later texture than the first has to match a patch to count instead: errors of
/// what it was taken from stay in it.
constexpr double kLaterTexture = 0.1;

/// The texture that a face's patch in a view matches best, with its moments; none: -1.
std::pair<int, PatchMoments> best_texture(const Alignment& align, const Patches& patches,
                                          std::size_t c, const std::array<int, 3>& corners) {
  std::pair<int, PatchMoments> best{-1, {}};
  double most = 0;
  for (std::size_t t = 0; t < patches.size(); ++t) {
    PatchSums patch;
    for (const int v : corners) {
      patch += patches[t][c][static_cast<std::size_t>(v)];
    }
    if (!(patch.count > 0)) {
      continue;
    }
    const PatchMoments moments = moments_of(patch, align.textures[t]->channels, align.noise);
    const double match = moments.correlation - (t > 0 ? kLaterTexture : 0);
    if (best.first < 0 || match > most) {
      best = {static_cast<int>(t), moments};
      most = match;
    }
  }
  return best;
}

/// How well each vertex's patch looks like the first texture, on the mean over views.
void correlate(const Alignment& align, const Patches& patches, PhotometricTerm& term) {
  parallel_for(align.cloth.x.rows(), 256, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) {
      double sum = 0;
      for (const auto& of_view : patches.front()) {
        const PatchSums& patch = of_view[static_cast<std::size_t>(v)];
        if (patch.count > 0) {
          sum += moments_of(patch, align.textures.front()->channels, align.noise).correlation;
          ++term.views[v];
        }
      }
      term.correlation[v] = term.views[v] > 0 ? sum / term.views[v] : -1;
    }
  });
}

/// A face's part of the energy, of second order.
struct FaceEnergy {
  FaceQuadratic quadratic;  ///< face -1: no view says anything
  double energy = 0;
};

/// One view of a face, the texture that it is compared with, how its patch looks there, how pixels
/// move with points, and its weight.
struct TrustedView {
  std::size_t c;
  FaceView view;
  const GarmentTexture& texture;
  PatchMoments moments;
  Jacobian jacobian;
  double weight;
};

/// Adds the residuals of a face's samples in one view, and how they change as its corners move.
void add_residuals(const Alignment& align, Index face, const TrustedView& trusted,
                   FaceEnergy& sum) {
  const PatchMoments& moments = trusted.moments;
  const auto channels = static_cast<std::size_t>(trusted.texture.channels);
  const std::vector<float>& values = align.values(trusted.texture);
  for (int s = align.samples.offsets[static_cast<std::size_t>(face)];
       s < align.samples.offsets[static_cast<std::size_t>(face) + 1]; ++s) {
    const auto at = static_cast<std::size_t>(s);
    const Eigen::Vector3f& b = align.samples.barycentric[at];
    const Vector2 pixel = align.scale * pixel_of(trusted.view, b);
    Sampled sampled;
    if (trusted.texture.known[at] == 0 ||
        !sample_at(align.image(trusted.c), pixel.x(), pixel.y(), sampled)) {
      continue;
    }
    Eigen::Matrix3d outer = Eigen::Matrix3d::Zero();
    Vector3 pull = Vector3::Zero();
    for (std::size_t k = 0; k < channels; ++k) {
      const double residual = (sampled.value[k] - moments.mean_I[k]) / moments.deviation_I -
                              (values[at * channels + k] - moments.mean_R[k]) / moments.deviation_R;
      const Vector3 slope =
          align.scale / moments.deviation_I *
          (sampled.dx[k] * trusted.jacobian.row(0) + sampled.dy[k] * trusted.jacobian.row(1))
              .transpose();
      // Geman and McClure: a highlight, a wrong neighbour or the edge of a shadow that was
      // cast elsewhere in the template's frame pulls the less the more it differs.
      const double fall = 1 + residual * residual / (kSaturated * kSaturated);
      const double share = trusted.weight * align.samples.areas[at] / (fall * fall);
      outer += share * slope * slope.transpose();
      pull += share * residual * slope;
      sum.energy += share * residual * residual;
    }
    for (int i = 0; i < 3; ++i) {
      sum.quadratic.g.segment<3>(3 * i) += b[i] * pull;
      for (int j = 0; j < 3; ++j) {
        sum.quadratic.H.block<3, 3>(3 * i, 3 * j) += static_cast<double>(b[i]) * b[j] * outer;
      }
    }
  }
}

FaceEnergy face_energy(const Alignment& align, const Patches& patches, Index f,
                       const PhotometricOptions& options) {
  const ViewedCloth& cloth = align.cloth;
  const Triangles& faces = cloth.topology.faces;
  const Points& x = cloth.x;
  const std::array<int, 3> corners = {faces(f, 0), faces(f, 1), faces(f, 2)};
  FaceEnergy sum;
  sum.quadratic.face = -1;
  const Vector3 centre =
      (x.row(corners[0]) + x.row(corners[1]) + x.row(corners[2])).transpose() / 3;
  double total = 0;
  for (std::size_t c = 0; c < cloth.views.size(); ++c) {
    const FaceView view = align.view_of(f, c);
    if (!(view.cosine > kInside)) {
      continue;
    }
    const auto [texture, moments] = best_texture(align, patches, c, corners);
    const double trust =
        std::clamp((moments.correlation - options.bad) / (options.good - options.bad), 0.0, 1.0);
    const auto jacobian = project_jacobian(cloth.views[c].camera, centre);
    if (!(trust > 0) || !jacobian) {
      continue;
    }
    const double weight = trust * view.cosine;
    total += weight;
    add_residuals(
        align, f,
        {c, view, *align.textures[static_cast<std::size_t>(texture)], moments, *jacobian, weight},
        sum);
  }
  if (total > 0) {
    sum.quadratic.face = static_cast<int>(f);
    const double factor = options.weight / std::max(total, 1.0);
    sum.quadratic.H *= factor;
    sum.quadratic.g *= factor;
    sum.energy *= factor;
  }
  return sum;
}

}  // namespace

PhotometricTerm photometric_term(const ViewedCloth& cloth, const ClothSamples& samples,
                                 const std::vector<const GarmentTexture*>& textures, int level,
                                 const PhotometricOptions& options) {
  PhotometricTerm term;
  term.correlation = Eigen::VectorXd::Constant(cloth.x.rows(), -1);
  term.views = Eigen::VectorXi::Zero(cloth.x.rows());
  const Alignment align = alignment_of(cloth, samples, textures, level, options);
  if (cloth.views.empty() || align.textures.empty()) {
    return term;
  }
  const Patches patches = patches_of(align);
  correlate(align, patches, term);
  const Index face_count = cloth.topology.faces.rows();
  std::vector<FaceEnergy> all(static_cast<std::size_t>(face_count));
  parallel_for(face_count, 32, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f) {
      all[static_cast<std::size_t>(f)] = face_energy(align, patches, f, options);
    }
  });
  for (const FaceEnergy& of_face : all) {
    if (of_face.quadratic.face >= 0) {
      term.quadratics.push_back(of_face.quadratic);
      term.energy += of_face.energy;
    }
  }
  return term;
}

}  // namespace atelier
