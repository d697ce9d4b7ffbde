// The same work repeated in C++, for bench/python_calls: what a call from Python costs beside it.
#include <chrono>
#include <cstdint>
#include <functional>

#include "bodymodel/skinning.h"
#include "core/points_view.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "simulation/solver.h"

namespace atelier::python {
namespace {

/// Seconds of each of `count` calls.
std::vector<double> seconds_of(int count, const std::function<void()>& work) {
  const py::gil_scoped_release released;
  std::vector<double> seconds;
  for (int i = 0; i < count; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    seconds.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  return seconds;
}

}  // namespace

void bind_bench(py::module_& module) {
  module.def("_seconds_of_skinning", [](const BodyModel& model, const ShapedBody& body,
                                        const Pose& pose, int count) {
    return seconds_of(count, [&] { const Points posed = skin_vertices(model, body, pose); });
  });
  module.def("_seconds_of_closest_points",
             [](const TriangleTree& tree, PointsView queries, int count) {
               return seconds_of(count, [&] { const auto found = closest_points(tree, queries); });
             });
  module.def("_seconds_of_normals", [](PointsView vertices, const Triangles& faces, int count) {
    return seconds_of(count, [&] { const Points normals = vertex_normals(vertices, faces); });
  });
  module.def("_seconds_of_steps", [](Solver& solver, const Control& control, int count) {
    return seconds_of(count, [&] { solver.step(control); });
  });
  module.def("_address_of_points",
             [](PointsView points) { return reinterpret_cast<std::uintptr_t>(points.data()); });
}

}  // namespace atelier::python
