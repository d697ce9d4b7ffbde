#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/device.h"
#include "core/garment.h"
#include "simulation/xpbd/xpbd.h"

namespace atelier::fixtures {

/// A frame in which the body stays where it is.
inline Control still(const Points& body) {
  Control control;
  control.body_start = body;
  control.body_end = body;
  return control;
}

/// A flat sheet in the plane y = 0 of `columns` x `rows` cells from (0, 0, 0) along x and z. Kind
/// 'd': one diagonal; 'a': alternating diagonals; 'e': equilateral triangles of side `size` (rows
/// are then sqrt(3)/2 apart and every second row is shifted by half, its ends straightened).
inline Mesh sheet(int columns, int rows, double size, char kind = 'd') {
  Mesh mesh;
  if (kind == 'e') {
    // Odd rows are shifted by half a cell; their ends lie on the straight border.
    std::vector<Eigen::RowVector3d> points;
    std::vector<std::vector<int>> id(static_cast<std::size_t>(rows) + 1);
    const double step = std::sqrt(3.0) / 2 * size;
    for (int r = 0; r <= rows; ++r) {
      const bool odd = r % 2 == 1;
      const int count = odd ? columns + 2 : columns + 1;
      for (int c = 0; c < count; ++c) {
        double x = c * size;
        if (odd) {
          x = c == 0 ? 0 : c == count - 1 ? columns * size : (c - 0.5) * size;
        }
        id[r].push_back(static_cast<int>(points.size()));
        points.emplace_back(x, 0.0, r * step);
      }
    }
    std::vector<Eigen::RowVector3i> faces;
    for (int r = 0; r < rows; ++r) {
      const bool lower_odd = r % 2 == 1;
      const std::vector<int>& even = lower_odd ? id[r + 1] : id[r];
      const std::vector<int>& odd = lower_odd ? id[r] : id[r + 1];
      const auto face = [&](int a, int b, int c) {
        // Upwards normal: counter-clockwise seen from +y with z to the viewer's bottom.
        if (lower_odd) {
          faces.emplace_back(a, b, c);
        } else {
          faces.emplace_back(a, c, b);
        }
      };
      for (int c = 0; c <= columns; ++c) {
        face(even[c], odd[c], odd[c + 1]);
        if (c < columns) {
          face(even[c], odd[c + 1], even[c + 1]);
        }
      }
    }
    mesh.vertices.resize(static_cast<Index>(points.size()), 3);
    for (std::size_t i = 0; i < points.size(); ++i) {
      mesh.vertices.row(static_cast<Index>(i)) = points[i];
    }
    mesh.faces.resize(static_cast<Index>(faces.size()), 3);
    for (std::size_t i = 0; i < faces.size(); ++i) {
      mesh.faces.row(static_cast<Index>(i)) = faces[i];
    }
    return mesh;
  }
  mesh.vertices.resize((columns + 1) * (rows + 1), 3);
  for (int r = 0; r <= rows; ++r) {
    for (int c = 0; c <= columns; ++c) {
      mesh.vertices.row(r * (columns + 1) + c) << c * size, 0.0, r * size;
    }
  }
  mesh.faces.resize(2 * columns * rows, 3);
  Index f = 0;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int a = r * (columns + 1) + c;
      const int b = a + 1;
      const int d = a + columns + 1;
      const int e = d + 1;
      if (kind == 'a' && (r + c) % 2 == 1) {
        mesh.faces.row(f++) << a, d, b;
        mesh.faces.row(f++) << b, d, e;
      } else {
        mesh.faces.row(f++) << a, d, e;
        mesh.faces.row(f++) << a, e, b;
      }
    }
  }
  return mesh;
}

/// Flat rest shape from the template's own x and z.
inline void use_flat_rest(Garment& garment) {
  garment.rest.resize(garment.mesh.vertices.rows(), 2);
  garment.rest.col(0) = garment.mesh.vertices.col(0);
  garment.rest.col(1) = garment.mesh.vertices.col(2);
  garment.rest_faces = garment.mesh.faces;
}

inline Garment garment_of(Mesh mesh, double density, double stretch, double bending) {
  Garment garment;
  garment.name = "cloth";
  garment.mesh = std::move(mesh);
  garment.material.density = density;
  garment.material.stretch_warp = stretch;
  garment.material.stretch_weft = stretch;
  garment.material.shear = 0.4 * stretch;
  garment.material.bending = bending;
  return garment;
}

/// Vertices for which `inside(x, y, z)` holds in the template.
template <class Inside>
std::vector<int> vertices_where(const Points& positions, const Inside& inside) {
  std::vector<int> out;
  for (Index v = 0; v < positions.rows(); ++v) {
    if (inside(positions(v, 0), positions(v, 1), positions(v, 2))) {
      out.push_back(static_cast<int>(v));
    }
  }
  return out;
}

/// A chain of `links` springs hanging down from the origin, the first particle fixed.
inline Cloth chain(int links, double length, double stiffness, double mass, double end_mass) {
  Points x(links + 1, 3);
  std::vector<double> masses;
  std::vector<ClothSpring> springs;
  for (int i = 0; i <= links; ++i) {
    x.row(i) << 0, -i * length, 0;
    masses.push_back(i == links ? end_mass : mass);
    if (i > 0) {
      springs.push_back({i - 1, i, length, stiffness});
    }
  }
  return make_spring_net(x, masses, springs, {0});
}

/// Runs frames until nothing moves faster than `rest_speed` or `most` frames are done.
inline ClothState settle(ClothSolver& solver, const Control& control, int most,
                         double rest_speed = 1e-5) {
  ClothState state;
  for (int i = 0; i < most; ++i) {
    solver.advance(control);
    if (i % 10 == 9) {
      state = solver.state();
      if (state.velocities.rowwise().norm().maxCoeff() < rest_speed) {
        return state;
      }
    }
  }
  return solver.state();
}

/// True in scripts/soak, where tests run in full.
inline bool soaking() {
  const char* soak = std::getenv("ATELIER_SOAK");
  return soak != nullptr && std::string(soak) == "1";
}

/// Frames of a test that goes on for as long as anyone likes: a few, or in scripts/soak 100,000 or
/// ATELIER_SOAK_FRAMES.
inline int frames_or_soak(int few) {
  if (!soaking()) {
    return few;
  }
  const char* frames = std::getenv("ATELIER_SOAK_FRAMES");
  return frames != nullptr ? std::max(few, std::atoi(frames)) : 100000;
}

/// The largest of a figure in each tenth of a run, to see whether it grows.
class Tenths {
 public:
  explicit Tenths(int frames) : frames_(frames) {}
  void add(int frame, double value) {
    double& most = most_[static_cast<std::size_t>(10LL * frame / frames_)];
    most = std::max(most, value);
  }
  /// Of each tenth, for a run that goes on another day.
  std::array<double, 10>& most() { return most_; }
  double early() const { return *std::max_element(most_.begin(), most_.begin() + 5); }
  double late() const { return *std::max_element(most_.begin() + 5, most_.end()); }
  std::string text() const {
    std::string out;
    for (const double most : most_) {
      out += (out.empty() ? "" : " ") + std::to_string(most).substr(0, 6);
    }
    return out;
  }

 private:
  int frames_;
  std::array<double, 10> most_{};
};

/// The devices that this machine can run; of them the one that ATELIER_TEST_DEVICE=cpu or cuda
/// names. Where that leaves none, the test that asks counts as skipped: its loop checks nothing.
inline std::vector<Device> devices() {
  const char* only = std::getenv("ATELIER_TEST_DEVICE");
  std::vector<Device> out;
  if (only == nullptr || std::string(only) != "cuda") {
    out.push_back(Device::Cpu);
  }
  if (cuda_available() && (only == nullptr || std::string(only) != "cpu")) {
    out.push_back(Device::Cuda);
  }
  if (out.empty()) {
    [] { GTEST_SKIP() << "no device " << std::getenv("ATELIER_TEST_DEVICE") << " here"; }();
  }
  return out;
}

}  // namespace atelier::fixtures
