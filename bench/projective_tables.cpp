// Tables of docs/results/projective_friction.md: projective dynamics with dry friction, measured.
//
//   projective_tables residual       what is left of Coulomb's law, by iterations; --plot FILE.svg
//   projective_tables convergence    to implicit Euler with iterations, to XPBD with steps
//   projective_tables drape          Cusick's test by iterations and rings, XPBD beside
//   projective_tables speed          ms a step of ten iterations, one and two threads, XPBD beside
//   projective_tables rest FILE      rest shape: flat panel, or 3D template
//   projective_tables other FILE     beside the cloth of the method's authors' program
//   projective_tables forces FILE    stiffnesses of that cloth, from its motion alone
//   projective_tables scene FOLDER   writes a scene for that program (scripts/authors-program)
//   projective_tables runs FOLDER... residual and time of its runs, ours beside them
//
// FILE: a sequence.npz with body_vertices, body_faces, cloth_vertices, cloth_faces, cloth_uv,
// cloth_seams, cloth_attached and fps.

#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <map>
#include <set>

#include "bench/beside_authors.h"
#include "bench/log_plot.h"
#include "bench/plain_meshes.h"
#include "core/parallel.h"
#include "simulation/contact/crossings.h"
#include "simulation/material/fabric.h"
#include "simulation/projective/projective.h"
#include "simulation/xpbd/xpbd.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/cusick_drape.h"
#include "tests/simulation/foreign/foreign_skirt.h"
#include "tests/simulation/implicit_euler.h"

namespace atelier {
namespace {

using namespace fixtures;

Garment fabric_of(Mesh mesh, double stretch) {
  Garment garment;
  garment.name = "sheet";
  garment.mesh = std::move(mesh);
  garment.material.density = 0.2;
  garment.material.stretch_warp = stretch;
  garment.material.stretch_weft = stretch;
  garment.material.shear = 0.4 * stretch;
  garment.material.bending = 1e-5;
  garment.material.friction = 0.4;
  garment.material.thickness = 1e-3;
  garment.material.damping = 0;
  return garment;
}

SolverOptions step_options(double step, int substeps, int iterations) {
  SolverOptions options;
  options.name = "projective-friction";
  options.time_step = step * substeps;
  options.substeps = options.projective.substeps = substeps;
  options.projective.iterations = iterations;
  options.xpbd.iterations = iterations;
  options.report = false;
  return options;
}

Control at_rest(const Mesh& body) {
  Control control;
  control.body_start = control.body_end = body.vertices;
  return control;
}

// --- what is left of Coulomb's law

/// Mean of four frames of a sheet, or two on one another, that fell on a ball for eight.
ProjectiveResidual residual_on_ball(int iterations, int acceleration, int sheets) {
  std::vector<Cloth> cloths;
  for (int k = 0; k < sheets; ++k) {
    Garment garment = fabric_of(square_sheet(15, 0.28), 300);
    garment.mesh.vertices.col(1).array() += 0.102 + 0.0015 * k;
    cloths.push_back(make_cloth(garment));
  }
  const Mesh ball = ball_mesh(0.1, 24);
  SolverOptions options = step_options(1.0 / 600, 10, iterations);
  options.projective.acceleration = acceleration;
  options.self_contact = sheets > 1;
  ProjectiveSolver solver(join_cloths(cloths), ball.faces, options);
  ProjectiveResidual mean;
  for (int i = 0; i < 12; ++i) {
    solver.advance(at_rest(ball));
    if (i >= 8) {
      const ProjectiveResidual now = solver.residual();
      mean.contact += now.contact / 4;
      mean.cloth_contact += now.cloth_contact / 4;
      mean.momentum += now.momentum / 4;
    }
  }
  return mean;
}

/// Prints the table, and draws it where `plot` names a file.
void print_residuals(const std::string& plot) {
  std::vector<LogLine> lines;
  std::printf("| iterations | sheets | 5 | 10 | 20 | 30 | 300 |\n|---|---|---|---|---|---|---|\n");
  for (const int sheets : {1, 2}) {
    for (const int acceleration : {0, 5}) {
      std::vector<ProjectiveResidual> row;
      for (const int iterations : {5, 10, 20, 30, 300}) {
        row.push_back(residual_on_ball(iterations, acceleration, sheets));
      }
      const char* how = acceleration == 0 ? "as published" : "accelerated";
      const auto print = [&](const char* of, const char* colour,
                             double ProjectiveResidual::*field) {
        LogLine line{std::string(of) + ", " + how, colour, acceleration == 0, {}};
        std::printf("| %s: %s | %d |", how, of, sheets);
        for (const ProjectiveResidual& one : row) {
          std::printf(" %.2g |", one.*field);
          line.y.push_back(one.*field);
        }
        std::printf("\n");
        return line;
      };
      const LogLine body = print("body", "#2b5d8a", &ProjectiveResidual::contact);
      if (sheets > 1) {
        lines.push_back(print("cloth", "#b5532a", &ProjectiveResidual::cloth_contact));
      } else {
        lines.push_back(body);
      }
      const LogLine momentum = print("momentum", "#4a8a3a", &ProjectiveResidual::momentum);
      if (sheets == 1) {
        lines.push_back(momentum);
      }
    }
  }
  if (!plot.empty()) {
    write_log_plot(plot, "iterations", "residual / weight of a particle in a step",
                   {5, 10, 20, 30, 300}, lines);
  }
}

// --- what it converges to

/// A sheet of `cells` cells a side and 30 cm that swings from two corners.
Cloth swinging_sheet(int cells, double bending) {
  return make_cloth(garment_of(sheet(cells, cells, 0.3 / cells, 'a'), 0.2, 50, bending),
                    {0, cells});
}

double largest_distance(const Points& a, const Points& b) {
  return (a - b).rowwise().norm().maxCoeff();
}

/// From implicit Euler's cloth (a dense Newton solver) after 12 steps, as a share of the side.
double off_implicit_euler(int iterations, int acceleration, double bending) {
  const double h = 1.0 / 240;
  const Cloth cloth = swinging_sheet(5, bending);
  SolverOptions options = step_options(h, 1, iterations);
  options.projective.acceleration = acceleration;
  ClothState exact = rest_state(cloth);
  ProjectiveSolver solver(cloth, {}, options);
  for (int i = 0; i < 12; ++i) {
    exact = newton_step(cloth, exact, h);
    solver.advance({});
  }
  return largest_distance(solver.state().positions, exact.positions) / 0.3;
}

void print_convergence() {
  std::printf(
      "| iterations a step | 2 | 5 | 10 | 20 | 50 | 100 |\n|---|---|---|---|---|---|---|\n");
  for (const double bending : {0.0, 1e-4}) {
    for (const int acceleration : {0, 5}) {
      std::printf("| %s, %s |", acceleration == 0 ? "as published" : "accelerated",
                  bending > 0 ? "1e-4 N m" : "no bends");
      for (const int iterations : {2, 5, 10, 20, 50, 100}) {
        std::printf(" %.2g |", off_implicit_euler(iterations, acceleration, bending));
      }
      std::printf("\n");
    }
  }
  const Cloth cloth = swinging_sheet(8, 0);
  const int frames = 10;
  SolverOptions fine = step_options(1.0 / 6000, 100, 60);
  fine.xpbd.precision = "double";
  ClothSolver xpbd(cloth, {}, xpbd_options(fine));
  for (int i = 0; i < frames; ++i) {
    xpbd.advance({});
  }
  std::printf("\n| steps a frame | 2 | 4 | 8 | 16 | 32 | 64 |\n|---|---|---|---|---|---|---|\n");
  std::printf("| from XPBD's cloth of 100 substeps, %% of the side |");
  for (const int steps : {2, 4, 8, 16, 32, 64}) {
    ProjectiveSolver solver(cloth, {}, step_options(1.0 / (60 * steps), steps, 40));
    for (int i = 0; i < frames; ++i) {
      solver.advance({});
    }
    std::printf(" %.2g |",
                100 * largest_distance(solver.state().positions, xpbd.state().positions) / 0.3);
  }
  std::printf("\n");
}

// --- drape

/// Cusick's coefficient of a fabric by either solver; its substeps grow with the rings squared, so
/// that none of them is softer by its solver.
void print_drape(const Material& fabric, const std::vector<int>& rings,
                 const std::vector<int>& iterations, double seconds) {
  std::printf("%s of %g N m, coefficient in %% (fastest vertex at the end in mm/s).\n\n",
              fabric.name.c_str(), fabric.bending);
  std::printf("| solver | iterations |");
  for (const int count : rings) {
    std::printf(" %d rings |", count);
  }
  std::printf("\n|---|---|");
  for (std::size_t i = 0; i < rings.size(); ++i) {
    std::printf("---|");
  }
  std::printf("\n");
  for (const std::string solver : {"xpbd", "projective-friction"}) {
    for (const int count : iterations) {
      std::printf("| %s | %d |", solver.c_str(), count);
      for (const int of : rings) {
        CusickOptions options{
            .rings = of, .seconds = seconds, .solver = solver, .iterations = count};
        options.substeps = 30 * of * of / (15 * 15);
        const CusickDrape drape = cusick_drape(fabric, options);
        std::printf(" %.2f (%.1f) |", drape.coefficient, 1e3 * drape.rest_speed);
        std::fflush(stdout);
      }
      std::printf("\n");
    }
  }
}

// --- speed

/// Of the clock, the median and the least, and of the processor: others on the machine do not
/// change the last two much.
struct StepTime {
  double ms, least_ms, processor_ms;
};

constexpr int kStepsOfFrame = 5;

/// A step of `steps` steps, in frames of kStepsOfFrame, after some to fall by.
template <class Frame>
StepTime time_of(int fall, int steps, const Frame& frame) {
  for (int i = 0; i < fall; i += kStepsOfFrame) {
    frame();
  }
  const int frames = (steps + kStepsOfFrame - 1) / kStepsOfFrame;
  std::vector<double> ms;
  const std::clock_t processor = std::clock();
  for (int i = 0; i < frames; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    frame();
    const auto end = std::chrono::steady_clock::now();
    ms.push_back(std::chrono::duration<double, std::milli>(end - begin).count() / kStepsOfFrame);
  }
  std::nth_element(ms.begin(), ms.begin() + frames / 2, ms.end());
  return {ms[static_cast<std::size_t>(frames / 2)], *std::min_element(ms.begin(), ms.end()),
          1e3 * static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC / frames /
              kStepsOfFrame};
}

void print_speed(int side, int steps) {
  const double step = 1.0 / 300;
  Garment garment = fabric_of(square_sheet(side, 1), 1000);
  garment.mesh.vertices.col(1).array() += 0.302;
  const Cloth cloth = make_cloth(garment);
  const Mesh ball = ball_mesh(0.3, 50);
  std::printf(
      "%d vertices on a ball of %d triangles, frames of %d steps of 1/300 s of 10 "
      "iterations.\n\n",
      side * side, static_cast<int>(ball.faces.rows()), kStepsOfFrame);
  std::printf(
      "| solver | self-contact | threads | ms a step | least | ms of processor | Coulomb's law "
      "| momentum | spring residual um |\n|---|---|---|---|---|---|---|---|---|\n");
  const int fall = 40;
  for (const bool self : {false, true}) {
    for (const int threads : {1, 2}) {
      set_thread_count(threads);
      for (const int acceleration : {0, 5}) {
        SolverOptions options = step_options(step, kStepsOfFrame, 10);
        options.projective.acceleration = acceleration;
        options.self_contact = self;
        ProjectiveSolver solver(cloth, ball.faces, options);
        const StepTime time = time_of(fall, steps, [&] { solver.advance(at_rest(ball)); });
        const ProjectiveResidual left = solver.residual();
        std::printf("| projective-friction%s | %s | %d | %.1f | %.1f | %.1f | %.2g | %.2g | - |\n",
                    acceleration == 0 ? ", as published" : "", self ? "yes" : "no", threads,
                    time.ms, time.least_ms, time.processor_ms, left.contact, left.momentum);
      }
      SolverOptions options = step_options(step, kStepsOfFrame, 10);
      options.self_contact = self;
      ClothSolver xpbd(cloth, ball.faces, xpbd_options(options));
      const StepTime time = time_of(fall, steps, [&] { xpbd.advance(at_rest(ball)); });
      options.report = true;
      ClothSolver reporter(cloth, ball.faces, xpbd_options(options));
      reporter.set_state(xpbd.state());
      std::printf("| xpbd | %s | %d | %.1f | %.1f | %.1f | - | - | %.0f |\n", self ? "yes" : "no",
                  threads, time.ms, time.least_ms, time.processor_ms,
                  1e6 * reporter.advance(at_rest(ball)).spring_residual);
    }
  }
  set_thread_count(0);
}

// --- another program's cloth

/// Forces of springs of 1 N/m, and of bends of 1 N m, on the vertices [V,3].
struct UnitForces {
  Points springs, bends;
};
UnitForces unit_forces(const Cloth& cloth, const Points& x) {
  UnitForces out{Points::Zero(x.rows(), 3), Points::Zero(x.rows(), 3)};
  for (int i = 0; i < cloth.fibre_count; ++i) {
    const ClothSpring& s = cloth.springs[i];
    const Eigen::RowVector3d d = x.row(s.b) - x.row(s.a);
    const Eigen::RowVector3d pull = (1 - s.rest / d.norm()) * d;
    out.springs.row(s.a) += pull;
    out.springs.row(s.b) -= pull;
  }
  for (const ClothCurvature& around : cloth.curvatures) {
    Eigen::RowVector3d value = Eigen::RowVector3d::Zero();
    for (std::size_t k = 0; k < around.vertices.size(); ++k) {
      value += around.weights[k] * x.row(around.vertices[k]);
    }
    for (std::size_t k = 0; k < around.vertices.size(); ++k) {
      out.bends.row(around.vertices[k]) -= around.weights[k] * value;
    }
  }
  return out;
}

/// Stiffnesses from the file alone, by least squares over its frames: what moves the cloth below a
/// ring of the skirt, less its weight, is what springs and bends pull across the ring. Contact with
/// the body is left out.
void print_forces(const ForeignSequence& sequence) {
  const Cloth cloth = published_cloth(sequence);
  const std::vector<Points>& x = sequence.cloth;
  std::vector<double> radius(cloth.mass.size());
  for (Index i = 0; i < sequence.garment.rest_faces.size(); ++i) {
    radius[static_cast<std::size_t>(sequence.garment.mesh.faces(i / 3, i % 3))] =
        sequence.garment.rest.row(sequence.garment.rest_faces(i / 3, i % 3)).norm();
  }
  std::vector<UnitForces> forces;
  forces.reserve(x.size());
  for (const Points& frame : x) {
    forces.push_back(unit_forces(cloth, frame));
  }
  std::printf(
      "| ring at m of radius | springs N/m | bends N m | of the force is left |\n"
      "|---|---|---|---|\n");
  for (const double ring : {0.3, 0.4, 0.5, 0.6, 0.7, 0.74}) {
    Eigen::MatrixXd matrix(3 * (static_cast<Index>(x.size()) - 2), 2);
    Eigen::VectorXd moves(matrix.rows());
    for (std::size_t f = 1; f + 1 < x.size(); ++f) {
      // Second differences are means over two frames, with these weights of three forces.
      const auto mean_below = [&](Points UnitForces::*of) {
        Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
        for (std::size_t v = 0; v < radius.size(); ++v) {
          const Index row = static_cast<Index>(v);
          if (radius[v] > ring) {
            sum += ((forces[f - 1].*of).row(row) + 4 * (forces[f].*of).row(row) +
                    (forces[f + 1].*of).row(row)) /
                   6;
          }
        }
        return sum;
      };
      Eigen::RowVector3d needed = Eigen::RowVector3d::Zero();
      for (std::size_t v = 0; v < radius.size(); ++v) {
        const Index row = static_cast<Index>(v);
        if (radius[v] > ring) {
          needed +=
              cloth.mass[v] * (sequence.fps * sequence.fps *
                                   (x[f + 1].row(row) - 2 * x[f].row(row) + x[f - 1].row(row)) +
                               Eigen::RowVector3d(0, 9.81, 0));
        }
      }
      const Index at = 3 * (static_cast<Index>(f) - 1);
      matrix.block<3, 1>(at, 0) = mean_below(&UnitForces::springs).transpose();
      matrix.block<3, 1>(at, 1) = mean_below(&UnitForces::bends).transpose();
      moves.segment<3>(at) = needed.transpose();
    }
    const Eigen::Vector2d found = matrix.colPivHouseholderQr().solve(moves);
    std::printf("| %.2f | %.1f | %.2g | %.2f |\n", ring, found[0], found[1],
                (matrix * found - moves).norm() / moves.norm());
  }
}

void print_beside(const ForeignSequence& sequence, int last) {
  const Cloth cloth = published_cloth(sequence);
  std::printf(
      "%d vertices, %d frames from the same start, on the same body.\n\n| cloth | frame | mean "
      "distance mm | strain %% | area m2 | silhouette m2 | hem m | crossings |\n"
      "|---|---|---|---|---|---|---|---|\n",
      static_cast<int>(cloth.mass.size()), last);
  const auto print = [&](const char* name, int f, const Points& x) {
    const Points& other = sequence.cloth[static_cast<std::size_t>(f)];
    const ClothFigures now = figures_of(x, cloth);
    std::printf("| %s | %d | %.1f | %.2f | %.4f | %.4f | %.4f | %d |\n", name, f,
                1e3 * (x - other).rowwise().norm().mean(), 100 * now.strain, now.area,
                now.silhouette, now.hem, count_crossings(x, cloth.faces));
  };
  for (int f = 10; f <= last; f += 10) {
    print("authors' program", f, sequence.cloth[static_cast<std::size_t>(f)]);
  }
  for (const int acceleration : {0, 5}) {
    SolverOptions options = foreign_options();
    options.projective.acceleration = acceleration;
    ProjectiveSolver solver(cloth, sequence.body_faces, options);
    solver.set_state(start_of(sequence));
    replay(sequence, last, [&](const Control& control, int f) {
      solver.advance(control);
      if (f % 10 == 0) {
        print(acceleration == 0 ? "projective-friction, as published" : "projective-friction", f,
              solver.state().positions);
      }
    });
  }
  ClothSolver xpbd(foreign_cloth(sequence), sequence.body_faces, xpbd_options(foreign_options()));
  xpbd.set_state(start_of(sequence));
  replay(sequence, last, [&](const Control& control, int f) {
    xpbd.advance(control);
    if (f % 10 == 0) {
      print("xpbd, 4 iterations", f, xpbd.state().positions);
    }
  });
}

/// The skirt with its flat panel's lengths and angles, with the template's lengths (the first
/// frame), and with the template's angles too, after `last` frames.
void print_rest_shapes(const ForeignSequence& sequence, int last) {
  const Cloth flat = foreign_cloth(sequence);
  std::printf(
      "| rest lengths | rest angles | solver | strain %% | area m2 | silhouette m2 | hem m | from "
      "the "
      "flat panel's cloth mm |\n|---|---|---|---|---|---|---|---|\n");
  for (const char* name : {"projective-friction", "xpbd"}) {
    Points reference;
    for (const int kind : {0, 1, 2}) {
      ForeignSequence own = sequence;
      ClothOptions cloth_options;
      cloth_options.rest_angles = kind == 2 ? "template" : "flat";
      if (kind > 0) {
        own.garment.rest.resize(0, 2);
        own.garment.rest_faces.resize(0, 3);
      }
      const Cloth cloth = foreign_cloth(own, cloth_options);
      Points end;
      SolverOptions options = foreign_options();
      if (std::string(name) == "xpbd") {
        ClothSolver solver(cloth, sequence.body_faces, xpbd_options(options));
        solver.set_state(start_of(sequence));
        replay(sequence, last, [&](const Control& control, int) { solver.advance(control); });
        end = solver.state().positions;
      } else {
        ProjectiveSolver solver(cloth, sequence.body_faces, options);
        solver.set_state(start_of(sequence));
        replay(sequence, last, [&](const Control& control, int) { solver.advance(control); });
        end = solver.state().positions;
      }
      reference = kind == 0 ? end : reference;
      const ClothFigures now = figures_of(end, flat);
      std::printf("| %s | %s | %s | %.2f | %.4f | %.4f | %.4f | %.1f |\n",
                  kind == 0 ? "flat panel" : "3D template", kind == 2 ? "3D template" : "flat",
                  name, 100 * now.strain, now.area, now.silhouette, now.hem,
                  1e3 * (end - reference).rowwise().norm().mean());
    }
  }
}

}  // namespace
}  // namespace atelier

int main(int argc, char** argv) {
  int side = 100;
  int steps = 40;
  int frames = 20;
  double spring = atelier::fixtures::kForeignSpring;
  std::string file;
  std::string plot;
  std::string fabric = "wool";
  std::vector<int> rings{15};
  std::vector<int> iterations{20, 60};
  double seconds = 2;
  double bending = 0;
  CLI::App app("Tables of projective dynamics with dry friction");
  app.require_subcommand(1);
  CLI::App* forces = app.add_subcommand("forces", "Stiffnesses of the authors' cloth");
  CLI::App* residual = app.add_subcommand("residual", "Coulomb's law by iterations");
  residual->add_option("--plot", plot, "SVG of the table");
  const CLI::App* convergence =
      app.add_subcommand("convergence", "To implicit Euler with iterations, to XPBD with steps");
  CLI::App* drape = app.add_subcommand("drape", "Cusick's drape coefficient");
  drape->add_option("--fabric", fabric, "Fabric of the specimen");
  drape->add_option("--rings", rings, "Rings of triangles, several")->check(CLI::Range(6, 200));
  drape->add_option("--iterations", iterations, "Iterations a substep, several")
      ->check(CLI::Range(1, 1000));
  drape->add_option("--bending", bending, "N m in place of the fabric's")
      ->check(CLI::Range(1e-9, 1.0));
  drape->add_option("--seconds", seconds, "Seconds of hanging")->check(CLI::Range(0.1, 60.0));
  CLI::App* speed = app.add_subcommand("speed", "ms a step");
  speed->add_option("--side", side, "Vertices of a side of the sheet")->check(CLI::Range(4, 1000));
  speed->add_option("--steps", steps, "Steps that are timed")->check(CLI::Range(1, 10000));
  atelier::AuthorsRun run;
  std::vector<std::string> folders;
  CLI::App* scene = app.add_subcommand("scene", "A scene for the authors' program");
  scene->add_option("folder", file, "New folder")->required();
  scene->add_option("--iterations", run.iterations, "Iterations a step")
      ->check(CLI::Range(1, 1000));
  scene->add_flag("--self-contact", run.self_contact, "Contact of the cloth with itself");
  CLI::App* runs = app.add_subcommand("runs", "Residual and time beside the authors' program");
  runs->add_option("folders", folders, "Folders of scenes that it has run")->required();
  CLI::App* rest = app.add_subcommand("rest", "Rest shapes");
  CLI::App* other = app.add_subcommand("other", "Beside the authors' program");
  for (CLI::App* of_file : {rest, other, forces}) {
    of_file->add_option("file", file, "sequence.npz")->required()->check(CLI::ExistingFile);
  }
  for (CLI::App* of_file : {rest, other}) {
    of_file->add_option("--frames", frames, "Frames that are simulated")->check(CLI::Range(1, 50));
    of_file->add_option("--spring", spring, "N/m of an edge")->check(CLI::Range(1.0, 1e5));
  }
  CLI11_PARSE(app, argc, argv);
  try {
    if (*residual) {
      atelier::print_residuals(plot);
    } else if (*convergence) {
      atelier::print_convergence();
    } else if (*drape) {
      atelier::Material specimen = atelier::fabric_material(fabric);
      specimen.bending = bending > 0 ? bending : specimen.bending;
      atelier::print_drape(specimen, rings, iterations, seconds);
    } else if (*speed) {
      atelier::print_speed(side, steps);
    } else if (*scene) {
      atelier::write_authors_scene(file, run);
    } else if (*runs) {
      atelier::print_authors_runs(folders);
    } else if (*forces) {
      atelier::print_forces(atelier::fixtures::read_foreign(file, spring));
    } else if (*rest) {
      atelier::print_rest_shapes(atelier::fixtures::read_foreign(file, spring), frames);
    } else {
      atelier::print_beside(atelier::fixtures::read_foreign(file, spring), frames);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
