#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "capture/detection/find_people.h"
#include "tests/capture_detection/small_network.h"

namespace atelier::fixtures {

struct LinearOutput {
  std::string name;
  std::vector<std::int64_t> shape;
  std::vector<float> constant;
  float of_red = 0;  ///< times the largest red of the input, added to the first value
};

/// A network whose outputs are constant but for the largest red value of its input.
inline std::vector<std::byte> linear_network(int size, const std::vector<LinearOutput>& outputs) {
  SmallNetwork network;
  network.input = {1, 3, size, size};
  network.nodes = {
      node("MaxPool", {"input"}, "largest",
           ints_attribute("kernel_shape", {size, size}) + ints_attribute("strides", {size, size}))};
  for (const LinearOutput& output : outputs) {
    const auto count = static_cast<std::int64_t>(output.constant.size());
    std::vector<float> weights(output.constant.size() * 3, 0.0F);
    weights[0] = output.of_red;
    network.initializers.push_back(tensor(output.name + "_w", {count, 3, 1, 1}, weights));
    network.initializers.push_back(tensor(output.name + "_b", {count}, output.constant));
    network.initializers.push_back(int_tensor(output.name + "_s", output.shape));
    network.nodes.push_back(node("Conv", {"largest", output.name + "_w", output.name + "_b"},
                                 output.name + "_c", ints_attribute("kernel_shape", {1, 1})));
    network.nodes.push_back(node("Reshape", {output.name + "_c", output.name + "_s"}, output.name));
    network.outputs.emplace_back(output.name, output.shape);
  }
  return onnx_bytes(network);
}

/// A detector that sees somebody in the middle of bright images, and landmarks in the middle of
/// their crop whose presence is the brightness.
inline PeopleNetworks bright_networks() {
  std::vector<float> boxes(std::size_t{2254} * 12, 0.0F);
  const std::vector<float> box = {108, 108, 40, 90, 108, 108, 108, 64, 0, 0, 0, 0};
  std::copy(box.begin(), box.end(), boxes.begin());
  std::vector<float> scores(2254, -50.0F);
  scores[0] = 0;
  std::vector<float> rows(std::size_t{39} * 5, 0.0F);
  for (std::size_t k = 0; k < 39; ++k) {
    rows[5 * k] = 128;
    rows[5 * k + 1] = k == 34 ? 26.0F : 128;
  }
  PeopleNetworks networks;
  networks.person_file = "person.onnx";
  networks.landmarks_file = "landmarks.onnx";
  networks.person = linear_network(
      224, {{"boxes", {1, 2254, 12}, boxes, 0}, {"scores", {1, 2254, 1}, scores, 8}});
  networks.landmarks = linear_network(
      256, {{"mask", {1, 1, 256, 256}, std::vector<float>(std::size_t{256} * 256, 9.0F), 0},
            {"maps", {1, 39, 64, 64}, std::vector<float>(std::size_t{39} * 64 * 64, -9.0F), 0},
            {"rows", {1, 195}, rows, 0},
            {"presence", {1, 1}, {0}, 1}});
  return networks;
}

}  // namespace atelier::fixtures
