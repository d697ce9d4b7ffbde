#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/simulation/cloth_fixtures.h"

/// Strips and loops that bend as the exact elastica says, for any solver.
namespace atelier::fixtures {

inline constexpr double kLength = 0.1;
inline constexpr double kDensity = 0.2;
inline constexpr double kWeight = kDensity * 9.81;

/// How a strip along z bends: freely, or without bending across itself as the elastica supposes.
/// Hinges of an equilateral mesh are a plate of Poisson's ratio -1/3 (the angle at an edge tells
/// the curvature across it less a third of that along it): a free narrow strip curls across itself
/// and is softer by 1/9 than the plate, which a garment's folds, being cylinders, are not.
enum class Across { Free, Straight };

inline Cloth strip_cloth(const Garment& garment, const std::vector<int>& clamp, Across across) {
  Cloth cloth = make_cloth(garment, clamp);
  for (ClothHinge& hinge : cloth.hinges) {
    const double along =
        garment.mesh.vertices(hinge.edge0, 2) - garment.mesh.vertices(hinge.edge1, 2);
    // Slanted edges do not bend on a cylinder, and so only feel what is across.
    if (across == Across::Straight && std::abs(along) > 1e-6) {
      hinge.stiffness *= 100;
    }
  }
  return cloth;
}

/// The free end of a strip.
struct Tip {
  double drop = 0, out = 0;  // of the length
  double slope = 0;          // degrees, of the last row of elements
  double chord() const { return std::atan2(drop, out) * 180 / std::numbers::pi; }
};
/// A strip along z from -one row to kLength.
inline Mesh strip(char kind, int elements, int columns = 1) {
  const double row = kLength / elements;
  Mesh mesh = sheet(columns, elements + 1, kind == 'e' ? row / (std::sqrt(3.0) / 2) : row, kind);
  mesh.vertices.col(2).array() -= row;
  return mesh;
}

/// A strip with load number w L^3 / B `gamma`, clamped by the rows of its mesh up to z = 0; its
/// free end is at z = length.
struct ClampedStrip {
  Mesh mesh;
  Cloth cloth;
  double slow;  ///< a stiffer strip is solved with smaller steps, and comes to rest the sooner
};
inline ClampedStrip clamped_strip(Mesh mesh, double gamma, Across across) {
  // As good as inextensible: its own weight stretches it by 1e-3. More would only be harder to
  // solve, and what is not solved looks like a softer strip.
  const Garment garment = garment_of(std::move(mesh), kDensity, 1000 * kWeight * kLength,
                                     kWeight * kLength * kLength * kLength / gamma);
  const std::vector<int> clamp =
      vertices_where(garment.mesh.vertices, [](double, double, double z) { return z < 1e-9; });
  return {garment.mesh, strip_cloth(garment, clamp, across), std::sqrt(std::min(1.0, gamma / 10))};
}

/// The free end of a strip whose vertices came to rest at `positions`.
inline Tip tip_at(const Mesh& mesh, const Points& positions) {
  // Of the rows of vertices the last and the one before.
  Eigen::Vector2d last(0, 0);
  Eigen::Vector2d before(0, 0);
  double rows[2] = {0, 0};
  double row = 0;
  for (Index v = 0; v < positions.rows(); ++v) {
    const double z = mesh.vertices(v, 2);
    row = z < kLength - 1e-9 ? std::max(row, z) : row;
  }
  for (Index v = 0; v < positions.rows(); ++v) {
    const Eigen::Vector2d at(positions(v, 2), -positions(v, 1));
    if (mesh.vertices(v, 2) > kLength - 1e-9) {
      last += at;
      ++rows[0];
    } else if (mesh.vertices(v, 2) > row - 1e-9) {
      before += at;
      ++rows[1];
    }
  }
  last /= rows[0];
  const Eigen::Vector2d end = last - before / rows[1];
  return {last.y() / kLength, last.x() / kLength,
          std::atan2(end.y(), end.x()) * 180 / std::numbers::pi};
}

/// Loads w L^3 / B of a cantilever and where the exact elastica has its end.
struct ElasticaRow {
  double gamma, drop, out, chord, slope;
};
inline constexpr ElasticaRow kElastica[] = {
    {0.1, 0.01250, 0.99991, 0.716, 0.955},  {1, 0.12347, 0.99125, 7.100, 9.460},
    {2, 0.23851, 0.96689, 13.857, 18.426},  {5, 0.49591, 0.84666, 30.358, 39.935},
    {8, 0.64063, 0.72442, 41.487, 53.865},  {10, 0.70020, 0.65635, 46.851, 60.312},
    {20, 0.82988, 0.44523, 61.786, 76.748}, {50, 0.90792, 0.24501, 74.898, 87.459},
    {100, 0.93752, 0.15922, 80.361, 89.617}};

/// Loads of a heart loop and how far it hangs down, over its length (Peirce's loop).
struct HeartLoopRow {
  double load, drop;
};
inline constexpr HeartLoopRow kHeartLoops[] = {{0, 0.13386},   {10, 0.13954},  {50, 0.16069},
                                               {100, 0.18404}, {200, 0.22239}, {400, 0.27544},
                                               {800, 0.33204}, {3000, 0.40918}};

/// A loop whose ends are clamped together, pointing up, and how it starts.
struct HeartLoopScene {
  Cloth cloth;
  ClothState start;
  Control control;
  double frame;  ///< s, a frame in units of the strip's own bending wave, else of its fall
};
inline HeartLoopScene heart_loop_scene(double load) {
  constexpr int kElements = 60;
  const double row = kLength / kElements;
  Mesh mesh = sheet(2, kElements + 2, row / (std::sqrt(3.0) / 2), 'e');
  const double gravity = load > 0 ? 9.81 : 0;
  const double bending = load > 0 ? kWeight * kLength * kLength * kLength / load : 1e-5;
  const Garment garment = garment_of(
      mesh, kDensity,
      1e4 * bending / (kLength * kLength) + (load > 0 ? 1000 * kWeight * kLength : 0), bending);
  const std::vector<int> clamp = vertices_where(
      garment.mesh.vertices,
      [&](double, double, double z) { return z < 1.5 * row || z > (kElements + 0.5) * row; });
  const Cloth cloth = strip_cloth(garment, clamp, Across::Straight);
  // Where it starts: up, three quarters of a circle outwards, a straight bottom; both sides alike.
  ClothState state = rest_state(cloth);
  const double radius = kLength / 2 / (1 + 1.5 * 3.14159265358979323846);
  for (Index v = 0; v < state.positions.rows(); ++v) {
    const double s = mesh.vertices(v, 2) - row;
    const bool second = s > kLength / 2;
    const double t = second ? kLength - s : s;
    double out = 0;
    double up = t;
    if (t > 0) {
      const double angle = std::min(t / radius, 1.5 * 3.14159265358979323846);
      out = radius * (1 - std::cos(angle)) - std::max(0.0, t - radius * angle);
      up = radius * std::sin(angle);
    }
    state.positions.row(v) << mesh.vertices(v, 0), up, second ? -out : out;
  }
  Control control;
  control.gravity = {0, -gravity, 0};
  const double unit = std::sqrt(kDensity * std::pow(kLength, 4) / bending);
  const double frame = load > 0 ? std::min(1.0 / 60, 0.02 * unit) : 0.02 * unit;
  return {cloth, state, control, frame};
}

}  // namespace atelier::fixtures
