#include "simulation/cloth/solver_options.h"

#include <algorithm>

namespace atelier {

namespace {

/// Contact, air and damping, the same for every solver.
void add_body_contact(OptionTable& t, CommonSolverOptions& common) {
  t.add("friction", common.friction, -1, 100, "",
        "Friction coefficient against the body; below 0: the material's");
  t.add("thickness", common.thickness, -1, 0.1, "m", "Gap to the body; below 0: the material's");
  t.add("contact_reach", common.contact_reach, 0.001, 0.5, "m",
        "Minimum distance at which contacts are detected");
  t.add("depenetration_speed", common.depenetration_speed, 0.01, 100, "m/s",
        "Speed at which existing penetrations are resolved");
}

void add_self_contact(OptionTable& t, CommonSolverOptions& common) {
  t.add("self_contact", common.self_contact, "Contact of cloth with itself and with other layers");
  t.add("self_thickness", common.self_thickness, -1, 0.1, "m",
        "Gap between layers; below 0: the material's");
  t.add("self_friction", common.self_friction, -1, 100, "",
        "Friction coefficient between layers; below 0: the material's");
}

void add_air_and_reports(OptionTable& t, CommonSolverOptions& common) {
  t.add("air_density", common.air_density, 0, 10, "kg/m3", "Density of the air");
  t.add("drag", common.drag, 0, 10, "", "Drag coefficient normal to the cloth");
  t.add("lift", common.lift, 0, 10, "", "Lift coefficient of the cloth");
  t.add("velocity_damping", common.velocity_damping, 0, 1000, "1/s",
        "Damping rate of all velocities; raise it to reach rest sooner");
  t.add("report", common.report, "Strain, residual and energy after every frame").not_keyed();
  t.add("intersection_interval", common.intersection_interval, 0, 1e9, "",
        "Number of frames between exact counts of self-intersections and of vertices inside the "
        "body; 0: never")
      .not_keyed();
}

/// Without the fields that the caller sets itself.
OptionTable fewer(OptionTable table, const std::vector<std::string>& without) {
  std::erase_if(table.fields, [&](const OptionField& field) {
    return std::find(without.begin(), without.end(), field.name) != without.end();
  });
  return table;
}

}  // namespace

OptionTable describe_common(CommonSolverOptions& common) {
  OptionTable t;
  t.add("time_step", common.time_step, 1e-5, 1, "s", "Duration of a frame");
  add_body_contact(t, common);
  add_self_contact(t, common);
  add_air_and_reports(t, common);
  return t;
}

OptionTable describe_xpbd(CommonSolverOptions& common, XpbdMethodOptions& method) {
  OptionTable t;
  t.add("substeps", common.substeps, 1, 10000, "",
        "Substeps of a frame; raise it for stiffer cloth");
  t.add("iterations", method.iterations, 1, 100000, "",
        "Solver iterations in a substep; more substeps are better than more iterations");
  t.add("precision", method.precision, {"float", "double"},
        "Arithmetic precision; double for reference");
  t.add("sweep", method.sweep, {"gauss-seidel", "jacobi"}, "Order of the projections");
  t.add("jacobi_radius", method.jacobi_radius, 0, 0.9999, "",
        "Estimated spectral radius of a Jacobi iteration");
  t.add("vectors", method.vectors, {"auto", "scalar", "avx2"}, "CPU vector instructions");
  t.add("cuda_barrier", method.cuda_barrier, {"auto", "block", "cluster", "grid", "graph"},
        "Barrier that the blocks of a GPU synchronise by");
  t.add("cuda_blocks", method.cuda_blocks, 0, 1024, "",
        "Number of blocks of a scene on a GPU; 0: chosen for speed");
  t.add("body_edges", common.body_edges,
        "Contact of the body's sharp edges with the cloth's edges too");
  t.add("self_interval", common.self_interval, 0, 10000, "",
        "Number of substeps that a search for self-contacts looks ahead; 0: chosen for the device");
  return t;
}

OptionTable describe_projective(ProjectiveMethodOptions& method) {
  OptionTable t;
  t.add("substeps", method.substeps, 1, 10000, "",
        "Substeps of a frame; raise it for stiffer cloth");
  t.add("iterations", method.iterations, 1, 100000, "",
        "Local and global steps of a substep; raise it where cloth stretches or slips too slowly");
  t.add("acceleration", method.acceleration, 0, 20, "",
        "Number of iterations that Anderson acceleration combines; 0: none");
  t.add("strain_limit", method.strain_limit, 0, 10, "",
        "Stretch beyond which springs and yarns are 30 times as stiff; 0: no limit");
  t.add("half_precision", method.half_precision,
        "Half precision for the factor of the matrix on a GPU, which is a tenth faster, unless the "
        "cloth is too stiff for it");
  return t;
}

OptionTable describe(SolverOptions& options, const std::vector<std::string>& without) {
  OptionTable table;
  table.add("solver", options.name, {"xpbd", "projective-friction"},
            "Simulator of the cloth: xpbd, or projective-friction, projective dynamics with dry "
            "friction");
  table.add(fewer(describe_common(options), without));
  table.add("xpbd", describe_xpbd(options, options.xpbd));
  return table.add("projective_friction", describe_projective(options.projective));
}

std::string solver_flag(const std::string& field, const std::string& section,
                        const SolverOptions& options) {
  SolverOptions any;
  const OptionTable table = describe(any);
  for (const std::string& name : {field, options.name + "." + field}) {
    std::string flag = name;
    std::replace(flag.begin(), flag.end(), '-', '_');
    const auto known = std::find_if(table.fields.begin(), table.fields.end(),
                                    [&](const OptionField& one) { return one.name == flag; });
    if (known != table.fields.end()) {
      flag = "--" + (section.empty() ? "" : section + ".") + name;
      std::replace(flag.begin(), flag.end(), '_', '-');
      return flag;
    }
  }
  return "";
}

}  // namespace atelier
