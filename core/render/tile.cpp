#include "core/render/tile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "core/random.h"
#include "core/render/reflectance.h"
#include "core/render/shading_point.h"

namespace atelier {

namespace {

constexpr int kFirstRun = 4;  // samples of each pixel that are shaded together: first these, which
constexpr int kNextRun = 16;  // may show that a tile is empty, then as many as stay in cache
constexpr int kEmptyRun = 1;  // the first where no mesh is seen: all is smooth but sharp shadows

constexpr float kSharpRoughness = 0.5f;  // below, gloss is also sampled by its lobe (our choice)

// One sample's surface and the light gathered so far.
struct Shaded {
  ShadingPoint point;
  Vec3f light;          // towards the viewer
  Vec3f missing;        // at a seamless ground: the irradiance that something blocks
  Vec3f open;           // there, of the area lights with nothing in the way, where `mapped`
  std::uint32_t pixel;  // within the tile
  std::uint32_t index;  // of the sample within its pixel
  bool ground;
  bool mapped;  // the scene knows the area lights' shadow here
};

// Visibility of one light from one sample, summed over its shadow rays.
struct LightSum {
  FormFactor form;
  float weight = 0;   // of all rays
  float visible = 0;  // of those that arrive
  int rays = 0;
  Vec3f gloss{0, 0, 0};
  int gloss_rays = 0;
};

// The environment's irradiance from one sample.
struct SkySum {
  Vec3f all{0, 0, 0};
  Vec3f visible{0, 0, 0};
  bool blocked = false;  // any of its rays

  Vec3f blocked_share() const {
    const auto share = [](float seen, float whole) { return whole > 0 ? 1 - seen / whole : 0.0f; };
    return blocked
               ? Vec3f{share(visible.x, all.x), share(visible.y, all.y), share(visible.z, all.z)}
               : Vec3f{0, 0, 0};
  }
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
       int y0, bool occupied)
      : scene_(scene),
        camera_(camera),
        options_(options),
        x0_(x0),
        y0_(y0),
        occupied_(occupied),
        detailed_(occupied) {
    x1_ = std::min(camera.width, x0 + kTile);
    y1_ = std::min(camera.height, y0 + kTile);
    eye_ = vec3f(camera_center(camera));
    pixel_angle_ = static_cast<float>(1 / std::sqrt(camera.fx * camera.fy));
    for (std::uint32_t pixel = 0; pixel < kTile * kTile; ++pixel) {
      const auto x = static_cast<std::uint64_t>(x0) + pixel % kTile;
      const auto y = static_cast<std::uint64_t>(y0) + pixel / kTile;
      seeds_[pixel] = random_words(static_cast<std::uint64_t>(options.seed), 0, (y << 32) | x);
    }
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t i = 0; i < 3; ++i) {
        const auto d = ray_direction(camera, {x0 + 0.5 * kTile * static_cast<double>(i),
                                              y0 + 0.5 * kTile * static_cast<double>(j)});
        bent_beyond_ |= !d;
        nodes_[j][i] = d ? vec3f(*d) : Vec3f{0, 0, 0};
      }
    }
  }

  Image render() {
    int taken = 0;
    do {
      const int run = taken > 0                            ? kNextRun
                      : occupied_ || detailed_background() ? kFirstRun
                                                           : kEmptyRun;
      const int last = std::min(options_.samples, taken + run);
      shoot(taken, last);
      taken = last;
      for (std::size_t l = 0; l < scene_.lights.size(); ++l) {
        add_light(l);
      }
      if (scene_.ambient != Ambient::None) {
        add_ambient();
      }
      collect();
      // Background and paper without shadow have no detail that more samples would show.
    } while (taken < options_.samples && detailed_);
    Image image(x1_ - x0_, y1_ - y0_, options_.alpha ? 4 : 3);
    const float share = 1 / static_cast<float>(taken);
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const auto pixel = static_cast<std::size_t>(y) * kTile + static_cast<std::size_t>(x);
        const Vec3f color = share * color_[pixel];
        image.at(x, y, 0) = color.x;
        image.at(x, y, 1) = color.y;
        image.at(x, y, 2) = color.z;
        if (options_.alpha) {
          image.at(x, y, 3) = std::min(1.0f, share * alpha_[pixel]);
        }
      }
    }
    return image;
  }

 private:
  bool on_paper(const Shaded& s) const { return s.ground && scene_.ground->seamless; }

  bool detailed_background() const {
    return scene_.background.kind == Background::Kind::Environment &&
           scene_.environment.source.image != nullptr;
  }

  // Direction through a point of a pixel: the lens inverted at 3 x 3 points of the tile, and the
  // parabola through them between, which is off by some 1e-5 pixels for the strongest lenses.
  std::optional<Vec3f> direction(int x, int y, Point2f u) const {
    if (bent_beyond_) {
      const auto d =
          ray_direction(camera_, {x + static_cast<double>(u.x), y + static_cast<double>(u.y)});
      return d ? std::optional<Vec3f>(vec3f(*d)) : std::nullopt;
    }
    const auto weights = [](float t) {  // Lagrange at 0, 1/2, 1
      return std::array<float, 3>{(2 * t - 1) * (t - 1), 4 * t * (1 - t), t * (2 * t - 1)};
    };
    const auto wx = weights((static_cast<float>(x - x0_) + u.x) / kTile);
    const auto wy = weights((static_cast<float>(y - y0_) + u.y) / kTile);
    Vec3f d{0, 0, 0};
    for (std::size_t j = 0; j < 3; ++j) {
      d += wy[j] * (wx[0] * nodes_[j][0] + wx[1] * nodes_[j][1] + wx[2] * nodes_[j][2]);
    }
    return normalized(d);
  }

  Vec3f background(int y, Vec3f direction) const {
    const Background& b = scene_.background;
    if (b.kind == Background::Kind::Environment) {
      return source_radiance(scene_.environment.source, direction);
    }
    const float t = (static_cast<float>(y) + 0.5f) / static_cast<float>(camera_.height);
    return mix(vec3f(b.top), vec3f(b.bottom), t);
  }

  void shoot(int first, int last) {
    shaded_.clear();
    RTCRayHit16 packet{};
    struct Lane {
      int y;
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
      if (occupied_) {
        scene_.tree.intersect(packet);
      }
      for (int lane = 0; lane < count; ++lane) {
        const Lane& l = lanes[static_cast<std::size_t>(lane)];
        keep(packet, lane, l.y, l.pixel, l.index, l.direction);
      }
      count = 0;
    };
    for (int y = y0_; y < y1_; ++y) {
      for (int x = x0_; x < x1_; ++x) {
        const auto pixel = static_cast<std::uint32_t>((y - y0_) * kTile + x - x0_);
        const std::uint32_t lens_seed = seeds_[pixel].word[0];
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
          packet.ray.tfar[count] = std::numeric_limits<float>::infinity();
          packet.ray.time[count] = 0;
          packet.ray.mask[count] = ~0u;
          packet.ray.id[count] = 0;
          packet.ray.flags[count] = 0;
          packet.hit.geomID[count] = RTC_INVALID_GEOMETRY_ID;
          packet.hit.instID[0][count] = RTC_INVALID_GEOMETRY_ID;
          lanes[static_cast<std::size_t>(count)] = {y, pixel, index, *d};
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

  void keep(const RTCRayHit16& packet, int lane, int y, std::uint32_t pixel, std::uint32_t index,
            Vec3f direction) {
    const bool hit = packet.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID;
    const float distance = hit ? packet.ray.tfar[lane] : std::numeric_limits<float>::infinity();
    Shaded s{};
    s.pixel = pixel;
    s.index = index;
    if (scene_.ground && direction.y < 0) {
      const float to_ground = (static_cast<float>(scene_.ground->height) - eye_.y) / direction.y;
      if (to_ground > 0 && to_ground < distance) {
        s.ground = true;
        s.point = ground_point(scene_, eye_ + to_ground * direction, direction);
        if (scene_.ground->seamless) {
          s.light = background(y, direction);
          if (const auto known = scene_.ground_shadows.at(s.point.position.x, s.point.position.z)) {
            s.mapped = true;
            s.open = known->open;
            s.missing = known->missing;
          }
        } else {
          detailed_ = true;
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
      color_[pixel] += background(y, direction);
    }
  }

  void add_shadow_rays(std::size_t l, std::uint32_t i, int first, int count, bool refining) {
    const RectangleLight& light = scene_.lights[l];
    const Shaded& s = shaded_[i];
    LightSum& sum = sums_[i];
    const Vec3f origin = s.point.position + scene_.epsilon * s.point.facet;
    const std::uint32_t light_seed =
        sobol::mixed_bits(seeds_[s.pixel].word[2] + static_cast<std::uint32_t>(l));
    sum.rays += count;
    const bool sharp = is_sharp(s.point);
    sum.gloss_rays += sharp && refining ? 0 : count;
    for (int k = 0; k < count; ++k) {
      const Point2f u = sobol_point(static_cast<std::uint32_t>(first + k) & 0xFFFFu, light_seed);
      const Vec3f to_light = light_point(light, u) - origin;
      const float n_dot_d = dot(to_light, s.point.normal);
      const float light_dot_d = -dot(to_light, light.normal);
      if (n_dot_d <= 0 || light_dot_d <= 0) {
        continue;
      }
      const float distance2 = squared_norm(to_light);
      const float weight = n_dot_d * light_dot_d / (distance2 * distance2);
      sum.weight += weight;
      if (scene_.ground && origin.y + to_light.y < static_cast<float>(scene_.ground->height)) {
        continue;  // that part of the light lies below the floor
      }
      ShadowRay ray{};
      ray.shaded = i;
      ray.weight = weight;
      if (!sharp || !refining) {
        const float inverse = 1 / std::sqrt(distance2);
        ray.gloss = gloss_sample(light, s.point, inverse * to_light, distance2, sharp);
      }
      // The direction is not a unit vector: the ray's parameter runs from 0 to 1.
      ray.ray = rays_.add(origin, to_light, scene_.epsilon / std::sqrt(distance2), 1 - 1e-4f);
      shadow_rays_.push_back(ray);
    }
  }

  // A narrow lobe: points of the light alone would hardly ever fall into it.
  static bool is_sharp(const ShadingPoint& point) {
    return point.gloss > 0 && point.roughness < kSharpRoughness;
  }

  // One ray's share of gloss and sheen. Where rays also follow the lobe, as many as go to points of
  // the light, both are weighted by the balance heuristic (Veach 1995).
  Vec3f gloss_sample(const RectangleLight& light, const ShadingPoint& point, Vec3f direction,
                     float distance2, bool sharp) const {
    if (point.gloss <= 0 && point.sheen <= 0) {
      return {0, 0, 0};
    }
    const float cos_light = std::max(1e-6f, -dot(direction, light.normal));
    float density = distance2 / (cos_light * light.area);
    if (sharp) {
      const Vec3f half = normalized(point.view + direction);
      density += gloss_density(std::max(0.0f, dot(point.normal, half)), dot(point.view, half),
                               point.roughness);
    }
    return (1 / density) *
           product(light.radiance,
                   gloss_towards_viewer(point, direction, dot(point.normal, direction)));
  }

  void add_lobe_rays(std::size_t l, std::uint32_t i, int first, int count) {
    const RectangleLight& light = scene_.lights[l];
    const ShadingPoint& point = shaded_[i].point;
    const Vec3f origin = point.position + scene_.epsilon * point.facet;
    const Frame frame(point.normal);
    const std::uint32_t lobe_seed =
        sobol::mixed_bits(seeds_[shaded_[i].pixel].word[3] + static_cast<std::uint32_t>(l));
    for (int k = 0; k < count; ++k) {
      const Point2f u = sobol_point(static_cast<std::uint32_t>(first + k) & 0xFFFFu, lobe_seed);
      const Vec3f half = frame.world(gloss_half_vector(u, point.roughness));
      const Vec3f direction = normalized(2 * dot(point.view, half) * half - point.view);
      const float distance = distance_to(light, origin, direction);
      if (dot(direction, point.normal) <= 0 || distance <= 0 ||
          (scene_.ground &&
           origin.y + distance * direction.y < static_cast<float>(scene_.ground->height))) {
        continue;
      }
      ShadowRay ray{};
      ray.shaded = i;
      ray.gloss = gloss_sample(light, point, direction, distance * distance, true);
      ray.ray = rays_.add(origin, direction, scene_.epsilon, distance * (1 - 1e-4f));
      shadow_rays_.push_back(ray);
    }
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
    sums_.assign(shaded_.size(), LightSum{});
    for (std::uint32_t i = 0; i < shaded_.size(); ++i) {
      if (shaded_[i].mapped) {
        continue;
      }
      // Unshadowed paper never asks for the form factor: it waits until a ray is blocked.
      if (!on_paper(shaded_[i])) {
        sums_[i].form = form_factor(light, shaded_[i].point.position, shaded_[i].point.normal);
      }
      if (on_paper(shaded_[i]) || sums_[i].form.value > 0) {
        const int first = static_cast<int>(shaded_[i].index) * options_.shadow_samples;
        add_shadow_rays(l, i, first, options_.shadow_samples, false);
        if (is_sharp(shaded_[i].point)) {
          add_lobe_rays(l, i, first, options_.shadow_samples);
        }
      }
    }
    trace_shadows();
    if (options_.penumbra_samples > 0) {
      refine_penumbra(l);
    }
    for (std::size_t i = 0; i < shaded_.size(); ++i) {
      LightSum& sum = sums_[i];
      Shaded& s = shaded_[i];
      if (s.mapped) {
        continue;
      }
      if (on_paper(s)) {
        if (sum.visible >= sum.weight * (1 - 1e-5f)) {
          continue;
        }
        sum.form = form_factor(light, s.point.position, s.point.normal);
      }
      if (sum.form.value <= 0) {
        continue;
      }
      const Vec3f open = (std::numbers::pi_v<float> * sum.form.value) * light.radiance;
      // Above the horizon the closed form is exact and rays only say which share is seen; across
      // it, rays that start below count for nothing and the plain mean is the one without bias.
      const Vec3f irradiance =
          sum.form.whole
              ? (sum.weight > 0 ? sum.visible / sum.weight : 0.0f) * open
              : (sum.visible * light.area / static_cast<float>(sum.rays)) * light.radiance;
      if (on_paper(s)) {
        s.missing += open - irradiance;
        detailed_ = true;
        continue;
      }
      s.light += diffuse_light(s.point, irradiance) +
                 (1 / static_cast<float>(std::max(1, sum.gloss_rays))) * sum.gloss;
    }
  }

  // Further rays where those of a pixel and its neighbours disagree.
  void refine_penumbra(std::size_t l) {
    constexpr int kSide = kTile + 2;
    std::array<float, kSide * kSide> least{};
    std::array<float, kSide * kSide> most{};
    least.fill(1);
    most.fill(0);
    const auto place = [](std::uint32_t pixel) {
      return (pixel / kTile + 1) * kSide + pixel % kTile + 1;
    };
    for (std::size_t i = 0; i < shaded_.size(); ++i) {
      if (sums_[i].weight > 0) {
        const float share = sums_[i].visible / sums_[i].weight;
        const std::size_t p = place(shaded_[i].pixel);
        least[p] = std::min(least[p], share);
        most[p] = std::max(most[p], share);
      }
    }
    const int base = options_.samples * options_.shadow_samples;
    for (std::uint32_t i = 0; i < shaded_.size(); ++i) {
      if (sums_[i].weight <= 0) {
        continue;
      }
      const std::size_t p = place(shaded_[i].pixel);
      float low = 1;
      float high = 0;
      for (const std::size_t row : {p - kSide, p, p + kSide}) {
        for (std::size_t q = row - 1; q <= row + 1; ++q) {
          low = std::min(low, least[q]);
          high = std::max(high, most[q]);
        }
      }
      if (high - low > 1e-4f) {
        add_shadow_rays(l, i, base + static_cast<int>(shaded_[i].index) * options_.penumbra_samples,
                        options_.penumbra_samples, true);
      }
    }
    trace_shadows();
  }

  void add_ambient() {
    for (Shaded& s : shaded_) {
      Vec3f irradiance = s.point.ambient;
      if (scene_.ambient == Ambient::PerPixel) {
        const SkySum sky = sky_per_pixel(s);
        irradiance = sky.visible;
        if (on_paper(s)) {
          // Only the blocked share matters: where nothing is in the way, paper has no noise.
          s.missing += product(scene_.open_ground_irradiance, sky.blocked_share());
          detailed_ = detailed_ || sky.blocked;
          continue;
        }
      } else if (on_paper(s)) {
        s.missing += scene_.open_ground_irradiance - irradiance;
        continue;
      }
      float openness = 1;
      if (s.point.gloss > 0) {
        const Vec3f open =
            std::numbers::pi_v<float> * glossy_radiance(scene_.environment, s.point.normal, 1);
        openness = std::clamp(luminance(irradiance) / std::max(1e-6f, luminance(open)), 0.0f, 1.0f);
      }
      s.light += ambient_light(scene_, s.point, irradiance, openness);
    }
  }

  SkySum sky_per_pixel(const Shaded& s) {
    const Frame frame(s.point.normal);
    const Vec3f origin = s.point.position + scene_.epsilon * s.point.facet;
    const std::uint32_t ambient_seed = seeds_[s.pixel].word[1];
    const auto count = static_cast<std::uint32_t>(options_.ambient_samples);
    ambient_radiance_.clear();
    rays_.clear();
    for (std::uint32_t k = 0; k < count; ++k) {
      const EnvironmentSample e = sample_environment(scene_.environment, frame,
                                                     (s.index * count + k) & 0xFFFFu, ambient_seed);
      if (e.weight > 0) {
        rays_.add(origin, e.direction, scene_.epsilon, std::numeric_limits<float>::infinity());
        ambient_radiance_.push_back(e.weight * radiance(scene_.environment, e.direction));
      }
    }
    rays_.trace(scene_.tree, false);
    SkySum sky;
    const float share = 1 / static_cast<float>(count);
    for (std::size_t ray = 0; ray < rays_.size(); ++ray) {
      sky.all += share * ambient_radiance_[ray];
      if (rays_.visible(ray)) {
        sky.visible += share * ambient_radiance_[ray];
      } else {
        sky.blocked = true;
      }
    }
    rays_.clear();
    return sky;
  }

  void collect() {
    for (const Shaded& s : shaded_) {
      if (!on_paper(s)) {
        color_[s.pixel] += s.light;
        alpha_[s.pixel] += 1;
        continue;
      }
      const Vec3f kept = kept_light(s);
      if (options_.alpha) {
        alpha_[s.pixel] += 1 - luminance(kept);  // a black layer of that thickness
      } else {
        color_[s.pixel] += product(kept, s.light);
      }
    }
  }

  static Vec3f shares(Vec3f missing, Vec3f all) {
    const auto share = [](float a, float b) {
      return b > 0 ? std::clamp(1 - a / b, 0.0f, 1.0f) : 1.0f;
    };
    return {share(missing.x, all.x), share(missing.y, all.y), share(missing.z, all.z)};
  }

  // The share of its light that paper gets, channel by channel.
  Vec3f kept_light(const Shaded& s) const {
    if (s.missing.x == 0 && s.missing.y == 0 && s.missing.z == 0) {
      return {1, 1, 1};
    }
    Vec3f open{0, 0, 0};
    if (scene_.ambient != Ambient::None) {
      open = scene_.open_ground_irradiance;
    }
    if (s.mapped) {
      return shares(s.missing, open + s.open);
    }
    for (const RectangleLight& light : scene_.lights) {
      open +=
          (std::numbers::pi_v<float> * form_factor(light, s.point.position, s.point.normal).value) *
          light.radiance;
    }
    return shares(s.missing, open);
  }

  const PreparedScene::Data& scene_;
  const Camera& camera_;
  const RenderOptions& options_;
  int x0_, y0_, x1_ = 0, y1_ = 0;
  Vec3f eye_{0, 0, 0};
  float pixel_angle_ = 0;
  std::array<std::array<Vec3f, 3>, 3> nodes_{};
  bool bent_beyond_ = false;  // the lens cannot be inverted all over the tile
  std::array<Vec3f, kTile * kTile> color_{};
  std::array<float, kTile * kTile> alpha_{};
  std::array<RandomWords, kTile * kTile> seeds_{};
  bool occupied_;  // a mesh may be seen in the tile
  bool detailed_;  // something but background and unshadowed paper may be
  std::vector<Shaded> shaded_;
  std::vector<LightSum> sums_;
  std::vector<ShadowRay> shadow_rays_;
  std::vector<Vec3f> ambient_radiance_;
  OcclusionRays rays_;
};

}  // namespace

Image rendered_tile(const PreparedScene::Data& scene, const Camera& camera,
                    const RenderOptions& options, int x0, int y0, bool occupied) {
  return Tile(scene, camera, options, x0, y0, occupied).render();
}

}  // namespace atelier
