#include "capture/fabric.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/saturating_cast.h"
#include "core/types.h"

namespace atelier {
namespace {

using Color = Eigen::Vector3f;

double lattice(std::int64_t x, std::int64_t y, std::int64_t z, std::uint64_t seed) {
  // Murmur's finaliser over the packed coordinates: one lattice point, one number.
  std::uint64_t h = seed * 0x9E3779B97F4A7C15ull;
  for (const std::int64_t c : {x, y, z}) {
    h ^= static_cast<std::uint64_t>(c) + 0x9E3779B97F4A7C15ull + (h << 6) + (h >> 2);
    h ^= h >> 33;
    h *= 0xFF51AFD7ED558CCDull;
    h ^= h >> 33;
  }
  return static_cast<double>(h >> 11) * 0x1.0p-52 - 1;
}

double smooth(double t) {
  return t * t * t * (t * (6 * t - 15) + 10);
}

/// Linear RGB of a hue at a lightness, `saturation` away from grey.
Color tinted(double hue, double saturation, double lightness) {
  Color color;
  for (int c = 0; c < 3; ++c) {
    const double wave = std::cos(2 * std::numbers::pi * (hue - c / 3.0));
    color[c] =
        static_cast<float>(std::clamp(lightness * (1 + saturation * 1.3 * wave), 0.01, 0.95));
  }
  return color;
}

/// Lighter and darker yarns: streaks along the warp and across it, and the weave's own grid.
double weave(double x, double y, double strength, std::uint64_t seed) {
  const double warp = value_noise(x * 900, y * 22, 0.5, seed + 1);
  const double weft = value_noise(x * 22, y * 900, 0.5, seed + 2);
  const double slub =
      value_noise(x * 240, y * 9, 0.5, seed + 3) + value_noise(x * 9, y * 240, 0.5, seed + 4);
  const double patch = value_noise(x * 30, y * 30, 0.5, seed + 5);
  const double grid =
      std::sin(x * 2 * std::numbers::pi / 0.0032) * std::sin(y * 2 * std::numbers::pi / 0.0032);
  return 1 + strength * (0.5 * warp + 0.5 * weft + 0.55 * slub + 0.3 * patch + 0.25 * grid);
}

/// Flowers on a jittered lattice: the nearest few cells are looked at.
struct Print {
  double pitch;  ///< m between flowers
  std::array<Color, 4> petals;
  Color leaf;
  Color heart;
  std::uint64_t seed;

  Color over(const Color& ground, double x, double y) const {
    Color color = ground;
    const auto cx = saturating_cast<std::int64_t>(std::floor(x / pitch));
    const auto cy = saturating_cast<std::int64_t>(std::floor(y / pitch));
    for (std::int64_t j = cy - 1; j <= cy + 1; ++j) {
      for (std::int64_t i = cx - 1; i <= cx + 1; ++i) {
        const auto draw = [&](int n) { return 0.5 + 0.5 * lattice(i, j, n, seed); };
        const double px = pitch * (static_cast<double>(i) + 0.2 + 0.6 * draw(0)) - x;
        const double py = pitch * (static_cast<double>(j) + 0.2 + 0.6 * draw(1)) - y;
        const double radius = pitch * (0.22 + 0.20 * draw(2));
        const double r = std::hypot(px, py) / radius;
        if (r > 1.75) {
          continue;
        }
        const double angle = std::atan2(py, px) + 2 * std::numbers::pi * draw(3);
        const int count = 5 + saturating_cast<int>(draw(4) * 3);
        const double petal = 0.66 + 0.34 * std::cos(count * angle);
        // Two leaves behind the flower.
        const double leaf_angle = std::abs(std::sin(angle * 1.0 + 3 * draw(5)));
        if (r < 1.7 && leaf_angle > 0.93 + 0.05 * r - 0.04) {
          color = leaf;
        }
        if (r < petal) {
          const Color& tone = petals[saturating_cast<std::size_t>(draw(6) * 3.999)];
          color = tone * static_cast<float>(0.82 + 0.25 * r / petal);
          if (r > petal * 0.88) {
            color *= 0.72F;  // outlines
          }
        }
        if (r < 0.24) {
          color = heart;
        }
      }
    }
    return color;
  }
};

Print print_of(const FabricOptions& options, std::uint64_t seed) {
  Print print;
  print.pitch = 0.055 * options.print_scale;
  const bool dark = options.lightness < 0.25;
  print.petals = {tinted(options.hue + 0.45, 0.55, dark ? 0.55 : 0.42),
                  tinted(options.hue + 0.55, 0.7, dark ? 0.4 : 0.30),
                  tinted(options.hue + 0.08, 0.25, 0.68), tinted(options.hue + 0.38, 0.6, 0.5)};
  print.leaf = tinted(0.34, 0.6, dark ? 0.2 : 0.13);
  print.heart = tinted(0.14, 0.75, 0.5);
  print.seed = seed + 11;
  return print;
}

/// Cells on a dark net. The colours of a row are drawn so that no 3 x 3 neighbourhood's first row
/// and column repeat soon: with 7 colours and 9 cells a chance repeat is below 1e-7.
Color coded(double x, double y, const FabricOptions& options, std::uint64_t seed) {
  static const std::array<Color, 7> kColors = {
      Color(0.80F, 0.80F, 0.78F), Color(0.62F, 0.06F, 0.05F), Color(0.06F, 0.32F, 0.08F),
      Color(0.05F, 0.10F, 0.52F), Color(0.75F, 0.55F, 0.04F), Color(0.36F, 0.05F, 0.40F),
      Color(0.04F, 0.40F, 0.45F)};
  const double u = x / options.cell;
  const double v = y / options.cell;
  const double fu = u - std::floor(u) - 0.5;
  const double fv = v - std::floor(v) - 0.5;
  if (std::max(std::abs(fu), std::abs(fv)) > 0.42) {
    return Color(0.03F, 0.03F, 0.035F);
  }
  const double draw =
      0.5 + 0.5 * lattice(saturating_cast<std::int64_t>(std::floor(u)),
                          saturating_cast<std::int64_t>(std::floor(v)), 0, seed + 21);
  return kColors[saturating_cast<std::size_t>(draw * 6.999)];
}

}  // namespace

OptionTable describe(FabricOptions& options) {
  OptionTable table;
  table
      .add("kind", options.kind,
           {{"plain", FabricKind::Plain},
            {"woven", FabricKind::Woven},
            {"print", FabricKind::Print},
            {"all-print", FabricKind::AllPrint},
            {"coded", FabricKind::Coded}},
           "Pattern of the cloth: plain is the hard case for registration, coded the easy one; "
           "print leaves trousers under a top woven, all-print prints them too")
      .add("resolution", options.resolution, 16, 16384, "", "Side of the albedo texture in texels")
      .add("hue", options.hue, 0, 1, "", "Hue of the base colour in turns: 0 red, 0.33 green")
      .add("saturation", options.saturation, 0, 1, "", "Saturation of the base colour")
      .add("lightness", options.lightness, 0.02, 0.9, "", "Reflectance of the base colour")
      .add("cell", options.cell, 0.002, 0.1, "m", "Width of a cell of the coded print")
      .add("print_scale", options.print_scale, 0.1, 10, "",
           "Factor on the size of the printed figures");
  return table;
}

double value_noise(double x, double y, double z, std::uint64_t seed) {
  const auto x0 = saturating_cast<std::int64_t>(std::floor(x));
  const auto y0 = saturating_cast<std::int64_t>(std::floor(y));
  const auto z0 = saturating_cast<std::int64_t>(std::floor(z));
  const double tx = smooth(x - std::floor(x));
  const double ty = smooth(y - std::floor(y));
  const double tz = smooth(z - std::floor(z));
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1;
    const int j = corner >> 1 & 1;
    const int k = corner >> 2;
    const double weight = (i != 0 ? tx : 1 - tx) * (j != 0 ? ty : 1 - ty) * (k != 0 ? tz : 1 - tz);
    if (weight > 0) {
      sum += weight * lattice(x0 + i, y0 + j, z0 + k, seed);
    }
  }
  return sum;
}

Image fabric_image(double size, const FabricOptions& options, std::uint64_t seed) {
  FabricOptions copy = options;
  const std::vector<std::string> wrong = check_options(describe(copy));
  ATELIER_CHECK(wrong.empty(), wrong.empty() ? "" : wrong.front());
  ATELIER_CHECK(size > 0, "a fabric needs a size above 0");
  const int n = options.resolution;
  const Color base = tinted(options.hue, options.saturation, options.lightness);
  const Print print = print_of(options, seed);
  Image image(n, n, 3);
  parallel_for(n, 8, [&](Index begin, Index end) {
    for (Index row = begin; row < end; ++row) {
      const double y = size * (1 - (static_cast<double>(row) + 0.5) / n);
      for (int column = 0; column < n; ++column) {
        const double x = size * (column + 0.5) / n;
        Color color = base;
        double texture = 1;
        switch (options.kind) {
          case FabricKind::Plain:
            texture = 1 + 0.02 * value_noise(x * 40, y * 40, 0.5, seed + 5);
            break;
          case FabricKind::Woven:
            texture = weave(x, y, 0.22, seed);
            break;
          case FabricKind::Print:
          case FabricKind::AllPrint:
            color = print.over(base, x, y);
            texture = weave(x, y, 0.14, seed);
            break;
          case FabricKind::Coded:
            color = coded(x, y, options, seed);
            texture = weave(x, y, 0.05, seed);
            break;
        }
        for (int c = 0; c < 3; ++c) {
          image.at(column, static_cast<int>(row), c) =
              std::clamp(static_cast<float>(texture) * color[c], 0.005F, 0.95F);
        }
      }
    }
  });
  return image;
}

}  // namespace atelier
