#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "appearance/appearance_data.h"
#include "appearance/appearance_model.h"
#include "appearance/network/network.h"
#include "core/normals.h"
#include "tests/support/shapes.h"

namespace atelier::fixtures {

/// A small garment that brightens where its normal is along x, with a highlight towards the camera:
/// three frames of a waving sheet, two cameras of different gain, every texel of 16 x 16 seen in
/// every image, from outside.
inline AppearanceData small_data() {
  constexpr int kResolution = 16;
  AppearanceData data;
  data.name = "sheet";
  Mesh mesh = grid(6, 6);
  data.faces = data.uv_faces = mesh.faces;
  data.uvs.resize(mesh.vertices.rows(), 2);
  data.uvs.col(0) = 0.05 + 0.9 * mesh.vertices.col(0).array();
  data.uvs.col(1) = 0.95 - 0.9 * mesh.vertices.col(2).array();
  data.camera_ids = {"a", "b"};
  data.centers.resize(2, 3);
  data.centers << 0.5, 3, -1, 2.5, 2, 2;
  data.widths = data.heights = {64, 64};
  const TexelMap texels = texel_map(data.faces, data.uvs, data.uv_faces, kResolution);
  for (int f = 0; f < 3; ++f) {
    Points vertices = mesh.vertices;
    for (Index v = 0; v < vertices.rows(); ++v) {
      vertices(v, 1) = 0.08 * std::sin(6 * vertices(v, 0) + f) * std::cos(4 * vertices(v, 2));
    }
    SurfaceFrame frame = surface_frame(vertices, data.faces, data.uvs, data.uv_faces, f);
    frame.transfer.resize(vertices.rows(), 2 * kTransferTerms);
    for (Index i = 0; i < kTransferTerms; ++i) {
      const auto wave = static_cast<float>(i) * frame.position.col(0).array();
      frame.transfer.col(i) = frame.normal.col(1).array().square() * wave.cos();
      frame.transfer.col(kTransferTerms + i).setConstant(0.5F);
    }
    data.frames.push_back(std::move(frame));
  }
  for (int f = 0; f < 3; ++f) {
    for (int c = 0; c < 2; ++c) {
      AppearanceView view;
      view.camera_idx = c;
      view.frame_idx = f;
      const SurfaceFrame& frame = data.frames[static_cast<std::size_t>(f)];
      const Eigen::MatrixXf position = texel_values(texels, data.faces, frame.position);
      const Eigen::MatrixXf normal = texel_values(texels, data.faces, frame.normal);
      for (std::size_t i = 0; i < texels.covered.size(); ++i) {
        const int texel = texels.covered[i];
        view.pixel.push_back(texel % 4096);
        view.u.push_back((texel % kResolution + 0.5F) / kResolution);
        view.v.push_back(1 - (texel / kResolution + 0.5F) / kResolution);
        const auto row = static_cast<Index>(i);
        const Eigen::RowVector3f to =
            (data.centers.row(c).cast<float>() - position.row(row)).normalized();
        const float shade = 0.3F + 0.6F * normal(row, 0) + 0.2F * to.dot(normal.row(row));
        for (int k = 0; k < 3; ++k) {
          const float print = 0.6F + 0.2F * std::sin(0.7F * static_cast<float>(texel + k));
          const float value = 255 * std::clamp(shade * print + 0.2F, 0.05F, 0.95F);
          view.colors.push_back(static_cast<std::uint8_t>(value * (c == 0 ? 1.0F : 0.95F)));
        }
      }
      data.views.push_back(std::move(view));
    }
  }
  return data;
}

/// A network that has views to learn from.
inline AppearanceNetwork learner(const AppearanceModel& model, const AppearanceData& data,
                                 Device device = Device::Cpu, const CodeLosses& losses = {}) {
  AppearanceNetwork network(model, device);
  network.learn_from(data, losses);
  return network;
}

/// Adds to one number of a parameter.
inline void nudge(AppearanceModel& model, const std::string& name, std::size_t i, float by) {
  Tensor& tensor = model.parameters.at(name);
  float value = 0;
  std::memcpy(&value, tensor.data.data() + 4 * i, 4);
  value += by;
  std::memcpy(tensor.data.data() + 4 * i, &value, 4);
}

/// Compares the derivatives by each parameter of a batch's loss with finite differences.
inline void expect_gradients(const AppearanceModel& model, const AppearanceData& data,
                             const std::vector<int>& batch, const CodeLosses& losses = {}) {
  const auto gradient = learner(model, data, Device::Cpu, losses).loss_gradient(batch);
  ASSERT_EQ(gradient.size(), model.parameters.size());
  for (const auto& [name, tensor] : gradient) {
    // Along the gradient of one tensor at a time: of a single weight, floats leave no digits.
    const auto values = values_of<float>(tensor);
    double squares = 0;
    for (const float value : values) {
      squares += static_cast<double>(value) * value;
    }
    const double length = std::sqrt(squares);
    ASSERT_GT(length, 0) << name;
    // A fiftieth of the tensor's own length, where it has one: weight normalisation bends near 0.
    double own = 0;
    for (const float value : values_of<float>(model.parameters.at(name))) {
      own += static_cast<double>(value) * value;
    }
    const double step = std::clamp(0.02 * std::sqrt(own), 3e-4, 4e-3);
    AppearanceModel plus = model;
    AppearanceModel minus = model;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto by = static_cast<float>(step * values[i] / length);
      nudge(plus, name, i, by);
      nudge(minus, name, i, -by);
    }
    const double difference = (learner(plus, data, Device::Cpu, losses).loss(batch).value -
                               learner(minus, data, Device::Cpu, losses).loss(batch).value) /
                              (2 * step);
    EXPECT_NEAR(difference, length, 0.03 * length + 3e-6) << name;
  }
}

}  // namespace atelier::fixtures
