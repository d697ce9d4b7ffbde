#include "core/render/render.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/render/prepared_scene.h"
#include "core/render/shading_point.h"

namespace atelier {

namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr int kTile = 8;         // pixels a side
constexpr int kSamplesRun = 16;  // samples of each pixel that are shaded together

enum class Purpose : std::uint64_t { Lens, Ambient, FirstLight };

// One sample's surface and the light gathered so far.
struct Shaded {
  ShadingPoint point;
  Vec3f light;          // towards the viewer
  Vec3f irradiance;     // at a seamless ground: all of it ...
  Vec3f open;           // ... and what it would be with nothing in the way
  std::uint32_t pixel;  // within the tile
  std::uint32_t index;  // of the sample within its pixel
  bool ground;
};

// Visibility of one light from one sample, summed over its shadow rays.
struct LightSum {
  FormFactor form;
  float weight = 0;   // of all rays
  float visible = 0;  // of those that arrive
  Vec3f gloss{0, 0, 0};
  int rays = 0;
};

struct ShadowRay {
  std::uint32_t shaded;
  float weight;
  Vec3f gloss;
  std::size_t ray;
};

class Tile {
 public:
  Tile(const PreparedScene::Data& scene, const Camera& camera, const RenderOptions& options, int x0,
       int y0)
      : scene_(scene), camera_(camera), options_(options), x0_(x0), y0_(y0) {
    x1_ = std::min(camera.width, x0 + kTile);
    y1_ = std::min(camera.height, y0 + kTile);
    eye_ = vec3f(camera_center(camera));
    pixel_angle_ = static_cast<float>(1 / std::sqrt(camera.fx * camera.fy));
    for (int y = y0_; y <= y1_; ++y) {
      for (int x = x0_; x <= x1_; ++x) {
        const auto d = ray_direction(camera, {static_cast<double>(x), static_cast<double>(y)});
        corners_[y - y0_][x - x0_] = d ? std::optional<Vec3f>(vec3f(*d)) : std::nullopt;
      }
    }
  }

  void render(Image& image) {
    for (int first = 0; first < options_.samples; first += kSamplesRun) {
      shoot(first, std::min(options_.samples, first + kSamplesRun));
      for (std::size_t l = 0; l < scene_.lights.size(); ++l) {
        add_light(l);
      }
      if (scene_.ambient != Ambient::None) {
        add_ambient();
      }
      collect();
    }
    const float share = 1 / static_cast<float>(options_.samples);
    for (int y = y0_; y < y1_; ++y) {
      for (int x = x0_; x < x1_; ++x) {
        const std::size_t pixel = static_cast<std::size_t>((y - y0_) * kTile + x - x0_);
        const Vec3f color = share * color_[pixel];
        image.at(x, y, 0) = color.x;
        image.at(x, y, 1) = color.y;
        image.at(x, y, 2) = color.z;
        if (options_.alpha) {
          image.at(x, y, 3) = std::min(1.0f, share * alpha_[pixel]);
        }
      }
    }
  }

 private:
  std::uint32_t seed(std::uint32_t pixel, Purpose purpose, std::uint64_t n = 0) const {
    const auto x = static_cast<std::uint64_t>(x0_) + pixel % kTile;
    const auto y = static_cast<std::uint64_t>(y0_) + pixel / kTile;
    return random_words(static_cast<std::uint64_t>(options_.seed),
                        static_cast<std::uint64_t>(purpose) + n, (y << 32) | x)
        .word[0];
  }

  // Direction through a point of a pixel. Within one pixel the lens bends linearly to 1e-4 of it,
  // so that its inverse is needed at the corners only.
  std::optional<Vec3f> direction(int x, int y, Point2f u) const {
    const auto& a = corners_[y - y0_][x - x0_];
    const auto& b = corners_[y - y0_][x - x0_ + 1];
    const auto& c = corners_[y - y0_ + 1][x - x0_];
    const auto& d = corners_[y - y0_ + 1][x - x0_ + 1];
    if (a && b && c && d) {
      return normalized(mix(mix(*a, *b, u.x), mix(*c, *d, u.x), u.y));
    }
    const auto exact =
        ray_direction(camera_, {x + static_cast<double>(u.x), y + static_cast<double>(u.y)});
    return exact ? std::optional<Vec3f>(vec3f(*exact)) : std::nullopt;
  }

  Vec3f background(int x, int y, Vec3f direction) const {
    const Background& b = scene_.background;
    if (b.kind == Background::Kind::Environment) {
      return source_radiance(scene_.environment.source, direction);
    }
    (void)x;
    const float t = (static_cast<float>(y) + 0.5f) / static_cast<float>(camera_.height);
    return mix(vec3f(b.top), vec3f(b.bottom), t);
  }

  void shoot(int first, int last) {
    shaded_.clear();
    RTCRayHit16 packet;
    struct Lane {
      int x, y;
      std::uint32_t pixel, index;
      Vec3f direction;
    };
    std::array<Lane, 16> lanes{};
    int count = 0;
    const auto flush = [&] {
      for (int lane = count; lane < 16; ++lane) {
        packet.ray.tnear[lane] = 1;
        packet.ray.tfar[lane] = 0;
      }
      scene_.tree.intersect(packet);
      for (int lane = 0; lane < count; ++lane) {
        const Lane& l = lanes[static_cast<std::size_t>(lane)];
        keep(packet, lane, l.x, l.y, l.pixel, l.index, l.direction);
      }
      count = 0;
    };
    for (int y = y0_; y < y1_; ++y) {
      for (int x = x0_; x < x1_; ++x) {
        const auto pixel = static_cast<std::uint32_t>((y - y0_) * kTile + x - x0_);
        const std::uint32_t lens_seed = seed(pixel, Purpose::Lens);
        for (int s = first; s < last; ++s) {
          const auto index = static_cast<std::uint32_t>(s);
          const auto d = direction(x, y, sobol_point(index, lens_seed));
          if (!d) {
            continue;  // beyond what the lens sees: black, no coverage
          }
          packet.ray.org_x[count] = eye_.x;
          packet.ray.org_y[count] = eye_.y;
          packet.ray.org_z[count] = eye_.z;
          packet.ray.dir_x[count] = d->x;
          packet.ray.dir_y[count] = d->y;
          packet.ray.dir_z[count] = d->z;
          packet.ray.tnear[count] = 0;
          packet.ray.tfar[count] = kFar;
          packet.ray.time[count] = 0;
          packet.ray.mask[count] = ~0u;
          packet.ray.id[count] = 0;
          packet.ray.flags[count] = 0;
          packet.hit.geomID[count] = RTC_INVALID_GEOMETRY_ID;
          packet.hit.instID[0][count] = RTC_INVALID_GEOMETRY_ID;
          lanes[static_cast<std::size_t>(count)] = {x, y, pixel, index, *d};
          if (++count == 16) {
            flush();
          }
        }
      }
    }
    if (count > 0) {
      flush();
    }
  }

  void keep(const RTCRayHit16& packet, int lane, int x, int y, std::uint32_t pixel,
            std::uint32_t index, Vec3f direction) {
    const bool hit = packet.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID;
    const float distance = hit ? packet.ray.tfar[lane] : kFar;
    Shaded s{};
    s.pixel = pixel;
    s.index = index;
    if (scene_.ground && direction.y < 0) {
      const float to_ground = (static_cast<float>(scene_.ground->height) - eye_.y) / direction.y;
      if (to_ground > 0 && to_ground < distance) {
        s.ground = true;
        s.point = ground_point(scene_, eye_ + to_ground * direction, direction);
        if (scene_.ground->seamless) {
          s.light = background(x, y, direction);
        }
        shaded_.push_back(s);
        return;
      }
    }
    if (hit) {
      const MeshHit h{packet.hit.geomID[lane], packet.hit.primID[lane], packet.hit.u[lane],
                      packet.hit.v[lane], distance};
      s.point = shading_point(scene_, h, eye_, direction, pixel_angle_, options_.samples);
      shaded_.push_back(s);
      return;
    }
    if (!options_.alpha) {
      color_[pixel] += background(x, y, direction);
    }
  }

  void add_shadow_rays(const RectangleLight& light, std::size_t l, std::uint32_t i, int first,
                       int count) {
    const Shaded& s = shaded_[i];
    LightSum& sum = sums_[i];
    const Vec3f origin = s.point.position + scene_.epsilon * s.point.facet;
    for (int k = 0; k < count; ++k) {
      ++sum.rays;
      const Point2f u =
          sobol_point(static_cast<std::uint32_t>(first + k) & 0xFFFFu, light_seeds_[s.pixel]);
      const Vec3f to_light = light_point(light, u) - origin;
      const float distance2 = squared_norm(to_light);
      const float distance = std::sqrt(distance2);
      const Vec3f direction = (1 / distance) * to_light;
      const float n_dot_l = dot(direction, s.point.normal);
      const float cos_light = -dot(direction, light.normal);
      if (n_dot_l <= 0 || cos_light <= 0) {
        continue;
      }
      const float solid = cos_light / distance2;
      const float weight = n_dot_l * solid;
      sum.weight += weight;
      if (scene_.ground && origin.y + distance * direction.y < scene_.ground->height) {
        continue;  // the light lies below the floor
      }
      ShadowRay ray{};
      ray.shaded = i;
      ray.weight = weight;
      ray.gloss = (solid * light.area) *
                  product(light.radiance, gloss_towards_viewer(s.point, direction, n_dot_l));
      ray.ray = rays_.add(origin, direction, scene_.epsilon, distance * (1 - 1e-4f));
      shadow_rays_.push_back(ray);
    }
    (void)l;
  }

  void trace_shadows() {
    rays_.trace(scene_.tree, true);
    for (const ShadowRay& ray : shadow_rays_) {
      if (rays_.visible(ray.ray)) {
        sums_[ray.shaded].visible += ray.weight;
        sums_[ray.shaded].gloss += ray.gloss;
      }
    }
    rays_.clear();
    shadow_rays_.clear();
  }

  void add_light(std::size_t l) {
    const RectangleLight& light = scene_.lights[l];
    for (std::uint32_t pixel = 0; pixel < kTile * kTile; ++pixel) {
      light_seeds_[pixel] = seed(pixel, Purpose::FirstLight, l);
    }
    sums_.assign(shaded_.size(), LightSum{});
    for (std::uint32_t i = 0; i < shaded_.size(); ++i) {
      sums_[i].form = form_factor(light, shaded_[i].point.position, shaded_[i].point.normal);
      if (sums_[i].form.value > 0) {
        add_shadow_rays(light, l, i, static_cast<int>(shaded_[i].index) * options_.shadow_samples,
                        options_.shadow_samples);
      }
    }
    trace_shadows();
    if (options_.penumbra_samples > 0) {
      // Pixels whose rays disagree lie in a penumbra and get more.
      std::array<float, kTile * kTile> seen{};
      std::array<float, kTile * kTile> all{};
      for (std::size_t i = 0; i < shaded_.size(); ++i) {
        seen[shaded_[i].pixel] += sums_[i].visible;
        all[shaded_[i].pixel] += sums_[i].weight;
      }
      const int base = options_.samples * options_.shadow_samples;
      for (std::uint32_t i = 0; i < shaded_.size(); ++i) {
        const float share = seen[shaded_[i].pixel] / std::max(1e-30f, all[shaded_[i].pixel]);
        if (sums_[i].form.value > 0 && share > 1e-4f && share < 1 - 1e-4f) {
          add_shadow_rays(light, l, i,
                          base + static_cast<int>(shaded_[i].index) * options_.penumbra_samples,
                          options_.penumbra_samples);
        }
      }
      trace_shadows();
    }
    for (std::size_t i = 0; i < shaded_.size(); ++i) {
      const LightSum& sum = sums_[i];
      if (sum.form.value <= 0) {
        continue;
      }
      Shaded& s = shaded_[i];
      const Vec3f open = (kPi * sum.form.value) * light.radiance;
      // Above the horizon the closed form is exact and rays only say which share is seen; across
      // it, rays that start below count for nothing and the plain mean is the one without bias.
      const Vec3f irradiance =
          sum.form.whole
              ? (sum.weight > 0 ? sum.visible / sum.weight : 0.0f) * open
              : (sum.visible * light.area / static_cast<float>(sum.rays)) * light.radiance;
      if (s.ground && scene_.ground->seamless) {
        s.irradiance += irradiance;
        s.open += open;
        continue;
      }
      s.light +=
          diffuse_light(s.point, irradiance) + (1 / static_cast<float>(sum.rays)) * sum.gloss;
    }
  }

  void add_ambient() {
    for (Shaded& s : shaded_) {
      Vec3f irradiance = s.point.ambient;
      if (scene_.ambient == Ambient::PerPixel) {
        irradiance = ambient_per_pixel(s);
      }
      if (s.ground && scene_.ground->seamless) {
        s.irradiance += irradiance;
        s.open += scene_.open_ground_irradiance;
        continue;
      }
      float openness = 1;
      if (s.point.gloss > 0) {
        const Vec3f open = (kPi)*glossy_radiance(scene_.environment, s.point.normal, 1);
        openness = std::clamp(luminance(irradiance) / std::max(1e-6f, luminance(open)), 0.0f, 1.0f);
      }
      s.light += ambient_light(scene_, s.point, irradiance, openness);
    }
  }

  Vec3f ambient_per_pixel(const Shaded& s) {
    const Frame frame(s.point.normal);
    const Vec3f origin = s.point.position + scene_.epsilon * s.point.facet;
    const std::uint32_t ambient_seed = seed(s.pixel, Purpose::Ambient);
    ambient_radiance_.clear();
    rays_.clear();
    for (int k = 0; k < options_.ambient_samples; ++k) {
      const auto index = (s.index * static_cast<std::uint32_t>(options_.ambient_samples) +
                          static_cast<std::uint32_t>(k)) &
                         0xFFFFu;
      const EnvironmentSample e =
          sample_environment(scene_.environment, frame, index, ambient_seed);
      if (e.weight > 0) {
        rays_.add(origin, e.direction, scene_.epsilon, kFar);
        ambient_radiance_.push_back(e.weight * radiance(scene_.environment, e.direction));
      }
    }
    rays_.trace(scene_.tree, false);
    Vec3f sum{0, 0, 0};
    for (std::size_t ray = 0; ray < rays_.size(); ++ray) {
      if (rays_.visible(ray)) {
        sum += ambient_radiance_[ray];
      }
    }
    rays_.clear();
    return (1 / static_cast<float>(options_.ambient_samples)) * sum;
  }

  void collect() {
    for (const Shaded& s : shaded_) {
      if (s.ground && scene_.ground->seamless) {
        const auto ratio = [](float have, float open) {
          return open > 0 ? std::clamp(have / open, 0.0f, 1.0f) : 1.0f;
        };
        const Vec3f kept{ratio(s.irradiance.x, s.open.x), ratio(s.irradiance.y, s.open.y),
                         ratio(s.irradiance.z, s.open.z)};
        if (options_.alpha) {
          alpha_[s.pixel] += 1 - luminance(kept);  // a black layer of that thickness
        } else {
          color_[s.pixel] += product(kept, s.light);
        }
        continue;
      }
      color_[s.pixel] += s.light;
      alpha_[s.pixel] += 1;
    }
  }

  const PreparedScene::Data& scene_;
  const Camera& camera_;
  const RenderOptions& options_;
  int x0_, y0_, x1_ = 0, y1_ = 0;
  Vec3f eye_{0, 0, 0};
  float pixel_angle_ = 0;
  std::array<std::array<std::optional<Vec3f>, kTile + 1>, kTile + 1> corners_;
  std::array<Vec3f, kTile * kTile> color_{};
  std::array<float, kTile * kTile> alpha_{};
  std::array<std::uint32_t, kTile * kTile> light_seeds_{};
  std::vector<Shaded> shaded_;
  std::vector<LightSum> sums_;
  std::vector<ShadowRay> shadow_rays_;
  std::vector<Vec3f> ambient_radiance_;
  OcclusionRays rays_;
};

}  // namespace

Image render(const PreparedScene& scene, const Camera& camera, const RenderOptions& options) {
  check_camera(camera);
  ATELIER_CHECK(options.samples >= 1 && options.samples <= 1024, "samples must lie in [1, 1024]");
  ATELIER_CHECK(options.shadow_samples >= 1 && options.shadow_samples <= 256,
                "shadow_samples must lie in [1, 256]");
  ATELIER_CHECK(options.penumbra_samples >= 0 && options.penumbra_samples <= 256,
                "penumbra_samples must lie in [0, 256]");
  ATELIER_CHECK(options.ambient_samples >= 1 && options.ambient_samples <= 1024,
                "ambient_samples must lie in [1, 1024]");
  Image image(camera.width, camera.height, options.alpha ? 4 : 3);
  const int columns = (camera.width + kTile - 1) / kTile;
  const int rows = (camera.height + kTile - 1) / kTile;
  parallel_for(static_cast<Index>(columns) * rows, 4, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      Tile tile(scene.data(), camera, options, static_cast<int>(i % columns) * kTile,
                static_cast<int>(i / columns) * kTile);
      tile.render(image);
    }
  });
  return image;
}

Image render(const Scene& scene, const Camera& camera, const RenderOptions& options) {
  return render(prepare(scene), camera, options);
}

}  // namespace atelier
