// Tables of docs/results/projective_friction.md: projective dynamics with dry friction, measured.
//
//   projective_tables residual       what is left of Coulomb's law, by iterations
//   projective_tables speed          ms a step of ten iterations, one and two threads, XPBD beside
//   projective_tables rest FILE      rest shape: flat panel, or 3D template
//   projective_tables other FILE     beside the cloth of the method's authors' program
//
// FILE: a sequence.npz with body_vertices, body_faces, cloth_vertices, cloth_faces, cloth_uv,
// cloth_seams, cloth_attached and fps.

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <map>
#include <numbers>
#include <set>

#include "core/io/npz.h"
#include "core/parallel.h"
#include "core/tensor.h"
#include "simulation/contact/crossings.h"
#include "simulation/projective/projective.h"
#include "simulation/xpbd/xpbd.h"

namespace atelier {
namespace {

/// `side` x `side` vertices in the plane y = 0 about the origin, diagonals in turn.
Mesh square_sheet(int side, double size) {
  Mesh mesh;
  mesh.vertices.resize(side * side, 3);
  mesh.faces.resize(2 * (side - 1) * (side - 1), 3);
  Index f = 0;
  for (int r = 0; r < side; ++r) {
    for (int c = 0; c < side; ++c) {
      const int a = r * side + c;
      mesh.vertices.row(a) << size * (c / (side - 1.0) - 0.5), 0, size * (r / (side - 1.0) - 0.5);
      if (r + 1 < side && c + 1 < side) {
        if ((r + c) % 2 == 0) {
          mesh.faces.row(f++) << a, a + side, a + side + 1;
          mesh.faces.row(f++) << a, a + side + 1, a + 1;
        } else {
          mesh.faces.row(f++) << a, a + side, a + 1;
          mesh.faces.row(f++) << a + 1, a + side, a + side + 1;
        }
      }
    }
  }
  return mesh;
}

/// A ball about the origin of 2 `rings` x `rings` quads, poles on the y axis.
Mesh ball_mesh(double radius, int rings) {
  const int around = 2 * rings;
  Mesh mesh;
  mesh.vertices.resize((rings - 1) * around + 2, 3);
  std::vector<Eigen::RowVector3i> faces;
  const int top = (rings - 1) * around;
  mesh.vertices.row(top) << 0, radius, 0;
  mesh.vertices.row(top + 1) << 0, -radius, 0;
  for (int r = 1; r < rings; ++r) {
    const double polar = std::numbers::pi * r / rings;
    for (int i = 0; i < around; ++i) {
      const double turn = 2 * std::numbers::pi * i / around;
      const int a = (r - 1) * around + i;
      const int b = (r - 1) * around + (i + 1) % around;
      mesh.vertices.row(a) << radius * std::sin(polar) * std::cos(turn), radius * std::cos(polar),
          radius * std::sin(polar) * std::sin(turn);
      if (r == 1) {
        faces.emplace_back(top, b, a);
      }
      if (r + 1 < rings) {
        faces.emplace_back(a, b, b + around);
        faces.emplace_back(a, b + around, a + around);
      } else {
        faces.emplace_back(top + 1, a, b);
      }
    }
  }
  mesh.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    mesh.faces.row(static_cast<Index>(i)) = faces[i];
  }
  return mesh;
}

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

void print_residuals() {
  std::printf("| iterations | sheets | 5 | 10 | 20 | 30 | 300 |\n|---|---|---|---|---|---|---|\n");
  for (const int sheets : {1, 2}) {
    for (const int acceleration : {0, 5}) {
      std::vector<ProjectiveResidual> row;
      for (const int iterations : {5, 10, 20, 30, 300}) {
        row.push_back(residual_on_ball(iterations, acceleration, sheets));
      }
      const char* how = acceleration == 0 ? "as published" : "accelerated";
      const auto print = [&](const char* of, double ProjectiveResidual::*field) {
        std::printf("| %s: %s | %d |", how, of, sheets);
        for (const ProjectiveResidual& one : row) {
          std::printf(" %.2g |", one.*field);
        }
        std::printf("\n");
      };
      print("body", &ProjectiveResidual::contact);
      if (sheets > 1) {
        print("cloth", &ProjectiveResidual::cloth_contact);
      }
      print("momentum", &ProjectiveResidual::momentum);
    }
  }
}

// --- speed

/// Of the clock, the median, and of the processor, which others on the machine do not change much.
struct StepTime {
  double ms, processor_ms;
};

/// Of `steps` steps, after some to fall by.
template <class Step>
StepTime time_of(int fall, int steps, const Step& step) {
  for (int i = 0; i < fall; ++i) {
    step();
  }
  std::vector<double> ms;
  const std::clock_t processor = std::clock();
  for (int i = 0; i < steps; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    step();
    const auto end = std::chrono::steady_clock::now();
    ms.push_back(std::chrono::duration<double, std::milli>(end - begin).count());
  }
  std::nth_element(ms.begin(), ms.begin() + steps / 2, ms.end());
  return {ms[static_cast<std::size_t>(steps / 2)],
          1e3 * static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC / steps};
}

void print_speed(int side, int steps) {
  const double step = 1.0 / 300;
  Garment garment = fabric_of(square_sheet(side, 1), 1000);
  garment.mesh.vertices.col(1).array() += 0.302;
  const Cloth cloth = make_cloth(garment);
  const Mesh ball = ball_mesh(0.3, 50);
  std::printf("%d vertices on a ball of %d triangles, steps of 1/300 s of 10 iterations.\n\n",
              side * side, static_cast<int>(ball.faces.rows()));
  std::printf(
      "| solver | self-contact | threads | ms a step | ms of processor | Coulomb's law | momentum "
      "| spring "
      "residual um |\n|---|---|---|---|---|---|---|---|\n");
  const int fall = 40;
  for (const bool self : {false, true}) {
    for (const int threads : {1, 2}) {
      set_thread_count(threads);
      for (const int acceleration : {0, 5}) {
        SolverOptions options = step_options(step, 1, 10);
        options.projective.acceleration = acceleration;
        options.self_contact = self;
        ProjectiveSolver solver(cloth, ball.faces, options);
        const StepTime time = time_of(fall, steps, [&] { solver.advance(at_rest(ball)); });
        const ProjectiveResidual left = solver.residual();
        std::printf("| projective-friction%s | %s | %d | %.1f | %.1f | %.2g | %.2g | - |\n",
                    acceleration == 0 ? ", as published" : "", self ? "yes" : "no", threads,
                    time.ms, time.processor_ms, left.contact, left.momentum);
      }
      SolverOptions options = step_options(step, 1, 10);
      options.self_contact = self;
      ClothSolver xpbd(cloth, ball.faces, xpbd_options(options));
      const StepTime time = time_of(fall, steps, [&] { xpbd.advance(at_rest(ball)); });
      options.report = true;
      ClothSolver reporter(cloth, ball.faces, xpbd_options(options));
      reporter.set_state(xpbd.state());
      std::printf("| xpbd | %s | %d | %.1f | %.1f | - | - | %.0f |\n", self ? "yes" : "no", threads,
                  time.ms, time.processor_ms,
                  1e6 * reporter.advance(at_rest(ball)).spring_residual);
    }
  }
  set_thread_count(0);
}

// --- another program's cloth

/// The other program's material: springs of one stiffness, and a bend at every inner vertex, by
/// mean value coordinates without a norm. On an equilateral lattice of edge l its row is sqrt(3) l
/// times the sum of both curvatures, and a vertex has 0.87 l^2: B = 2 sqrt(3) k of the bend's
/// stiffness k. The sequence's description has 3025 N/m and 4e-4; cloth of 3025 N/m would stretch a
/// twentieth as much as that cloth does, and 3025 is 55 squared.
constexpr double kForeignSpring = 55;  // N/m, unless --spring says else
constexpr double kForeignBend = 4e-4;  // N m
constexpr double kForeignDistance =
    4.5e-3;  // m, nearest that its cloth is to the body at the start

/// A cloth and a body that another program moved; the cloth's seams are closed.
struct ForeignSequence {
  std::vector<Points> body, cloth;  ///< of each frame
  Triangles body_faces;
  double spring = kForeignSpring;  ///< N/m
  Garment garment;                 ///< template: the first frame; rest: the flat panel
  std::vector<int> attached;
  double fps = 30;
};

Triangles triangles_of(const Npz& npz, const char* name) {
  const std::vector<std::int64_t> all = integers_of(npz.read(name));
  Triangles faces(static_cast<Index>(all.size() / 3), 3);
  for (Index i = 0; i < faces.size(); ++i) {
    faces(i / 3, i % 3) = static_cast<int>(all[static_cast<std::size_t>(i)]);
  }
  return faces;
}

std::vector<Points> frames_of(const Npz& npz, const char* name, const std::vector<int>& rows) {
  const Tensor tensor = npz.read(name);
  const std::vector<double> numbers = doubles_of(tensor);
  const Index vertices = static_cast<Index>(tensor.shape[1]);
  const Index count = rows.empty() ? vertices : static_cast<Index>(rows.size());
  std::vector<Points> frames(tensor.shape[0], Points(count, 3));
  for (std::size_t f = 0; f < frames.size(); ++f) {
    for (Index i = 0; i < 3 * count; ++i) {
      const Index vertex = rows.empty() ? i / 3 : rows[static_cast<std::size_t>(i / 3)];
      const std::size_t at =
          3 * (f * static_cast<std::size_t>(vertices) + static_cast<std::size_t>(vertex));
      frames[f](i / 3, i % 3) = numbers[at + static_cast<std::size_t>(i % 3)];
    }
  }
  return frames;
}

ForeignSequence read_foreign(const std::string& file, double spring) {
  const Npz npz(file);
  ForeignSequence out;
  out.spring = spring;
  out.body_faces = triangles_of(npz, "body_faces");
  const Triangles faces = triangles_of(npz, "cloth_faces");
  const std::vector<double> uv = doubles_of(npz.read("cloth_uv"));
  std::vector<int> sewn(uv.size() / 2);
  for (std::size_t v = 0; v < sewn.size(); ++v) {
    sewn[v] = static_cast<int>(v);
  }
  const std::vector<std::int64_t> seams = integers_of(npz.read("cloth_seams"));
  for (std::size_t i = 0; i + 1 < seams.size(); i += 2) {
    sewn[static_cast<std::size_t>(seams[i + 1])] = static_cast<int>(seams[i]);
  }
  std::vector<int> rows;
  std::vector<int> number(sewn.size(), -1);
  for (std::size_t v = 0; v < sewn.size(); ++v) {
    if (sewn[v] == static_cast<int>(v)) {
      number[v] = static_cast<int>(rows.size());
      rows.push_back(static_cast<int>(v));
    }
  }
  out.body = frames_of(npz, "body_vertices", {});
  out.cloth = frames_of(npz, "cloth_vertices", rows);
  out.garment.name = "skirt";
  out.garment.mesh.vertices = out.cloth[0];
  out.garment.mesh.faces = faces;
  for (Index i = 0; i < faces.size(); ++i) {
    int& corner = out.garment.mesh.faces(i / 3, i % 3);
    corner = number[static_cast<std::size_t>(sewn[static_cast<std::size_t>(corner)])];
  }
  out.garment.rest.resize(static_cast<Index>(uv.size() / 2), 2);
  for (Index i = 0; i < out.garment.rest.size(); ++i) {
    out.garment.rest(i / 2, i % 2) = uv[static_cast<std::size_t>(i)];
  }
  out.garment.rest_faces = faces;
  std::set<int> attached;
  for (const std::int64_t v : integers_of(npz.read("cloth_attached"))) {
    attached.insert(number[static_cast<std::size_t>(sewn[static_cast<std::size_t>(v)])]);
  }
  out.attached.assign(attached.begin(), attached.end());
  out.fps = doubles_of(npz.read("fps")).at(0);
  return out;
}

/// What a frame looks like as a whole.
struct ClothFigures {
  double strain = 0;      ///< mean |length / flat length - 1| of edges
  double area = 0;        ///< m2
  double silhouette = 0;  ///< m2, shadow along z
  double hem = 0;         ///< m, height of the lowest twentieth of vertices
};

double shadow_along_z(const Points& x, const Triangles& faces) {
  constexpr double kCell = 2.5e-3;
  std::set<std::pair<int, int>> dark;
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector2d a = x.row(faces(f, 0)).head<2>().transpose();
    const Eigen::Vector2d b = x.row(faces(f, 1)).head<2>().transpose();
    const Eigen::Vector2d c = x.row(faces(f, 2)).head<2>().transpose();
    const Eigen::Vector2d low = a.cwiseMin(b).cwiseMin(c) / kCell;
    const Eigen::Vector2d high = a.cwiseMax(b).cwiseMax(c) / kCell;
    const auto side = [](const Eigen::Vector2d& p, const Eigen::Vector2d& q,
                         const Eigen::Vector2d& at) {
      return (q.x() - p.x()) * (at.y() - p.y()) - (q.y() - p.y()) * (at.x() - p.x());
    };
    for (int j = static_cast<int>(std::floor(low.y())); j <= static_cast<int>(high.y()); ++j) {
      for (int i = static_cast<int>(std::floor(low.x())); i <= static_cast<int>(high.x()); ++i) {
        const Eigen::Vector2d at(kCell * (i + 0.5), kCell * (j + 0.5));
        const double s[3] = {side(a, b, at), side(b, c, at), side(c, a, at)};
        if ((s[0] >= 0 && s[1] >= 0 && s[2] >= 0) || (s[0] <= 0 && s[1] <= 0 && s[2] <= 0)) {
          dark.emplace(i, j);
        }
      }
    }
  }
  return kCell * kCell * static_cast<double>(dark.size());
}

ClothFigures figures_of(const Points& x, const Cloth& flat) {
  ClothFigures out;
  for (int i = 0; i < flat.fibre_count; ++i) {
    const ClothSpring& s = flat.springs[i];
    out.strain += std::abs((x.row(s.a) - x.row(s.b)).norm() / s.rest - 1) / flat.fibre_count;
  }
  for (Index f = 0; f < flat.faces.rows(); ++f) {
    const Eigen::Vector3d e1 = (x.row(flat.faces(f, 1)) - x.row(flat.faces(f, 0))).transpose();
    const Eigen::Vector3d e2 = (x.row(flat.faces(f, 2)) - x.row(flat.faces(f, 0))).transpose();
    out.area += 0.5 * e1.cross(e2).norm();
  }
  out.silhouette = shadow_along_z(x, flat.faces);
  std::vector<double> heights(x.col(1).data(), x.col(1).data() + x.rows());
  std::sort(heights.begin(), heights.end());
  const std::size_t lowest = std::max<std::size_t>(1, heights.size() / 20);
  for (std::size_t i = 0; i < lowest; ++i) {
    out.hem += heights[i] / static_cast<double>(lowest);
  }
  return out;
}

Cloth foreign_cloth(const ForeignSequence& sequence, const ClothOptions& options = {}) {
  Garment garment = sequence.garment;
  garment.material = {};
  garment.material.density = 0.2;
  garment.material.friction = 0.3;
  garment.material.thickness = kForeignDistance;
  garment.material.damping = 0;
  garment.material.bending = 2 * std::sqrt(3.0) * kForeignBend;
  garment.material.stretch_warp = garment.material.stretch_weft = sequence.spring;
  Cloth cloth = make_cloth(garment, sequence.attached, options);
  for (int i = 0; i < cloth.fibre_count; ++i) {
    cloth.springs[i].stiffness = sequence.spring;
  }
  return cloth;
}

SolverOptions foreign_options() {
  SolverOptions options = step_options(1.0 / 480, 16, 32);
  options.self_contact = true;
  options.self_thickness = 4e-3;
  options.xpbd.iterations = 4;
  options.xpbd.precision = "double";
  return options;
}

/// Frames 0 to `last`; `advance(control)` moves the cloth by one.
template <class Advance>
void replay(const ForeignSequence& sequence, int last, const Advance& advance) {
  for (int f = 0; f < last; ++f) {
    Control control;
    control.body_start = sequence.body[static_cast<std::size_t>(f)];
    control.body_end = sequence.body[static_cast<std::size_t>(f) + 1];
    control.pin_targets = sequence.cloth[static_cast<std::size_t>(f) + 1];
    advance(control, f + 1);
  }
}

ClothState start_of(const ForeignSequence& sequence) {
  ClothState state;
  state.positions = sequence.cloth[0];
  state.velocities = sequence.fps * (sequence.cloth[1] - sequence.cloth[0]);
  return state;
}

void print_beside(const ForeignSequence& sequence, int last) {
  const Cloth cloth = foreign_cloth(sequence);
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
  ClothSolver xpbd(cloth, sequence.body_faces, xpbd_options(foreign_options()));
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
  int steps = 15;
  int frames = 20;
  double spring = atelier::kForeignSpring;
  std::string file;
  CLI::App app("Tables of projective dynamics with dry friction");
  app.require_subcommand(1);
  const CLI::App* residual = app.add_subcommand("residual", "Coulomb's law by iterations");
  CLI::App* speed = app.add_subcommand("speed", "ms a step");
  speed->add_option("--side", side, "Vertices of a side of the sheet")->check(CLI::Range(4, 1000));
  speed->add_option("--steps", steps, "Steps that are timed")->check(CLI::Range(1, 10000));
  CLI::App* rest = app.add_subcommand("rest", "Rest shapes");
  CLI::App* other = app.add_subcommand("other", "Beside the authors' program");
  for (CLI::App* of_file : {rest, other}) {
    of_file->add_option("file", file, "sequence.npz")->required()->check(CLI::ExistingFile);
    of_file->add_option("--frames", frames, "Frames that are simulated")->check(CLI::Range(1, 50));
    of_file->add_option("--spring", spring, "N/m of an edge")->check(CLI::Range(1.0, 1e5));
  }
  CLI11_PARSE(app, argc, argv);
  try {
    if (*residual) {
      atelier::print_residuals();
    } else if (*speed) {
      atelier::print_speed(side, steps);
    } else if (*rest) {
      atelier::print_rest_shapes(atelier::read_foreign(file, spring), frames);
    } else {
      atelier::print_beside(atelier::read_foreign(file, spring), frames);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
