#include "core/render/ground_shadows.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "core/render/gather_ground_shadows.h"
#include "core/saturating_cast.h"

namespace atelier {

namespace {

constexpr float kCell = 0.04f;            // m, of the finest grid: sharper shadows are left to rays
constexpr int kCoarsest = 8;              // cells a side of the squares that are looked at first
constexpr float kStraight = 0.02f;        // of all light: what interpolation may be off by
constexpr std::uint32_t kSeed = 0x5DC0u;  // the same points of a light seen from everywhere: what
                                          // few rays miss changes slowly along the ground

struct Place {
  int i, j;
};

/// A square of cells whose corners are known.
struct Square {
  int i, j, side;
};

/// The grid while it is being filled.
class Filling {
 public:
  Filling(const PreparedScene::Data& scene, GroundShadows& shadows, int rays)
      : scene_(scene), shadows_(shadows), points_(shadows.open.width), rays_(rays) {
    asked_.assign(static_cast<std::size_t>(points_) * static_cast<std::size_t>(points_), 0);
    for (std::size_t l = 0; l < scene.lights.size(); ++l) {
      for (int k = 0; k < rays; ++k) {
        targets_.push_back(light_point(
            scene.lights[l],
            sobol_point(static_cast<std::uint32_t>(k), kSeed + static_cast<std::uint32_t>(l))));
      }
    }
  }

  void fill() {
    std::vector<Square> squares;
    for (int j = 0; j + kCoarsest < points_; j += kCoarsest) {
      for (int i = 0; i + kCoarsest < points_; i += kCoarsest) {
        squares.push_back({i, j, kCoarsest});
      }
    }
    for (const Square& s : squares) {
      ask(s, s.side);
    }
    answer();
    std::vector<Square> accepted;
    while (!squares.empty() && squares.front().side > 1) {
      const int half = squares.front().side / 2;
      for (const Square& s : squares) {
        ask(s, half);
      }
      answer();
      std::vector<Square> finer;
      for (const Square& s : squares) {
        const bool straight = is_straight(s);
        for (const auto& [i, j] : {Place{s.i, s.j}, Place{s.i + half, s.j}, Place{s.i, s.j + half},
                                   Place{s.i + half, s.j + half}}) {
          (straight ? accepted : finer).push_back({i, j, half});
        }
      }
      squares = std::move(finer);
    }
    // The finest first: a border belongs to the finer of its two sides.
    for (auto s = accepted.rbegin(); s != accepted.rend(); ++s) {
      interpolate(*s);
    }
  }

 private:
  std::size_t place(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(points_) +
           static_cast<std::size_t>(i);
  }

  // The points of a square that lie `step` apart.
  void ask(const Square& s, int step) {
    for (int j = s.j; j <= s.j + s.side; j += step) {
      for (int i = s.i; i <= s.i + s.side; i += step) {
        if (asked_[place(i, j)] == 0) {
          asked_[place(i, j)] = 1;
          queue_.push_back({i, j});
        }
      }
    }
  }

  void answer() {
    parallel_for(static_cast<Index>(queue_.size()), 16, [&](Index begin, Index end) {
      OcclusionRays rays;
      std::vector<float> weights;
      for (Index q = begin; q < end; ++q) {
        const Place at = queue_[static_cast<std::size_t>(q)];
        put(at.i, at.j, shadow_at(at, rays, weights));
      }
    });
    queue_.clear();
  }

  // `rays` and `weights` are scratch.
  GroundShadow shadow_at(Place at, OcclusionRays& rays, std::vector<float>& weights) const {
    const Vec3f up{0, 1, 0};
    const Vec3f p{shadows_.min_x + shadows_.cell * static_cast<float>(at.i),
                  static_cast<float>(scene_.ground->height),
                  shadows_.min_z + shadows_.cell * static_cast<float>(at.j)};
    const Vec3f origin = p + scene_.epsilon * up;
    GroundShadow shadow{{0, 0, 0}, {0, 0, 0}};
    for (std::size_t l = 0; l < scene_.lights.size(); ++l) {
      const RectangleLight& light = scene_.lights[l];
      const float form = form_factor(light, p, up).value;
      if (form <= 0) {
        continue;
      }
      rays.clear();
      weights.clear();
      float all = 0;
      for (int k = 0; k < rays_; ++k) {
        const Vec3f to_light =
            targets_[l * static_cast<std::size_t>(rays_) + static_cast<std::size_t>(k)] - origin;
        const float distance2 = squared_norm(to_light);
        const float weight =
            to_light.y * std::max(0.0f, -dot(to_light, light.normal)) / (distance2 * distance2);
        if (weight > 0) {
          rays.add(origin, to_light, scene_.epsilon / std::sqrt(distance2), 1 - 1e-4f);
          weights.push_back(weight);
          all += weight;
        }
      }
      rays.trace(scene_.tree, true);
      float blocked = 0;
      for (std::size_t ray = 0; ray < rays.size(); ++ray) {
        blocked += rays.visible(ray) ? 0 : weights[ray];
      }
      const Vec3f open = (std::numbers::pi_v<float> * form) * light.radiance;
      shadow.open += open;
      shadow.missing += (all > 0 ? blocked / all : 0.0f) * open;
    }
    return shadow;
  }

  void put(int i, int j, const GroundShadow& shadow) {
    float* open = &shadows_.open.at(i, j);
    float* missing = &shadows_.missing.at(i, j);
    open[0] = shadow.open.x;
    open[1] = shadow.open.y;
    open[2] = shadow.open.z;
    missing[0] = shadow.missing.x;
    missing[1] = shadow.missing.y;
    missing[2] = shadow.missing.z;
  }

  float blocked_share(int i, int j) const {
    const float* open = &shadows_.open.at(i, j);
    const float* missing = &shadows_.missing.at(i, j);
    return missing[1] / std::max(1e-12f, open[1]);
  }

  // Whether the points between the corners are what bilinear interpolation makes of these.
  bool is_straight(const Square& s) const {
    const int half = s.side / 2;
    const float a = blocked_share(s.i, s.j);
    const float b = blocked_share(s.i + s.side, s.j);
    const float c = blocked_share(s.i, s.j + s.side);
    const float d = blocked_share(s.i + s.side, s.j + s.side);
    const auto off = [&](int i, int j, float expected) {
      return std::abs(blocked_share(s.i + i, s.j + j) - expected) > kStraight;
    };
    return !off(half, half, 0.25f * (a + b + c + d)) && !off(half, 0, 0.5f * (a + b)) &&
           !off(half, s.side, 0.5f * (c + d)) && !off(0, half, 0.5f * (a + c)) &&
           !off(s.side, half, 0.5f * (b + d));
  }

  void interpolate(const Square& s) {
    const auto corner = [&](const Image& image, int i, int j) {
      const float* v = &image.at(i, j);
      return Vec3f{v[0], v[1], v[2]};
    };
    const auto between = [&](const Image& image, float u, float v) {
      const int i1 = s.i + s.side;
      const int j1 = s.j + s.side;
      return mix(mix(corner(image, s.i, s.j), corner(image, i1, s.j), u),
                 mix(corner(image, s.i, j1), corner(image, i1, j1), u), v);
    };
    for (int j = 0; j <= s.side; ++j) {
      for (int i = 0; i <= s.side; ++i) {
        const float u = static_cast<float>(i) / static_cast<float>(s.side);
        const float v = static_cast<float>(j) / static_cast<float>(s.side);
        if (asked_[place(s.i + i, s.j + j)] == 0) {
          asked_[place(s.i + i, s.j + j)] = 1;
          put(s.i + i, s.j + j, {between(shadows_.open, u, v), between(shadows_.missing, u, v)});
        }
        if (i < s.side && j < s.side) {
          shadows_
              .smooth[static_cast<std::size_t>(s.j + j) * static_cast<std::size_t>(points_ - 1) +
                      static_cast<std::size_t>(s.i + i)] = 1;
        }
      }
    }
  }

  const PreparedScene::Data& scene_;
  GroundShadows& shadows_;
  int points_;
  int rays_;
  std::vector<Vec3f> targets_;  // [lights, rays] points of the lights
  std::vector<char> asked_;     // [points, points] whose light is known
  std::vector<Place> queue_;
};

}  // namespace

GroundShadows gathered_ground_shadows(const PreparedScene::Data& scene, float middle_x,
                                      float middle_z, float reach, int rays) {
  GroundShadows shadows;
  const int squares = std::max(1, saturating_cast<int>(std::ceil(2 * reach / (kCell * kCoarsest))));
  const int cells = kCoarsest * squares;
  shadows.cell = 2 * reach / static_cast<float>(cells);
  shadows.min_x = middle_x - reach;
  shadows.min_z = middle_z - reach;
  shadows.open = Image(cells + 1, cells + 1, 3);
  shadows.missing = Image(cells + 1, cells + 1, 3);
  shadows.smooth.assign(static_cast<std::size_t>(cells) * static_cast<std::size_t>(cells), 0);
  Filling(scene, shadows, rays).fill();
  return shadows;
}

std::optional<GroundShadow> GroundShadows::at(float x, float z) const {
  const float u = (x - min_x) / cell;
  const float v = (z - min_z) / cell;
  const auto last = static_cast<float>(open.width - 1);
  if (open.data.empty() || !(u >= 0 && v >= 0 && u < last && v < last)) {
    return std::nullopt;
  }
  const int i = saturating_cast<int>(u);
  const int j = saturating_cast<int>(v);
  if (smooth[static_cast<std::size_t>(j) * static_cast<std::size_t>(open.width - 1) +
             static_cast<std::size_t>(i)] == 0) {
    return std::nullopt;
  }
  const float fu = u - static_cast<float>(i);
  const float fv = v - static_cast<float>(j);
  const auto read = [&](const Image& image) {
    const auto corner = [&](int a, int b) {
      const float* t = &image.at(a, b);
      return Vec3f{t[0], t[1], t[2]};
    };
    return mix(mix(corner(i, j), corner(i + 1, j), fu),
               mix(corner(i, j + 1), corner(i + 1, j + 1), fu), fv);
  };
  return GroundShadow{read(open), read(missing)};
}

}  // namespace atelier
