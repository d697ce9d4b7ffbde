#include "bench/beside_authors.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <stdexcept>

#include "bench/plain_meshes.h"
#include "core/parallel.h"
#include "simulation/projective/coulomb.h"
#include "simulation/projective/elastic_rows.h"
#include "simulation/projective/projective.h"
#include "tests/simulation/foreign/foreign_skirt.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr int kSide = 100;              // vertices
constexpr double kStep = 1.0 / 300;     // s
constexpr double kSpring = 500;         // N/m of every edge
constexpr double kBend = 3e-6;          // N m of every inner vertex
constexpr double kDensity = 0.2;        // kg/m2
constexpr double kFriction = 0.4;       // with the ball and with itself
constexpr double kBall = 0.3;           // m
constexpr double kGap = 1e-3;           // m from the ball, and between layers
constexpr double kGravity = 9.81;       // m/s2
constexpr int kFall = 40;               // steps before those that are measured
constexpr int kMeasured = 40;           // steps
constexpr int kEvery = 5;               // steps of which the last one's residual counts: our frames
constexpr const char* kRuns = "data0";  // of the first run in a folder
constexpr const char* kSelf = "\"Self-collision\" : true";

/// In single precision, as the program reads it.
Mesh authors_sheet() {
  Mesh sheet = square_sheet(kSide, 1);
  sheet.vertices.col(1).array() += kBall + kGap + 1e-3;
  sheet.vertices = sheet.vertices.cast<float>().cast<double>().eval();
  return sheet;
}

/// The same cloth for our solver.
Cloth authors_cloth() {
  Garment garment;
  garment.name = "sheet";
  garment.mesh = authors_sheet();
  garment.rest.resize(garment.mesh.vertices.rows(), 2);
  garment.rest << garment.mesh.vertices.col(0), garment.mesh.vertices.col(2);
  garment.rest_faces = garment.mesh.faces;
  garment.material = {};
  garment.material.density = kDensity;
  garment.material.friction = kFriction;
  garment.material.thickness = kGap;
  garment.material.damping = 0;
  garment.material.stretch_warp = garment.material.stretch_weft = kSpring;
  Cloth cloth = make_cloth(garment);
  for (int i = 0; i < cloth.fibre_count; ++i) {
    cloth.springs[i].stiffness = kSpring;
  }
  cloth.hinges.clear();
  cloth.curvatures = fixtures::foreign_curvatures(garment, kBend);
  rebuild_schedule(cloth);
  return cloth;
}

std::string text_of_file(const fs::path& path) {
  std::ifstream file(path);
  if (!file) {
    throw std::runtime_error(path.string() + ": cannot be read; scripts/authors-program runs it");
  }
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Positions that the program wrote after `steps` steps.
Points positions_after(const fs::path& folder, int steps, Index count) {
  char name[32];
  std::snprintf(name, sizeof name, "out_%06d.obj", steps - 1);
  std::istringstream text(text_of_file(folder / kRuns / "output" / name));
  Points x(count, 3);
  std::string word;
  for (Index v = 0; v < count; ++v) {
    if (!(text >> word >> x(v, 0) >> x(v, 1) >> x(v, 2)) || word != "v") {
      throw std::runtime_error(folder.string() + ": " + name + " lacks vertex " +
                               std::to_string(v));
    }
  }
  return x;
}

/// What a step left, as ProjectiveSolver measures it: of the vertices within the ball at its start,
/// which the program takes for contacts.
/// @param x  [V,3] m at its end, one step before and two
ProjectiveResidual residual_of_step(const Cloth& cloth, const ElasticRows& rows, const Points& x,
                                    const Points& before, const Points& first) {
  const std::size_t n = cloth.mass.size();
  std::vector<Vec4<double>> at(n);
  std::vector<Vec4<double>> v(n);
  std::vector<Vec4<double>> force(n);
  std::vector<Vec4<double>> of_rows(rows.rows.size());
  const auto lane = [](const auto& row) { return Vec4<double>{row[0], row[1], row[2], 0}; };
  for (std::size_t i = 0; i < n; ++i) {
    const Index row = static_cast<Index>(i);
    at[i] = lane(x.row(row));
    v[i] = lane(((x.row(row) - before.row(row)) / kStep).eval());
  }
  elastic_forces(rows, at, v, of_rows, force);
  ProjectiveResidual out;
  double weight = 0;
  double contact_sum = 0;
  double free_sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Index row = static_cast<Index>(i);
    const Vec4<double> v0 = lane(((before.row(row) - first.row(row)) / kStep).eval());
    const Vec3d wish = xyz(v0) + Vec3d{0, -kGravity * kStep, 0};
    const Vec3d implied = cloth.mass[i] * (xyz(v[i]) - wish) - kStep * xyz(force[i]);
    weight += cloth.mass[i] * kGravity * kStep / static_cast<double>(n);
    const Vec3d out_of_ball = xyz(lane(before.row(row)));
    if (norm(out_of_ball) < kBall + kGap) {
      const double one = coulomb_residual(implied, xyz(v[i]), (1 / norm(out_of_ball)) * out_of_ball,
                                          kFriction, cloth.mass[i]);
      contact_sum += one * one;
      ++out.contacts;
    } else {
      free_sum += squared_norm(implied);
    }
  }
  out.contact = out.contacts > 0 ? std::sqrt(contact_sum / out.contacts) / weight : 0;
  const double others = std::max<double>(1, static_cast<double>(n) - out.contacts);
  out.momentum = std::sqrt(free_sum / others) / weight;
  return out;
}

void add_to(ProjectiveResidual& mean, const ProjectiveResidual& one) {
  constexpr double kShare = static_cast<double>(kEvery) / kMeasured;
  mean.contact += kShare * one.contact;
  mean.momentum += kShare * one.momentum;
  mean.contacts = one.contacts;
}

/// The mean that stats.txt has of a step, ms.
double step_ms(const fs::path& folder) {
  const std::string stats = text_of_file(folder / kRuns / "stats.txt");
  const std::size_t section = stats.find("Step time");
  const std::size_t mean = section == std::string::npos ? section : stats.find("Mean", section);
  const std::size_t colon = mean == std::string::npos ? mean : stats.find(':', mean);
  if (colon == std::string::npos) {
    throw std::runtime_error(folder.string() + ": stats.txt has no time of a step");
  }
  return 1e-3 * std::stod(stats.substr(colon + 1));
}

void print_row(const std::string& name, int iterations, bool self, const std::string& threads,
               double ms, const ProjectiveResidual& left) {
  std::printf("| %s | %d | %s | %s | %.1f | %.2g | %.2g | %d |\n", name.c_str(), iterations,
              self ? "yes" : "no", threads.c_str(), ms, left.contact, left.momentum, left.contacts);
  std::fflush(stdout);
}

void print_theirs(const fs::path& folder, const Cloth& cloth) {
  const Index count = static_cast<Index>(cloth.mass.size());
  std::vector<int> same(cloth.mass.size());
  for (std::size_t i = 0; i < same.size(); ++i) {
    same[i] = static_cast<int>(i);
  }
  const ElasticRows rows = make_elastic_rows(cloth, same);
  ProjectiveResidual mean;
  for (int step = kFall + kEvery; step <= kFall + kMeasured; step += kEvery) {
    add_to(mean, residual_of_step(cloth, rows, positions_after(folder, step, count),
                                  positions_after(folder, step - 1, count),
                                  positions_after(folder, step - 2, count)));
  }
  const std::string scene = text_of_file(folder / "scene.json");
  const std::size_t at = scene.find("\"LocalGlobal\" : ");
  const int iterations = at == std::string::npos ? 0 : std::stoi(scene.substr(at + 16));
  print_row("authors' program", iterations, scene.find(kSelf) != std::string::npos, "1",
            step_ms(folder), mean);
}

/// Ours on the same cloth; the ball has 9,800 triangles.
void print_ours(const Cloth& cloth, const AuthorsRun& run, int acceleration, int threads) {
  const Mesh ball = ball_mesh(kBall, 50);
  SolverOptions options;
  options.name = "projective-friction";
  options.time_step = kStep * kEvery;
  options.substeps = options.projective.substeps = kEvery;
  options.projective.iterations = run.iterations;
  options.projective.acceleration = acceleration;
  options.self_contact = run.self_contact;
  options.report = false;
  Control control;
  control.gravity = {0, -kGravity, 0};
  control.body_start = control.body_end = ball.vertices;
  set_thread_count(threads);
  ProjectiveSolver solver(cloth, ball.faces, options);
  ProjectiveResidual mean;
  double ms = 0;
  for (int step = 0; step < kFall + kMeasured; step += kEvery) {
    const auto begin = std::chrono::steady_clock::now();
    solver.advance(control);
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - begin;
    ms += taken.count() / (kFall + kMeasured);  // of all steps, as stats.txt has it
    if (step >= kFall) {
      add_to(mean, solver.residual());
    }
  }
  set_thread_count(0);
  print_row(acceleration == 0 ? "projective-friction, as published" : "projective-friction",
            run.iterations, run.self_contact, std::to_string(threads), ms, mean);
}

}  // namespace

void write_authors_scene(const fs::path& folder, const AuthorsRun& run) {
  fs::create_directories(folder);
  const Mesh sheet = authors_sheet();
  std::ofstream mesh(folder / "sheet.obj");
  mesh << std::setprecision(17);
  for (Index v = 0; v < sheet.vertices.rows(); ++v) {
    mesh << "v " << sheet.vertices(v, 0) << " " << sheet.vertices(v, 1) << " "
         << sheet.vertices(v, 2) << "\n";
  }
  for (Index f = 0; f < sheet.faces.rows(); ++f) {
    mesh << "f " << sheet.faces(f, 0) + 1 << " " << sheet.faces(f, 1) + 1 << " "
         << sheet.faces(f, 2) + 1 << "\n";
  }
  std::ofstream scene(folder / "scene.json");
  scene << std::setprecision(17)
        << "{\n\"Parameters\" : {\n\"Frame number\" : " << kFall + kMeasured
        << ",\n\"LocalGlobal\" : " << run.iterations << ",\n\"Timestep\" : " << kStep
        << ",\n\"Steps per frame\" : 1,\n"
        << (run.self_contact ? kSelf : "\"Self-collision\" : false")
        << ",\n\"Self-collision tolerance\" : " << kGap << ",\n\"Gravity\" : [0.0, " << -kGravity
        << ", 0.0],\n\"Air damping\" : 0.0\n},\n\"Friction coefficients\" : [[ " << kFriction
        << " ]],\n\"Meshes\" : [ {\n\"Obj filename\" : \"sheet.obj\",\n"
        << "\"Area Density\" : " << kDensity << ",\n\"Bending\" : " << kBend
        << ",\n\"Stretching\" : " << kSpring << ",\n\"Material Identifier\" : 0\n} ],\n"
        << "\"Obstacles\" : [ {\n\"Type\" : \"Sphere\",\n\"Material Identifier\" : 0,\n"
        << "\"Position\" : [0.0, 0.0, 0.0],\n\"Radius\" : " << kBall + kGap << "\n} ]\n}\n";
  mesh.close();
  scene.close();
  if (!mesh || !scene) {
    throw std::runtime_error(folder.string() + ": the scene cannot be written");
  }
}

void print_authors_runs(const std::vector<std::string>& folders) {
  std::printf(
      "%d vertices, steps of 1/300 s: %d that fall, %d of which residuals are means; times are "
      "means of all.\n\n| solver | iterations | self-contact | threads | ms a step | Coulomb's law "
      "| "
      "momentum | contacts at the end |\n|---|---|---|---|---|---|---|---|\n",
      kSide * kSide, kFall, kMeasured);
  const Cloth cloth = authors_cloth();
  for (const std::string& folder : folders) {
    print_theirs(folder, cloth);
  }
  for (const bool self : {false, true}) {
    for (const int iterations : {10, 20}) {
      for (const int acceleration : {0, 5}) {
        for (const int threads : {1, 2}) {
          print_ours(cloth, {iterations, self}, acceleration, threads);
        }
      }
    }
  }
}

}  // namespace atelier
