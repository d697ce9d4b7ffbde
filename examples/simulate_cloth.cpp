// Lets a square of cotton, held by two corners, swing for two seconds.
//   simulate_cloth [cuda]
#include <exception>
#include <iostream>
#include <string>

#include "core/garment.h"
#include "simulation/material/fabric.h"
#include "simulation/solver.h"

using namespace atelier;

/// A square of `side` metres in the plane y = 1, of n x n quads.
static Mesh square(double side, int n) {
  Mesh mesh;
  mesh.vertices.resize((n + 1) * (n + 1), 3);
  mesh.faces.resize(2 * n * n, 3);
  for (int z = 0; z <= n; ++z) {
    for (int x = 0; x <= n; ++x) {
      mesh.vertices.row(z * (n + 1) + x) << side * x / n, 1, side * z / n;
    }
  }
  for (int i = 0; i < n * n; ++i) {
    const int a = i / n * (n + 1) + i % n;
    mesh.faces.row(2 * i) << a, a + n + 1, a + 1;
    mesh.faces.row(2 * i + 1) << a + 1, a + n + 1, a + n + 2;
  }
  return mesh;
}

int main(int count, char** arguments) {
  try {
    constexpr int kQuads = 30;
    Garment garment;
    garment.name = "towel";
    garment.mesh = square(0.6, kQuads);
    garment.material = fabric_material("cotton");

    SimulationModel model;  // what does not change; no body here
    model.cloth = make_cloth(garment, {0, kQuads});
    SolverOptions options;
    options.substeps = 40;  // the stiffer the cloth, the more
    const bool cuda = count > 1 && std::string(arguments[1]) == "cuda";
    const auto solver = create_solver(model, options, cuda ? Device::Cuda : Device::Cpu);
    const Control control;  // gravity; wind, a moving body and pins are set here
    for (int frame = 1; frame <= 120; ++frame) {  // of 1/60 s
      const FrameReport report = solver->step(control);
      if (frame % 30 == 0) {
        const ClothState state = solver->state();  // a checkpoint, too
        std::cout << "frame " << frame << ": lowest point at " << state.positions.col(1).minCoeff()
                  << " m, strain " << 100 * report.strain_p95 << " %\n";
      }
    }
  } catch (const std::exception& error) {
    std::cerr << "simulate_cloth: " << error.what() << "\n";
    return 3;
  }
}
