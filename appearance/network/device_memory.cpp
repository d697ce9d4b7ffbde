#include "appearance/network/device_memory.h"

#include "core/error.h"

namespace atelier {

Tensor off_device(const torch::Tensor& tensor) {
  const torch::Tensor host = tensor.detach().to(torch::kCPU, torch::kFloat32).contiguous();
  return tensor_of(
      std::span<const float>(host.data_ptr<float>(), static_cast<std::size_t>(host.numel())),
      host.sizes().vec());
}

torch::Tensor sampling_grid(const std::vector<float>& u, const std::vector<float>& v,
                            torch::Device device) {
  ATELIER_CHECK(u.size() == v.size(), "u and v differ in number");
  std::vector<float> places(2 * u.size());
  for (std::size_t i = 0; i < u.size(); ++i) {
    places[2 * i] = 2 * u[i] - 1;
    places[2 * i + 1] = 1 - 2 * v[i];
  }
  return on_device(places.data(), {1, 1, static_cast<std::int64_t>(u.size()), 2}, device);
}

}  // namespace atelier
