#include "simulation/projective/elastic_rows.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/parallel.h"

namespace atelier {
namespace {

constexpr Index kRowGrain = 1024;

using EdgeLengths = std::map<std::pair<int, int>, double>;

EdgeLengths rest_lengths(const Cloth& cloth) {
  EdgeLengths lengths;
  for (int i = 0; i < cloth.fibre_count; ++i) {
    const ClothSpring& s = cloth.springs[i];
    lengths[std::minmax(s.a, s.b)] = s.rest;
  }
  return lengths;
}

/// Where the corner across an edge stands over it in the flat rest shape.
struct Foot {
  double share;   ///< along the edge, from its first end
  double height;  ///< m
};

Foot foot_over(double edge, double to_first, double to_second) {
  const double along =
      (edge * edge + to_first * to_first - to_second * to_second) / (2 * edge * edge);
  const double across = to_first * to_first - along * along * edge * edge;
  return {along, std::sqrt(std::max(across, 0.0))};
}

/// The row of a hinge; stiffness 0 where its triangles have no height.
ElasticRow bend_row(const ClothHinge& hinge, const Cloth& cloth, const EdgeLengths& lengths,
                    const std::vector<int>& internal) {
  const auto length = [&](int a, int b) {
    const auto found = lengths.find(std::minmax(a, b));
    return found != lengths.end()
               ? found->second
               : (cloth.rest_positions.row(a) - cloth.rest_positions.row(b)).norm();
  };
  const double edge = length(hinge.edge0, hinge.edge1);
  const Foot left =
      foot_over(edge, length(hinge.left, hinge.edge0), length(hinge.left, hinge.edge1));
  const Foot right =
      foot_over(edge, length(hinge.right, hinge.edge0), length(hinge.right, hinge.edge1));
  ElasticRow row;
  const double least = 1e-6 * edge;
  if (!(left.height > least) || !(right.height > least)) {
    return row;
  }
  row.particle = {internal[hinge.edge0], internal[hinge.edge1], internal[hinge.left],
                  internal[hinge.right]};
  row.weight = {-(1 - left.share) / left.height - (1 - right.share) / right.height,
                -left.share / left.height - right.share / right.height, 1 / left.height,
                1 / right.height};
  row.stiffness = hinge.stiffness;
  return row;
}

void index_rows_by_particle(ElasticRows& out) {
  out.begin.assign(static_cast<std::size_t>(out.count) + 1, 0);
  for (const ElasticRow& row : out.rows) {
    for (int p : row.particle) {
      if (p >= 0) {
        ++out.begin[p + 1];
      }
    }
  }
  for (int i = 0; i < out.count; ++i) {
    out.begin[i + 1] += out.begin[i];
  }
  std::vector<int> next(out.begin.begin(), out.begin.end() - 1);
  out.row.resize(static_cast<std::size_t>(out.begin.back()));
  out.weight.resize(out.row.size());
  for (std::size_t r = 0; r < out.rows.size(); ++r) {
    for (int k = 0; k < 4; ++k) {
      const int p = out.rows[r].particle[k];
      if (p >= 0) {
        out.row[next[p]] = static_cast<int>(r);
        out.weight[next[p]++] = out.rows[r].weight[k];
      }
    }
  }
}

/// What a row is where particles are at `x`.
Vec3d row_value(const ElasticRow& row, const std::vector<Vec4<double>>& x) {
  Vec3d sum = row.weight[0] * xyz(x[row.particle[0]]) + row.weight[1] * xyz(x[row.particle[1]]);
  for (int k = 2; k < 4; ++k) {
    if (row.particle[k] >= 0) {
      sum += row.weight[k] * xyz(x[row.particle[k]]);
    }
  }
  return sum;
}

/// What a rest angle of `bend` makes of the row of a hinge: along the mean normal of its triangles.
Vec3d bent_rest(const ElasticRow& row, double bend, const std::vector<Vec4<double>>& x) {
  const Vec3d p0 = xyz(x[row.particle[0]]);
  const Vec3d edge = xyz(x[row.particle[1]]) - p0;
  const Vec3d left = cross(edge, xyz(x[row.particle[2]]) - p0);
  const Vec3d right = cross(xyz(x[row.particle[3]]) - p0, edge);
  const double size_left = norm(left);
  const double size_right = norm(right);
  if (!(size_left > 0) || !(size_right > 0)) {
    return {};
  }
  const Vec3d normal = (1 / size_left) * left + (1 / size_right) * right;
  const double size = norm(normal);
  return size > 1e-12 ? (-bend / size) * normal : Vec3d{};
}

/// Forces of the two rows of a triangle: warp and weft as springs of rest length 1, and shear of
/// energy 1/2 shear cos^2 of the angle between the yarns.
void yarn_forces(const std::array<double, 3>& moduli, Vec3d fu, Vec3d fv, Vec3d& on_u,
                 Vec3d& on_v) {
  const double lu = norm(fu);
  const double lv = norm(fv);
  if (!(lu > 1e-12) || !(lv > 1e-12)) {
    on_u = on_v = {};
    return;
  }
  const Vec3d u = (1 / lu) * fu;
  const Vec3d v = (1 / lv) * fv;
  const double cosine = dot(u, v);
  on_u = -(moduli[0] * (lu - 1)) * u - (moduli[2] * cosine / lu) * (v - cosine * u);
  on_v = -(moduli[1] * (lv - 1)) * v - (moduli[2] * cosine / lv) * (u - cosine * v);
}

}  // namespace

ElasticRows make_elastic_rows(const Cloth& cloth, const std::vector<int>& internal) {
  ElasticRows out;
  out.count = static_cast<int>(internal.size());
  out.damping = cloth.material.damping;
  const auto moves = [&](std::initializer_list<int> vertices) {
    return std::any_of(vertices.begin(), vertices.end(),
                       [&](int v) { return cloth.fixed[v] == 0; });
  };
  for (const ClothSpring& s : cloth.springs) {
    if (s.stiffness > 0 && moves({s.a, s.b})) {
      out.rows.push_back({{internal[s.a], internal[s.b], -1, -1}, {1, -1, 0, 0}, s.stiffness});
      out.spring_rest.push_back(s.rest);
    }
  }
  out.bend_begin = static_cast<int>(out.rows.size());
  const EdgeLengths lengths = rest_lengths(cloth);
  for (const ClothHinge& h : cloth.hinges) {
    if (!(h.stiffness > 0) || !moves({h.edge0, h.edge1, h.left, h.right})) {
      continue;
    }
    const ElasticRow row = bend_row(h, cloth, lengths, internal);
    if (row.stiffness > 0) {
      out.rows.push_back(row);
      out.bend_rest.push_back(2 * std::sin(h.rest / 2));
    }
  }
  out.yarn_begin = static_cast<int>(out.rows.size());
  for (const ClothStrain& s : cloth.strains) {
    if (!moves({s.v0, s.v1, s.v2})) {
      continue;
    }
    const auto row = [&](double first, double second, double stiffness) {
      return ElasticRow{{internal[s.v0], internal[s.v1], internal[s.v2], -1},
                        {-first - second, first, second, 0},
                        stiffness};
    };
    // The curvature of the shear energy is below 2 shear between both rows.
    out.rows.push_back(row(s.inverse_rest[0], s.inverse_rest[1], s.warp + s.shear));
    out.rows.push_back(row(s.inverse_rest[2], s.inverse_rest[3], s.weft + s.shear));
    out.yarn_moduli.push_back({s.warp, s.weft, s.shear});
  }
  index_rows_by_particle(out);
  return out;
}

void elastic_forces(const ElasticRows& rows, const std::vector<Vec4<double>>& x,
                    const std::vector<Vec4<double>>& v, std::vector<Vec4<double>>& of_rows,
                    std::vector<Vec4<double>>& force) {
  const double damping = rows.damping;
  const auto damped = [&](const ElasticRow& row, Vec3d value, Vec3d pull) {
    if (!(damping > 0)) {
      return pull;
    }
    const double squared = squared_norm(value);
    const double rate = squared > 0 ? dot(row_value(row, v), value) / squared : 0;
    return pull - (damping * row.stiffness * rate) * value;
  };
  parallel_for(rows.bend_begin, kRowGrain, [&](Index begin, Index end) {
    for (Index r = begin; r < end; ++r) {
      const ElasticRow& row = rows.rows[r];
      const Vec3d d = xyz(x[row.particle[0]]) - xyz(x[row.particle[1]]);
      const double length = norm(d);
      const double share = length > 1e-12 ? rows.spring_rest[r] / length - 1 : 0;
      of_rows[r] = with_w(damped(row, d, (row.stiffness * share) * d), 0.0);
    }
  });
  parallel_for(rows.yarn_begin - rows.bend_begin, kRowGrain, [&](Index begin, Index end) {
    for (Index k = begin; k < end; ++k) {
      const Index r = rows.bend_begin + k;
      const ElasticRow& row = rows.rows[r];
      const Vec3d d = row_value(row, x);
      const double bend = rows.bend_rest[k];
      const Vec3d rest = bend != 0 ? bent_rest(row, bend, x) : Vec3d{};
      of_rows[r] = with_w(damped(row, d, row.stiffness * (rest - d)), 0.0);
    }
  });
  const Index triangles = static_cast<Index>(rows.yarn_moduli.size());
  parallel_for(triangles, kRowGrain, [&](Index begin, Index end) {
    for (Index t = begin; t < end; ++t) {
      const Index r = rows.yarn_begin + 2 * t;
      const Vec3d fu = row_value(rows.rows[r], x);
      const Vec3d fv = row_value(rows.rows[r + 1], x);
      Vec3d on_u;
      Vec3d on_v;
      yarn_forces(rows.yarn_moduli[t], fu, fv, on_u, on_v);
      of_rows[r] = with_w(damped(rows.rows[r], fu, on_u), 0.0);
      of_rows[r + 1] = with_w(damped(rows.rows[r + 1], fv, on_v), 0.0);
    }
  });
  parallel_for(rows.count, kRowGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      Vec3d sum{};
      for (int e = rows.begin[i]; e < rows.begin[i + 1]; ++e) {
        sum += rows.weight[e] * xyz(of_rows[rows.row[e]]);
      }
      force[i] = with_w(sum, 0.0);
    }
  });
}

Eigen::SparseMatrix<double> projective_matrix(const ElasticRows& rows,
                                              const std::vector<double>& mass,
                                              const std::vector<int>& place, int free_count,
                                              double h) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(16 * rows.rows.size() + mass.size());
  for (std::size_t i = 0; i < mass.size(); ++i) {
    if (place[i] >= 0) {
      entries.emplace_back(place[i], place[i], mass[i]);
    }
  }
  const double scale = h * (h + rows.damping);
  for (const ElasticRow& row : rows.rows) {
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < 4; ++b) {
        const int i = row.particle[a] >= 0 ? place[row.particle[a]] : -1;
        const int j = row.particle[b] >= 0 ? place[row.particle[b]] : -1;
        if (i >= 0 && j >= 0) {
          entries.emplace_back(i, j, scale * row.stiffness * row.weight[a] * row.weight[b]);
        }
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(free_count, free_count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace atelier
