#pragma once

#include <cstddef>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/cuda_check.h"
#include "core/error.h"

namespace atelier {

/// An array in device memory, owned. Copies are explicit (upload, download) and run on the default
/// stream: they wait for the kernels launched before. Pass `data()` to kernels.
/// Throws EnvironmentError where a CUDA call fails or device memory runs out.
template <class T>
class CudaBuffer {
  static_assert(std::is_trivially_copyable_v<T>, "device memory holds plain data");

 public:
  CudaBuffer() = default;

  /// `size` elements, not initialised.
  explicit CudaBuffer(std::size_t size) : size_(size) {
    ATELIER_CHECK(size <= std::numeric_limits<std::size_t>::max() / sizeof(T), "size overflows");
    data_ = static_cast<T*>(allocate_cuda(size * sizeof(T)));
  }

  /// A copy of `size` elements at `host`.
  CudaBuffer(const T* host, std::size_t size) : CudaBuffer(size) { upload(host, size); }

  explicit CudaBuffer(const std::vector<T>& host) : CudaBuffer(host.data(), host.size()) {}

  ~CudaBuffer() { release_cuda(data_); }
  CudaBuffer(const CudaBuffer&) = delete;
  CudaBuffer& operator=(const CudaBuffer&) = delete;
  CudaBuffer(CudaBuffer&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  CudaBuffer& operator=(CudaBuffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }

  T* data() { return data_; }
  const T* data() const { return data_; }
  std::size_t size() const { return size_; }

  /// Fills the whole buffer from the host. Throws LogicError unless `size` is the buffer's.
  void upload(const T* host, std::size_t size) {
    ATELIER_CHECK(size == size_, "upload of another size");
    if (size > 0) {
      ATELIER_CUDA_CHECK(cudaMemcpy(data_, host, size * sizeof(T), cudaMemcpyHostToDevice));
    }
  }
  void upload(const std::vector<T>& host) { upload(host.data(), host.size()); }

  /// Copies the whole buffer to the host.
  std::vector<T> download() const {
    std::vector<T> host(size_);
    if (size_ > 0) {
      ATELIER_CUDA_CHECK(cudaMemcpy(host.data(), data_, size_ * sizeof(T), cudaMemcpyDeviceToHost));
    }
    return host;
  }

  /// Sets every byte to zero.
  void clear() {
    if (size_ > 0) {
      ATELIER_CUDA_CHECK(cudaMemset(data_, 0, size_ * sizeof(T)));
    }
  }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace atelier
