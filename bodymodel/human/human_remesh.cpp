#include "bodymodel/human/human_remesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bodymodel/human/human_edge_length.h"
#include "core/parallel.h"

namespace atelier {
namespace {

using Face = std::array<int, 3>;

class Remesher {
 public:
  Remesher(const HumanField& field, HumanHalfMesh mesh, double scale)
      : field_(field), scale_(scale), mesh_(std::move(mesh)) {}

  void round() {
    split();
    collapse();
    flip();
    relax();
  }

  HumanHalfMesh take() { return std::move(mesh_); }

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
  double target(int a, int b) const {
    return scale_ * human_edge_length(field_, 0.5 * (at(a) + at(b)));
  }
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

  // The state of collapsing within a pass.
  struct CollapsePass {
    std::vector<char> border;              // of vertices
    std::vector<std::vector<int>> around;  // faces of each vertex
    std::vector<char> touched;             // vertices beside what has collapsed: for the next pass
    std::vector<char> dead;                // faces that are gone
  };

  // An edge drawn together: `gone` becomes `keep`, which moves to `place`.
  struct Collapse {
    int keep, gone;
    Vec3d place;
    std::vector<int> ring_keep, ring_gone;  // vertices round each, without the two, sorted
  };

  CollapsePass begin_collapses(const std::vector<Edge>& list) const {
    CollapsePass pass;
    pass.border.assign(mesh_.points.size(), 0);
    pass.around.resize(mesh_.points.size());
    pass.touched.assign(mesh_.points.size(), 0);
    pass.dead.assign(mesh_.faces.size(), 0);
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
      for (int v : mesh_.faces[f]) {
        pass.around[static_cast<std::size_t>(v)].push_back(static_cast<int>(f));
      }
    }
    for (const Edge& e : list) {
      if (e.face[1] < 0) {
        pass.border[static_cast<std::size_t>(e.a)] = 1;
        pass.border[static_cast<std::size_t>(e.b)] = 1;
      }
    }
    return pass;
  }

  // Edges well below their length, the shortest for their place first.
  std::vector<std::size_t> short_edges(const std::vector<Edge>& list) const {
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const double ratio = length(list[i].a, list[i].b) / target(list[i].a, list[i].b);
      if (ratio < 4.0 / 5) {
        order.push_back({ratio, i});
      }
    }
    std::sort(order.begin(), order.end());
    std::vector<std::size_t> edges;
    for (const auto& [ratio, i] : order) {
      edges.push_back(i);
    }
    return edges;
  }

  // How an edge would collapse; none where its surroundings have changed in this pass, where the
  // border would move inwards or where the surface would be pinched.
  std::optional<Collapse> planned_collapse(const Edge& e, const CollapsePass& pass) const {
    int keep = e.a;
    int gone = e.b;
    const bool is_border = e.face[1] < 0;
    const std::vector<char>& border = pass.border;
    if (border[static_cast<std::size_t>(gone)] && !border[static_cast<std::size_t>(keep)]) {
      std::swap(keep, gone);
    }
    if (border[static_cast<std::size_t>(keep)] && border[static_cast<std::size_t>(gone)] &&
        !is_border) {
      return {};
    }
    const bool middle =
        border[static_cast<std::size_t>(keep)] == border[static_cast<std::size_t>(gone)];
    Collapse collapse{keep, gone, middle ? 0.5 * (at(keep) + at(gone)) : at(keep), {}, {}};
    for (int which = 0; which < 2; ++which) {
      std::vector<int>& ring = which == 0 ? collapse.ring_keep : collapse.ring_gone;
      for (int f : pass.around[static_cast<std::size_t>(which == 0 ? keep : gone)]) {
        if (pass.dead[static_cast<std::size_t>(f)]) {
          return {};
        }
        for (int v : mesh_.faces[static_cast<std::size_t>(f)]) {
          if (pass.touched[static_cast<std::size_t>(v)]) {
            return {};
          }
          if (v != keep && v != gone) {
            ring.push_back(v);
          }
        }
      }
      std::sort(ring.begin(), ring.end());
      ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
    }
    std::vector<int> common;
    std::set_intersection(collapse.ring_keep.begin(), collapse.ring_keep.end(),
                          collapse.ring_gone.begin(), collapse.ring_gone.end(),
                          std::back_inserter(common));
    if (common.size() != (is_border ? 1u : 2u)) {
      return {};  // the link condition: anything else would pinch the surface
    }
    return collapse;
  }

  // Whether no face turns much, vanishes or gets an edge that would be split again.
  bool keeps_shape(const Collapse& collapse, const CollapsePass& pass) const {
    for (const int end : {collapse.keep, collapse.gone}) {
      for (int f : pass.around[static_cast<std::size_t>(end)]) {
        const Face& face = mesh_.faces[static_cast<std::size_t>(f)];
        Vec3d before[3], after[3];
        int hits = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          before[c] = at(face[c]);
          const bool moved = face[c] == collapse.keep || face[c] == collapse.gone;
          hits += moved;
          after[c] = moved ? collapse.place : before[c];
        }
        if (hits == 2) {
          continue;  // a face of the edge: it goes
        }
        const Vec3d n0 = cross(before[1] - before[0], before[2] - before[0]);
        const Vec3d n1 = cross(after[1] - after[0], after[2] - after[0]);
        if (dot(n0, n1) < 0.6 * norm(n0) * norm(n1) || norm(n1) < 1e-12) {
          return false;
        }
        for (std::size_t c = 0; c < 3; ++c) {
          if (norm(after[c] - after[(c + 1) % 3]) >
              1.35 * scale_ * human_edge_length(field_, 0.5 * (after[c] + after[(c + 1) % 3]))) {
            return false;
          }
        }
      }
    }
    return true;
  }

  void apply_collapse(const Edge& e, const Collapse& collapse, CollapsePass& pass) {
    for (int f : e.face) {
      if (f >= 0) {
        pass.dead[static_cast<std::size_t>(f)] = 1;
      }
    }
    for (int f : pass.around[static_cast<std::size_t>(collapse.gone)]) {
      for (int& v : mesh_.faces[static_cast<std::size_t>(f)]) {
        if (v == collapse.gone) {
          v = collapse.keep;
        }
      }
    }
    mesh_.points[static_cast<std::size_t>(collapse.keep)] = collapse.place;
    for (const std::vector<int>* ring : {&collapse.ring_keep, &collapse.ring_gone}) {
      for (int v : *ring) {
        pass.touched[static_cast<std::size_t>(v)] = 1;
      }
    }
    pass.touched[static_cast<std::size_t>(collapse.keep)] = 1;
    pass.touched[static_cast<std::size_t>(collapse.gone)] = 1;
  }

  void drop_dead_faces(const std::vector<char>& dead) {
    std::vector<Face> alive;
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
      if (!dead[f]) {
        alive.push_back(mesh_.faces[f]);
      }
    }
    mesh_.faces = std::move(alive);
    compact();
  }

  void collapse() {
    for (int round = 0; round < 6; ++round) {
      const std::vector<Edge> list = edges();
      CollapsePass pass = begin_collapses(list);
      bool any = false;
      for (const std::size_t i : short_edges(list)) {
        const std::optional<Collapse> collapse = planned_collapse(list[i], pass);
        if (collapse && keeps_shape(*collapse, pass)) {
          apply_collapse(list[i], *collapse, pass);
          any = true;
        }
      }
      drop_dead_faces(pass.dead);
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

  void relax() {
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
      const double t = human_edge_length(field_, centre);
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
        Vec3d q = field_project(field_, p + 0.6 * d);
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
  HumanHalfMesh mesh_;
};

}  // namespace

HumanHalfMesh remesh_human(const HumanField& field, HumanHalfMesh mesh, double edge_scale,
                           int rounds) {
  Remesher remesher(field, std::move(mesh), edge_scale);
  for (int round = 0; round < rounds; ++round) {
    remesher.round();
  }
  return remesher.take();
}

}  // namespace atelier
