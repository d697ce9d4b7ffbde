#include "bodymodel/human_polygonise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "core/parallel.h"

namespace atelier {
namespace {

using Face = std::array<int, 3>;

struct HalfMesh {
  std::vector<Vec3d> points;
  std::vector<Face> faces;
};

// Marching tetrahedra (six per cell, Kuhn's split, so that neighbours agree).
HalfMesh march(const HumanField& field, double h) {
  const double top = field.anatomy.build.stature + 0.03;
  const double reach = field.anatomy.joints.fingers[2][3].x + 0.05;
  const int coarse = 4;
  const int nx = static_cast<int>(reach / h / coarse + 1) * coarse;
  const int ny = static_cast<int>((top + 0.03) / h / coarse + 1) * coarse;
  const int nz = static_cast<int>(0.45 / h / coarse + 1) * coarse;
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
  HalfMesh mesh;
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

// Target edge length at a point, metres at a stature of 1.7.
double target_edge(const HumanField& field, Vec3d p) {
  const HumanJoints& j = field.anatomy.joints;
  const double k = field.anatomy.build.stature / 1.7;
  const auto ramp = [](double x, double a, double b) {
    const double t = std::clamp((x - a) / (b - a), 0.0, 1.0);
    return t * t * (3 - 2 * t);
  };
  double edge = 0.0185;
  // The legs lie beyond the wrist's plane too.
  const double to_hand = p.x > j.elbow.x ? dot(p - j.wrist, field.anatomy.arm.axis) / k : -1.0;
  edge += (0.0088 - edge) * ramp(to_hand, -0.08, 0.03);
  edge += (0.0057 - edge) * ramp(to_hand, 0.05, 0.11);
  edge += (0.0100 - edge) * ramp(-p.y / k, -0.16, -0.05);
  const double ahead = (p.z - j.ankle.z + 0.09 * (p.x - j.ankle.x)) / k;
  edge += (0.0055 - edge) * ramp(-p.y / k, -0.08, -0.04) * ramp(ahead, 0.120, 0.150);
  const double head = ramp(p.y / k, 1.40, 1.50);
  const double face = ramp(p.z / k, 0.02, 0.09);
  const auto near = [&](Vec3d place, double all, double none) {
    return 1 - ramp(norm((1 / k) * p - place), all, none);
  };
  edge += (0.0085 - edge) * near({0, 1.069, 0.125}, 0.016, 0.055);  // navel
  double of_head = 0.0140 - 0.0083 * face;
  of_head += (0.0090 - of_head) * near({0.045, 1.512, 0.030}, 0.020, 0.055);  // jaw
  of_head += (0.0039 - of_head) * near({0.078, 1.570, 0.005}, 0.024, 0.050);  // ear
  of_head += (0.0034 - of_head) * near({0, 1.555, 0.130}, 0.014, 0.040);      // nose
  of_head += (0.0028 - of_head) * near({0.010, 1.522, 0.120}, 0.016, 0.042);  // mouth
  of_head += (0.0023 - of_head) * near({0.031, 1.589, 0.108}, 0.015, 0.042);  // eye
  edge += (of_head - edge) * head;
  return edge * k;
}

class Remesher {
 public:
  Remesher(const HumanField& field, HalfMesh mesh, double scale)
      : field_(field), scale_(scale), mesh_(std::move(mesh)) {}

  void round(bool project) {
    split();
    collapse();
    flip();
    relax(project);
  }

  HalfMesh take() { return std::move(mesh_); }

 private:
  struct Edge {
    int a, b;     // a < b
    int face[2];  // -1: none
    int opposite[2];
  };

  static std::int64_t edge_key(int a, int b) {
    return a < b ? (static_cast<std::int64_t>(a) << 32) | static_cast<std::uint32_t>(b)
                 : (static_cast<std::int64_t>(b) << 32) | static_cast<std::uint32_t>(a);
  }

  Vec3d at(int i) const { return mesh_.points[static_cast<std::size_t>(i)]; }
  double target(int a, int b) const { return scale_ * target_edge(field_, 0.5 * (at(a) + at(b))); }
  double length(int a, int b) const { return norm(at(a) - at(b)); }

  std::vector<Edge> edges() const {
    std::unordered_map<std::int64_t, int> index;
    index.reserve(mesh_.faces.size() * 2);
    std::vector<Edge> list;
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
      for (std::size_t c = 0; c < 3; ++c) {
        const int a = mesh_.faces[f][c];
        const int b = mesh_.faces[f][(c + 1) % 3];
        const auto [it, fresh] = index.try_emplace(edge_key(a, b), static_cast<int>(list.size()));
        if (fresh) {
          list.push_back({std::min(a, b), std::max(a, b), {-1, -1}, {-1, -1}});
        }
        Edge& e = list[static_cast<std::size_t>(it->second)];
        const int side = e.face[0] < 0 ? 0 : 1;
        e.face[side] = static_cast<int>(f);
        e.opposite[side] = mesh_.faces[f][(c + 2) % 3];
      }
    }
    return list;
  }

  void split() {
    for (int pass = 0; pass < 6; ++pass) {
      std::vector<Edge> list = edges();
      std::vector<std::pair<double, std::size_t>> order;
      for (std::size_t i = 0; i < list.size(); ++i) {
        const double ratio = length(list[i].a, list[i].b) / target(list[i].a, list[i].b);
        if (ratio > 4.0 / 3) {
          order.push_back({-ratio, i});
        }
      }
      if (order.empty()) {
        return;
      }
      std::sort(order.begin(), order.end());
      std::vector<char> touched(mesh_.faces.size(), 0);
      for (const auto& [ratio, i] : order) {
        const Edge& e = list[i];
        bool free = true;
        for (int f : e.face) {
          free = free && (f < 0 || touched[static_cast<std::size_t>(f)] == 0);
        }
        if (!free) {
          continue;
        }
        const int m = static_cast<int>(mesh_.points.size());
        mesh_.points.push_back(0.5 * (at(e.a) + at(e.b)));
        for (int f : e.face) {
          if (f < 0) {
            continue;
          }
          touched[static_cast<std::size_t>(f)] = 1;
          Face old = mesh_.faces[static_cast<std::size_t>(f)];
          Face other = old;
          for (std::size_t c = 0; c < 3; ++c) {
            if (old[c] == e.a) {
              old[c] = m;
            } else if (other[c] == e.b) {
              other[c] = m;
            }
          }
          mesh_.faces[static_cast<std::size_t>(f)] = old;
          mesh_.faces.push_back(other);
        }
      }
    }
  }

  void collapse() {
    for (int pass = 0; pass < 6; ++pass) {
      const std::vector<Edge> list = edges();
      std::vector<char> border(mesh_.points.size(), 0);
      std::vector<std::vector<int>> around(mesh_.points.size());
      for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
        for (int v : mesh_.faces[f]) {
          around[static_cast<std::size_t>(v)].push_back(static_cast<int>(f));
        }
      }
      std::vector<std::pair<double, std::size_t>> order;
      for (std::size_t i = 0; i < list.size(); ++i) {
        if (list[i].face[1] < 0) {
          border[static_cast<std::size_t>(list[i].a)] = 1;
          border[static_cast<std::size_t>(list[i].b)] = 1;
        }
        const double ratio = length(list[i].a, list[i].b) / target(list[i].a, list[i].b);
        if (ratio < 4.0 / 5) {
          order.push_back({ratio, i});
        }
      }
      std::sort(order.begin(), order.end());
      std::vector<char> touched(mesh_.points.size(), 0);
      std::vector<char> dead(mesh_.faces.size(), 0);
      bool any = false;
      for (const auto& [ratio, i] : order) {
        const Edge& e = list[i];
        int keep = e.a;
        int gone = e.b;
        const bool is_border = e.face[1] < 0;
        if (border[static_cast<std::size_t>(gone)] && !border[static_cast<std::size_t>(keep)]) {
          std::swap(keep, gone);
        }
        if (border[static_cast<std::size_t>(keep)] && border[static_cast<std::size_t>(gone)] &&
            !is_border) {
          continue;
        }
        const bool middle =
            border[static_cast<std::size_t>(keep)] == border[static_cast<std::size_t>(gone)];
        const Vec3d p = middle ? 0.5 * (at(keep) + at(gone)) : at(keep);
        // Neighbourhoods.
        std::vector<int> ring_keep, ring_gone;
        bool free = true;
        for (int which = 0; which < 2; ++which) {
          for (int f : around[static_cast<std::size_t>(which == 0 ? keep : gone)]) {
            free = free && !dead[static_cast<std::size_t>(f)];
            for (int v : mesh_.faces[static_cast<std::size_t>(f)]) {
              free = free && !touched[static_cast<std::size_t>(v)];
              if (v != keep && v != gone) {
                (which == 0 ? ring_keep : ring_gone).push_back(v);
              }
            }
          }
        }
        if (!free) {
          continue;
        }
        const auto unique = [](std::vector<int>& ring) {
          std::sort(ring.begin(), ring.end());
          ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
        };
        unique(ring_keep);
        unique(ring_gone);
        std::vector<int> common;
        std::set_intersection(ring_keep.begin(), ring_keep.end(), ring_gone.begin(),
                              ring_gone.end(), std::back_inserter(common));
        if (common.size() != (is_border ? 1u : 2u)) {
          continue;  // the link condition: anything else would pinch the surface
        }
        bool good = true;
        for (int which = 0; which < 2 && good; ++which) {
          for (int f : around[static_cast<std::size_t>(which == 0 ? keep : gone)]) {
            const Face& face = mesh_.faces[static_cast<std::size_t>(f)];
            bool both = false;
            Vec3d before[3], after[3];
            int hits = 0;
            for (std::size_t c = 0; c < 3; ++c) {
              before[c] = at(face[c]);
              const bool moved = face[c] == keep || face[c] == gone;
              hits += moved;
              after[c] = moved ? p : before[c];
            }
            both = hits == 2;
            if (both) {
              continue;
            }
            const Vec3d n0 = cross(before[1] - before[0], before[2] - before[0]);
            const Vec3d n1 = cross(after[1] - after[0], after[2] - after[0]);
            if (dot(n0, n1) < 0.6 * norm(n0) * norm(n1) || norm(n1) < 1e-12) {
              good = false;
              break;
            }
            for (std::size_t c = 0; c < 3; ++c) {
              if (norm(after[c] - after[(c + 1) % 3]) >
                  1.35 * scale_ * target_edge(field_, 0.5 * (after[c] + after[(c + 1) % 3]))) {
                good = false;
              }
            }
          }
        }
        if (!good) {
          continue;
        }
        for (int f : e.face) {
          if (f >= 0) {
            dead[static_cast<std::size_t>(f)] = 1;
          }
        }
        for (int f : around[static_cast<std::size_t>(gone)]) {
          for (int& v : mesh_.faces[static_cast<std::size_t>(f)]) {
            if (v == gone) {
              v = keep;
            }
          }
        }
        mesh_.points[static_cast<std::size_t>(keep)] = p;
        for (int v : ring_keep) {
          touched[static_cast<std::size_t>(v)] = 1;
        }
        for (int v : ring_gone) {
          touched[static_cast<std::size_t>(v)] = 1;
        }
        touched[static_cast<std::size_t>(keep)] = 1;
        touched[static_cast<std::size_t>(gone)] = 1;
        any = true;
      }
      std::vector<Face> alive;
      for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
        if (!dead[f]) {
          alive.push_back(mesh_.faces[f]);
        }
      }
      mesh_.faces = std::move(alive);
      compact();
      if (!any) {
        return;
      }
    }
  }

  void compact() {
    std::vector<int> index(mesh_.points.size(), -1);
    std::vector<Vec3d> points;
    for (Face& face : mesh_.faces) {
      for (int& v : face) {
        int& i = index[static_cast<std::size_t>(v)];
        if (i < 0) {
          i = static_cast<int>(points.size());
          points.push_back(at(v));
        }
        v = i;
      }
    }
    mesh_.points = std::move(points);
  }

  void flip() {
    const std::vector<Edge> list = edges();
    std::vector<int> valence(mesh_.points.size(), 0);
    std::vector<int> ideal(mesh_.points.size(), 6);
    std::unordered_map<std::int64_t, char> exists;
    for (const Edge& e : list) {
      ++valence[static_cast<std::size_t>(e.a)];
      ++valence[static_cast<std::size_t>(e.b)];
      exists[edge_key(e.a, e.b)] = 1;
      if (e.face[1] < 0) {
        ideal[static_cast<std::size_t>(e.a)] = 4;
        ideal[static_cast<std::size_t>(e.b)] = 4;
      }
    }
    std::vector<char> touched(mesh_.faces.size(), 0);
    const auto excess = [&](int v, int change) {
      const int e =
          valence[static_cast<std::size_t>(v)] + change - ideal[static_cast<std::size_t>(v)];
      return e * e;
    };
    for (const Edge& e : list) {
      if (e.face[1] < 0 || touched[static_cast<std::size_t>(e.face[0])] ||
          touched[static_cast<std::size_t>(e.face[1])]) {
        continue;
      }
      const int c = e.opposite[0];
      const int d = e.opposite[1];
      if (c == d || exists.count(edge_key(c, d))) {
        continue;
      }
      const int before = excess(e.a, 0) + excess(e.b, 0) + excess(c, 0) + excess(d, 0);
      const int after = excess(e.a, -1) + excess(e.b, -1) + excess(c, 1) + excess(d, 1);
      if (after >= before) {
        continue;
      }
      // Orientation: face 0 has the edge in one direction.
      Face& f0 = mesh_.faces[static_cast<std::size_t>(e.face[0])];
      Face& f1 = mesh_.faces[static_cast<std::size_t>(e.face[1])];
      int a = e.a;
      int b = e.b;
      for (std::size_t k = 0; k < 3; ++k) {
        if (f0[k] == e.b && f0[(k + 1) % 3] == e.a) {
          std::swap(a, b);
          break;
        }
      }
      const auto normal = [&](int i, int j, int k) { return cross(at(j) - at(i), at(k) - at(i)); };
      const Vec3d old = normal(a, b, c) + normal(b, a, d);
      const Vec3d n0 = normal(a, d, c);
      const Vec3d n1 = normal(d, b, c);
      if (dot(n0, old) < 0.5 * norm(n0) * norm(old) || dot(n1, old) < 0.5 * norm(n1) * norm(old)) {
        continue;
      }
      f0 = {a, d, c};
      f1 = {d, b, c};
      touched[static_cast<std::size_t>(e.face[0])] = 1;
      touched[static_cast<std::size_t>(e.face[1])] = 1;
      exists[edge_key(c, d)] = 1;
      --valence[static_cast<std::size_t>(e.a)];
      --valence[static_cast<std::size_t>(e.b)];
      ++valence[static_cast<std::size_t>(c)];
      ++valence[static_cast<std::size_t>(d)];
    }
  }

  void relax(bool project) {
    const std::vector<Edge> list = edges();
    const std::size_t n = mesh_.points.size();
    std::vector<Vec3d> sum(n, {0, 0, 0});
    std::vector<double> weight(n, 0);
    std::vector<char> border(n, 0);
    for (const Edge& e : list) {
      if (e.face[1] < 0) {
        border[static_cast<std::size_t>(e.a)] = border[static_cast<std::size_t>(e.b)] = 1;
      }
    }
    for (const Face& face : mesh_.faces) {
      const Vec3d a = at(face[0]), b = at(face[1]), c = at(face[2]);
      const Vec3d centre = (1.0 / 3) * (a + b + c);
      const double t = target_edge(field_, centre);
      const double w = norm(cross(b - a, c - a)) / (t * t * t);
      for (int v : face) {
        if (!border[static_cast<std::size_t>(v)]) {
          sum[static_cast<std::size_t>(v)] += w * centre;
          weight[static_cast<std::size_t>(v)] += w;
        }
      }
    }
    for (const Edge& e : list) {
      if (e.face[1] < 0) {
        const double w = 1 / target(e.a, e.b);
        sum[static_cast<std::size_t>(e.a)] += w * at(e.b);
        weight[static_cast<std::size_t>(e.a)] += w;
        sum[static_cast<std::size_t>(e.b)] += w * at(e.a);
        weight[static_cast<std::size_t>(e.b)] += w;
      }
    }
    std::vector<Vec3d> next = mesh_.points;
    parallel_for(static_cast<Index>(n), 256, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        const std::size_t v = static_cast<std::size_t>(i);
        if (weight[v] == 0) {
          continue;
        }
        const Vec3d p = mesh_.points[v];
        Vec3d d = (1 / weight[v]) * sum[v] - p;
        Vec3d normal = field_normal(field_, p);
        if (border[v]) {
          normal.x = 0;
          d.x = 0;
        }
        const double n2 = squared_norm(normal);
        if (n2 > 0) {
          d = d - (dot(d, normal) / n2) * normal;
        }
        Vec3d q = p + 0.6 * d;
        if (project) {
          q = field_project(field_, q);
        }
        if (border[v]) {
          q.x = 0;
        } else {
          q.x = std::max(q.x, 2e-4);
        }
        next[v] = q;
      }
    });
    // A move that turns a face over is taken back.
    for (int pass = 0; pass < 3; ++pass) {
      for (const Face& face : mesh_.faces) {
        const auto normal = [&](const std::vector<Vec3d>& p) {
          const Vec3d a = p[static_cast<std::size_t>(face[0])];
          return cross(p[static_cast<std::size_t>(face[1])] - a,
                       p[static_cast<std::size_t>(face[2])] - a);
        };
        const Vec3d before = normal(mesh_.points);
        const Vec3d after = normal(next);
        if (dot(before, after) < 0.3 * norm(before) * norm(after)) {
          for (int v : face) {
            next[static_cast<std::size_t>(v)] = mesh_.points[static_cast<std::size_t>(v)];
          }
        }
      }
    }
    mesh_.points = std::move(next);
  }

  const HumanField& field_;
  double scale_;
  HalfMesh mesh_;
};

}  // namespace

Mesh polygonise_human(const HumanField& field, const HumanPolygoniseOptions& options) {
  HalfMesh half = march(field, options.grid);
  for (Vec3d& p : half.points) {
    if (p.x < 1e-9) {
      p.x = 0;
    }
  }
  Remesher remesher(field, std::move(half), options.edge_scale);
  for (int round = 0; round < options.rounds; ++round) {
    remesher.round(true);
  }
  half = remesher.take();
  Mesh mesh;
  mesh.vertices.resize(static_cast<Index>(half.points.size()), 3);
  for (std::size_t i = 0; i < half.points.size(); ++i) {
    mesh.vertices.row(static_cast<Index>(i)) << half.points[i].x, half.points[i].y,
        half.points[i].z;
  }
  mesh.faces.resize(static_cast<Index>(half.faces.size()), 3);
  for (std::size_t i = 0; i < half.faces.size(); ++i) {
    mesh.faces.row(static_cast<Index>(i)) << half.faces[i][0], half.faces[i][1], half.faces[i][2];
  }
  return mesh;
}

}  // namespace atelier
