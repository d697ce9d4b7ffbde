#include "bodymodel/human/human_march.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "core/saturating_cast.h"

namespace atelier {

HumanHalfMesh march_human(const HumanField& field, double h) {
  const double top = field.anatomy.build.stature + 0.03;
  const double reach = field.anatomy.joints.fingers[2][3].x + 0.05;
  const int coarse = 4;
  const int nx = saturating_cast<int>(reach / h / coarse + 1) * coarse;
  const int ny = saturating_cast<int>((top + 0.03) / h / coarse + 1) * coarse;
  const int nz = saturating_cast<int>(0.45 / h / coarse + 1) * coarse;
  const Vec3d origin = {0, -0.03, -0.19};
  const auto position = [&](int x, int y, int z) {
    return origin + h * Vec3d{1.0 * x, 1.0 * y, 1.0 * z};
  };
  const auto key = [&](int x, int y, int z) {
    return (static_cast<std::int64_t>(x) * (ny + 1) + y) * (nz + 1) + z;
  };
  std::vector<std::array<int, 3>> blocks;
  for (int x = 0; x < nx; x += coarse) {
    for (int y = 0; y < ny; y += coarse) {
      for (int z = 0; z < nz; z += coarse) {
        const double v =
            field_value(field, position(x, y, z) + (0.5 * coarse * h) * Vec3d{1, 1, 1});
        if (std::abs(v) < 2.2 * coarse * h) {
          blocks.push_back({x, y, z});
        }
      }
    }
  }
  std::unordered_map<std::int64_t, double> values;
  const auto value = [&](int x, int y, int z) {
    const std::int64_t id = key(x, y, z);
    const auto found = values.find(id);
    if (found != values.end()) {
      return found->second;
    }
    double v = field_value(field, position(x, y, z));
    if (std::abs(v) < 1e-7) {
      v = 1e-7;  // no vertex on a grid point
    }
    values.emplace(id, v);
    return v;
  };
  HumanHalfMesh mesh;
  std::unordered_map<std::int64_t, std::unordered_map<std::int64_t, int>> crossings;
  const int corners[8][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                             {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
  const int tets[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7},
                          {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
  for (const auto& block : blocks) {
    for (int cell = 0; cell < coarse * coarse * coarse; ++cell) {
      const int x = block[0] + cell % coarse;
      const int y = block[1] + cell / coarse % coarse;
      const int z = block[2] + cell / coarse / coarse;
      double v[8];
      int inside = 0;
      for (int c = 0; c < 8; ++c) {
        v[c] = value(x + corners[c][0], y + corners[c][1], z + corners[c][2]);
        inside += v[c] < 0;
      }
      if (inside == 0 || inside == 8) {
        continue;
      }
      for (const auto& tet : tets) {
        const auto vertex = [&](int a, int b) {
          const auto grid = [&](int c) {
            return key(x + corners[c][0], y + corners[c][1], z + corners[c][2]);
          };
          std::int64_t ka = grid(a);
          std::int64_t kb = grid(b);
          if (ka > kb) {
            std::swap(ka, kb);
            std::swap(a, b);
          }
          const auto [it, fresh] =
              crossings[ka].try_emplace(kb, static_cast<int>(mesh.points.size()));
          if (fresh) {
            const double t = std::clamp(v[a] / (v[a] - v[b]), 0.02, 0.98);
            const Vec3d pa = position(x + corners[a][0], y + corners[a][1], z + corners[a][2]);
            const Vec3d pb = position(x + corners[b][0], y + corners[b][1], z + corners[b][2]);
            mesh.points.push_back(pa + t * (pb - pa));
          }
          return it->second;
        };
        int in[4], out[4], n_in = 0, n_out = 0;
        for (int c : tet) {
          (v[c] < 0 ? in[n_in++] : out[n_out++]) = c;
        }
        const auto add = [&](int i, int j, int k) {
          // Outward: away from the inside corners.
          const Vec3d a = mesh.points[static_cast<std::size_t>(i)];
          const Vec3d n = cross(mesh.points[static_cast<std::size_t>(j)] - a,
                                mesh.points[static_cast<std::size_t>(k)] - a);
          const Vec3d q =
              position(x + corners[in[0]][0], y + corners[in[0]][1], z + corners[in[0]][2]);
          if (dot(n, a - q) >= 0) {
            mesh.faces.push_back({i, j, k});
          } else {
            mesh.faces.push_back({i, k, j});
          }
        };
        if (n_in == 1) {
          add(vertex(in[0], out[0]), vertex(in[0], out[1]), vertex(in[0], out[2]));
        } else if (n_in == 3) {
          add(vertex(out[0], in[0]), vertex(out[0], in[1]), vertex(out[0], in[2]));
        } else if (n_in == 2) {
          const int a = vertex(in[0], out[0]), b = vertex(in[0], out[1]);
          const int c = vertex(in[1], out[1]), d = vertex(in[1], out[0]);
          add(a, b, c);
          add(a, c, d);
        }
      }
    }
  }
  return mesh;
}

}  // namespace atelier
