#include "simulation/cloth/cloth.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "python/arrays.h"
#include "python/bindings.h"
#include "python/checks.h"
#include "python/device.h"
#include "python/options.h"
#include "python/signals.h"
#include "simulation/cloth_state_archive.h"
#include "simulation/material/fabric.h"
#include "simulation/solver.h"

ATELIER_OPTIONS(ClothOptions);
ATELIER_OPTIONS(SolverOptions);

namespace atelier::python {
namespace {

using namespace py::literals;

void bind_cloths(py::module_& module) {
  module.def("fabric_names", &fabric_names, "Fabrics whose values were measured.");
  module.def(
      "fabric_material",
      [](const std::string& name) {
        const std::vector<std::string> known = fabric_names();
        if (std::find(known.begin(), known.end(), name) == known.end()) {
          std::string names;
          for (const std::string& one : known) {
            names += (names.empty() ? "" : ", ") + one;
          }
          throw DataError("", "fabric", "'" + name + "'", "one of " + names);
        }
        return fabric_material(name);
      },
      "name"_a, "Measured values of a fabric of `fabric_names`.");
  py::class_<Cloth> cloth(module, "Cloth", "The model of one piece of cloth.");
  array_field<&Cloth::rest_positions>(cloth, "rest_positions", "[V,3] where a simulation starts");
  array_field<&Cloth::faces>(cloth, "faces", "[F,3]");
  array_field<&Cloth::mass>(cloth, "mass", "[V] kg");
  array_field<&Cloth::fixed>(cloth, "fixed", "[V] 1: moved by Control alone");
  array_field<&Cloth::layer>(cloth, "layer", "[V] or empty");
  cloth.def_property_readonly("spring_count",
                              [](const Cloth& self) { return self.springs.size(); });
  cloth.def_property_readonly("hinge_count", [](const Cloth& self) { return self.hinges.size(); });
  module.def(
      "make_cloth",
      [](const Garment& garment, const std::vector<int>& pins, const ClothOptions& options) {
        require_vertices("pins", pins, garment.mesh.vertices.rows());
        return make_cloth(garment, pins, options);
      },
      "garment"_a, "pins"_a = py::none(), "options"_a = py::none(), py::call_guard<LongCall>(),
      "The model of a garment; `pins` [P] are vertices moved by Control. Raises DataError for "
      "a garment that cannot be simulated.");
  module.def(
      "join_cloths", [](const std::vector<Cloth>& cloths) { return join_cloths(cloths); },
      "cloths"_a, py::call_guard<LongCall>(), "Layers, from the inside out.");
}

void bind_states(py::module_& module) {
  py::class_<ClothState> state(module, "ClothState",
                               "The part of a scene that changes from frame to frame.");
  state.def(py::init([](Points positions, Points velocities, std::int64_t frame) {
              return ClothState{std::move(positions), std::move(velocities), frame};
            }),
            "positions"_a, "velocities"_a, "frame"_a = 0);
  array_field<&ClothState::positions>(state, "positions", "[V,3] m");
  array_field<&ClothState::velocities>(state, "velocities", "[V,3] m/s");
  state.def_readwrite("frame", &ClothState::frame, "frames done");
  module.def("rest_state", &rest_state, "cloth"_a, "The cloth at rest in its template shape.");

  py::class_<Control> control(module, "Control", "The boundary conditions of one frame.");
  control.def(py::init([](const Eigen::Vector3d& gravity, const Eigen::Vector3d& wind,
                          Points body_start, Points body_end, Points pin_targets) {
                Control made;
                made.gravity = gravity;
                made.wind = wind;
                made.body_start = std::move(body_start);
                made.body_end = std::move(body_end);
                made.pin_targets = std::move(pin_targets);
                return made;
              }),
              "gravity"_a = std::vector<double>{0, -9.81, 0},
              "wind"_a = std::vector<double>{0, 0, 0}, "body_start"_a = py::none(),
              "body_end"_a = py::none(), "pin_targets"_a = py::none());
  array_field<&Control::gravity>(control, "gravity", "[3] m/s2");
  array_field<&Control::wind>(control, "wind", "[3] m/s");
  array_field<&Control::wind_field>(control, "wind_field", "[V,3] m/s, or empty");
  array_field<&Control::body_start>(control, "body_start", "[B,3] at the start of the frame");
  array_field<&Control::body_end>(control, "body_end", "[B,3] at its end");
  array_field<&Control::pin_targets>(
      control, "pin_targets",
      "[V,3] where fixed vertices are at the end of the frame, or empty: they stay");
  control.def_readwrite("exact_counts", &Control::exact_counts, "count in this frame");

  py::class_<FrameReport> report(module, "FrameReport", "Diagnostics of one simulated frame.");
  report.def_readonly("frame", &FrameReport::frame);
  report.def_readonly("strain_p50", &FrameReport::strain_p50);
  report.def_readonly("strain_p95", &FrameReport::strain_p95);
  report.def_readonly("strain_max", &FrameReport::strain_max);
  report.def_readonly("kinetic_energy", &FrameReport::kinetic_energy, "J");
  report.def_readonly("elastic_energy", &FrameReport::elastic_energy, "J");
  report.def_readonly("body_contacts", &FrameReport::body_contacts);
  report.def_readonly("penetrating", &FrameReport::penetrating, "free vertices inside the body");
  report.def_readonly("penetration_depth", &FrameReport::penetration_depth, "m");
  report.def_readonly("self_contacts", &FrameReport::self_contacts);
  report.def_readonly("device_ms", &FrameReport::device_ms);
  report.def_readonly("crossings", &FrameReport::crossings, "-1: not counted");
  report.def_readonly("body_crossings", &FrameReport::body_crossings, "-1: not counted");
  report.def_readonly("inside", &FrameReport::inside, "-1: not counted");
  report.def("__repr__", [](const FrameReport& self) {
    return "<FrameReport of frame " + std::to_string(self.frame) + ", strain_p95 " +
           std::to_string(self.strain_p95) + ">";
  });
}

/// What `simulate` returns.
struct Simulated {
  py::array positions;
  std::vector<FrameReport> reports;
};

/// Simulates frame after frame without the interpreter's lock; Python is asked for a frame's
/// control, told of progress, and asked for signals.
Simulated simulate(Solver& solver, Index frames, const py::object& control, Index every,
                   const py::object& progress) {
  if (frames < 0 || every < 1) {
    throw DataError("", frames < 0 ? "frames" : "every",
                    std::to_string(frames < 0 ? frames : every),
                    frames < 0 ? "0 or more" : "1 or more");
  }
  const bool asked = PyCallable_Check(control.ptr()) != 0;
  if (!asked && !control.is_none() && !py::isinstance<Control>(control)) {
    throw DataError("", "control", std::string(py::repr(control)).substr(0, 60),
                    "a Control, a function that returns one, or None");
  }
  const Control gravity_alone;
  const Control* now = asked || control.is_none() ? &gravity_alone : &control.cast<Control&>();
  py::object answer;  // keeps what `now` points to
  const Index vertices = solver.state().positions.rows();
  const Index kept = frames / every;
  std::vector<double> positions;  // grows with the frames: nobody waits for memory of later ones
  std::vector<FrameReport> reports;
  {
    const py::gil_scoped_release released;
    SignalWatch watch;
    for (Index i = 0; i < frames; ++i) {
      watch.check();
      if (asked) {
        const py::gil_scoped_acquire lock;
        answer = control(i);
        if (!py::isinstance<Control>(answer)) {
          throw DataError("", "control",
                          "a function that gave " + std::string(py::repr(answer)).substr(0, 60),
                          "a Control for every frame");
        }
        now = &answer.cast<Control&>();
      }
      reports.push_back(solver.step(*now));
      if ((i + 1) % every == 0) {
        const Points places = solver.state().positions;
        positions.insert(positions.end(), places.data(), places.data() + places.size());
      }
      if (!progress.is_none()) {
        const py::gil_scoped_acquire lock;
        progress(i + 1, frames);
      }
    }
  }
  return {array_of(std::move(positions)).reshape({kept, vertices, Index{3}}), std::move(reports)};
}

void bind_solver(py::module_& module) {
  py::class_<SimulationModel> model(
      module, "SimulationModel",
      "The part of a scene that does not change: cloth and the body's faces.");
  model.def(py::init([](Cloth cloth, Triangles body_faces) {
              // Of how many vertices is known with a Control.
              require_faces(body_faces, std::numeric_limits<int>::max());
              return SimulationModel{std::move(cloth), std::move(body_faces)};
            }),
            "cloth"_a, "body_faces"_a = py::none());
  struct_field<&SimulationModel::cloth>(model, "cloth");
  array_field<&SimulationModel::body_faces>(model, "body_faces", "[F,3]; empty: no body");

  py::class_<Solver>(module, "Solver", "A cloth solver for one model: create_solver.")
      .def_property_readonly("name", &Solver::name)
      .def_property_readonly(
          "device", [](const Solver& self) -> std::string { return device_name(self.device()); })
      .def_property("state", &Solver::state, &Solver::set_state,
                    "positions and velocities, copied; a checkpoint")
      .def("step", &Solver::step, "control"_a, py::call_guard<py::gil_scoped_release>(),
           "Advances by one frame of the options' length under a Control, and gives its "
           "FrameReport. "
           "`state` has positions [V,3] m and velocities [V,3] m/s afterwards.");
  py::class_<Simulated>(module, "Simulated", "Result of `simulate`.")
      .def_readonly("positions", &Simulated::positions, "[N,V,3] m, of every n-th frame")
      .def_readonly("reports", &Simulated::reports, "of every frame");
  module.def("solver_names", &solver_names, "Names of the available solvers.");
  module.def(
      "create_solver",
      [](const SimulationModel& scene, const SolverOptions& options, const std::string& device) {
        return create_solver(scene, options, device_of(device));
      },
      "model"_a, "options"_a = py::none(), "device"_a = "cpu",
      py::call_guard<py::gil_scoped_release>(),
      "The solver `options.solver` in the model's rest state, on \"cpu\" or \"cuda\".");
  module.def(
      "simulate", &simulate, "solver"_a, "frames"_a, "control"_a = py::none(), "every"_a = 1,
      "progress"_a = py::none(),
      "Advances by many frames. `control` is a Control, None (gravity alone), or a function of "
      "the frame's number from 0 that returns one; `progress(done, total)` is called after each "
      "frame. Ctrl-C, and what these raise, end it with the solver at the last whole frame.");
}

}  // namespace

void bind_cloth(py::module_& module) {
  ATELIER_OPTIONS_CLASS(ClothOptions);
  ATELIER_OPTIONS_CLASS(SolverOptions);
  bind_cloths(module);
  bind_states(module);
  bind_solver(module);
}

}  // namespace atelier::python
