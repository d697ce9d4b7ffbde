#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "core/error.h"
#include "simulation/projective/cuda_projective_memory.cuh"

namespace atelier {
namespace {

int chunks_of(const InverseFactor::Part& part) {
  return (part.stride + kColumnsAnItem - 1) / kColumnsAnItem;
}

void add_rows(const InverseFactor::Part& part, std::vector<RowsItem>& items) {
  for (int row = part.begin; row < part.end; row += kRowsAnItem) {
    for (int c = 0; c < chunks_of(part); ++c) {
      const int column = c * kColumnsAnItem;
      items.push_back({part.row(row) + column, part.stride, row,
                       std::min(kRowsAnItem, part.end - row), part.column + column,
                       std::min(kColumnsAnItem, part.stride - column), c});
    }
  }
}

void add_tile_rows(const InverseFactor::Part& part, int column, std::vector<TileRow>& rows) {
  static_assert(InverseFactor::kAlign == 8);
  const int low = std::max(0, part.column - column) / 8;
  const int high = std::min(kColumnsATile, part.column + part.stride - column) / 8;
  for (int row = std::max(part.begin, column); row < part.end; ++row) {
    const std::int64_t eight = (part.row(row) + (column - part.column)) / 8;
    ATELIER_CHECK(eight <= std::numeric_limits<int>::max() / 2, "a factor of less than 32 GB");
    rows.push_back({row, static_cast<int>(eight), static_cast<unsigned char>(low),
                    static_cast<unsigned char>(high),
                    static_cast<unsigned short>(chunks_of(part))});
  }
}

std::vector<ColumnsTile> tiles_of(const InverseFactor& factor, std::vector<TileRow>& rows) {
  const std::vector<InverseFactor::Part>& parts = factor.parts();
  std::vector<int> part_of(static_cast<std::size_t>(factor.size()));
  for (std::size_t p = 0; p < parts.size(); ++p) {
    std::fill(part_of.begin() + parts[p].begin, part_of.begin() + parts[p].end,
              static_cast<int>(p));
  }
  std::vector<ColumnsTile> tiles;
  for (int column = 0; column < factor.size(); column += kColumnsATile) {
    const int end = std::min(column + kColumnsATile, factor.size());
    std::set<int> with_rows;  // parts of these columns, and those around them
    for (int c = column; c < end; ++c) {
      for (int p = part_of[c]; p >= 0 && with_rows.insert(p).second; p = parts[p].parent) {
      }
    }
    const int rows_begin = static_cast<int>(rows.size());
    for (int p : with_rows) {
      add_tile_rows(parts[p], column, rows);
    }
    tiles.push_back({column, end - column, rows_begin, static_cast<int>(rows.size())});
  }
  return tiles;
}

/// W in half precision, each row divided by a power of two, `scale` [unknowns], so that its largest
/// number has room above it and the others below.
std::vector<__half> in_halves(const InverseFactor& factor, std::vector<float>& scale) {
  constexpr int kLargest = 14;  // as an exponent of two; there is room up to 15
  std::vector<__half> out(factor.values().size());
  for (const InverseFactor::Part& part : factor.parts()) {
    for (int i = part.begin; i < part.end; ++i) {
      const double* const row = factor.values().data() + part.row(i);
      const double largest = std::accumulate(
          row, row + part.stride, 0.0,
          [](double most, double value) { return std::max(most, std::fabs(value)); });
      const int shift = largest > 0 ? std::ilogb(largest) - kLargest : 0;
      scale[i] = std::ldexp(1.0f, shift);
      std::transform(row, row + part.stride, out.begin() + part.row(i), [&](double value) {
        return __float2half(static_cast<float>(std::ldexp(value, -shift)));
      });
    }
  }
  return out;
}

/// Of all rows.
RowEntries row_entries(const ElasticRows& of) {
  RowEntries out;
  out.begin.assign(static_cast<std::size_t>(of.count) + 1, 0);
  const auto each = [&](const auto& add) {
    for (std::size_t r = 0; r < of.rows.size(); ++r) {
      for (int k = 0; k < 4; ++k) {
        if (of.rows[r].particle[k] >= 0) {
          add(of.rows[r].particle[k], static_cast<int>(r), of.rows[r].weight[k]);
        }
      }
    }
  };
  each([&](int particle, int, double) { ++out.begin[particle + 1]; });
  std::partial_sum(out.begin.begin(), out.begin.end(), out.begin.begin());
  out.row.resize(static_cast<std::size_t>(out.begin.back()));
  out.weight.resize(out.row.size());
  std::vector<int> next(out.begin.begin(), out.begin.end() - 1);
  each([&](int particle, int r, double w) {
    out.row[next[particle]] = r;
    out.weight[next[particle]++] = w;
  });
  return out;
}

}  // namespace

DeviceInverse::DeviceInverse(const InverseFactor& factor, bool halves) {
  std::vector<float> scale(static_cast<std::size_t>(factor.size()), 1.0f);
  if (halves) {
    halves_ = CudaBuffer<__half>(in_halves(factor, scale));
  } else {
    values_ = CudaBuffer<float>(std::vector<float>(factor.values().begin(), factor.values().end()));
  }
  scale_ = CudaBuffer<float>(scale);
  std::vector<RowsItem> items;
  std::vector<TileRow> rows;
  for (const InverseFactor::Part& part : factor.parts()) {
    add_rows(part, items);
    chunks_ = std::max(chunks_, part.begin < part.end ? chunks_of(part) : 0);
  }
  std::vector<ColumnsTile> tiles = tiles_of(factor, rows);
  std::stable_sort(tiles.begin(), tiles.end(), [](const ColumnsTile& a, const ColumnsTile& b) {
    return a.rows_end - a.rows_begin > b.rows_end - b.rows_begin;
  });
  std::stable_sort(items.begin(), items.end(), [](const RowsItem& a, const RowsItem& b) {
    return a.columns * a.rows > b.columns * b.rows;
  });
  constexpr int kLong = 512;  // columns that a warp alone would take long for
  const auto short_begin = std::stable_partition(
      items.begin(), items.end(), [](const RowsItem& item) { return item.columns > kLong; });
  long_items_ = static_cast<int>(short_begin - items.begin());
  items_ = CudaBuffer<RowsItem>(items);
  tiles_ = CudaBuffer<ColumnsTile>(tiles);
  tile_rows_ = CudaBuffer<TileRow>(rows);
}

PreparedProjective::PreparedProjective(const Cloth& cloth, const ProjectiveMethodOptions& method,
                                       double h)
    : particles(prepare_cloth<double>(cloth)),
      rows(make_elastic_rows(cloth, particles.internal, method.strain_limit)),
      entries(row_entries(rows)) {
  std::vector<int> among_free(static_cast<std::size_t>(particles.count), -1);
  std::vector<int> particle_of;
  for (int i = 0; i < particles.count; ++i) {
    mass.push_back(cloth.mass[particles.external[i]]);
    if (particles.inverse_mass[i] > 0) {
      among_free[i] = static_cast<int>(particle_of.size());
      particle_of.push_back(i);
    }
  }
  const int unknowns = static_cast<int>(particle_of.size());
  Points positions(unknowns, 3);
  std::vector<double> mass_of_unknown;
  for (int u = 0; u < unknowns; ++u) {
    mass_of_unknown.push_back(mass[particle_of[u]]);
    positions.row(u) = cloth.rest_positions.row(particles.external[particle_of[u]]);
  }
  const Eigen::SparseMatrix<double> matrix = projective_matrix(rows, mass, among_free, unknowns, h);
  inverse.emplace(matrix, positions);
  gentle.assign(static_cast<std::size_t>(particles.count), 0);
  for (int u = 0; u < unknowns; ++u) {
    const int i = particle_of[u];
    gentle[i] = is_held_gently(matrix.coeff(u, u), mass[i]) ? 1 : 0;
  }
  halves = method.half_precision && half_precision_serves(matrix, mass_of_unknown);
  place.assign(static_cast<std::size_t>(particles.count), -1);
  for (int u = 0; u < unknowns; ++u) {
    particle.push_back(particle_of[inverse->order()[u]]);
    place[particle.back()] = u;
  }
}

DeviceProjective::DeviceProjective(const PreparedProjective& p)
    : rows(p.rows.rows),
      spring_rest(p.rows.spring_rest),
      bend_rest(p.rows.bend_rest),
      yarn_moduli(p.rows.yarn_moduli),
      begin(p.entries.begin),
      row(p.entries.row),
      weight(p.entries.weight),
      place(p.place),
      particle(p.particle),
      mass(p.mass),
      gentle(p.gentle),
      tether_anchor(p.particles.tether_anchor),
      tether_length(p.particles.tether_length),
      inverse(*p.inverse, p.halves) {}

ElasticView DeviceProjective::elastic(const ElasticRows& of) const {
  return {rows.data(),   spring_rest.data(), bend_rest.data(), yarn_moduli.data(),
          of.bend_begin, of.yarn_begin,      of.damping,       longest_share(of),
          begin.data(),  row.data(),         weight.data()};
}

DeviceTouches::DeviceTouches(std::size_t n)
    : alone_(n), flight_(n), counts_(2), begin_(n), degree_(n), filled_(n) {
  for (CudaBuffer<Vec4<double>>& one : reached_) {
    one = CudaBuffer<Vec4<double>>(n);
  }
}

void DeviceTouches::make_room(int room) {
  const std::size_t n = static_cast<std::size_t>(room);
  // The old ones go first: there may not be memory for both.
  room_ = 0;
  touches_ = CudaBuffer<ClothTouch>();
  touches_ = CudaBuffer<ClothTouch>(n);
  touches_.clear();  // kernels copy them whole, their padding too
  for (CudaBuffer<Vec4<double>>& one : impulses_) {
    one = CudaBuffer<Vec4<double>>();
    one = CudaBuffer<Vec4<double>>(n);
  }
  entries_ = CudaBuffer<int>();
  entries_ = CudaBuffer<int>(4 * n);
  room_ = room;
}

TouchesView DeviceTouches::view(double friction) {
  return {touches_.data(),
          {impulses_[0].data(), impulses_[1].data()},
          counts_.data(),
          begin_.data(),
          degree_.data(),
          filled_.data(),
          entries_.data(),
          room_,
          friction,
          alone_.data(),
          {reached_[0].data(), reached_[1].data()}};
}

MovingProjective::MovingProjective(std::size_t n, std::size_t unknowns,
                                   const DeviceInverse& inverse, std::size_t window, bool with_body)
    : bounds(n),
      right(unknowns + 2 * InverseFactor::kAlign),
      partial(unknowns * static_cast<std::size_t>(inverse.chunks())),
      of_change(unknowns * window),
      of_next(unknowns * window),
      dots((1 + 2 * window) * static_cast<std::size_t>(inverse.tiles())),
      memory(2) {
  for (CudaBuffer<Vec4<double>>* buffer : {&x, &velocity, &frame_start, &frame_velocity, &origin,
                                           &start, &wish, &v, &at, &impulses, &target}) {
    *buffer = CudaBuffer<Vec4<double>>(n);
  }
  for (CudaBuffer<Vec4<double>>* buffer : {&change, &last_change, &last_next}) {
    *buffer = CudaBuffer<Vec4<double>>(unknowns);
  }
  right.clear();  // what is behind stays so
  target.clear();
  if (with_body) {
    touched = CudaBuffer<int>(n);
    touch_counts = CudaBuffer<int>(4);
    touch_items = CudaBuffer<int>(2 * n);
    outlook = CudaBuffer<BodyOutlook<double>>(n);
    candidates = CudaBuffer<int>(n * kBodyCandidates);
    depth = CudaBuffer<double>(n);
    across = CudaBuffer<VelocityBound>(n);
    across_impulses = CudaBuffer<Vec4<double>>(n);
  }
  bad = CudaBuffer<int>(std::vector<int>{kAllFinite, 0});
}

}  // namespace atelier
