#pragma once

#include <memory>
#include <string>
#include <vector>

#include "simulation/xpbd/cuda_jacobi.cuh"
#include "simulation/xpbd/cuda_scene.cuh"

namespace atelier {

/// Features of a solver's frames besides undamped springs and hinges.
struct CudaFrameParts {
  bool full;          ///< anything at all
  bool self;          ///< contact of the cloth with itself
  bool body;          ///< a body
  bool keeps_starts;  ///< where a substep began is asked for while it runs
};

/// How the frames of one solver are launched: decided once from the cloth, the options and the
/// device. See docs/decisions/0006-xpbd-patches.md for what was measured.
template <class T>
class CudaLaunch {
 public:
  /// Throws LogicError if a patch does not fit on chip, EnvironmentError if clusters are asked for
  /// where there are none.
  CudaLaunch(const PreparedCloth<T>& prepared, const XpbdOptions& options,
             std::vector<CudaSceneRule<T>> scenes, const CudaFrameParts& parts);
  ~CudaLaunch();
  CudaLaunch(const CudaLaunch&) = delete;
  CudaLaunch& operator=(const CudaLaunch&) = delete;

  /// Tells the frame what lies on chip.
  void describe(CudaFrame<T>& frame) const;
  /// Substeps `first_substep` to `last_substep` - 1 of every scene.
  void run(const CudaFrame<T>& frame);

 private:
  void run_jacobi(const CudaFrame<T>& frame);
  void run_graph(const CudaFrame<T>& frame);

  std::vector<CudaSceneRule<T>> scenes_;
  CudaFrameParts parts_;
  bool few_ = false;              ///< see FrameKind
  bool resident_ = false;         ///< the plans of all that a block works on fit on chip
  bool records_on_chip_ = false;  ///< and their edges
  std::string barrier_;
  int blocks_ = 1;  ///< of a scene
  unsigned threads_ = 1;
  unsigned grid_ = 1;
  std::size_t shared_bytes_ = 0;
  std::unique_ptr<CudaJacobi<T>> jacobi_;  ///< null: Gauss-Seidel
  /// The launches of one frame, replayed while its arguments stay the same.
  cudaGraphExec_t graph_ = nullptr;
  std::vector<unsigned char> graph_arguments_;
  cudaStream_t capture_ = nullptr;
};

extern template class CudaLaunch<float>;
extern template class CudaLaunch<double>;

}  // namespace atelier
