#include "simulation/cloth/solver_sections.h"

#include <algorithm>

namespace atelier {

OptionTable describe_sections(SolverOptions& options, const std::vector<std::string>& without) {
  OptionTable xpbd = describe_xpbd(options, options.xpbd);
  std::erase_if(xpbd.fields, [](const OptionField& field) {
    return field.name != "substeps" && field.name != "iterations";
  });
  OptionTable table;
  table.add("xpbd", xpbd);
  table.add("projective_friction", describe_projective(options.projective));
  std::erase_if(table.fields, [&](const OptionField& field) {
    return std::find(without.begin(), without.end(), field.name) != without.end();
  });
  return table;
}

SolverOptions solved_as(SolverOptions options, const SolverOptions& other) {
  options.name = other.name;
  options.substeps = other.substeps;
  options.xpbd = other.xpbd;
  options.projective = other.projective;
  return options;
}

}  // namespace atelier
