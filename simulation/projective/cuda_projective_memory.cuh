#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "simulation/cloth/solver_options.h"
#include "simulation/contact/body_encounter.h"
#include "simulation/projective/cuda_projective.cuh"
#include "simulation/projective/elastic_rows.h"
#include "simulation/projective/inverse_factor.h"
#include "simulation/xpbd/prepared_cloth.h"

namespace atelier {

/// W on the device.
class DeviceInverse {
 public:
  /// `halves`: in half precision, each row by a scale of its own.
  DeviceInverse(const InverseFactor& factor, bool halves);

  InverseView view() const {
    return {values_.size() > 0 ? values_.data() : nullptr,
            halves_.size() > 0 ? halves_.data() : nullptr,
            scale_.data(),
            items_.data(),
            long_items_,
            static_cast<int>(items_.size()),
            tiles_.data(),
            static_cast<int>(tiles_.size()),
            tile_rows_.data()};
  }
  /// Into which the products of a row are cut at most.
  int chunks() const { return chunks_; }
  int tiles() const { return static_cast<int>(tiles_.size()); }

 private:
  CudaBuffer<float> values_;
  CudaBuffer<__half> halves_;
  CudaBuffer<float> scale_;
  CudaBuffer<RowsItem> items_;
  CudaBuffer<ColumnsTile> tiles_;
  CudaBuffer<TileRow> tile_rows_;
  int long_items_ = 0;
  int chunks_ = 0;
};

/// For every particle the rows that it is in.
struct RowEntries {
  std::vector<int> begin;  ///< [V + 1]
  std::vector<int> row;
  std::vector<double> weight;
};

/// What of a cloth never changes, on the host.
struct PreparedProjective {
  /// Substeps of `h` s.
  PreparedProjective(const Cloth& cloth, const ProjectiveMethodOptions& method, double h);

  PreparedCloth<double> particles;
  ElasticRows rows;
  RowEntries entries;
  std::vector<double> mass;
  std::vector<char> gentle;  ///< [V] 1: held gently by the body
  std::optional<InverseFactor> inverse;
  bool halves = false;        ///< it is kept in half precision
  std::vector<int> place;     ///< of particles among the unknowns, -1: fixed
  std::vector<int> particle;  ///< of unknowns
};

/// That on the device.
struct DeviceProjective {
  explicit DeviceProjective(const PreparedProjective& p);

  ElasticView elastic(const ElasticRows& of) const;

  CudaBuffer<ElasticRow> rows;
  CudaBuffer<double> spring_rest, bend_rest;
  CudaBuffer<std::array<double, 3>> yarn_moduli;
  CudaBuffer<int> begin, row;
  CudaBuffer<double> weight;
  CudaBuffer<int> place, particle;
  CudaBuffer<double> mass;
  CudaBuffer<char> gentle;
  CudaBuffer<int> tether_anchor;
  CudaBuffer<double> tether_length;
  DeviceInverse inverse;
};

/// Contacts between pieces of cloth.
class DeviceTouches {
 public:
  /// Among `n` particles; no contacts.
  explicit DeviceTouches(std::size_t n);

  /// For `room` contacts, all of which are forgotten.
  void make_room(int room);
  int room() const { return room_; }
  TouchesView view(double friction);
  /// [V] where cloth would go without contact.
  Vec4<double>* flight() { return flight_.data(); }

 private:
  int room_ = 0;
  CudaBuffer<ClothTouch> touches_;
  CudaBuffer<Vec4<double>> impulses_[2], reached_[2];
  CudaBuffer<Vec4<double>> alone_, flight_;
  CudaBuffer<int> counts_, begin_, degree_, filled_, entries_;
};

/// What changes.
struct MovingProjective {
  static constexpr int kAllFinite = std::numeric_limits<int>::max();

  /// `n` particles, `unknowns` of them free; `window`: iterations that are combined.
  MovingProjective(std::size_t n, std::size_t unknowns, const DeviceInverse& inverse,
                   std::size_t window, bool with_body);

  CudaBuffer<Vec4<double>> x, velocity, frame_start, frame_velocity, origin, start, wish, v, at,
      impulses, across_impulses, target, air;
  CudaBuffer<VelocityBound> bounds, across;
  CudaBuffer<Vec4<float>> right, partial;
  CudaBuffer<Vec4<double>> change, last_change, last_next, of_change, of_next;
  CudaBuffer<double> dots;
  CudaBuffer<AndersonMemory> memory;
  CudaBuffer<int> touched, touch_counts, touch_items;
  CudaBuffer<BodyOutlook<double>> outlook;
  CudaBuffer<int> candidates;
  CudaBuffer<double> depth;
  CudaBuffer<int> bad;  ///< [2] what ProjectiveFrame::bad and ::pinched point to
};

}  // namespace atelier
