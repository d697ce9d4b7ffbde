#ifndef ATELIER_HAS_CUDA

#include "core/error.h"
#include "simulation/projective/projective_cuda.h"

namespace atelier {

struct ProjectiveCudaSolver::Scene {};

ProjectiveCudaSolver::ProjectiveCudaSolver(const Cloth&, const Triangles&, const SolverOptions&) {
  throw EnvironmentError("CUDA", "this build has none");
}
ProjectiveCudaSolver::~ProjectiveCudaSolver() = default;
ProjectiveCudaSolver::ProjectiveCudaSolver(ProjectiveCudaSolver&&) noexcept = default;
ProjectiveCudaSolver& ProjectiveCudaSolver::operator=(ProjectiveCudaSolver&&) noexcept = default;

void ProjectiveCudaSolver::set_state(const ClothState&) {}
ClothState ProjectiveCudaSolver::state() const {
  return {};
}
FrameReport ProjectiveCudaSolver::advance(const Control&) {
  return {};
}

}  // namespace atelier

#endif
