#include "simulation/projective/elastic_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "simulation/projective/elastic_math.h"

namespace atelier {
namespace {

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
  row.limit = hinge.stiffness;  // an angle's energy has twice the curvature at 70 degrees
  return row;
}

/// Sorts entries of particles into one list; `each(add)` calls add(particle, of, weight).
template <class Each>
ParticleWeights weights_of_particles(int count, const Each& each) {
  ParticleWeights out;
  out.begin.assign(static_cast<std::size_t>(count) + 1, 0);
  each([&](int particle, int, double) { ++out.begin[particle + 1]; });
  for (int i = 0; i < count; ++i) {
    out.begin[i + 1] += out.begin[i];
  }
  std::vector<int> next(out.begin.begin(), out.begin.end() - 1);
  out.of.resize(static_cast<std::size_t>(out.begin.back()));
  out.weight.resize(out.of.size());
  each([&](int particle, int of, double weight) {
    out.of[next[particle]] = of;
    out.weight[next[particle]++] = weight;
  });
  return out;
}

/// The matrix of all curvatures, a row a particle, columns in their order.
ParticleWeights curvature_matrix(int count, const std::vector<ClothCurvature>& curvatures,
                                 const std::vector<int>& internal) {
  std::vector<Eigen::Triplet<double>> entries;
  for (const ClothCurvature& around : curvatures) {
    for (std::size_t a = 0; a < around.vertices.size(); ++a) {
      for (std::size_t b = 0; b < around.vertices.size(); ++b) {
        entries.emplace_back(internal[around.vertices[a]], internal[around.vertices[b]],
                             -around.stiffness * around.weights[a] * around.weights[b]);
      }
    }
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return weights_of_particles(count, [&](const auto& add) {
    for (int i = 0; i < count; ++i) {
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(matrix, i); it; ++it) {
        add(i, static_cast<int>(it.col()), it.value());
      }
    }
  });
}

/// Sets what forces are evaluated from.
void index_by_particle(ElasticRows& out) {
  const ParticleWeights ends = weights_of_particles(out.count, [&](const auto& add) {
    for (int r = 0; r < out.bend_begin; ++r) {
      add(out.rows[r].particle[0], r, 1);
      add(out.rows[r].particle[1], r, -1);
    }
  });
  out.springs.begin = ends.begin;
  out.springs.row = ends.of;
  for (std::size_t e = 0; e < ends.of.size(); ++e) {
    const ElasticRow& row = out.rows[ends.of[e]];
    out.springs.other.push_back(row.particle[ends.weight[e] > 0 ? 1 : 0]);
    out.springs.rest.push_back(out.spring_rest[ends.of[e]]);
    out.springs.stiffness.push_back(row.stiffness);
    out.springs.limit.push_back(row.limit);
  }
  out.others = weights_of_particles(out.count, [&](const auto& add) {
    for (int r = out.bend_begin; r < static_cast<int>(out.rows.size()); ++r) {
      for (int k = 0; k < 4; ++k) {
        if (out.rows[r].particle[k] >= 0) {
          add(out.rows[r].particle[k], r, out.rows[r].weight[k]);
        }
      }
    }
  });
}

}  // namespace

ElasticRows make_elastic_rows(const Cloth& cloth, const std::vector<int>& internal,
                              double most_stretch) {
  ElasticRows out;
  out.count = static_cast<int>(internal.size());
  out.most_stretch = most_stretch;
  const auto limited = [&](double stiffness) {
    return most_stretch > 0 ? kLimitStiffness * stiffness : 0;
  };
  out.damping = cloth.material.damping;
  const auto moves = [&](std::initializer_list<int> vertices) {
    return std::any_of(vertices.begin(), vertices.end(),
                       [&](int v) { return cloth.fixed[v] == 0; });
  };
  for (const ClothSpring& s : cloth.springs) {
    if (s.stiffness > 0 && moves({s.a, s.b})) {
      out.rows.push_back({{internal[s.a], internal[s.b], -1, -1},
                          {1, -1, 0, 0},
                          s.stiffness,
                          s.rest > 0 ? limited(s.stiffness) : 0});
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
    const auto row = [&](const double* rest, double along) {
      return ElasticRow{{internal[s.v0], internal[s.v1], internal[s.v2], -1},
                        {-rest[0] - rest[1], rest[0], rest[1], 0},
                        along + s.shear,  // the curvature of shear is below 2 shear between both
                        limited(along)};
    };
    out.rows.push_back(row(s.inverse_rest, s.warp));
    out.rows.push_back(row(s.inverse_rest + 2, s.weft));
    out.yarn_moduli.push_back({s.warp, s.weft, s.shear});
  }
  index_by_particle(out);
  out.curvatures = curvature_matrix(out.count, cloth.curvatures, internal);
  return out;
}

double longest_share(const ElasticRows& rows) {
  return rows.most_stretch > 0 ? 1 + rows.most_stretch : std::numeric_limits<double>::infinity();
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
  const auto add = [&](int a, int b, double stiffness) {
    const int i = a >= 0 ? place[a] : -1;
    const int j = b >= 0 ? place[b] : -1;
    if (i >= 0 && j >= 0) {
      entries.emplace_back(i, j, scale * stiffness);
    }
  };
  for (int r = 0; r < static_cast<int>(rows.rows.size()); ++r) {
    const ElasticRow& row = rows.rows[r];
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < 4; ++b) {
        add(row.particle[a], row.particle[b],
            (row.stiffness + row.limit) * row.weight[a] * row.weight[b]);
      }
    }
  }
  for (int i = 0; i < rows.count; ++i) {
    for (int e = rows.curvatures.begin[i]; e < rows.curvatures.begin[i + 1]; ++e) {
      add(i, rows.curvatures.of[e], -rows.curvatures.weight[e]);
    }
  }
  Eigen::SparseMatrix<double> matrix(free_count, free_count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace atelier
